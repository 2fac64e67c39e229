/* The converter of the nRF52833: 14 bits, three inputs in one go, which it writes into memory. Not run on a processor. */
#include "board.h"
#include "parameters.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define CONVERTER_START REGISTER(0x40007000)
#define CONVERTER_SAMPLE REGISTER(0x40007004)
#define CONVERTER_STARTED REGISTER(0x40007100)
#define CONVERTER_END REGISTER(0x40007104)
#define CONVERTER_ENABLE REGISTER(0x40007500)
#define CHANNEL_INPUT(number) REGISTER(0x40007510u + 16u * (number))
#define CHANNEL_CONFIGURATION(number) REGISTER(0x40007518u + 16u * (number))
#define CONVERTER_RESOLUTION REGISTER(0x400075F0)
#define RESULT_ADDRESS REGISTER(0x4000762C)
#define RESULT_COUNT REGISTER(0x40007630)

#define GAIN_AND_TIME 0x20300u /* a third beside 0.6 V, from 0 to 1.8 V, and 10 us to settle */
#define OWN_BITS 14
#define INPUTS 3u

void converter_begin(void);

static volatile int16_t results[INPUTS];

void converter_begin(void)
{
    CONVERTER_ENABLE = 1u;
    CONVERTER_RESOLUTION = 3u; /* 14 bits */
    for (uint32_t place = 0u; place < INPUTS; ++place) {
        CHANNEL_INPUT(place) = place + 1u; /* AIN0, AIN1, AIN2 */
        CHANNEL_CONFIGURATION(place) = GAIN_AND_TIME;
    }
    RESULT_ADDRESS = (uint32_t)results;
    RESULT_COUNT = INPUTS;
}

/* One result in the bits of the controller; below 0 V it is 0. */
static int16_t shown(int16_t result)
{
    return (int16_t)(result < 0 ? 0 : result >> (OWN_BITS - CONTROLLER_BITS));
}

board_readings board_read(void)
{
    CONVERTER_STARTED = 0u;
    CONVERTER_END = 0u;
    CONVERTER_START = 1u;
    while (CONVERTER_STARTED == 0u) {
    }
    CONVERTER_SAMPLE = 1u;
    while (CONVERTER_END == 0u) {
    }
    const board_readings seen = {shown(results[2]), shown(results[0]), shown(results[1])};
    return seen;
}
