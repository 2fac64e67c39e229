/* Reset of a Cortex-M: its vectors, data with a value at the start, all others to 0, then main. */
#include <stddef.h>
#include <stdint.h>

int main(void);
void start(void);
void stuck(void);
/* Of the linker script: the end of RAM, and where data begin and end. */
void __stack(void);
extern uint32_t __data_begin[], __data_end[], __data_values[], __zero_begin[], __zero_end[];
void board_tick(void) __attribute__((weak, alias("stuck")));
void *memcpy(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);

/* The compiler calls these two for what it moves or clears. */
void *memcpy(void *to, const void *from, size_t count)
{
    volatile char *next = to;
    const char *given = from;
    while (count-- > 0) {
        *next++ = *given++;
    }
    return to;
}

void *memset(void *to, int value, size_t count)
{
    volatile char *next = to;
    while (count-- > 0) {
        *next++ = (char)value;
    }
    return to;
}

void start(void)
{
    const uint32_t *given = __data_values;
    for (volatile uint32_t *next = __data_begin; next < __data_end; ++next) {
        *next = *given++;
    }
    for (volatile uint32_t *next = __zero_begin; next < __zero_end; ++next) {
        *next = 0u;
    }
    (void)main();
}

/* A fault, or an interrupt that nobody asked for: nothing feeds the watchdog any longer, so that all vents. */
__attribute__((used)) void stuck(void)
{
    for (;;) {
    }
}

/* The stack, 15 exceptions of the processor, then the interrupts up to that of TIMER0. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 9])(void) = {
    __stack, start, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck,
    stuck, stuck, stuck, stuck, stuck, stuck, stuck, stuck, board_tick};
