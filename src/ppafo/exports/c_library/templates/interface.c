/* ---- From here on the interface: what @name@.h declares. ---- */

#define NEVER_FAILED @never@
#define SAME_MOMENT @same_moment@

enum {
    SETTINGS = @setting_count@,
    OUTPUTS = @output_count@,
    METRICS = @metric_count@,
    STATES = sizeof(run_states) / sizeof(double)
};

/* What the settings come to: numbers of the steps, parameters and states at the start. */
typedef struct {
    run_parameters parameters;
    run_states states;
    run_counts counts;
} prepared_run;

/* Every setting: its name, its default, and what it may be, in the order of @name@_settings. */
static const struct {
    const char *name;
    double standard;
    double lowest;
    double highest;
    bool may_be_lowest;
    bool as_chosen; /* before settings follow others */
} SETTING[SETTINGS] = {
@table@
};

struct @name@_run {
    run_parameters parameters;
    run_states states;
    run_samples samples;
    double interval;       /* steps from one sample to the next */
    int64_t bytes;
    int64_t steps;         /* in all */
    int64_t steps_done;
    int64_t steps_per_sample;
    int64_t sample_count;  /* in all */
    int64_t samples_taken;
    int64_t samples_shown;
    int64_t needs_parts;   /* 1 where the error decides about the parts of a step */
    int64_t signal_delay;  /* steps */
    int64_t command_delay;
    /* Late signals and commands follow in memory. */
};

/* Settings with those that follow others in what these make of them; see README.md. */
static @name@_settings with_followers(const @name@_settings *chosen)
{
    @name@_settings before = *chosen;
    @name@_settings all;
@first@    all = before;
@follow@
    (void)before;
    return all;
}

static void prepare_run(const @name@_settings *chosen, prepared_run *prepared)
{
    const @name@_settings all = with_followers(chosen);
    const @name@_settings *settings = &all;
    memset(prepared, 0, sizeof(*prepared));
    prepare(settings, &prepared->parameters, &prepared->states, &prepared->counts);
}

/* The setting for which Python would run other functions than there are here, NULL where there is none. */
static const char *needs_other_program(const @name@_settings *settings, const prepared_run *prepared)
{
    (void)settings;
    if (prepared->counts.interval < 1.0) {
        return "run_output_interval";
    }
    if (prepared->counts.steps > 1.0e9) {
        return "run_duration";
    }
@needs_other@
    return NULL;
}
@is_whole@
static ppafo_array array_of(double *values, int64_t first, int64_t second, int64_t third)
{
    const ppafo_array made = {values, {first, second, third}};
    return made;
}

/* True where all numbers of a run are finite. */
static bool is_finite(const run_states *states)
{
    double values[STATES];
    bool found = true;
    int place;
    memcpy(values, states, sizeof(values));
    for (place = 0; place < (int)STATES; ++place) {
        found = found && values[place] - values[place] == 0.0;
    }
    return found;
}

static int64_t values_of_history(int64_t signal_delay, int64_t command_delay)
{
    return @signal_rows@ * (signal_delay + 2) + command_delay + 2;
}

void @name@_defaults(@name@_settings *settings)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        ((double *)settings)[place] = SETTING[place].standard;
    }
}

/* The first setting that is out of range, NULL where there is none. */
static const char *out_of_range(const @name@_settings *chosen, const @name@_settings *settings)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        const double value = ((const double *)(SETTING[place].as_chosen ? chosen : settings))[place];
        const double lowest = SETTING[place].lowest;
        if (!((value > lowest || (SETTING[place].may_be_lowest && value == lowest)) && value <= SETTING[place].highest)) {
            return SETTING[place].name;
        }
    }
    return NULL;
}

/* The first setting that is out of range or contradicts another, NULL where there is none. */
static const char *wrong_setting(const @name@_settings *chosen)
{
    const @name@_settings all = with_followers(chosen);
    const @name@_settings *settings = &all;
    const char *outside = out_of_range(chosen, settings);
    if (outside != NULL) {
        return outside;
    }
@relations@
@profiles@
    return NULL;
}

const char *@name@_bad_setting(const @name@_settings *chosen)
{
    prepared_run prepared;
    const char *wrong = wrong_setting(chosen);
    if (wrong != NULL) {
        return wrong;
    }
    prepare_run(chosen, &prepared);
    return needs_other_program(chosen, &prepared);
}

size_t @name@_size(const @name@_settings *settings)
{
    prepared_run prepared;
    if (@name@_bad_setting(settings) != NULL) {
        return 0;
    }
    prepare_run(settings, &prepared);
    return sizeof(@name@_run) + sizeof(double) * (size_t)values_of_history((int64_t)prepared.counts.signal_delay,
        (int64_t)prepared.counts.command_delay);
}

static @name@_status begin_run(@name@_run *run, const @name@_settings *settings)
{
    prepared_run prepared;
    double *history = (double *)(run + 1);
    int64_t place;
    int64_t values;
    if (wrong_setting(settings) != NULL) {
        return @NAME@_BAD_SETTING;
    }
    prepare_run(settings, &prepared);
    if (needs_other_program(settings, &prepared) != NULL) {
        return @NAME@_OTHER_PROGRAM;
    }
    memset(run, 0, sizeof(*run));
    run->parameters = prepared.parameters;
    run->states = prepared.states;
    run->interval = prepared.counts.interval;
    run->steps = (int64_t)prepared.counts.steps;
    run->steps_per_sample = (int64_t)prepared.counts.steps_per_sample;
    run->sample_count = (int64_t)(((double)run->steps + SAME_MOMENT) / run->interval) + 1;
    run->needs_parts = prepared.counts.needs_parts != 0.0 ? 1 : 0;
    run->signal_delay = (int64_t)prepared.counts.signal_delay;
    run->command_delay = (int64_t)prepared.counts.command_delay;
    values = values_of_history(run->signal_delay, run->command_delay);
    for (place = 0; place < values; ++place) {
        history[place] = 0.0;
    }
    run->bytes = (int64_t)(sizeof(*run) + sizeof(double) * (size_t)values);
    return @NAME@_GOING_ON;
}

void @name@_copy(@name@_run *to, const @name@_run *from)
{
    memcpy(to, from, (size_t)from->bytes);
}
