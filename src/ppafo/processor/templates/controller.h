/* The controller: what the board hands it at each sample, and what it gives back. */
#ifndef PPAFO_CONTROLLER_H
#define PPAFO_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

/* Forget everything. */
void controller_begin(void);

/* Command from -1000 to 1000 for readings from 0 to CONTROLLER_TOP, once every sample. */
int16_t controller_sample(int16_t reference, int16_t pressure_1, int16_t pressure_2);

/* False, until it begins anew, once a reading was at an end of its range. */
bool controller_is_sound(void);

#endif
