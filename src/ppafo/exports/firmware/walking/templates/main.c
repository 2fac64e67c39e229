/* @title@: one sample after another. A reset by the watchdog vents for good: nobody knows what was wrong. */
#include "board.h"

int main(void)
{
    const bool has_bitten = board_begin();
    controller_begin();
    for (;;) {
        board_wait();
        const int16_t command = controller_sample(board_read());
        board_drive((int16_t)(has_bitten ? 0 : command));
    }
}
