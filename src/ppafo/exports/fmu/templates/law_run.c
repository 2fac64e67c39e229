/* ---- A law as a run under way, which goes from sample to sample. ---- */
#include <string.h>

enum { OUTPUTS = 1, METRICS = 0 };

#define SAME_MOMENT 0.0

typedef struct {
    double time;
    double command;
} @name@_outputs;

typedef struct {
    struct {
        double period;
    } timing;
    @name@_settings settings;
} run_parameters;

typedef struct {
    double steps_per_sample;
    double signal_delay;
    double command_delay;
    double needs_parts;
} run_counts;

typedef struct {
    run_parameters parameters;
    run_counts counts;
} prepared_run;

typedef struct {
    run_parameters parameters;
    @name@_state state;
    @name@_measurement measurement;
    double reference;
    double interval;
    int64_t bytes;
    int64_t steps;
    int64_t steps_done;
    int64_t steps_per_sample;
    int64_t sample_count;
    int64_t samples_taken;
    int64_t samples_shown;
    int64_t needs_parts;
    int64_t signal_delay;
    int64_t command_delay;
} @name@_run;

/* No setting of a law follows another. */
static @name@_settings with_followers(const @name@_settings *chosen)
{
    return *chosen;
}

static const char *wrong_setting(const @name@_settings *settings)
{
    return @name@_bad_setting(settings);
}

static void prepare_run(const @name@_settings *settings, prepared_run *prepared)
{
    memset(prepared, 0, sizeof(*prepared));
    prepared->parameters.settings = *settings;
    prepared->parameters.timing.period = settings->controller_period;
    prepared->counts.steps_per_sample = 1.0;
}

static const char *needs_other_program(const @name@_settings *settings, const prepared_run *prepared)
{
    (void)settings;
    (void)prepared;
    return NULL;
}

static int64_t values_of_history(int64_t signal_delay, int64_t command_delay)
{
    (void)signal_delay;
    (void)command_delay;
    return 0;
}

static size_t @name@_size(const @name@_settings *settings)
{
    (void)settings;
    return sizeof(@name@_run);
}

static int begin_run(@name@_run *run, const @name@_settings *settings)
{
    prepared_run prepared;
    prepare_run(settings, &prepared);
    memset(run, 0, sizeof(*run));
    run->parameters = prepared.parameters;
    @name@_reset(&run->state);
    run->interval = 1.0;
    run->bytes = (int64_t)sizeof(*run);
    run->steps_per_sample = 1;
    run->sample_count = 1;
    return 0;
}

static void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs)
{
    outputs->time = (double)run->steps_done * run->parameters.timing.period;
    outputs->command = run->state.last_command;
}

/* Keep the inputs for the samples of a communication step. */
static void lead(@name@_run *run, @arguments@, double time, double length)
{
    (void)time;
    (void)length;
    run->reference = reference;
@keep@
}

/* Take some samples under the same inputs. */
static bool advance_steps(@name@_run *run, int64_t steps)
{
    int64_t step;
    double command = 0.0;
    for (step = 0; step < steps; ++step) {
        command = @name@_update(&run->parameters.settings, &run->state, run->reference, &run->measurement);
    }
    run->steps_done += steps;
    return command - command == 0.0;
}
