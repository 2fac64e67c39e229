/* Runs a unit without FMPy, to be built for the same platform: prints torque and pressure 1 in 17 digits at every step.
 *
 *     drive_unit LIBRARY TOKEN STEPS STEP TORQUE PRESSURE
 *
 * TORQUE and PRESSURE are the numbers of these variables. With -DFMI=3 it is a unit of FMI 3, else of FMI 2.
 */
#include <stdio.h>
#include <stdlib.h>

#if defined(_WIN32)
#include <windows.h>
#define LOOK_UP(name) (void *)GetProcAddress(library, name)
#else
#include <dlfcn.h>
#define LOOK_UP(name) dlsym(library, name)
#endif

#if FMI == 3
#include "fmi3Functions.h"
#define FUNCTION(name) fmi3##name##TYPE *name = (fmi3##name##TYPE *)LOOK_UP("fmi3" #name)
#else
#include "fmi2Functions.h"
#define FUNCTION(name) fmi2##name##TYPE *name = (fmi2##name##TYPE *)LOOK_UP("fmi2" #name)
#endif

#define TRY(call) if ((call) != 0) { fprintf(stderr, "%s failed\n", #call); return 1; }

int main(int count, char **given)
{
    if (count != 7) {
        return 2;
    }
#if defined(_WIN32)
    HMODULE library = LoadLibraryA(given[1]);
#else
    void *library = dlopen(given[1], RTLD_NOW);
#endif
    if (library == NULL) {
        fprintf(stderr, "%s cannot be loaded\n", given[1]);
        return 1;
    }
    const int steps = atoi(given[3]);
    const double step = atof(given[4]);
    const unsigned int numbers[2] = {(unsigned int)atoi(given[5]), (unsigned int)atoi(given[6])};
    double values[2];
    FUNCTION(EnterInitializationMode);
    FUNCTION(ExitInitializationMode);
    FUNCTION(DoStep);
    FUNCTION(FreeInstance);
#if FMI == 3
    FUNCTION(InstantiateCoSimulation);
    FUNCTION(GetFloat64);
    bool needs_event, ends, is_early;
    double reached;
    fmi3Instance unit = InstantiateCoSimulation("unit", given[2], "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
    if (unit == NULL) {
        return 1;
    }
    TRY(EnterInitializationMode(unit, false, 0.0, 0.0, false, 0.0));
#else
    FUNCTION(Instantiate);
    FUNCTION(SetupExperiment);
    FUNCTION(GetReal);
    fmi2Component unit = Instantiate("unit", fmi2CoSimulation, given[2], "", NULL, 0, 0);
    if (unit == NULL) {
        return 1;
    }
    TRY(SetupExperiment(unit, 0, 0.0, 0.0, 0, 0.0));
    TRY(EnterInitializationMode(unit));
#endif
    TRY(ExitInitializationMode(unit));
    for (int number = 0; number <= steps; ++number) {
#if FMI == 3
        if (number > 0) {
            TRY(DoStep(unit, (number - 1) * step, step, true, &needs_event, &ends, &is_early, &reached));
        }
        TRY(GetFloat64(unit, numbers, 2, values, 2));
#else
        if (number > 0) {
            TRY(DoStep(unit, (number - 1) * step, step, 1));
        }
        TRY(GetReal(unit, numbers, 2, values));
#endif
        printf("%.17g %.17g\n", values[0], values[1]);
    }
    FreeInstance(unit);
    return 0;
}
