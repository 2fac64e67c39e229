/* ---- From here on the interface: what @name@.h declares. ---- */

@prepared_run@
struct @name@_run {
    double parameters[PARAMETERS];
    double states[STATES];
    double first[STATES];
    /* The last two samples, each in the place that its number leaves when it is divided by 2. */
    double samples[2][OUTPUTS];
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
    @name@_settings all = *chosen;
@follow@
    (void)before;
    return all;
}

static void prepare_run(const @name@_settings *chosen, prepared_run *prepared)
{
    const @name@_settings all = with_followers(chosen);
    const @name@_settings *settings = &all;
    memset(prepared, 0, sizeof(*prepared));
@prepare@
}

static int64_t values_of_history(int64_t signal_delay, int64_t command_delay)
{
    return @signal_rows@ * (signal_delay + 2) + command_delay + 2;
}

void @name@_defaults(@name@_settings *settings)
{
@defaults@
}

const char *@name@_bad_setting(const @name@_settings *chosen)
{
    const @name@_settings all = with_followers(chosen);
    const @name@_settings *settings = &all;
@ranges@
    return NULL;
}

size_t @name@_size(const @name@_settings *settings)
{
    prepared_run prepared;
    if (@name@_bad_setting(settings) != NULL) {
        return 0;
    }
    prepare_run(settings, &prepared);
    if (is_other_program(settings, &prepared)) {
        return 0;
    }
    return sizeof(@name@_run) + sizeof(double) * (size_t)values_of_history((int64_t)prepared.counts[COUNT_SIGNAL_DELAY],
        (int64_t)prepared.counts[COUNT_COMMAND_DELAY]);
}

@name@_status @name@_initialise(@name@_run *run, const @name@_settings *settings)
{
    prepared_run prepared;
    double *history = (double *)(run + 1);
    int64_t place;
    int64_t values;
    if (@name@_bad_setting(settings) != NULL) {
        return @NAME@_BAD_SETTING;
    }
    prepare_run(settings, &prepared);
    if (is_other_program(settings, &prepared)) {
        return @NAME@_OTHER_PROGRAM;
    }
    memset(run, 0, sizeof(*run));
    memcpy(run->parameters, prepared.parameters, sizeof(run->parameters));
    memcpy(run->states, prepared.states, sizeof(run->states));
    memcpy(run->first, prepared.states, sizeof(run->first));
    run->interval = prepared.counts[COUNT_INTERVAL];
    run->steps = (int64_t)prepared.counts[COUNT_STEPS];
    run->steps_per_sample = (int64_t)prepared.counts[COUNT_STEPS_PER_SAMPLE];
    run->sample_count = (int64_t)(((double)run->steps + SAME_MOMENT) / run->interval) + 1;
    run->needs_parts = prepared.counts[COUNT_NEEDS_PARTS] != 0.0 ? 1 : 0;
    run->signal_delay = (int64_t)prepared.counts[COUNT_SIGNAL_DELAY];
    run->command_delay = (int64_t)prepared.counts[COUNT_COMMAND_DELAY];
    values = values_of_history(run->signal_delay, run->command_delay);
    for (place = 0; place < values; ++place) {
        history[place] = 0.0;
    }
    run->bytes = (int64_t)(sizeof(*run) + sizeof(double) * (size_t)values);
    return @NAME@_GOING_ON;
}

/* Do all steps up to the one in which the next sample is due, with it; after the last sample also those that are left. */
static void take_sample(@name@_run *run)
{
    double *history = (double *)(run + 1);
    const int64_t slots = run->signal_delay + 2;
    const double due = (double)run->samples_taken * run->interval;
    int64_t until = (int64_t)(due + SAME_MOMENT) + 1;
    if (until > run->steps || run->samples_taken + 1 == run->sample_count) {
        until = run->steps;
    }
    @advance@(array_of(run->states, STATES, 1, 0), array_of(run->parameters, PARAMETERS, 1, 0),
        array_of(history, @signal_rows@, slots, 1),
        array_of(history + @signal_rows@ * slots, run->command_delay + 2, 1, 0), array_of(history, 0, STATES, 1),
        array_of(run->samples[0], 2, OUTPUTS, 1), run->steps_done, until - run->steps_done, run->steps,
        run->steps_per_sample, run->interval, run->sample_count - 1, run->samples_taken, 1, run->signal_delay,
        run->command_delay);
    run->steps_done = until;
    run->samples_taken = until == run->steps ? run->sample_count : run->samples_taken + 1;
}

static double time_of(const @name@_run *run, int64_t sample)
{
    return (double)sample * (run->parameters[PARAMETER_TIMING_STEP] * run->interval);
}

@name@_status @name@_step(@name@_run *run)
{
    const double *states = run->states;
    bool is_finite = true;
    int64_t place;
    if (run->samples_shown == run->sample_count) {
        return @NAME@_FINISHED;
    }
    if (run->samples_shown == run->samples_taken) {
        take_sample(run);
    }
    for (place = 0; place < STATES; ++place) {
        is_finite = is_finite && states[place] - states[place] == 0.0;
    }
    if (!(time_of(run, run->samples_shown) < states[AT_RESULT_FAILURE_TIME]) || !is_finite) {
        return states[AT_RESULT_TOO_MANY_PARTS] != 0.0 ? @NAME@_TOO_MANY_PARTS : @NAME@_FAILED;
    }
    ++run->samples_shown;
    return @NAME@_GOING_ON;
}

void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs)
{
    const int64_t sample = run->samples_shown > 0 ? run->samples_shown - 1 : 0;
    const double *values = run->samples[sample % 2];
    outputs->time = time_of(run, sample);
@read_outputs@
}

void @name@_read_metrics(const @name@_run *run, @name@_metrics *given)
{
    @name@_run now = *run;
    double found[METRICS];
    metrics(array_of(now.first, STATES, 0, 0), array_of(now.states, STATES, 0, 0),
        array_of(now.parameters, PARAMETERS, 0, 0), now.samples_taken, array_of(found, METRICS, 0, 0));
@read_metrics@
}

void @name@_copy(@name@_run *to, const @name@_run *from)
{
    memcpy(to, from, (size_t)from->bytes);
}
