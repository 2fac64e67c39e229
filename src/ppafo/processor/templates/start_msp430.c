/* Reset: the stack, then main. There are no data with a value at the start, so nothing is copied. */
#include <stddef.h>

int main(void);
void *memcpy(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);

/* The compiler calls these two for what it moves or clears. */
void *memcpy(void *to, const void *from, size_t count)
{
    char *next = to;
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

__attribute__((naked, noreturn, used, section(".start"))) void start(void)
{
    __asm__ volatile("mov #0x5a80, &0x0120\n\t" /* WDTCTL: held until the board sets it up */
                     "mov #__stack, r1\n\t"
                     "call #main");
}

__attribute__((section(".reset_vector"), used)) static void (*const reset_vector)(void) = start;
