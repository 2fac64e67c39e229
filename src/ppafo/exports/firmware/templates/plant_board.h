/* What a board does for the plant. */
#ifndef PPAFO_BOARD_H
#define PPAFO_BOARD_H

#include <stdint.h>

enum { PLANT_VALUES = @value_count@ };

/* What the converter of the controller would show, 1 as long as the run is possible, and the values of a recording:
@value_names@ */
typedef struct {
    int16_t reference;
    int16_t pressure_1;
    int16_t pressure_2;
    int16_t is_well;
    double values[PLANT_VALUES];
} plant_shown;

/* Set up the board. */
void board_begin(void);

/* Show a sample to the board of the controller. */
void board_show(const plant_shown *shown);

/* Wait for the command for this sample, from -@command_steps@ to @command_steps@. */
int16_t board_wait_for_command(void);

/* There is too little memory, or a setting is wrong: nothing is shown any longer. */
void board_give_up(void);

#endif
