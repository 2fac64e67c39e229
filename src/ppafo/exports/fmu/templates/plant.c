/* ---- The plant alone: it goes on by steps of the engine, under inputs that are constant from one point to the next. ---- */

static bool do_steps(unit *item, int64_t steps)
{
    return advance_steps(item->run, steps) || refuse_impossible(item);
}

static bool take_first_sample(unit *item)
{
    if (!are_inputs_numbers(item)) {
        return false;
    }
    lead_unit(item, 0.0, 1.0);
    return do_steps(item, 0);
}

/* Go on to a time since the start that is a whole number of steps of the inputs, to a thousandth; the engine may divide these. */
static bool go_to(unit *item, double time)
{
    const double step = item->run->parameters.timing.period;
    const int64_t parts = item->run->steps_per_sample;
    const double wanted = time / step;
    const double done = (double)(item->run->steps_done / parts);
    int64_t until;
    if (!(wanted >= done - 1.0e-3 && wanted < 1.0e15)) {
        return refuse(item, "time %g s cannot be reached from %g s", time, item->now.time);
    }
    until = (int64_t)(wanted + 0.5);
    if (fabs(wanted - (double)until) > 1.0e-3) {
        return refuse(item, "time %g s lies between the steps of the inputs: a communication step is a multiple of @step_path@, %g s",
            time, step);
    }
    if (!are_inputs_numbers(item) || (item->now.is_stale && !renew(item))) {
        return false;
    }
    if (until * parts > item->run->steps_done) {
        lead_unit(item, done * step, ((double)until - done) * step);
        if (!do_steps(item, until * parts - item->run->steps_done)) {
            return false;
        }
    }
    item->now.time = time;
    return true;
}
