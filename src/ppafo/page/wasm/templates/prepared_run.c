#define NEVER_FAILED @never@
#define SAME_MOMENT @same_moment@

enum {
    SETTINGS = @setting_count@,
    OUTPUTS = @output_count@,
    STATES = @state_count@,
    PARAMETERS = @parameter_count@,
    METRICS = @metric_count@,
    COUNTS = @count_count@
};

/* What the settings come to: numbers of the steps, parameters and states at the start. */
typedef struct {
    double parameters[PARAMETERS];
    double states[STATES];
    double counts[COUNTS];
} prepared_run;

static ppafo_array array_of(double *values, int64_t first, int64_t second, int64_t third)
{
    ppafo_array made;
    made.values = values;
    made.extent[0] = first;
    made.extent[1] = second;
    made.extent[2] = third;
    return made;
}

/* The place of the setting for which Python would run other functions than there are here, SETTINGS where there is none. */
static int32_t needs_other_program(const @settings_type@ *settings, const prepared_run *prepared)
{
    (void)settings;
    if (prepared->counts[COUNT_INTERVAL] < 1.0) {
        return SETTING_RUN_OUTPUT_INTERVAL;
    }
    if (prepared->counts[COUNT_STEPS] > 1.0e9) {
        return SETTING_RUN_DURATION;
    }
@needs_other@
    return SETTINGS;
}
