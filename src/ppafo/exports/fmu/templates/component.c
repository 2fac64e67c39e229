/* The functions of fmi3.c as those of the interface of fmi-ls-wasm (a draft), in numbers of the canonical ABI.
 *
 * A result that is more than one number lies in room() until the next call; what is given belongs to the function.
 */
#include "@main@"

#define SHOWN(name) __attribute__((export_name(#name))) name
/* Where memory of no bytes begins. */
#define NOWHERE 16

__attribute__((import_module("env"), import_name("log_message"))) void log_message(const char *name,
    size_t name_length, int32_t status, const char *category, size_t category_length, const char *message,
    size_t message_length);

static union {
    uint8_t bytes[64];
    int32_t words[16];
    double numbers[8];
} shown;

uint8_t *SHOWN(room)(void)
{
    return shown.bytes;
}

void *SHOWN(cabi_realloc)(void *old, size_t old_size, size_t alignment, size_t size)
{
    void *made;
    (void)alignment;
    made = size == 0 ? (void *)NOWHERE : realloc(old_size == 0 ? NULL : old, size);
    if (made == NULL) {
        __builtin_trap();
    }
    return made;
}

static void discard(void *given)
{
    if (given != (void *)NOWHERE) {
        free(given);
    }
}

/* Free a list, and the first of each of so many pairs of numbers in it. */
static void discard_list(void *given, int32_t lists)
{
    int32_t place;
    for (place = 0; place < lists; ++place) {
        discard(((void **)given)[2 * place]);
    }
    discard(given);
}

static uint8_t *failed(fmi3Status status)
{
    shown.bytes[0] = 1;
    /* The place of the error depends on what stands beside it. */
    shown.bytes[4] = shown.bytes[8] = (uint8_t)status;
    return shown.bytes;
}

static uint8_t *list_of(const void *values, int32_t count)
{
    shown.bytes[0] = 0;
    shown.words[1] = (int32_t)(size_t)values;
    shown.words[2] = count;
    return shown.bytes;
}

static int32_t without(unit_instance *self, int32_t count)
{
    return (int32_t)done(self, has_none(self, (size_t)count));
}

static uint8_t *nothing_of(unit_instance *self, int32_t count)
{
    return without(self, count) == (int32_t)fmi3OK ? list_of(shown.bytes, 0) : failed(fmi3Error);
}

/* Memory for a list that is returned, until the next one. */
static void *kept_for(size_t bytes)
{
    static void *kept;
    free(kept);
    kept = malloc(bytes + 1);
    if (kept == NULL) {
        __builtin_trap();
    }
    return kept;
}

static void tell(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    const char *name = (const char *)environment;
    log_message(name, strlen(name), (int32_t)status, category, strlen(category), message, strlen(message));
}

/* A text with its end. */
static char *ended(char *text, int32_t length)
{
    char *made = (char *)calloc((size_t)length + 1, 1);
    if (made == NULL) {
        __builtin_trap();
    }
    memcpy(made, text, (size_t)length);
    discard(text);
    return made;
}

unit_instance *SHOWN(instantiate)(char *name, int32_t name_length, char *token, int32_t token_length, int32_t visible,
    int32_t logging, int32_t events, int32_t early, uint32_t *intermediate, int32_t count)
{
    char *own_name = ended(name, name_length);
    char *own_token = ended(token, token_length);
    unit_instance *made = (unit_instance *)fmi3InstantiateCoSimulation(own_name, own_token, NULL, visible != 0,
        logging != 0, events != 0, early != 0, intermediate, (size_t)count, own_name, tell, NULL);
    discard(intermediate);
    free(own_token);
    if (made == NULL) {
        free(own_name);
    }
    return made;
}

void SHOWN(drop)(unit_instance *self)
{
    free(self->environment);
    fmi3FreeInstance(self);
}

uint8_t *SHOWN(get_version)(void)
{
    const char *version = fmi3GetVersion();
    shown.words[0] = (int32_t)(size_t)version;
    shown.words[1] = (int32_t)strlen(version);
    return shown.bytes;
}

int32_t SHOWN(set_debug_logging)(unit_instance *self, int32_t is_on, void *categories, int32_t count)
{
    discard_list(categories, count);
    return (int32_t)fmi3SetDebugLogging(self, is_on != 0, 0, NULL);
}

int32_t SHOWN(enter_initialization_mode)(unit_instance *self, int32_t has_tolerance, double tolerance, double start,
    int32_t has_stop, double stop)
{
    return (int32_t)fmi3EnterInitializationMode(self, has_tolerance != 0, tolerance, start, has_stop != 0, stop);
}

#define PLAIN(name, function)                                                                                          \
    int32_t SHOWN(name)(unit_instance * self)                                                                          \
    {                                                                                                                  \
        return (int32_t)function(self);                                                                                \
    }
PLAIN(exit_initialization_mode, fmi3ExitInitializationMode)
PLAIN(enter_configuration_mode, fmi3EnterConfigurationMode)
PLAIN(exit_configuration_mode, fmi3ExitConfigurationMode)
PLAIN(enter_event_mode, fmi3EnterEventMode)
PLAIN(enter_step_mode, fmi3EnterStepMode)
PLAIN(evaluate_discrete_states, fmi3EvaluateDiscreteStates)
PLAIN(terminate, fmi3Terminate)
PLAIN(reset, fmi3Reset)

uint8_t *SHOWN(update_discrete_states)(unit_instance *self)
{
    fmi3Boolean found[5] = {false, false, false, false, false};
    double next = 0.0;
    const fmi3Status status
        = fmi3UpdateDiscreteStates(self, &found[0], &found[1], &found[2], &found[3], &found[4], &next);
    int place;
    if (status > fmi3Warning) {
        return failed(status);
    }
    shown.bytes[0] = 0;
    for (place = 0; place < 5; ++place) {
        shown.bytes[8 + place] = found[place] ? 1 : 0;
    }
    shown.numbers[2] = next;
    return shown.bytes;
}

uint8_t *SHOWN(get_float64)(unit_instance *self, uint32_t *references, int32_t count)
{
    double *values = (double *)kept_for((size_t)count * sizeof(double));
    const fmi3Status status = fmi3GetFloat64(self, references, (size_t)count, values, (size_t)count);
    discard(references);
    return status > fmi3Warning ? failed(status) : list_of(values, count);
}

int32_t SHOWN(set_float64)(unit_instance *self, uint32_t *references, int32_t count, double *values, int32_t value_count)
{
    const fmi3Status status = fmi3SetFloat64(self, references, (size_t)count, values, (size_t)value_count);
    discard(references);
    discard(values);
    return (int32_t)status;
}

uint8_t *SHOWN(get_clock)(unit_instance *self, uint32_t *references, int32_t count)
{
    fmi3Clock *values = (fmi3Clock *)kept_for((size_t)count * sizeof(fmi3Clock));
    const fmi3Status status = fmi3GetClock(self, references, (size_t)count, values);
    discard(references);
    return status > fmi3Warning ? failed(status) : list_of(values, count);
}

uint8_t *SHOWN(get_fmu_state)(unit_instance *self)
{
    fmi3FMUState state = NULL;
    size_t size = 0;
    fmi3Byte *bytes = NULL;
    fmi3Status status = fmi3GetFMUState(self, &state);
    if (status == fmi3OK) {
        status = fmi3SerializedFMUStateSize(self, state, &size);
    }
    if (status == fmi3OK) {
        bytes = (fmi3Byte *)kept_for(size);
        status = fmi3SerializeFMUState(self, state, bytes, size);
    }
    if (state != NULL) {
        (void)fmi3FreeFMUState(self, &state);
    }
    return status != fmi3OK ? failed(status) : list_of(bytes, (int32_t)size);
}

int32_t SHOWN(set_fmu_state)(unit_instance *self, fmi3Byte *bytes, int32_t size)
{
    fmi3FMUState state = NULL;
    fmi3Status status = fmi3DeserializeFMUState(self, bytes, (size_t)size, &state);
    if (status == fmi3OK) {
        status = fmi3SetFMUState(self, state);
    }
    if (state != NULL) {
        (void)fmi3FreeFMUState(self, &state);
    }
    discard(bytes);
    return (int32_t)status;
}

uint8_t *SHOWN(do_step)(unit_instance *self, double now, double step, int32_t is_final)
{
    fmi3Boolean has_event = false, terminates = false, is_early = false;
    double last = now;
    const fmi3Status status = fmi3DoStep(self, now, step, is_final != 0, &has_event, &terminates, &is_early, &last);
    if (status > fmi3Warning) {
        return failed(status);
    }
    shown.bytes[0] = 0;
    shown.numbers[1] = last;
    shown.bytes[16] = has_event ? 1 : 0;
    shown.bytes[17] = terminates ? 1 : 0;
    shown.bytes[18] = is_early ? 1 : 0;
    return shown.bytes;
}

/* What no unit of ppafo has. */
#include "without.c"
