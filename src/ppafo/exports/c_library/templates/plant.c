
/* ---- The plant alone, from step to step. ---- */

@steps@
/* What the inputs are from a time on, for a length of time [s]; an angle that is led goes on with its rate. */
static void lead(@name@_run *run, @arguments@, double time, double length)
{
    run_parameters *parameters = &run->parameters;
    const double lowest = command < -1.0 ? -1.0 : command;
    (void)time;
    (void)length;
    parameters->controller.command = lowest > @highest@ ? @highest@ : lowest;
@lead@
}

@name@_status @name@_initialise(@name@_run *run, const @name@_settings *settings, @arguments@)
{
    @name@_settings chosen = *settings;
    @name@_settings *first = &chosen;
    @name@_status status;
    (void)first;
@follow_inputs@
    status = begin_run(run, &chosen);
    if (status == @NAME@_BAD_SETTING && @name@_bad_setting(settings) == NULL) {
        return @NAME@_BAD_INPUT; /* what the inputs decide is out of range */
    }
    if (status != @NAME@_GOING_ON) {
        return status;
    }
    if (!(@are_numbers@)) {
        return @NAME@_BAD_INPUT;
    }
    lead(run, @inputs@, 0.0, 1.0);
    return advance_steps(run, 0) ? @NAME@_GOING_ON : @NAME@_FAILED;
}

@name@_status @name@_step(@name@_run *run, @arguments@)
{
    const double step = run->parameters.timing.step;
    if (!(@are_numbers@)) {
        return @NAME@_BAD_INPUT;
    }
    lead(run, @inputs@, (double)run->steps_done * step, (double)run->steps_per_sample * step);
    if (!advance_steps(run, run->steps_per_sample)) {
        return run->states.result.too_many_parts != 0.0 ? @NAME@_TOO_MANY_PARTS : @NAME@_FAILED;
    }
    return @NAME@_GOING_ON;
}

void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs)
{
    *outputs = run->samples.last;
    outputs->time = (double)run->steps_done * run->parameters.timing.step;
}
