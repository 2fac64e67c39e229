/* What a board does for the controller. */
#ifndef PPAFO_BOARD_H
#define PPAFO_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "controller.h"

/* Set up clock, timer, converter, outputs and watchdog. Outputs that vent stay so. True where the watchdog has bitten. */
bool board_begin(void);

/* Wait for the next sample. */
void board_wait(void);

/* What the converter shows, in counts of 14 bits whatever its own number of bits is. */
controller_readings board_read(void);

/* Drive the valves: above 0 plantarflexion, below 0 dorsiflexion, 0 vents both chambers. */
void board_drive(int16_t command);

#endif
