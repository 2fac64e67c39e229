/* @title@ as a functional mock-up unit of FMI 3.0 for co-simulation: this is the one file to compile.
 *
 * Written by ppafo @version@. Needed flags: -ffp-contract=off; never -ffast-math.
 */
#include "@name@.c"
#include "unit.c"

#include "fmi3Functions.h"

typedef struct {
    unit item;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback tell;
    bool uses_events;
    bool may_return_early;
} unit_instance;

static fmi3Status done(fmi3Instance instance, bool is_good)
{
    unit_instance *given = (unit_instance *)instance;
    if (!is_good && given->tell != NULL) {
        given->tell(given->environment, fmi3Error, "logStatusError", given->item.said);
    }
    return is_good ? fmi3OK : fmi3Error;
}

/* True in one of the phases from first to last; said where it is not. */
static bool is_in(fmi3Instance instance, unit_phase first, unit_phase last)
{
    unit *item = &((unit_instance *)instance)->item;
    const int64_t phase = item->now.phase;
    return (phase >= (int64_t)first && phase <= (int64_t)last) || refuse(item, "this cannot be called now");
}

/* False where something is asked for that this unit has not. */
static bool has_none(fmi3Instance instance, size_t count)
{
    unit *item = &((unit_instance *)instance)->item;
    return count == 0 || refuse(item, "this unit has no such variables, derivatives or modes");
}

/* Whether an output is discrete (d) or continuous (c). */
static const char CHANGE_OF_OUTPUT[OUTPUTS + 1] = "@output_changes@";

/* True where the event mode is used, in which alone a discrete output may change: between two events it is held. */
static bool is_held(const unit_instance *given, uint32_t variable)
{
    return @has_clock@ && given->uses_events && given->item.now.phase >= UNIT_RUNNING && !given->item.now.is_event
        && variable >= FIRST_OUTPUT && variable < FIRST_METRIC && CHANGE_OF_OUTPUT[variable - FIRST_OUTPUT] == 'd';
}

static void hold_what_is_shown(unit *item)
{
    @name@_outputs outputs;
    @name@_read_outputs(item->run, &outputs);
    memcpy(item->now.held, (const double *)&outputs + 1, sizeof(item->now.held));
}

/* When the controller decides, counted from 0, since the start. */
static double time_of_tick(const unit *item, int64_t tick)
{
    return (double)tick * item->run->parameters.timing.period;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(
    fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[])
{
    (void)instance;
    (void)loggingOn;
    (void)nCategories;
    (void)categories;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate)
{
    unit_instance *made;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (instanceName == NULL || instantiationToken == NULL || strcmp(instantiationToken, "@token@") != 0
        || nRequiredIntermediateVariables > 0) {
        if (logMessage != NULL) {
            logMessage(instanceEnvironment, fmi3Error, "logStatusError",
                "the token of this unit is @token@, and it has no intermediate variables");
        }
        return NULL;
    }
    made = (unit_instance *)calloc(1, sizeof(unit_instance));
    if (made == NULL) {
        return NULL;
    }
    made->environment = instanceEnvironment;
    made->tell = logMessage;
    made->uses_events = eventModeUsed;
    made->may_return_early = earlyReturnAllowed;
    forget(&made->item);
    return made;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    unit_instance *given = (unit_instance *)instance;
    if (given != NULL) {
        free(given->item.run);
        free(given);
    }
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    unit_instance *given = (unit_instance *)instance;
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    if (!is_in(instance, UNIT_NEW, UNIT_NEW)) {
        return done(instance, false);
    }
    given->item.now.start = startTime;
    given->item.now.phase = UNIT_BEGINNING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    unit_instance *given = (unit_instance *)instance;
    if (!is_in(instance, UNIT_BEGINNING, UNIT_BEGINNING) || (given->item.now.is_stale && !begin(&given->item))) {
        return done(instance, false);
    }
    given->item.now.phase = UNIT_RUNNING;
    given->item.now.is_event = given->uses_events ? 1 : 0;
    hold_what_is_shown(&given->item);
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    unit_instance *given = (unit_instance *)instance;
    if (!given->uses_events) {
        return done(instance, has_none(instance, 1));
    }
    if (!is_in(instance, UNIT_RUNNING, UNIT_RUNNING)) {
        return done(instance, false);
    }
    given->item.now.is_event = 1;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    unit_instance *given = (unit_instance *)instance;
    if (!is_in(instance, UNIT_RUNNING, UNIT_RUNNING)) {
        return done(instance, false);
    }
    if (given->item.now.is_event) {
        hold_what_is_shown(&given->item);
    }
    given->item.now.is_event = 0;
    given->item.now.is_tick = 0;
    return fmi3OK;
}

/* Nothing changes in an event: the controller has decided by then. The clock is inactive after it. */
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
    unit_instance *given = (unit_instance *)instance;
    if (!given->item.now.is_event) {
        return done(instance, refuse(&given->item, "this cannot be called now"));
    }
    given->item.now.is_tick = 0;
    *discreteStatesNeedUpdate = false;
    *terminateSimulation = false;
    *nominalsOfContinuousStatesChanged = false;
    *valuesOfContinuousStatesChanged = false;
    *nextEventTimeDefined = @has_clock@;
    *nextEventTime = given->item.now.start + time_of_tick(&given->item, given->item.now.ticks + 1);
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    unit_instance *given = (unit_instance *)instance;
    if (!is_in(instance, UNIT_RUNNING, UNIT_RUNNING)) {
        return done(instance, false);
    }
    given->item.now.phase = UNIT_ENDED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    forget(&((unit_instance *)instance)->item);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 values[], size_t nValues)
{
    unit_instance *given = (unit_instance *)instance;
    size_t place;
    for (place = 0; place < nValueReferences && place < nValues; ++place) {
        if (!get_value(&given->item, valueReferences[place], &values[place])) {
            return done(instance, false);
        }
        if (is_held(given, valueReferences[place])) {
            values[place] = given->item.now.held[valueReferences[place] - FIRST_OUTPUT];
        }
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 values[], size_t nValues)
{
    unit_instance *given = (unit_instance *)instance;
    size_t place;
    for (place = 0; place < nValueReferences && place < nValues; ++place) {
        if (!set_value(&given->item, valueReferences[place], values[place])) {
            return done(instance, false);
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetClock(
    fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Clock values[])
{
    unit_instance *given = (unit_instance *)instance;
    size_t place;
    for (place = 0; place < nValueReferences; ++place) {
        if (valueReferences[place] != TICK || !@has_clock@) {
            return done(instance, has_none(instance, 1));
        }
        values[place] = given->item.now.is_event && given->item.now.is_tick ? fmi3ClockActive : fmi3ClockInactive;
    }
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
    fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
    fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    unit_instance *given = (unit_instance *)instance;
    unit *item = &given->item;
    const int64_t ticks = item->now.ticks;
    double time = currentCommunicationPoint + communicationStepSize - item->now.start;
    (void)noSetFMUStatePriorToCurrentPoint;
    *eventHandlingNeeded = false;
    *terminateSimulation = false;
    *earlyReturn = false;
    *lastSuccessfulTime = currentCommunicationPoint;
    if (!is_in(instance, UNIT_RUNNING, UNIT_RUNNING)
        || (item->now.is_event && !refuse(item, "enter the step mode first"))) {
        return done(instance, false);
    }
    if (@has_clock@ && given->uses_events && given->may_return_early) {
        const double tick = time_of_tick(item, ticks + 1);
        *earlyReturn = tick < time - 1.0e-3 * time_of_tick(item, 1);
        time = *earlyReturn ? tick : time;
    }
    if (!go_to(item, time)) {
        return done(instance, false);
    }
    if (!given->uses_events) {
        hold_what_is_shown(item); /* for an instance with events that goes on from this state */
    }
    item->now.is_tick = item->now.ticks > ticks ? 1 : 0;
    *eventHandlingNeeded = @has_clock@ && given->uses_events && item->now.is_tick;
    *lastSuccessfulTime = item->now.start + time;
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return done(instance, keep_state(&((unit_instance *)instance)->item, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    return done(instance, restore_state(&((unit_instance *)instance)->item, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    (void)instance;
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    (void)instance;
    *size = size_outside(FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    return done(instance, state_to(&((unit_instance *)instance)->item, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(
    fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState)
{
    return done(instance, state_from(&((unit_instance *)instance)->item, serializedState, size, FMUState));
}

/* What this unit has not: other types of variables, other interfaces, derivatives, clocks of the tool. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage)
{
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)instanceEnvironment;
    (void)logMessage;
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
    fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)instanceEnvironment;
    (void)logMessage;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    return NULL;
}

fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int8 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt8 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int16 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt16 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Int64 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt64 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Boolean values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3String values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int8 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt8 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int16 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt16 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt32 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int64 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt64 values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Boolean values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3String values[], size_t nValues)
{
    (void)valueReferences;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Clock values[])
{
    (void)valueReferences;
    (void)values;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
    size_t *nDependencies)
{
    (void)instance;
    (void)valueReference;
    *nDependencies = 0;
    return fmi3OK;
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
    size_t elementIndicesOfDependent[], fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
    fmi3DependencyKind dependencyKinds[], size_t nDependencies)
{
    (void)dependent;
    (void)elementIndicesOfDependent;
    (void)independents;
    (void)elementIndicesOfIndependents;
    (void)dependencyKinds;
    (void)nDependencies;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity)
{
    (void)unknowns;
    (void)knowns;
    (void)nKnowns;
    (void)seed;
    (void)nSeed;
    (void)sensitivity;
    (void)nSensitivity;
    return done(instance, has_none(instance, nUnknowns));
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity)
{
    (void)unknowns;
    (void)knowns;
    (void)nKnowns;
    (void)seed;
    (void)nSeed;
    (void)sensitivity;
    (void)nSensitivity;
    return done(instance, has_none(instance, nUnknowns));
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    (void)valueReferences;
    (void)intervals;
    (void)qualifiers;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 shifts[])
{
    (void)valueReferences;
    (void)shifts;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 intervals[])
{
    (void)valueReferences;
    (void)intervals;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 shifts[])
{
    (void)valueReferences;
    (void)shifts;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
    fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    (void)enterEventMode;
    (void)terminateSimulation;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    (void)time;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
    size_t nContinuousStates)
{
    (void)continuousStates;
    (void)nContinuousStates;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
    size_t nContinuousStates)
{
    (void)derivatives;
    (void)nContinuousStates;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    (void)eventIndicators;
    (void)nEventIndicators;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    (void)continuousStates;
    (void)nContinuousStates;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    (void)nominals;
    (void)nContinuousStates;
    return done(instance, has_none(instance, 1));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    (void)instance;
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    (void)instance;
    *nContinuousStates = 0;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    (void)valueReferences;
    (void)orders;
    (void)values;
    (void)nValues;
    return done(instance, has_none(instance, nValueReferences));
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
    fmi3Float64 activationTime)
{
    (void)clockReference;
    (void)activationTime;
    return done(instance, has_none(instance, 1));
}
