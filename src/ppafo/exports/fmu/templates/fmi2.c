/* @title@ as a functional mock-up unit of FMI 2.0 for co-simulation: this is the one file to compile.
 *
 * Written by ppafo @version@. Needed flags: -ffp-contract=off; never -ffast-math.
 */
#include "@name@.c"
#include "unit.c"

#include "fmi2Functions.h"

typedef struct {
    unit item;
    fmi2CallbackFunctions own;
    char *name;
} instance;

static fmi2Status report(instance *given)
{
    if (given->own.logger != NULL) {
        given->own.logger(given->own.componentEnvironment, given->name, fmi2Error, "logStatusError", "%s", given->item.said);
    }
    return fmi2Error;
}

static fmi2Status done(instance *given, bool is_good)
{
    return is_good ? fmi2OK : report(given);
}

/* True in one of the phases from first to last; said where it is not. */
static bool is_in(instance *given, unit_phase first, unit_phase last)
{
    const int64_t phase = given->item.now.phase;
    return (phase >= (int64_t)first && phase <= (int64_t)last) || refuse(&given->item, "this cannot be called now");
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    (void)c;
    (void)on;
    (void)count;
    (void)categories;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    instance *made;
    (void)resources;
    (void)visible;
    (void)logging;
    if (name == NULL || token == NULL || strcmp(token, "@token@") != 0 || type != fmi2CoSimulation) {
        if (functions != NULL && functions->logger != NULL) {
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError",
                "this unit is for co-simulation, and its GUID is @token@");
        }
        return NULL;
    }
    made = (instance *)calloc(1, sizeof(instance));
    if (made == NULL) {
        return NULL;
    }
    made->name = (char *)calloc(strlen(name) + 1, 1);
    if (made->name == NULL) {
        free(made);
        return NULL;
    }
    memcpy(made->name, name, strlen(name));
    if (functions != NULL) {
        made->own = *functions;
    }
    forget(&made->item);
    return made;
}

void fmi2FreeInstance(fmi2Component c)
{
    instance *given = (instance *)c;
    if (given != NULL) {
        free(given->item.run);
        free(given->name);
        free(given);
    }
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
    fmi2Boolean has_stop, fmi2Real stop)
{
    instance *given = (instance *)c;
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    if (!is_in(given, UNIT_NEW, UNIT_NEW)) {
        return report(given);
    }
    given->item.now.start = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_NEW, UNIT_NEW)) {
        return report(given);
    }
    given->item.now.phase = UNIT_BEGINNING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_BEGINNING, UNIT_BEGINNING) || (given->item.now.is_stale && !begin(&given->item))) {
        return report(given);
    }
    given->item.now.phase = UNIT_RUNNING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_RUNNING, UNIT_RUNNING)) {
        return report(given);
    }
    given->item.now.phase = UNIT_ENDED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    forget(&((instance *)c)->item);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[])
{
    instance *given = (instance *)c;
    size_t place;
    for (place = 0; place < count; ++place) {
        if (!get_value(&given->item, references[place], &values[place])) {
            return report(given);
        }
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[])
{
    instance *given = (instance *)c;
    size_t place;
    for (place = 0; place < count; ++place) {
        if (!set_value(&given->item, references[place], values[place])) {
            return report(given);
        }
    }
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    instance *given = (instance *)c;
    return done(given, keep_state(&given->item, state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    instance *given = (instance *)c;
    return done(given, restore_state(&given->item, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    *size = size_outside(state);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    instance *given = (instance *)c;
    return done(given, state_to(&given->item, state, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    instance *given = (instance *)c;
    return done(given, state_from(&given->item, bytes, size, state));
}

/* What this unit has not: other types of variables, directional derivatives. */
static fmi2Status none(instance *given, size_t count)
{
    return done(given, count == 0 || refuse(&given->item, "this unit has no such variables or derivatives"));
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Integer values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Boolean values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Boolean values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2String values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2String values[])
{
    (void)references;
    (void)values;
    return none((instance *)c, count);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t unknown_count,
    const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[], fmi2Real values[])
{
    (void)unknowns;
    (void)knowns;
    (void)known_count;
    (void)seed;
    (void)values;
    return none((instance *)c, unknown_count);
}
