/* @title@
 *
 * @description@
 *
 * Written by ppafo @version@. Everything is in SI units; angles as in ppafo, pressures absolute.
 *
 *     @name@_settings settings;
 *     @name@_defaults(&settings);
 *     @name@_run *run = (@name@_run *)malloc(@name@_size(&settings));
 *     @name@_initialise(run, &settings);
 *     while (@name@_step(run) == @NAME@_GOING_ON) {
 *         @name@_read_outputs(run, &outputs);
 *     }
 *     @name@_read_metrics(run, &metrics);
 */
#ifndef PPAFO_@NAME@_H
#define PPAFO_@NAME@_H

#include <stddef.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* How a run stands. */
typedef enum {
    @NAME@_GOING_ON,       /* a sample can be read */
    @NAME@_FINISHED,       /* there is no further sample; the metrics are those of the whole run */
    @NAME@_FAILED,         /* the state became unphysical: try a smaller step; check inertia, volumes and areas */
    @NAME@_TOO_MANY_PARTS, /* the run failed: a step was cut into 100,000 parts and was still not done */
    @NAME@_BAD_SETTING,    /* @name@_bad_setting says which */
    @NAME@_OTHER_PROGRAM   /* the settings need functions that are not here, see README.md */
} @name@_status;

/* What can be chosen before a run begins. */
typedef struct {
@settings@
} @name@_settings;

/* One sample. */
typedef struct {
@outputs@
} @name@_outputs;

/* What came of a run; not a number (NAN) where it has no such part, as a hold that was never reached. */
typedef struct {
@metrics@
} @name@_metrics;

@run@
/* Begin a run. */
@name@_status @name@_initialise(@name@_run *run, const @name@_settings *settings);

/* Go on to the next sample, the first time to that at the start. */
@name@_status @name@_step(@name@_run *run);

/* The sample to which the last step led; all 0 before the first step. */
void @name@_read_outputs(const @name@_run *run, @name@_outputs *outputs);

/* The metrics of all samples so far. */
void @name@_read_metrics(const @name@_run *run, @name@_metrics *metrics);

/* Copy this run into another one, in memory of at least the same size. */
void @name@_copy(@name@_run *to, const @name@_run *from);

#if defined(__cplusplus)
}
#endif

#endif
