/* @title@
 *
 * @description@
 *
 * @law@ Source: @source@.
 *
 * Written by ppafo @version@. Everything is in SI units; pressures absolute. No allocation, no files, nothing static
 * that changes: the caller has the state.
 *
 *     static @name@_settings settings;
 *     static @name@_state state;
 *     @name@_defaults(&settings);
 *     @name@_reset(&state);
 *     once every controller_period:
 *         command = @name@_update(&settings, &state, reference, &measurement);
 */
#ifndef PPAFO_@NAME@_H
#define PPAFO_@NAME@_H

#if defined(__cplusplus)
extern "C" {
#endif

/* Gains, filters and limits of the law, and the time between two samples. */
typedef struct {
@settings@
} @name@_settings;

/* What the sensors show at a sample. */
typedef struct {
@measurement@
} @name@_measurement;

/* What the law remembers from sample to sample. A copy goes on as the first would. */
typedef struct {
@state@
} @name@_state;

/* The settings of the scenario. */
void @name@_defaults(@name@_settings *settings);

/* The name of the first setting that is out of range; a null pointer where all are good. */
const char *@name@_bad_setting(const @name@_settings *settings);

/* Forget everything. */
void @name@_reset(@name@_state *state);

/* Set the torque of a measurement from its angle and pressures, with the numbers of the actuator as exported. */
void @name@_observe(@name@_measurement *measurement);

/* The command for a sample, -1 to 1 (a walk: 2 vents both chambers), for a reference, in SI units, and a measurement. An
 * input that is no finite number leaves the state and the command as they were. */
double @name@_update(
    const @name@_settings *settings, @name@_state *state, double reference, const @name@_measurement *measurement);

#if defined(__cplusplus)
}
#endif

#endif
