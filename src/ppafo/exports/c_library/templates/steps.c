/* Do some steps under parameters as they stand, then take a sample; false where the run left what is possible. */
static bool advance_steps(@name@_run *run, int64_t steps)
{
    double *history = (double *)(run + 1);
    const int64_t slots = run->signal_delay + 2;
    const int64_t until = run->steps_done + steps;
    const int64_t sample = run->steps_done > 0 || steps > 0 ? 1 : 0;
    advance(&run->states, &run->parameters, &run->samples, array_of(history, @signal_rows@, slots, 1),
        array_of(history + @signal_rows@ * slots, run->command_delay + 2, 1, 0), run->steps_done, steps, until,
        run->steps_per_sample, sample > 0 ? (double)until : 1.0, sample, sample, run->signal_delay,
        run->command_delay@in_parts@);
    run->steps_done = until;
    run->samples_taken = sample + 1;
    run->samples_shown = sample + 1;
    return is_finite(&run->states) && run->states.result.failure_time == NEVER_FAILED;
}
