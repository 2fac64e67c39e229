#include <stddef.h>

#define PPAFO_ENTRY static inline __attribute__((always_inline))

@functions@

/* ---- From here on what the module shows; src/ppafo/page/wasm/__init__.py says how it is called. ---- */

#define SHOWN(name) __attribute__((export_name(#name))) name

typedef struct {
@members@
} run_settings;

@prepared_run@
enum {
    SIGNALS = @signal_rows@,
    LANES = @lanes@,
    /* Samples of one run that are taken at once, and room for them: the last step brings one more. */
    CHUNK = 32,
    ROOM = 2 * CHUNK,
    PAGE = 65536
};

/* How a run ended. */
enum { COMPLETED, DIVERGED, TOO_MANY_PARTS, REFUSED, NO_MEMORY };

/* The clock of runs that can go on together. */
typedef struct {
    double interval; /* steps from one sample to the next */
    int64_t steps;
    int64_t steps_per_sample;
    int64_t samples;
    int64_t signal_delay; /* steps */
    int64_t command_delay;
    bool needs_parts;
} run_clock;

static void fill(double *values, int64_t count, double value)
{
    for (int64_t place = 0; place < count; ++place) {
        values[place] = value;
    }
}

/* ---- Memory: everything behind the stack and the data of the module, one piece after the other. ---- */

extern unsigned char __heap_base;
static size_t taken;

static size_t begin_of_memory(void)
{
    return ((size_t)&__heap_base + 15) & ~(size_t)15;
}

void *SHOWN(reserve)(int32_t bytes)
{
    const size_t first = taken ? taken : begin_of_memory();
    const size_t end = first + (((size_t)bytes + 15) & ~(size_t)15);
    const size_t pages = (end + PAGE - 1) / PAGE;
    const size_t now = __builtin_wasm_memory_size(0);
    if (bytes < 0 || end < first || (pages > now && __builtin_wasm_memory_grow(0, pages - now) == (size_t)-1)) {
        return NULL;
    }
    taken = end;
    return (void *)first;
}

void SHOWN(release)(void *from)
{
    taken = (size_t)from;
}

static double *reserve_numbers(int64_t count)
{
    return count > INT32_MAX / 8 ? NULL : (double *)reserve((int32_t)count * 8);
}

/* ---- From settings to a run. ---- */

__attribute__((noinline)) static void prepare_run(const run_settings *settings, prepared_run *prepared)
{
    __builtin_memset(prepared, 0, sizeof(*prepared));
@prepare@
}

/* True for a number that is a whole one but for rounding. */
static inline bool is_whole(double count)
{
    return fabs(count - (double)ppafo_whole_part(count + 0.5)) <= 1.0e-9 * count;
}

/* The place of the first setting that is out of range or contradicts another, SETTINGS where all are good. */
static int32_t bad_setting(const run_settings *settings)
{
@conditions@
    return SETTINGS;
}

int32_t SHOWN(check)(const run_settings *settings)
{
    prepared_run prepared;
    const int32_t bad = bad_setting(settings);
    if (bad < SETTINGS) {
        return bad;
    }
    prepare_run(settings, &prepared);
    const int32_t other = needs_other_program(settings, &prepared);
    return other < SETTINGS ? SETTINGS + other : -1;
}

static run_clock clock_of(const double *counts)
{
    run_clock made;
    made.interval = counts[COUNT_INTERVAL];
    made.steps = (int64_t)counts[COUNT_STEPS];
    made.steps_per_sample = (int64_t)counts[COUNT_STEPS_PER_SAMPLE];
    made.samples = (int64_t)(((double)made.steps + SAME_MOMENT) / made.interval) + 1;
    made.signal_delay = (int64_t)counts[COUNT_SIGNAL_DELAY];
    made.command_delay = (int64_t)counts[COUNT_COMMAND_DELAY];
    made.needs_parts = counts[COUNT_NEEDS_PARTS] != 0.0;
    return made;
}

int32_t SHOWN(samples)(const run_settings *settings)
{
    prepared_run prepared;
    if (check(settings) >= 0) {
        return 0;
    }
    prepare_run(settings, &prepared);
    const int64_t found = clock_of(prepared.counts).samples;
    return found > INT32_MAX ? 0 : (int32_t)found;
}

static int64_t values_of_history(const run_clock *clock, int64_t width)
{
    return width * (SIGNALS * (clock->signal_delay + 2) + clock->command_delay + 2);
}

/* ---- One run with its samples. ---- */

/* A run under way. */
typedef struct {
    run_clock clock;
    prepared_run prepared;
    double *history;
    double trace[ROOM][OUTPUTS];
    int64_t steps_done;
    int64_t samples_taken;
} single_run;

/* Do all steps up to that in which a sample is due, with it; up to the last one also those that are left. */
__attribute__((noinline)) static void go_to_sample(single_run *run, int64_t sample)
{
    const run_clock *clock = &run->clock;
    const int64_t slots = clock->signal_delay + 2;
    int64_t until = (int64_t)((double)sample * clock->interval + SAME_MOMENT) + 1;
    if (until > clock->steps || sample + 1 == clock->samples) {
        until = clock->steps;
    }
#define GO_ON(advance)                                                                                                 \
    advance(array_of(run->prepared.states, STATES, 1, 0), array_of(run->prepared.parameters, PARAMETERS, 1, 0),       \
        array_of(run->history, SIGNALS, slots, 1),                                                                    \
        array_of(run->history + SIGNALS * slots, clock->command_delay + 2, 1, 0),                                     \
        array_of(run->history, 0, STATES, 1), array_of(run->trace[0], ROOM, OUTPUTS, 1), run->steps_done,            \
        until - run->steps_done, clock->steps, clock->steps_per_sample, clock->interval, clock->samples - 1,          \
        run->samples_taken, 1, clock->signal_delay, clock->command_delay)
    @go_on@
#undef GO_ON
    run->steps_done = until;
    run->samples_taken = until == clock->steps ? clock->samples : sample + 1;
}

static bool is_finite(const double *states, int64_t stride)
{
    bool found = true;
    for (int64_t place = 0; place < STATES; ++place) {
        found = found && states[place * stride] - states[place * stride] == 0.0;
    }
    return found;
}

static void read_metrics(double *states, int64_t samples, double *found)
{
    metrics(array_of(states, STATES, 0, 0), samples, array_of(found, METRICS, 0, 0));
}

/* Run to the end or to where it fails, with the samples in columns ``count`` long. */
static void run_alone(single_run *run, double *columns, int64_t count)
{
    fill(run->history, values_of_history(&run->clock, 1), 0.0);
    while (run->samples_taken < count && !(run->prepared.states[AT_RESULT_FAILURE_TIME] < NEVER_FAILED)) {
        const int64_t first = run->samples_taken;
        go_to_sample(run, first + CHUNK < count ? first + CHUNK - 1 : count - 1);
        for (int64_t row = 0; row < OUTPUTS; ++row) {
            for (int64_t sample = first; sample < run->samples_taken; ++sample) {
                columns[(row + 1) * count + sample] = run->trace[sample % ROOM][row];
            }
        }
    }
}

/* How a run ended, from its last states, ``stride`` apart. */
static int32_t status_of(const double *states, int64_t stride)
{
    if (!(states[AT_RESULT_FAILURE_TIME * stride] < NEVER_FAILED) && is_finite(states, stride)) {
        return COMPLETED;
    }
    return states[AT_RESULT_TOO_MANY_PARTS * stride] != 0.0 ? TOO_MANY_PARTS : DIVERGED;
}

int32_t SHOWN(run)(const run_settings *settings, double *columns, double *found, int32_t *good)
{
    single_run run;
    prepared_run begun;
    const size_t before = taken;
    *good = 0;
    fill(found, METRICS, (double)__builtin_nanf(""));
    if (check(settings) >= 0) {
        return REFUSED;
    }
    prepare_run(settings, &begun);
    run.clock = clock_of(begun.counts);
    run.prepared = begun;
    run.steps_done = 0;
    run.samples_taken = 0;
    run.history = reserve_numbers(values_of_history(&run.clock, 1));
    if (run.history == NULL) {
        return NO_MEMORY;
    }
    const int64_t count = run.clock.samples;
    const double interval = begun.parameters[PARAMETER_TIMING_STEP] * run.clock.interval;
    for (int64_t sample = 0; sample < count; ++sample) {
        columns[sample] = (double)sample * interval;
    }
    run_alone(&run, columns, count);
    taken = before;
    const int32_t ended = status_of(run.prepared.states, 1);
    if (ended == COMPLETED) {
        *good = (int32_t)count;
        read_metrics(run.prepared.states, count, found);
        return COMPLETED;
    }
    const double failed = run.prepared.states[AT_RESULT_FAILURE_TIME];
    const double limit = failed < NEVER_FAILED ? failed : columns[count - 1];
    for (*good = 1; *good < count && columns[*good] < limit; ++*good) {
    }
    return ended;
}

/* ---- Many runs, LANES at once. ---- */

/* A block of runs with one clock. */
typedef struct {
    double states[STATES][LANES];
    double parameters[PARAMETERS][LANES];
    prepared_run prepared[LANES];
    int32_t member[LANES];
    int64_t width;
} run_block;

/* What is wanted of many runs. */
typedef struct {
    double *metrics;
    int32_t *ended;
    int32_t first_channel;
    int32_t channels;
    int32_t every;
    int32_t places;
    double *traces;
} wanted_of_runs;

__attribute__((noinline)) static void run_together(run_block *block, const run_clock *clock, double *history,
    double *trace, int64_t places, int64_t every)
{
    const int64_t slots = clock->signal_delay + 2;
    fill(history, values_of_history(clock, LANES), 0.0);
#define GO_ON(advance)                                                                                                 \
    advance(array_of(block->states[0], STATES, LANES, 0), array_of(block->parameters[0], PARAMETERS, LANES, 0),       \
        array_of(history, SIGNALS, slots, LANES),                                                                     \
        array_of(history + SIGNALS * slots * LANES, clock->command_delay + 2, LANES, 0),                              \
        array_of(history, 0, STATES, LANES), array_of(trace, places, OUTPUTS, LANES), 0, clock->steps, clock->steps,  \
        clock->steps_per_sample, clock->interval, clock->samples - 1, 0, every, clock->signal_delay,                  \
        clock->command_delay)
    @go_on_together@
#undef GO_ON
}

/* Fill all lanes, those that are left over with the last run. */
static void fill_lanes(run_block *block)
{
    for (int64_t lane = 0; lane < LANES; ++lane) {
        const prepared_run *own = &block->prepared[lane < block->width ? lane : block->width - 1];
        for (int64_t place = 0; place < STATES; ++place) {
            block->states[place][lane] = own->states[place];
        }
        for (int64_t place = 0; place < PARAMETERS; ++place) {
            block->parameters[place][lane] = own->parameters[place];
        }
    }
}

/* How each run of a block ended, and what is wanted of it. */
static void judge_block(run_block *block, const run_clock *clock, const double *trace, const wanted_of_runs *wanted)
{
    for (int64_t lane = 0; lane < block->width; ++lane) {
        const int32_t member = block->member[lane];
        wanted->ended[member] = status_of(&block->states[0][lane], LANES);
        if (wanted->ended[member] != COMPLETED) {
            continue;
        }
        double states[STATES];
        for (int64_t place = 0; place < STATES; ++place) {
            states[place] = block->states[place][lane];
        }
        read_metrics(states, clock->samples, &wanted->metrics[member * METRICS]);
        for (int64_t channel = 0; channel < wanted->channels; ++channel) {
            double *own = &wanted->traces[(member * wanted->channels + channel) * wanted->places];
            for (int64_t place = 0; place < wanted->places && place * wanted->every < clock->samples; ++place) {
                own[place] = trace[(place * OUTPUTS + wanted->first_channel + channel) * LANES + lane];
            }
        }
    }
}

/* Run a block and take its lanes out; false where memory does not suffice. */
static bool run_block_of(run_block *block, const wanted_of_runs *wanted)
{
    const size_t before = taken;
    const run_clock clock = clock_of(block->prepared[0].counts);
    const bool traces = wanted->channels > 0;
    const int64_t places = traces ? (clock.samples - 1) / wanted->every + 1 : 1;
    double *history = reserve_numbers(values_of_history(&clock, LANES));
    double *trace = reserve_numbers(places * OUTPUTS * LANES);
    if (history == NULL || trace == NULL) {
        taken = before;
        return false;
    }
    fill_lanes(block);
    run_together(block, &clock, history, trace, places, traces ? wanted->every : INT64_MAX);
    judge_block(block, &clock, trace, wanted);
    taken = before;
    return true;
}

static bool has_same_counts(const double *left, const double *right)
{
    bool found = true;
    for (int64_t place = 0; place < COUNTS; ++place) {
        found = found && left[place] == right[place];
    }
    return found;
}

int32_t SHOWN(ensemble)(const run_settings *settings, int32_t runs, double *found, int32_t *ended, int32_t channel,
    int32_t every, int32_t places, double *traces)
{
    enum { WAITING = -1, NO_CHANNEL = -1, ALL_CHANNELS = -2 };
    const int32_t channels = channel == ALL_CHANNELS ? OUTPUTS : channel == NO_CHANNEL ? 0 : 1;
    const wanted_of_runs wanted = {found, ended, channel < 0 ? 0 : channel, channels, every, places, traces};
    const size_t before = taken;
    run_block *block = (run_block *)reserve(sizeof(run_block));
    double *counts = reserve_numbers((int64_t)runs * COUNTS);
    bool has_memory = block != NULL && counts != NULL;
    fill(found, (int64_t)runs * METRICS, (double)__builtin_nanf(""));
    fill(traces, (int64_t)runs * channels * places, (double)__builtin_nanf(""));
    for (int32_t member = 0; member < runs && has_memory; ++member) {
        ended[member] = check(&settings[member]) < 0 ? WAITING : REFUSED;
        if (ended[member] == WAITING) {
            prepare_run(&settings[member], &block->prepared[0]);
            __builtin_memcpy(&counts[member * COUNTS], block->prepared[0].counts, sizeof(block->prepared[0].counts));
        }
    }
    for (int32_t first = 0; first < runs && has_memory; ++first) {
        block->width = 0;
        for (int32_t member = first; ended[first] == WAITING && member < runs && block->width < LANES; ++member) {
            if (ended[member] == WAITING && has_same_counts(&counts[first * COUNTS], &counts[member * COUNTS])) {
                prepare_run(&settings[member], &block->prepared[block->width]);
                block->member[block->width++] = member;
            }
        }
        has_memory = block->width == 0 || run_block_of(block, &wanted);
    }
    taken = before;
    return has_memory ? COMPLETED : NO_MEMORY;
}
