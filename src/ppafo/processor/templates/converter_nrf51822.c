/* The converter of the nRF51822: 10 bits, one input after another. Not run on a processor. */
#include "board.h"
#include "parameters.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))

#define CONVERTER_START REGISTER(0x40007000)
#define CONVERTER_END REGISTER(0x40007100)
#define CONVERTER_ENABLE REGISTER(0x40007500)
#define CONVERTER_CONFIGURATION REGISTER(0x40007504)
#define CONVERTER_RESULT REGISTER(0x40007508)

#define TEN_BITS 0x02u
#define TWO_THIRDS 0x04u /* of the input beside 1.2 V: from 0 to 1.8 V */
#define INPUT(number) (1u << ((number) + 8u))
#define OWN_BITS 10

void converter_begin(void);

void converter_begin(void)
{
    CONVERTER_ENABLE = 1u;
}

/* One input in the bits of the controller. Where these are more, the upper ones are repeated below: the ends stay ends. */
static int16_t converted(uint32_t input)
{
    CONVERTER_CONFIGURATION = TEN_BITS | TWO_THIRDS | input;
    CONVERTER_END = 0u;
    CONVERTER_START = 1u;
    while (CONVERTER_END == 0u) {
    }
    const uint32_t found = CONVERTER_RESULT & 0x3FFu;
#if CONTROLLER_BITS > OWN_BITS
    return (int16_t)((found << (CONTROLLER_BITS - OWN_BITS)) | (found >> (2 * OWN_BITS - CONTROLLER_BITS)));
#else
    return (int16_t)(found >> (OWN_BITS - CONTROLLER_BITS));
#endif
}

board_readings board_read(void)
{
    const int16_t reference = converted(INPUT(2u));
    const int16_t pressure_1 = converted(INPUT(4u));
    const int16_t pressure_2 = converted(INPUT(3u));
    const board_readings seen = {reference, pressure_1, pressure_2};
    return seen;
}
