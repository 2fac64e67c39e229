/* A board for the simulator: what is read and driven are words of memory, and board_wait is where it is stopped. */
#include "board.h"

volatile controller_readings simulated_readings;
volatile struct {
    int16_t command;
    int16_t level_and_sign;
} simulated_outputs;

bool board_begin(void)
{
    return false;
}

__attribute__((noinline)) void board_wait(void)
{
    __asm__ volatile("nop");
}

controller_readings board_read(void)
{
    const controller_readings seen = {
        simulated_readings.heel,
        simulated_readings.toe,
        simulated_readings.angle,
        simulated_readings.pressure_1,
        simulated_readings.pressure_2};
    return seen;
}

void board_drive(int16_t command)
{
    simulated_outputs.command = command;
    simulated_outputs.level_and_sign = (int16_t)((controller_level() << 8) | controller_sign());
}
