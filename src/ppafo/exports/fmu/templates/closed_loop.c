/* ---- The closed loop: it goes from sample to sample, with outputs those of the last one. ---- */

static void follow_inputs(unit *item)
{
    (void)item;
}

static bool get_metric(unit *item, uint32_t number, double *value)
{
    @name@_metrics found;
    @name@_read_metrics(item->run, &found);
    *value = ((const double *)&found)[number];
    return true;
}

static bool go_to_sample(unit *item, int64_t sample)
{
    while (item->run->samples_shown <= sample) {
        switch (@name@_step(item->run)) {
        case @NAME@_GOING_ON:
            break;
        case @NAME@_FINISHED:
            return refuse(item, "the run ends at run.duration = %g s: set that before the start", item->now.settings.run_duration);
        default:
            return refuse_impossible(item);
        }
    }
    return true;
}

static bool take_first_sample(unit *item)
{
    return go_to_sample(item, 0);
}

/* Go on to a time since the start; every sample that is due by then, to a thousandth of their interval, is taken: a tool
 * that adds up its steps comes a little early. */
static bool go_to(unit *item, double time)
{
    const double period = item->run->parameters.timing.period;
    if (!(time >= item->now.time - 1.0e-3 * time_of(item->run, 1) && time < 1.0e15 * time_of(item->run, 1))) {
        return refuse(item, "time %g s cannot be reached from %g s", time, item->now.time);
    }
    if (item->now.is_stale && !renew(item)) {
        return false;
    }
    if (!go_to_sample(item, (int64_t)(time / time_of(item->run, 1) + 1.0e-3))) {
        return false;
    }
    item->now.time = time;
    item->now.ticks = (int64_t)(time / period + 1.0e-3);
    return true;
}
