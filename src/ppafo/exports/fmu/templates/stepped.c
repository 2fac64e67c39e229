/* What both kinds of unit share. */

static bool refuse_impossible(unit *item)
{
    return refuse(item, "the run left what is possible after %g s: try a smaller run.step, and check @checked@",
        item->now.time);
}
