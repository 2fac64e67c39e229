/* A board for the simulator: what is read and driven are words of memory, and board_wait is where it is stopped. */
#include "board.h"

volatile board_readings simulated_readings;
volatile struct {
    int16_t command;
    int16_t is_sound;
#if defined(__arm__)
    uint32_t begun; /* what the counter showed at the beginning of the sample, and at its end */
    uint32_t ended;
#endif
} simulated_outputs;

#if defined(__arm__)
/* SysTick counts the clock of the processor down, from the most that it holds. It is looked at before and after the
 * processor is stopped, as the time of the simulator may go on meanwhile. */
#define SYSTICK(offset) (*(volatile uint32_t *)(0xE000E010 + (offset)))
#define COUNTER_CONTROL SYSTICK(0)
#define COUNTER_LARGEST SYSTICK(4)
#define COUNTER SYSTICK(8)

__attribute__((noinline)) static void stop(void)
{
    __asm__ volatile(".global simulated_stop\nsimulated_stop:\n\tnop");
}
#endif

bool board_begin(void)
{
#if defined(__arm__)
    COUNTER_LARGEST = 0xFFFFFFu;
    COUNTER = 0u;
    COUNTER_CONTROL = 5u; /* on, by the clock of the processor */
#endif
    return false;
}

__attribute__((noinline)) void board_wait(void)
{
#if defined(__arm__)
    simulated_outputs.ended = COUNTER;
    stop();
    simulated_outputs.begun = COUNTER;
#else
    __asm__ volatile("nop");
#endif
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
