/* The @processor@, on @board@: timer, outputs, pulse, watchdog. README.md says what is wired to it.
 * Not run on a processor; timer, outputs and pulse run in QEMU's micro:bit V1. */
#include "board.h"
#include "parameters.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define RESET_REASON REGISTER(0x40000400)
#define CLOCK_START REGISTER(0x40000000)
#define CLOCK_STARTED REGISTER(0x40000100)
#define TIMER_START REGISTER(0x40008000)
#define TIMER_CLEAR REGISTER(0x4000800C)
#define TIMER_CAPTURE_2 REGISTER(0x40008048)
#define TIMER_COMPARED_0 REGISTER(0x40008140)
#define TIMER_COMPARED_1 REGISTER(0x40008144)
#define TIMER_SHORTS REGISTER(0x40008200)
#define TIMER_INTERRUPTS REGISTER(0x40008304)
#define TIMER_BITS REGISTER(0x40008508)
#define TIMER_PRESCALER REGISTER(0x40008510)
#define TIMER_AT_0 REGISTER(0x40008540)
#define TIMER_AT_1 REGISTER(0x40008544)
#define TIMER_AT_2 REGISTER(0x40008548)
#define WATCHDOG_START REGISTER(0x40010000)
#define WATCHDOG_CYCLES REGISTER(0x40010504)
#define WATCHDOG_REQUESTS REGISTER(0x40010508)
#define WATCHDOG_CONFIGURATION REGISTER(0x4001050C)
#define WATCHDOG_REQUEST_0 REGISTER(0x40010600)
#define OUT REGISTER(0x50000504)
#define OUT_SET REGISTER(0x50000508)
#define OUT_CLEAR REGISTER(0x5000050C)
#define DIRECTION_SET REGISTER(0x50000518)
#define INTERRUPT_ENABLE REGISTER(0xE000E100)

#define WATCHDOG_BITTEN 0x02u     /* of the reasons for a reset */
#define WATCHDOG_FED 0x6E524635u  /* reload */
#define WATCHDOG_TICKS 66u        /* of 32,768 Hz, and one: 2.05 ms */
#define WATCHDOG_ALWAYS 0x01u     /* also while the processor sleeps; it stands still with a debugger */
#define VALVE_A (1u << @pin_a@)  /* joins chamber 1 to the supply */
#define VALVE_B (1u << @pin_b@)  /* joins chamber 2 to the supply */
#define PULSE (1u << @pin_pulse@)    /* the pulse of a proportional valve */
#define ENABLE (1u << @pin_enable@)   /* holds the dump valve closed */
#define PULSE_TICKS 2000u         /* at 16 MHz 125 us, the unit of the sample period */
#define TIMER_INTERRUPT (1u << 8)

void converter_begin(void);
void board_tick(void);

static volatile uint32_t ticks;
static volatile uint32_t pulse;

/* Every 125 us, and where the pulse ends. The watchdog is fed as long as samples come: one that does not lets the processor
 * reset, and all vents. The pulse follows the timer itself: an interrupt that is late shifts an edge and nothing else. */
void board_tick(void)
{
    if (TIMER_COMPARED_0 != 0u) {
        TIMER_COMPARED_0 = 0u;
        if (ticks < CONTROLLER_TICKS + CONTROLLER_TICKS) {
            WATCHDOG_REQUEST_0 = WATCHDOG_FED;
            ++ticks;
        }
    }
    TIMER_COMPARED_1 = 0u;
    TIMER_CAPTURE_2 = 1u;
    if (TIMER_AT_2 < pulse) {
        OUT_SET = PULSE;
    } else {
        OUT_CLEAR = PULSE;
    }
}

static void set_pulse(uint32_t length)
{
    pulse = length;
    TIMER_AT_1 = length;
}

bool board_begin(void)
{
    const bool has_bitten = (RESET_REASON & WATCHDOG_BITTEN) != 0u;
    RESET_REASON = WATCHDOG_BITTEN; /* a 1 clears it */
    OUT = 0u;
    DIRECTION_SET = VALVE_A | VALVE_B | PULSE | ENABLE;
    CLOCK_START = 1u; /* the crystal */
    while (CLOCK_STARTED == 0u) {
    }
    converter_begin();
    ticks = 0u;
    TIMER_BITS = 0u; /* 16 of them */
    TIMER_PRESCALER = 0u;
    TIMER_AT_0 = PULSE_TICKS;
    set_pulse(PULSE_TICKS / 2u);
    TIMER_SHORTS = 0x01u; /* from the start at TIMER_AT_0 */
    TIMER_INTERRUPTS = 0x30000u;
    INTERRUPT_ENABLE = TIMER_INTERRUPT;
    TIMER_CLEAR = 1u;
    TIMER_START = 1u;
    WATCHDOG_CYCLES = WATCHDOG_TICKS;
    WATCHDOG_REQUESTS = 0x01u;
    WATCHDOG_CONFIGURATION = WATCHDOG_ALWAYS;
    WATCHDOG_START = 1u;
    __asm__ volatile("cpsie i" ::: "memory");
    return has_bitten;
}

void board_wait(void)
{
    while (ticks < CONTROLLER_TICKS) {
    }
    __asm__ volatile("cpsid i" ::: "memory");
    ticks = ticks - CONTROLLER_TICKS;
    __asm__ volatile("cpsie i" ::: "memory");
}

void board_drive(int16_t command, bool is_sound)
{
    if (!is_sound) {
        OUT_CLEAR = VALVE_A | VALVE_B | ENABLE;
        set_pulse(PULSE_TICKS / 2u);
        return;
    }
    OUT_CLEAR = command > 0 ? VALVE_B : command < 0 ? VALVE_A : VALVE_A | VALVE_B;
    OUT_SET = ENABLE | (command > 0 ? VALVE_A : command < 0 ? VALVE_B : 0u);
    set_pulse((uint32_t)(1000 + command));
}
