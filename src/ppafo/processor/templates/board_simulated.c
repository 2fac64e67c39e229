/* A board for the simulator: what is read and driven are words of memory, and board_wait is where it is stopped. */
#include "board.h"

volatile board_readings simulated_readings;
volatile struct {
    int16_t command;
    int16_t is_sound;
} simulated_outputs;

bool board_begin(void)
{
    return false;
}

__attribute__((noinline)) void board_wait(void)
{
    __asm__ volatile("nop");
}

board_readings board_read(void)
{
    const board_readings seen = {
        simulated_readings.reference, simulated_readings.pressure_1, simulated_readings.pressure_2};
    return seen;
}

void board_drive(int16_t command, bool is_sound)
{
    simulated_outputs.command = command;
    simulated_outputs.is_sound = (int16_t)(is_sound ? 1 : 0);
}
