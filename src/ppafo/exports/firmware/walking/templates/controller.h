/* The controller: what the board hands it at each sample, and what it gives back. */
#ifndef PPAFO_CONTROLLER_H
#define PPAFO_CONTROLLER_H

#include <stdint.h>

/* Readings from 0 to 16383: forces under heel and toes, ankle angle, pressures of both chambers. */
typedef struct {
    int16_t heel;
    int16_t toe;
    int16_t angle;
    int16_t pressure_1;
    int16_t pressure_2;
} controller_readings;

/* Forget everything. */
void controller_begin(void);

/* 1000 for plantarflexion, -1000 for dorsiflexion, 0 to vent both chambers, once every sample. */
int16_t controller_sample(controller_readings readings);

/* 0 helps, 1 lifts the foot only, 2 pauses, 3 has stopped until it begins anew. */
int16_t controller_level(void);

/* The last sign that made it help less, 0 before any: its number in README.md. */
int16_t controller_sign(void);

#endif
