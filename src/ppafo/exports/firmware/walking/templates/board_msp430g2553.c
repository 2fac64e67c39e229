/* The MSP430G2553 of a LaunchPad. README.md says what is wired to it. Not run in a simulator, which has no converter. */
#include "board.h"
#include "parameters.h"

#define REGISTER_8(address) (*(volatile uint8_t *)(address))
#define REGISTER_16(address) (*(volatile uint16_t *)(address))

#define IFG1 REGISTER_8(0x0002)
#define P1OUT REGISTER_8(0x0021)
#define P1DIR REGISTER_8(0x0022)
#define P2OUT REGISTER_8(0x0029)
#define P2DIR REGISTER_8(0x002A)
#define P2SEL REGISTER_8(0x002E)
#define ADC10AE0 REGISTER_8(0x004A)
#define DCOCTL REGISTER_8(0x0056)
#define BCSCTL1 REGISTER_8(0x0057)
#define CALDCO_16MHZ REGISTER_8(0x10F8)
#define CALBC1_16MHZ REGISTER_8(0x10F9)
#define WDTCTL REGISTER_16(0x0120)
#define TA0CTL REGISTER_16(0x0160)
#define TA0CCTL0 REGISTER_16(0x0162)
#define TA0CCR0 REGISTER_16(0x0172)
#define ADC10CTL0 REGISTER_16(0x01B0)
#define ADC10CTL1 REGISTER_16(0x01B2)
#define ADC10MEM REGISTER_16(0x01B4)

#define WATCHDOG_BITTEN 0x01u /* WDTIFG */
#define WATCHDOG_FED 0x5A08u  /* password, cleared, a reset after 32,768 cycles: 2.05 ms */
#define VALVE_A 0x01u         /* P2.0: joins chamber 1 to the supply */
#define VALVE_B 0x02u         /* P2.1: joins chamber 2 to the supply */
#define ENABLE 0x04u          /* P2.2: holds the dump valve closed */
#define INPUTS 0xB6u          /* A1, A2, A4, A5, A7: P1.1, P1.2, P1.4, P1.5, P1.7 */
#define CONVERTS 0x1013u      /* 16 clocks of sampling, on, enabled, go; the supply is the reference */
#define PULSE_TICKS 2000u     /* at 16 MHz 125 us, the unit of the sample period */
#define CONVERTER_BITS 10
#define SCALE_BITS 14

static volatile uint16_t ticks;

/* Every 125 us. The watchdog is fed as long as samples come: one that does not lets the chip reset, and all vents. */
__attribute__((interrupt(10))) void board_tick(void)
{
    if (ticks < CONTROLLER_TICKS + CONTROLLER_TICKS) {
        WDTCTL = WATCHDOG_FED;
        ++ticks;
    }
}

bool board_begin(void)
{
    const bool has_bitten = (IFG1 & WATCHDOG_BITTEN) != 0;
    IFG1 = (uint8_t)(IFG1 & ~WATCHDOG_BITTEN);
    DCOCTL = 0;
    BCSCTL1 = CALBC1_16MHZ;
    DCOCTL = CALDCO_16MHZ;
    P1OUT = 0;
    P2OUT = 0;
    P1DIR = 0;
    P2SEL = 0;
    P2DIR = VALVE_A | VALVE_B | ENABLE;
    ADC10AE0 = INPUTS;
    TA0CCR0 = PULSE_TICKS - 1u;
    TA0CCTL0 = 0x0010u;
    ticks = 0;
    TA0CTL = 0x0214u; /* 16 MHz, up to TA0CCR0 */
    WDTCTL = WATCHDOG_FED;
    __asm__ volatile("eint");
    return has_bitten;
}

void board_wait(void)
{
    while (ticks < CONTROLLER_TICKS) {
    }
    __asm__ volatile("dint\n\tnop");
    ticks = (uint16_t)(ticks - CONTROLLER_TICKS);
    __asm__ volatile("eint");
}

/* One input in counts of 14 bits, of which the lowest are 0. */
static int16_t converted(uint16_t input)
{
    ADC10CTL0 = 0; /* the input can be changed only while it is not enabled */
    ADC10CTL1 = input;
    ADC10CTL0 = CONVERTS;
    while ((ADC10CTL1 & 0x0001u) != 0u) {
    }
    return (int16_t)((ADC10MEM >> (CONVERTER_BITS - CONTROLLER_BITS)) << (SCALE_BITS - CONTROLLER_BITS));
}

controller_readings board_read(void)
{
    const int16_t heel = converted(0x1000u);
    const int16_t toe = converted(0x2000u);
    const int16_t angle = converted(0x4000u);
    const int16_t pressure_1 = converted(0x5000u);
    const int16_t pressure_2 = converted(0x7000u);
    const controller_readings seen = {heel, toe, angle, pressure_1, pressure_2};
    return seen;
}

void board_drive(int16_t command)
{
    P2OUT = command > 0 ? ENABLE | VALVE_A : command < 0 ? ENABLE | VALVE_B : 0;
}
