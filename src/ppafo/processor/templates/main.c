/* @title@: one sample after another, until a reading cannot be true or the watchdog bites. */
#include "board.h"
#include "controller.h"

int main(void)
{
    bool is_sound = !board_begin();
    controller_begin();
    for (;;) {
        board_wait();
        const board_readings seen = board_read();
        const int16_t command = controller_sample(seen.reference, seen.pressure_1, seen.pressure_2);
        is_sound = is_sound && controller_is_sound();
        board_drive((int16_t)(is_sound ? command : 0), is_sound);
    }
}
