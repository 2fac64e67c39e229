/* The MSP430G2553 of a LaunchPad. README.md says what is wired to it. Not run in a simulator, which has no converter. */
#include "msp430.h"

#define P1OUT REGISTER_8(0x0021)
#define P1DIR REGISTER_8(0x0022)
#define P2OUT REGISTER_8(0x0029)
#define P2DIR REGISTER_8(0x002A)
#define P2SEL REGISTER_8(0x002E)
#define ADC10AE0 REGISTER_8(0x004A)
#define ADC10CTL0 REGISTER_16(0x01B0)
#define ADC10CTL1 REGISTER_16(0x01B2)
#define ADC10MEM REGISTER_16(0x01B4)

#define VALVE_A 0x01u         /* P2.0: joins chamber 1 to the supply */
#define VALVE_B 0x02u         /* P2.1: joins chamber 2 to the supply */
#define ENABLE 0x04u          /* P2.2: holds the dump valve closed */
#define INPUTS 0xB6u          /* A1, A2, A4, A5, A7: P1.1, P1.2, P1.4, P1.5, P1.7 */
#define CONVERTS 0x1013u      /* 16 clocks of sampling, on, enabled, go; the supply is the reference */
#define CONVERTER_BITS 10
#define SCALE_BITS 14

bool board_begin(void)
{
    const bool has_bitten = clock_begin();
    P1OUT = 0;
    P2OUT = 0;
    P1DIR = 0;
    P2SEL = 0;
    P2DIR = VALVE_A | VALVE_B | ENABLE;
    ADC10AE0 = INPUTS;
    timer_begin();
    return has_bitten;
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
