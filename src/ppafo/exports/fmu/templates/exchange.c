/* ---- Model exchange: a tool integrates the states; here are their slopes, the event indicators and the events. ---- */

enum {
    UNKNOWNS = @unknowns@,
    FIRST_STATE = @first_state@,
    STATES_SHOWN = @state_count@,
    INDICATORS = @indicator_count@,
    FOUND = 3,
    WAITING = 512 /* commands on their way */
};

static const double NOMINALS[STATES_SHOWN] = {@nominals@};

/* Two instants [s] that are as good as one. */
#define SAME_INSTANT 1.0e-12

typedef void exchange_function(const run_parameters *, const @name@_settings *, ppafo_array, ppafo_array, double, double, double);

static void states_to_unknowns(const run_states *states, double *y)
{
@from_run@
}

static void unknowns_to_states(const double *y, const double *found, run_states *states)
{
    (void)found;
@to_run@
@masses@
}

/* Let parameters and unknowns have what the inputs are now. */
static void take_inputs(unit *item)
{
    lead_unit(item, 0.0, 1.0);
@led@
}

static void call(unit *item, exchange_function *function, double *found, int64_t count, double command)
{
    const @name@_settings all = with_followers(&item->now.settings);
    take_inputs(item);
    function(&item->run->parameters, &all, array_of(item->now.y, UNKNOWNS, 1, 1), array_of(found, count, 1, 1),
        item->now.time, command, item->now.way);
}

/* Send the command of the inputs on its way to the valve, and let those arrive that are due. */
static bool move_commands(unit *item)
{
    unit_state *now = &item->now;
    const double delay = ((double)item->run->command_delay + item->run->parameters.timing.command_lag)
        * item->run->parameters.timing.step;
    const double wanted = item->run->parameters.controller.command;
    if (!now->has_sent || wanted != now->sent) {
        if (now->waiting == WAITING) {
            return refuse(item, "more than %d commands are on their way to the valve", (int)WAITING);
        }
        now->on_the_way[now->waiting] = wanted;
        now->arrivals[now->waiting++] = now->time + delay;
        now->sent = wanted;
        now->has_sent = 1;
    }
    while (now->waiting > 0 && now->arrivals[0] <= now->time + SAME_INSTANT) {
        now->arrived = now->on_the_way[0];
        --now->waiting;
        memmove(now->on_the_way, now->on_the_way + 1, sizeof(double) * (size_t)now->waiting);
        memmove(now->arrivals, now->arrivals + 1, sizeof(double) * (size_t)now->waiting);
    }
    return true;
}

static bool are_unknowns_finite(unit *item)
{
    int place;
    for (place = 0; place < UNKNOWNS; ++place) {
        if (item->now.y[place] - item->now.y[place] != 0.0) {
            return refuse(item, "a state left what is possible after %g s", item->now.time);
        }
    }
    return true;
}

/* All that changes at once now: commands, the valve, and whether the vane sticks, slides or meets a stop. */
static bool handle_event(unit *item)
{
    double found[FOUND];
    unit_state *now = &item->now;
    if (!are_inputs_numbers(item) || (now->is_stale && now->phase >= UNIT_RUNNING && !renew(item))) {
        return false;
    }
    take_inputs(item);
    if (!move_commands(item)) {
        return false;
    }
    call(item, exchange_event, found, FOUND, now->arrived);
    now->command = found[0];
    now->next = found[1];
    now->way = found[2];
    if (now->waiting > 0 && now->arrivals[0] < now->next) {
        now->next = now->arrivals[0];
    }
    if (now->next < now->time + 2.0 * SAME_INSTANT) {
        now->next = now->time + 2.0 * SAME_INSTANT;
    }
    now->is_stale = 0;
    return are_unknowns_finite(item);
}

static bool take_first_sample(unit *item)
{
    item->now.time = 0.0;
    item->now.way = 0.0;
    item->now.arrived = 0.0;
    item->now.has_sent = 0;
    item->now.waiting = 0;
    states_to_unknowns(&item->run->states, item->now.y);
    return handle_event(item);
}

/* Let the outputs be those of the states and inputs as they are now. */
static bool bring_up(unit *item)
{
    double found[FOUND] = {0.0};
    if (!are_inputs_numbers(item)) {
        return false;
    }
    take_inputs(item);
@find_masses@
    unknowns_to_states(item->now.y, found, &item->run->states);
    return advance_steps(item->run, 0) || refuse(item, "a state left what is possible after %g s", item->now.time);
}

static bool get_slopes(unit *item, double *slopes)
{
    double found[UNKNOWNS];
    if (!are_inputs_numbers(item)) {
        return false;
    }
    call(item, exchange_slopes, found, UNKNOWNS, item->now.command);
    memcpy(slopes, found + FIRST_STATE, sizeof(double) * STATES_SHOWN);
    return true;
}

static bool get_indicators(unit *item, double *values)
{
    double found[FOUND] = {0.0};
    if (!are_inputs_numbers(item)) {
        return false;
    }
@margins@
    memcpy(values, found, sizeof(double) * INDICATORS);
    return true;
}

/* The states, then their slopes, by number. */
static bool get_further(unit *item, uint32_t number, double *value)
{
    double slopes[STATES_SHOWN];
    const uint32_t shown = STATES_SHOWN;
    if (number >= 2 * shown) {
        return refuse(item, "there is no such variable");
    }
    if (number < shown) {
        *value = item->now.y[FIRST_STATE + number];
        return true;
    }
    if (!get_slopes(item, slopes)) {
        return false;
    }
    *value = slopes[number - shown];
    return true;
}
