/* The protocol of "ppafo hil". See link.h. */
#include "link.h"

static const uint8_t HEAD[5] = {0xA5, 0x5A, 1, 1, LINK_SAMPLE_BYTES};
static const uint8_t CHANNELS = 0x1F; /* reference, angle, pressure_1, pressure_2, torque */

static uint32_t checksum(const uint8_t *bytes, uint8_t count)
{
    uint32_t sum = 0xFFFFFFFFu;
    uint8_t at;
    uint8_t bit;
    for (at = 0; at < count; ++at) {
        sum ^= bytes[at];
        for (bit = 0; bit < 8; ++bit) {
            sum = (sum & 1u) != 0u ? (sum >> 1) ^ 0xEDB88320u : sum >> 1;
        }
    }
    return ~sum;
}

static uint32_t read_32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static int32_t read_signed(const uint8_t *bytes)
{
    const uint32_t bits = read_32(bytes);
    return bits < 0x80000000u ? (int32_t)bits : (int32_t)(bits - 0x80000000u) - 0x7FFFFFFF - 1;
}

static void write_32(uint8_t *bytes, uint32_t value)
{
    bytes[0] = (uint8_t)(value & 0xFFu);
    bytes[1] = (uint8_t)(value >> 8 & 0xFFu);
    bytes[2] = (uint8_t)(value >> 16 & 0xFFu);
    bytes[3] = (uint8_t)(value >> 24 & 0xFFu);
}

/* True as long as the bytes may be the beginning of a sample. */
static bool may_begin(const link_reader *reader)
{
    uint8_t at;
    for (at = 0; at < reader->count && at < sizeof HEAD; ++at) {
        if (reader->bytes[at] != HEAD[at]) {
            return false;
        }
    }
    return true;
}

/* Drop bytes at the front until a sample may begin again. */
static void drop(link_reader *reader)
{
    uint8_t at;
    do {
        --reader->count;
        for (at = 0; at < reader->count; ++at) {
            reader->bytes[at] = reader->bytes[at + 1];
        }
    } while (!may_begin(reader));
}

bool link_take(link_reader *reader, uint8_t byte, link_sample *sample)
{
    const uint8_t *bytes = reader->bytes;
    reader->bytes[reader->count] = byte;
    ++reader->count;
    if (!may_begin(reader)) {
        drop(reader);
    }
    if (reader->count < LINK_SAMPLE_BYTES) {
        return false;
    }
    if (checksum(bytes, LINK_SAMPLE_BYTES - 4) != read_32(bytes + LINK_SAMPLE_BYTES - 4) || read_32(bytes + 16) != CHANNELS) {
        drop(reader);
        return false;
    }
    sample->flags = bytes[5];
    sample->run = (uint16_t)(bytes[6] | (uint16_t)bytes[7] << 8);
    sample->sequence = read_32(bytes + 8);
    sample->time = read_32(bytes + 12);
    sample->reference = read_signed(bytes + 20);
    sample->angle = read_signed(bytes + 24);
    sample->pressure_1 = read_signed(bytes + 28);
    sample->pressure_2 = read_signed(bytes + 32);
    sample->torque = read_signed(bytes + 36);
    reader->count = 0;
    return true;
}

void link_answer(const link_sample *sample, int32_t command, uint8_t flags, uint32_t time, uint8_t answer[LINK_ANSWER_BYTES])
{
    answer[0] = HEAD[0];
    answer[1] = HEAD[1];
    answer[2] = HEAD[2];
    answer[3] = 2;
    answer[4] = LINK_ANSWER_BYTES;
    answer[5] = flags;
    answer[6] = (uint8_t)(sample->run & 0xFFu);
    answer[7] = (uint8_t)(sample->run >> 8);
    write_32(answer + 8, sample->sequence);
    write_32(answer + 12, time);
    write_32(answer + 16, (uint32_t)command);
    write_32(answer + 20, checksum(answer, LINK_ANSWER_BYTES - 4));
}
