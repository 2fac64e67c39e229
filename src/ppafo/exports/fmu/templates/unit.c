/* ---- An instance of the unit: what lies between @name@.c and the functions of the standard. ---- */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    INPUTS = @input_count@,
    FIRST_OUTPUT = SETTINGS,
    FIRST_METRIC = FIRST_OUTPUT + OUTPUTS,
    FIRST_INPUT = FIRST_METRIC + METRICS,
    TICK = FIRST_INPUT + INPUTS, /* the clock of the controller */
    TIME
};

/* Paths of the settings. */
static const char *const PATHS[SETTINGS] = {
@paths@
};

/* Units of the settings. */
static const char *const UNITS[SETTINGS] = {
@units@
};

/* Whether a setting may be changed while the unit runs (t), only before (f), or is none of the unit's variables (h). */
static const char CHANGES[SETTINGS + 1] = "@changes@";

static const double FIRST_INPUTS[INPUTS + 1] = {@first_inputs@};

typedef enum { UNIT_NEW, UNIT_BEGINNING, UNIT_RUNNING, UNIT_ENDED } unit_phase;

/* Everything that an instance is, apart from its run; there is no pointer in it. */
typedef struct {
    char token[40];
    int64_t run_bytes;
    int64_t phase;
    int64_t is_stale; /* 1 where something was set that the run does not know of yet */
    int64_t ticks;    /* samples of the controller up to now, less the first */
    int64_t is_event; /* 1 in the event mode of FMI 3 */
    int64_t is_tick;  /* 1 while the clock of the controller is active */
    double start;     /* the time of the tool at which the run begins */
    double time;      /* since then */
    double inputs[INPUTS + 1];
    double held[OUTPUTS]; /* the outputs in the last event of FMI 3 */
    @name@_settings settings;
} unit_state;

typedef struct {
    unit_state now;
    @name@_run *run;
    char said[320]; /* why something was refused */
} unit;

/* What differs between the closed loop and the plant alone. */
static void follow_inputs(unit *item);
static bool take_first_sample(unit *item);
static bool get_metric(unit *item, uint32_t number, double *value);

static bool refuse(unit *item, const char *form, ...)
{
    va_list given;
    va_start(given, form);
    (void)vsnprintf(item->said, sizeof(item->said), form, given);
    va_end(given);
    return false;
}

static void forget(unit *item)
{
    memset(&item->now, 0, sizeof(item->now));
    memcpy(item->now.token, "@token@", sizeof("@token@"));
    memcpy(item->now.inputs, FIRST_INPUTS, sizeof(FIRST_INPUTS));
    @name@_defaults(&item->now.settings);
    item->now.is_stale = 1;
    free(item->run);
    item->run = NULL;
}

/* The path of a setting by its name in C. */
static const char *path_of(const char *name)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        const char *path = PATHS[place];
        size_t at = 0;
        while (name[at] != '\0' && (name[at] == path[at] || (name[at] == '_' && path[at] == '.'))) {
            ++at;
        }
        if (name[at] == '\0' && path[at] == '\0') {
            return path;
        }
    }
    return name;
}

/* True for a setting that is none of the unit's variables: it follows from the inputs. */
static bool is_hidden(const char *path)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        if (path == PATHS[place]) {
            return CHANGES[place] == 'h';
        }
    }
    return false;
}

/* Refuse a setting by its name in C: with the limit beyond which it is, or because it contradicts another one. */
static bool refuse_setting(unit *item, const char *name)
{
    const char *path = path_of(name);
    double value;
    int place = 0;
    while (place < SETTINGS - 1 && strcmp(SETTING[place].name, name) != 0) {
        ++place;
    }
    value = ((const double *)&item->now.settings)[place];
    if (is_hidden(path)) {
        return refuse(item, "an input is out of range (it sets %s)", path);
    }
    if (value > SETTING[place].highest) {
        return refuse(item, "parameter %s = %.9g %s is out of range: at most %.9g %s", path, value, UNITS[place],
            SETTING[place].highest, UNITS[place]);
    }
    if (value > SETTING[place].lowest || (SETTING[place].may_be_lowest && value == SETTING[place].lowest)) {
        return refuse(item, "parameter %s = %.9g %s contradicts another parameter", path, value, UNITS[place]);
    }
    return refuse(item, "parameter %s = %.9g %s is out of range: %s %.9g %s", path, value, UNITS[place],
        SETTING[place].may_be_lowest ? "at least" : "above", SETTING[place].lowest, UNITS[place]);
}

/* The numbers of a run for the settings, if they are good. */
static bool prepare_unit(unit *item, prepared_run *prepared)
{
    const char *bad;
    follow_inputs(item);
    bad = wrong_setting(&item->now.settings);
    if (bad != NULL) {
        return refuse_setting(item, bad);
    }
    prepare_run(&item->now.settings, prepared);
    bad = needs_other_program(&item->now.settings, prepared);
    if (bad != NULL) {
        return refuse(item, "parameter %s needs other functions than the unit has: export it from ppafo with it", path_of(bad));
    }
    return true;
}

/* Begin the run, and take its first sample. */
static bool begin(unit *item)
{
    prepared_run prepared;
    size_t size;
    if (!prepare_unit(item, &prepared)) {
        return false;
    }
    free(item->run);
    size = @name@_size(&item->now.settings);
    item->run = (@name@_run *)malloc(size);
    if (item->run == NULL) {
        return refuse(item, "no memory");
    }
    (void)begin_run(item->run, &item->now.settings);
    item->now.run_bytes = (int64_t)size;
    item->now.ticks = 0;
    item->now.is_tick = 1;
    item->now.time = 0.0;
    item->now.is_stale = take_first_sample(item) ? 0 : 1;
    return !item->now.is_stale;
}

/* True where the steps of a run, and delays in them, stay as they are. */
static bool keeps_steps(const @name@_run *run, const prepared_run *prepared)
{
    return run->steps_per_sample == (int64_t)prepared->counts.steps_per_sample
        && run->signal_delay == (int64_t)prepared->counts.signal_delay
        && run->command_delay == (int64_t)prepared->counts.command_delay;
}

/* Let the run know of parameters that were changed under way. */
static bool renew(unit *item)
{
    prepared_run prepared;
    if (!prepare_unit(item, &prepared)) {
        return false;
    }
    if (!keeps_steps(item->run, &prepared)) {
        return refuse(item, "these parameters ask for other steps of the engine: set them before the start");
    }
    item->run->parameters = prepared.parameters;
    item->run->needs_parts = prepared.counts.needs_parts != 0.0 ? 1 : 0;
    item->now.is_stale = 0;
    return true;
}

static bool is_input(uint32_t variable)
{
    const uint32_t end = TICK;
    return variable >= FIRST_INPUT && variable < end;
}

/* A variable by its number. What is calculated is calculated anew while the unit is being prepared. */
static bool get_value(unit *item, uint32_t variable, double *value)
{
    if (variable < SETTINGS) {
        const @name@_settings all = with_followers(&item->now.settings);
        *value = ((const double *)&all)[variable];
        return true;
    }
    if (is_input(variable)) {
        *value = item->now.inputs[variable - FIRST_INPUT];
        return true;
    }
    if (variable == TIME) {
        *value = item->now.start + item->now.time;
        return true;
    }
    if (variable == TICK || variable > TIME) {
        return refuse(item, "there is no variable %lu", (unsigned long)variable);
    }
    if (item->now.phase <= UNIT_BEGINNING && item->now.is_stale && !begin(item)) {
        return false;
    }
    if (variable < FIRST_METRIC) {
        @name@_outputs outputs;
        @name@_read_outputs(item->run, &outputs);
        *value = ((const double *)&outputs)[variable - FIRST_OUTPUT + 1];
    } else {
        return get_metric(item, variable - FIRST_METRIC, value);
    }
    return true;
}

static bool set_value(unit *item, uint32_t variable, double value)
{
    if (is_input(variable)) {
        item->now.inputs[variable - FIRST_INPUT] = value;
        item->now.is_stale = item->now.is_stale || item->now.phase <= UNIT_BEGINNING;
        return true;
    }
    if (variable >= SETTINGS || CHANGES[variable] == 'h') {
        return refuse(item, "variable %lu cannot be set", (unsigned long)variable);
    }
    if (item->now.phase > UNIT_BEGINNING && CHANGES[variable] != 't') {
        return refuse(item, "parameter %s is fixed once the unit runs", PATHS[variable]);
    }
    ((double *)&item->now.settings)[variable] = value;
    item->now.is_stale = 1;
    return true;
}

static size_t bytes_of(const unit *item)
{
    return sizeof(unit_state) + (item->run != NULL ? (size_t)item->now.run_bytes : 0);
}

static void write_state(const unit *item, void *to)
{
    memcpy(to, &item->now, sizeof(unit_state));
    if (item->run != NULL) {
        memcpy((char *)to + sizeof(unit_state), item->run, (size_t)item->now.run_bytes);
    } else {
        ((unit_state *)to)->run_bytes = 0;
    }
}

/* True where the counts of a run fit each other: they divide, and say where is written and how far is gone. */
static bool are_counts(const @name@_run *run)
{
    const int64_t most = run->sample_count > 2 ? run->sample_count : 2; /* the plant alone has the last two */
    return run->interval >= 1.0 && run->interval <= 1.0e15 && run->steps >= 0 && run->steps <= 1000000000
        && run->sample_count == (int64_t)(((double)run->steps + SAME_MOMENT) / run->interval) + 1
        && run->steps_per_sample > 0 && run->steps_per_sample <= 1000000000 && run->steps_done >= 0
        && run->samples_shown >= 0 && run->samples_shown <= run->samples_taken && run->samples_taken <= most;
}

/* True where the bytes behind a state are a run that this unit could have written. */
static bool is_run(const void *bytes, size_t size)
{
    @name@_run run;
    if (size < sizeof(run)) {
        return false;
    }
    memcpy(&run, bytes, sizeof(run));
    return are_counts(&run) && run.bytes == (int64_t)size && run.signal_delay >= 0 && run.command_delay >= 0
        && run.signal_delay < run.bytes && run.command_delay < run.bytes
        && size == sizeof(run) + sizeof(double) * (size_t)values_of_history(run.signal_delay, run.command_delay);
}

/* True where a state can be without a run, or with one. */
static bool is_phase(const unit_state *state, bool has_run)
{
    return state->phase >= UNIT_NEW && state->phase <= UNIT_ENDED
        && (has_run || (state->phase < UNIT_RUNNING && state->is_stale != 0));
}

/* Become what was written; bytes that are none of this unit's leave it as it was. */
static bool read_state(unit *item, const void *from, size_t size)
{
    unit_state state;
    @name@_run *run = NULL;
    if (size < sizeof(state)) {
        return refuse(item, "this is no state of this unit");
    }
    memcpy(&state, from, sizeof(state));
    size -= sizeof(state);
    if (memcmp(state.token, "@token@", sizeof("@token@")) != 0 || state.run_bytes != (int64_t)size
        || (size > 0 && !is_run((const char *)from + sizeof(state), size)) || !is_phase(&state, size > 0)) {
        return refuse(item, "this is no state of this unit");
    }
    if (size > 0) {
        run = (@name@_run *)malloc(size);
        if (run == NULL) {
            return refuse(item, "no memory");
        }
        memcpy(run, (const char *)from + sizeof(state), size);
    }
    free(item->run);
    item->run = run;
    item->now = state;
    return true;
}

/* A state on its own: how many bytes it has, then these. */
static void *made_state(unit *item, void *before, size_t size)
{
    size_t *kept = (size_t *)realloc(before, sizeof(double) + size);
    if (kept == NULL) {
        (void)refuse(item, "no memory");
    } else {
        *kept = size;
    }
    return kept;
}

static char *bytes_in(void *kept)
{
    return (char *)kept + sizeof(double);
}

static size_t size_of_state(const void *kept)
{
    return *(const size_t *)kept;
}

/* Become what was kept. */
static bool restore_state(unit *item, void *kept)
{
    if (kept == NULL) {
        return refuse(item, "this is no state of this unit");
    }
    return read_state(item, bytes_in(kept), size_of_state(kept));
}

static bool keep_state(unit *item, void **kept)
{
    void *made = made_state(item, *kept, bytes_of(item));
    if (made == NULL) {
        return false;
    }
    write_state(item, bytes_in(made));
    *kept = made;
    return true;
}

/* Bytes outside this unit end with their FNV-1a hash: a file may be damaged in a number that is still a number. */
static uint64_t hash_of(const void *bytes, size_t size)
{
    const unsigned char *given = (const unsigned char *)bytes;
    uint64_t hash = UINT64_C(14695981039346656037);
    size_t index;
    for (index = 0; index < size; index++) {
        hash = (hash ^ given[index]) * UINT64_C(1099511628211);
    }
    return hash;
}

static size_t size_outside(const void *kept)
{
    return size_of_state(kept) + sizeof(uint64_t);
}

static bool state_from(unit *item, const void *bytes, size_t size, void **kept)
{
    void *made;
    unit tried;
    uint64_t hash;
    if (size < sizeof(hash)) {
        return refuse(item, "this is no state of this unit");
    }
    size -= sizeof(hash);
    memcpy(&hash, (const char *)bytes + size, sizeof(hash));
    if (hash != hash_of(bytes, size)) {
        return refuse(item, "this is no state of this unit, or one that was changed");
    }
    memset(&tried, 0, sizeof(tried));
    if (!read_state(&tried, bytes, size)) {
        return refuse(item, "%s", tried.said);
    }
    free(tried.run);
    made = made_state(item, *kept, size);
    if (made == NULL) {
        return false;
    }
    memcpy(bytes_in(made), bytes, size);
    *kept = made;
    return true;
}

static bool state_to(unit *item, void *kept, void *bytes, size_t size)
{
    const size_t own = size_of_state(kept);
    const uint64_t hash = hash_of(bytes_in(kept), own);
    if (size < size_outside(kept)) {
        return refuse(item, "the state has %lu bytes", (unsigned long)size_outside(kept));
    }
    memcpy(bytes, bytes_in(kept), own);
    memcpy((char *)bytes + own, &hash, sizeof(hash));
    return true;
}
