/* ---- The inputs of the plant alone. ---- */

/* Settings at the start that the inputs have. */
static void follow_inputs(unit *item)
{
    @name@_settings *settings = &item->now.settings;
    const double *inputs = item->now.inputs;
    (void)inputs;
@follow@
}

static void lead_unit(unit *item, double time, double length)
{
    const double *inputs = item->now.inputs;
    lead(item->run, @inputs@, time, length);
}

static bool get_metric(unit *item, uint32_t number, double *value)
{
    (void)number;
    (void)value;
    return refuse(item, "the plant alone has no metrics");
}

static bool are_inputs_numbers(unit *item)
{
    int place;
    for (place = 0; place < INPUTS; ++place) {
        if (item->now.inputs[place] - item->now.inputs[place] != 0.0) {
            return refuse(item, "an input is no finite number");
        }
    }
    return true;
}
