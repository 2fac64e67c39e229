/* @title@
 *
 * @description@
 *
 * Written by ppafo @version@. Everything is in SI units; angles as in ppafo, pressures absolute.
 *
 *     @name@_settings settings;
 *     @name@_defaults(&settings);
 *     @name@_run *run = (@name@_run *)malloc(@name@_size(&settings));
 *     @name@_initialise(run, &settings, @inputs@);
 *     while (@name@_step(run, @inputs@) == @NAME@_GOING_ON) {
 *         @name@_read_outputs(run, &outputs);
 *     }
 */
#ifndef PPAFO_@NAME@_H
#define PPAFO_@NAME@_H

#include <stddef.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* How a step ended. */
typedef enum {
    @NAME@_GOING_ON,       /* the outputs can be read */
    @NAME@_BAD_INPUT,      /* an input is no finite number, or a chamber has no volume at the angle; the run is as it was */
    @NAME@_FAILED,         /* the state became unphysical: try a smaller step; check inertia, volumes and areas */
    @NAME@_TOO_MANY_PARTS, /* the run failed: a step was cut into 100,000 parts and was still not done */
    @NAME@_BAD_SETTING,    /* @name@_bad_setting says which */
    @NAME@_OTHER_PROGRAM   /* the settings need functions that are not here, see README.md */
} @name@_status;

/* What can be chosen before a run begins. */
typedef struct {
@settings@
} @name@_settings;

/* The plant at one time. */
typedef struct {
@outputs@
} @name@_outputs;

@run@
/* Begin a run, under inputs:
@said_inputs@ */
@name@_status @name@_initialise(@name@_run *run, const @name@_settings *settings, @arguments@);

/* Go on by one step, run_step [s], under inputs that are those of its beginning. @motion@ */
@name@_status @name@_step(@name@_run *run, @arguments@);

/* The plant after the last step. */
void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs);

/* Copy this run into another one, in memory of at least the same size. */
void @name@_copy(@name@_run *to, const @name@_run *from);

#if defined(__cplusplus)
}
#endif

#endif
