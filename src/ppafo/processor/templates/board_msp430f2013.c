/* The MSP430F2013 of an eZ430-F2013. README.md says what is wired to it. Not run in a simulator, which has no converter. */
#include "board.h"
#include "parameters.h"

#define REGISTER_8(address) (*(volatile uint8_t *)(address))
#define REGISTER_16(address) (*(volatile uint16_t *)(address))

#define IFG1 REGISTER_8(0x0002)
#define DCOCTL REGISTER_8(0x0056)
#define BCSCTL1 REGISTER_8(0x0057)
#define CALDCO_16MHZ REGISTER_8(0x10F8)
#define CALBC1_16MHZ REGISTER_8(0x10F9)
#define WDTCTL REGISTER_16(0x0120)
#define TIMER_CONTROL REGISTER_16(0x0160)   /* TACTL, TA0CTL */
#define TIMER_INTERRUPT REGISTER_16(0x0162) /* TACCTL0, TA0CCTL0 */
#define TIMER_PERIOD REGISTER_16(0x0172)    /* TACCR0, TA0CCR0 */

#define WATCHDOG_BITTEN 0x01u /* WDTIFG */
#define WATCHDOG_FED 0x5A08u  /* password, cleared, a reset after 32,768 cycles: 2.05 ms */
#define PULSE_TICKS 2000u     /* at 16 MHz 125 us, the unit of the sample period */

#define P1OUT REGISTER_8(0x0021)
#define P1DIR REGISTER_8(0x0022)
#define P1SEL REGISTER_8(0x0026)
#define P2OUT REGISTER_8(0x0029)
#define P2DIR REGISTER_8(0x002A)
#define P2SEL REGISTER_8(0x002E)
#define SD16INCTL0 REGISTER_8(0x00B0)
#define SD16AE REGISTER_8(0x00B7)
#define SD16CTL REGISTER_16(0x0100)
#define SD16CCTL0 REGISTER_16(0x0102)
#define SD16MEM0 REGISTER_16(0x0112)
#define TACCTL1 REGISTER_16(0x0164)
#define TACCR1 REGISTER_16(0x0174)

#define VALVE_A 0x40u         /* P2.6: joins chamber 1 to the supply */
#define VALVE_B 0x80u         /* P2.7: joins chamber 2 to the supply */
#define ENABLE 0x80u          /* P1.7: holds the dump valve closed */
#define PULSE 0x40u           /* P1.6, TA1: the pulse of a proportional valve */
#define INPUTS 0x15u          /* A0+ P1.0, A1+ P1.2, A2+ P1.4 */
#define SETTLED 0x00u         /* after a change of input the fourth result is the first that counts */
#define ONE_OF_32 0x0700u     /* one conversion at a time, of 32 samples of the modulator */

static volatile uint16_t ticks;

/* Every 125 us. The watchdog is fed as long as samples come: one that does not lets the processor reset, and all vents. */
__attribute__((interrupt(10))) void board_tick(void)
{
    if (ticks < CONTROLLER_TICKS + CONTROLLER_TICKS) {
        WDTCTL = WATCHDOG_FED;
        ++ticks;
    }
}

/* The clock at 16 MHz; true after a reset by the watchdog. */
static inline bool clock_begin(void)
{
    const bool has_bitten = (IFG1 & WATCHDOG_BITTEN) != 0;
    IFG1 = (uint8_t)(IFG1 & ~WATCHDOG_BITTEN);
    DCOCTL = 0;
    BCSCTL1 = CALBC1_16MHZ;
    DCOCTL = CALDCO_16MHZ;
    return has_bitten;
}

static inline void timer_begin(void)
{
    TIMER_PERIOD = PULSE_TICKS - 1u;
    TIMER_INTERRUPT = 0x0010u;
    ticks = 0;
    TIMER_CONTROL = 0x0214u; /* 16 MHz, up to TIMER_PERIOD */
    WDTCTL = WATCHDOG_FED;
    __asm__ volatile("eint");
}

void board_wait(void)
{
    while (ticks < CONTROLLER_TICKS) {
    }
    __asm__ volatile("dint\n\tnop");
    ticks = (uint16_t)(ticks - CONTROLLER_TICKS);
    __asm__ volatile("eint");
}

bool board_begin(void)
{
    const bool has_bitten = clock_begin();
    P1OUT = 0;
    P2OUT = 0;
    P2SEL = 0;
    P1SEL = PULSE;
    P1DIR = PULSE | ENABLE;
    P2DIR = VALVE_A | VALVE_B;
    SD16AE = INPUTS;
    SD16CTL = 0x0414u; /* the modulator at 16 MHz / 16, the reference inside on */
    SD16CCTL0 = ONE_OF_32;
    TACCR1 = PULSE_TICKS / 2u;
    TACCTL1 = 0x00E0u; /* reset and set: high until TACCR1 */
    timer_begin();
    return has_bitten;
}

/* One input in the bits of the controller; below 0 V it is 0. */
static int16_t converted(uint8_t input)
{
    SD16INCTL0 = (uint8_t)(SETTLED | input);
    SD16CCTL0 = ONE_OF_32 | 0x0002u;
    while ((SD16CCTL0 & 0x0004u) == 0u) {
    }
    const uint16_t found = SD16MEM0; /* 0x8000 is 0 V */
    return found < 0x8000u ? 0 : (int16_t)((found & 0x7FFFu) >> (15 - CONTROLLER_BITS));
}

board_readings board_read(void)
{
    const int16_t reference = converted(2);
    const int16_t pressure_1 = converted(0);
    const int16_t pressure_2 = converted(1);
    const board_readings seen = {reference, pressure_1, pressure_2};
    return seen;
}

void board_drive(int16_t command, bool is_sound)
{
    if (!is_sound) {
        P2OUT = 0;
        P1OUT = 0;
        TACCR1 = PULSE_TICKS / 2u;
        return;
    }
    P1OUT = ENABLE;
    P2OUT = command > 0 ? VALVE_A : command < 0 ? VALVE_B : 0;
    TACCR1 = (uint16_t)(1000 + command);
}
