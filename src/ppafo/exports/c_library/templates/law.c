/* ---- From here on the interface: what @name@.h declares. ---- */

enum { SETTINGS = @setting_count@, MEASURED = sizeof(@name@_measurement) / sizeof(double) };

/* Every setting: its name, its default, and what it may be, in the order of @name@_settings. */
static const struct {
    const char *name;
    double standard;
    double lowest;
    double highest;
    bool may_be_lowest;
    bool as_chosen;
} SETTING[SETTINGS] = {
@table@
};

void @name@_defaults(@name@_settings *settings)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        ((double *)settings)[place] = SETTING[place].standard;
    }
}

const char *@name@_bad_setting(const @name@_settings *settings)
{
    int place;
    for (place = 0; place < SETTINGS; ++place) {
        const double value = ((const double *)settings)[place];
        const double lowest = SETTING[place].lowest;
        if (!((value > lowest || (SETTING[place].may_be_lowest && value == lowest)) && value <= SETTING[place].highest)) {
            return SETTING[place].name;
        }
    }
    return 0;
}

void @name@_reset(@name@_state *state)
{
@reset@
}

void @name@_observe(@name@_measurement *measurement)
{
    observe(measurement);
}

double @name@_update(
    const @name@_settings *settings, @name@_state *state, double reference, const @name@_measurement *measurement)
{
    const double *values = (const double *)measurement;
    double doubt = reference - reference;
    int place;
    for (place = 0; place < MEASURED; ++place) {
        doubt += values[place] - values[place];
    }
    if (doubt == 0.0) {
        decide(settings, state, reference, measurement);
    }
    return state->last_command;
}
