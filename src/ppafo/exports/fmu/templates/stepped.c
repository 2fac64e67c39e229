/* ---- What both kinds of co-simulation share: their outputs are those of the last sample or step, and they have no other. ---- */

static bool get_further(unit *item, uint32_t number, double *value)
{
    (void)number;
    (void)value;
    return refuse(item, "there is no such variable");
}

static bool bring_up(unit *item)
{
    (void)item;
    return true;
}

static bool refuse_impossible(unit *item)
{
    return refuse(item, "the run left what is possible after %g s: try a smaller run.step, and check @checked@",
        item->now.time);
}
