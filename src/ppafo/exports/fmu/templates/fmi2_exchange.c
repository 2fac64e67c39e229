
/* ---- Model exchange. ---- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_RUNNING, UNIT_RUNNING)) {
        return report(given);
    }
    given->item.now.is_event = 1;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *event)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_RUNNING, UNIT_RUNNING) || !handle_event(&given->item)) {
        return report(given);
    }
    event->newDiscreteStatesNeeded = fmi2False;
    event->terminateSimulation = fmi2False;
    event->nominalsOfContinuousStatesChanged = fmi2False;
    event->valuesOfContinuousStatesChanged = fmi2True;
    event->nextEventTimeDefined = given->item.now.next < 1.0e8 ? fmi2True : fmi2False;
    event->nextEventTime = given->item.now.start + given->item.now.next;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    instance *given = (instance *)c;
    if (!is_in(given, UNIT_RUNNING, UNIT_RUNNING)) {
        return report(given);
    }
    given->item.now.is_event = 0;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean keeps_no_state, fmi2Boolean *wants_event, fmi2Boolean *ends)
{
    (void)c;
    (void)keeps_no_state;
    *wants_event = fmi2False;
    *ends = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    instance *given = (instance *)c;
    given->item.now.time = time - given->item.now.start;
    return fmi2OK;
}

/* True where a tool takes as many numbers as there are. */
static bool is_count(instance *given, size_t count, size_t wanted)
{
    return count == wanted || refuse(&given->item, "there are %lu of them", (unsigned long)wanted);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real values[], size_t count)
{
    instance *given = (instance *)c;
    if (!is_count(given, count, STATES_SHOWN)) {
        return report(given);
    }
    memcpy(given->item.now.y + FIRST_STATE, values, sizeof(double) * STATES_SHOWN);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real values[], size_t count)
{
    instance *given = (instance *)c;
    if (!is_count(given, count, STATES_SHOWN)) {
        return report(given);
    }
    memcpy(values, given->item.now.y + FIRST_STATE, sizeof(double) * STATES_SHOWN);
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real values[], size_t count)
{
    instance *given = (instance *)c;
    if (!is_count(given, count, STATES_SHOWN)) {
        return report(given);
    }
    memcpy(values, NOMINALS, sizeof(NOMINALS));
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real values[], size_t count)
{
    instance *given = (instance *)c;
    return done(given, is_count(given, count, STATES_SHOWN) && get_slopes(&given->item, values));
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real values[], size_t count)
{
    instance *given = (instance *)c;
    return done(given, is_count(given, count, INDICATORS) && get_indicators(&given->item, values));
}
