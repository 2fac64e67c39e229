/* @title@: one sample of the law, as a bench takes it once every controller_period. */
#include "@name@.h"

#include <stdio.h>

int main(void)
{
    static @name@_settings settings;
    static @name@_state state;
    static @name@_measurement measurement;

    @name@_defaults(&settings);
    /* Change what you like here, for example: settings.@example@ */
    if (@name@_bad_setting(&settings) != NULL) {
        fprintf(stderr, "%s is out of range\n", @name@_bad_setting(&settings));
        return 2;
    }
    @name@_reset(&state);
    /* What your sensors show, SI units. */
    measurement.angle = 1.5707963267948966;
    measurement.pressure_1 = 101325.0;
    measurement.pressure_2 = 101325.0;
    @name@_observe(&measurement); /* or the torque of a load cell */
    printf("command %.17g\n", @name@_update(&settings, &state, 1.0, &measurement));
    return 0;
}
