/* A board for the simulator (mps2-an386 of QEMU): what is shown and taken are words of memory. It is stopped at
 * simulated_stop whenever it waits for a command. */
#include "board.h"

/* A timer of this machine counts its clock of 25 MHz down, from the most that it holds. It is looked at before and after
 * the processor is stopped, as the time of the simulator may go on meanwhile. */
#define TIMER(offset) (*(volatile uint32_t *)(0x40000000 + (offset)))
#define COUNTER_CONTROL TIMER(0)
#define COUNTER TIMER(4)
#define COUNTER_LARGEST TIMER(8)

volatile int16_t simulated_command;
volatile struct {
    plant_shown shown;
    uint32_t begun;
    uint32_t ended;
} simulated_plant;

__attribute__((noinline)) static void stop(void)
{
    __asm__ volatile(".global simulated_stop\nsimulated_stop:\n\tnop");
}

void board_begin(void)
{
    COUNTER_LARGEST = 0xFFFFFFFFu;
    COUNTER = 0xFFFFFFFFu;
    COUNTER_CONTROL = 1u;
}

void board_show(const plant_shown *shown)
{
    simulated_plant.shown = *shown;
}

int16_t board_wait_for_command(void)
{
    simulated_plant.ended = COUNTER;
    stop();
    simulated_plant.begun = COUNTER;
    return simulated_command;
}

void board_give_up(void)
{
    simulated_plant.shown.is_well = 0;
    for (;;) {
        stop();
    }
}
