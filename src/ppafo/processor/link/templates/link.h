/* The protocol of "ppafo hil", for any board: packets out of bytes, answers into bytes. No memory is allocated, nothing is
 * waited for. docs/wire-protocol.md of ppafo has the bytes as a table. */
#ifndef PPAFO_LINK_H
#define PPAFO_LINK_H

#include <stdbool.h>
#include <stdint.h>

enum {
    LINK_BEGIN = 1,  /* of a sample: its run begins, where it has not yet */
    LINK_VENTED = 2, /* of a sample: the plant is vented, for good */
    LINK_OVER = 4,   /* of a sample: the run is over */
    LINK_UNSOUND = 1 /* of an answer: vent both chambers, for good */
};

enum {
    LINK_SAMPLE_BYTES = 44,
    LINK_ANSWER_BYTES = 24
};

/* What the plant shows: torques in uN m, the angle in urad, absolute pressures in Pa, the time in us. */
typedef struct {
    uint8_t flags;
    uint16_t run;
    uint32_t sequence;
    uint32_t time;
    int32_t reference;
    int32_t angle;
    int32_t pressure_1;
    int32_t pressure_2;
    int32_t torque;
} link_sample;

/* Bytes that came in and are no whole sample yet. Begin with all bytes 0. */
typedef struct {
    uint8_t bytes[LINK_SAMPLE_BYTES];
    uint8_t count;
} link_reader;

/* Take a byte that came in. True where it completes a sample; whatever is none is passed over. */
bool link_take(link_reader *reader, uint8_t byte, link_sample *sample);

/* Write the answer to a sample: a command from -1000000 to 1000000, and LINK_UNSOUND or 0. The time is the board's, in us. */
void link_answer(const link_sample *sample, int32_t command, uint8_t flags, uint32_t time, uint8_t answer[LINK_ANSWER_BYTES]);

#endif
