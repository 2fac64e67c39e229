/* What a board does for the controller. */
#ifndef PPAFO_BOARD_H
#define PPAFO_BOARD_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int16_t reference;
    int16_t pressure_1;
    int16_t pressure_2;
} board_readings;

/* Set up clock, timer, converter, outputs and watchdog. Outputs that vent stay so. True where the watchdog has bitten. */
bool board_begin(void);

/* Wait for the next sample. */
void board_wait(void);

/* What the converter shows, from 0 to CONTROLLER_TOP. */
board_readings board_read(void);

/* Drive the valves by a command from -1000 to 1000; vent both chambers, for good, where it is not sound. */
void board_drive(int16_t command, bool is_sound);

#endif
