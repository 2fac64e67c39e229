
/* ---- The closed loop, from sample to sample. ---- */

@name@_status @name@_initialise(@name@_run *run, const @name@_settings *settings)
{
    return begin_run(run, settings);
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
    advance(&run->states, &run->parameters, &run->samples, array_of(history, @signal_rows@, slots, 1),
        array_of(history + @signal_rows@ * slots, run->command_delay + 2, 1, 0), run->steps_done,
        until - run->steps_done, run->steps, run->steps_per_sample, run->interval, run->sample_count - 1,
        run->samples_taken, run->signal_delay, run->command_delay@in_parts@);
    run->steps_done = until;
    run->samples_taken = until == run->steps ? run->sample_count : run->samples_taken + 1;
}

static double time_of(const @name@_run *run, int64_t sample)
{
    return (double)sample * (run->parameters.timing.step * run->interval);
}

@name@_status @name@_step(@name@_run *run)
{
    if (run->samples_shown == run->sample_count) {
        return @NAME@_FINISHED;
    }
    if (run->samples_shown == run->samples_taken) {
        take_sample(run);
    }
    if (!(time_of(run, run->samples_shown) < run->states.result.failure_time) || !is_finite(&run->states)) {
        return run->states.result.too_many_parts != 0.0 ? @NAME@_TOO_MANY_PARTS : @NAME@_FAILED;
    }
    ++run->samples_shown;
    return @NAME@_GOING_ON;
}

void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs)
{
    const int64_t sample = run->samples_shown > 0 ? run->samples_shown - 1 : 0;
    *outputs = run->samples_taken > sample + 1 ? run->samples.before : run->samples.last;
    outputs->time = time_of(run, sample);
}

void @name@_read_metrics(const @name@_run *run, @name@_metrics *given)
{
    metrics(&run->states, run->samples_taken, given);
}
