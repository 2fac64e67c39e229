/* What the boards of MSP430s have alike: clock, a tick every 125 us, and the watchdog. Included once, by the board. */
#ifndef PPAFO_MSP430_H
#define PPAFO_MSP430_H

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

#endif
