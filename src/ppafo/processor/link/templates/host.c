/* @title@: the integer controller behind the protocol of "ppafo hil", on this computer.
 *
 *     controller udp PORT [SILENCE]        listens at 127.0.0.1:PORT
 *     controller serial DEVICE [SILENCE]   a serial device that is set up already (see stty), or a pseudo-terminal
 *
 * SILENCE is the time in ms after which the controller takes the plant for gone and vents; 20 unless given, 0 never.
 * On a board: keep all down to left(), hand link_take() the bytes that its UART or USB port receives, and vent where
 * left() is 0. */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "controller.h"
#include "link.h"
#include "plant.h"

enum { LONGEST_SILENCE = 3600000 }; /* ms */

static bool is_begun; /* a sample with LINK_BEGIN came, and nothing has ended the run since */
static bool is_known; /* the number of a run is known: that of the last one that began */
static bool is_sound;
static uint16_t run;
static uint32_t first; /* numbers of the first and of the newest sample of the run */
static uint32_t newest;
static uint32_t passed;  /* periods of the controller since the run began */
static uint32_t heard;   /* when the newest sample of the run came, us of this computer */
static uint32_t decided; /* when the controller's last sample period began, us of the plant */
static int32_t command;  /* in millionths */

/* What a converter would show of a value. */
static int16_t shown(double value, double step)
{
    const double count = value / step + 0.5;
    return (int16_t)(count < 0.0 ? 0.0 : count > PLANT_TOP ? PLANT_TOP : count);
}

/* One sample of the controller. */
static void decide(const link_sample *sample)
{
    const double reference = sample->reference / 1000000.0 + PLANT_MIDDLE * PLANT_TORQUE_STEP;
    const int16_t steps = controller_sample(shown(reference, PLANT_TORQUE_STEP),
        shown(sample->pressure_1, PLANT_PRESSURE_STEP), shown(sample->pressure_2, PLANT_PRESSURE_STEP));
    is_sound = is_sound && controller_is_sound();
    command = is_sound ? (int32_t)steps * 1000 : 0;
}

/* True where more periods of the controller went by than samples were sent, lost ones too: a slower plant, for which the
 * controller has the gains of another rate. Time stamps may jitter by a period, and clocks differ a little. */
static bool is_slow(uint32_t samples)
{
    return passed > samples + samples / 16u + 1u;
}

/* Decide once for each sample period that has begun. Lost samples leave a gap in the numbers. */
static void go_on(const link_sample *sample, uint32_t now)
{
    const uint32_t periods = (sample->time - decided) / PLANT_PERIOD_US;
    heard = now;
    passed += periods;
    is_sound = is_sound && !is_slow(sample->sequence - first);
    newest = sample->sequence;
    if (periods > 0) {
        decided += periods * PLANT_PERIOD_US;
        decide(sample);
    }
}

/* True where a run begins. What calls once more is heard before anything else came of its run; later it is an old sample,
 * which neither sets back a controller that has gone on nor brings back a run that has ended. */
static bool begins(const link_sample *sample)
{
    const bool is_new = !is_known || sample->run != run;
    return (sample->flags & LINK_BEGIN) != 0 && (is_new || (is_begun && is_sound && sample->sequence == newest));
}

/* Answer a sample. One that comes twice or late is answered with the command that stands, one of another run with none. */
static void answer(const link_sample *sample, uint32_t now, uint8_t bytes[LINK_ANSWER_BYTES])
{
    bool is_good;
    if (begins(sample)) {
        is_begun = true;
        is_known = true;
        is_sound = true;
        run = sample->run;
        first = sample->sequence;
        newest = sample->sequence;
        passed = 0;
        heard = now;
        decided = sample->time;
        controller_begin();
        decide(sample);
    } else if (is_begun && sample->run == run && sample->sequence > newest) {
        go_on(sample, now);
    }
    if ((sample->flags & (LINK_VENTED | LINK_OVER)) != 0) {
        is_begun = false;
    }
    is_good = is_begun && is_sound && sample->run == run;
    link_answer(sample, is_good ? command : 0, is_good ? 0 : LINK_UNSOUND, now, bytes);
}

static uint32_t microseconds(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u);
}

/* How long the plant may still be silent, in ms; 0 where it is gone, -1 where nothing is waited for. Only new samples of
 * the run show that it is there: a line that carries garbage, or one sample again and again, is silent. */
static int left(uint32_t silence)
{
    const uint32_t gone = microseconds() - heard;
    if (silence == 0 || !is_begun) {
        return -1;
    }
    return gone < silence ? (int)((silence - gone + 999u) / 1000u) : 0;
}

static int opened(const char *kind, const char *place)
{
    struct sockaddr_in own;
    int port;
    if (strcmp(kind, "serial") == 0) {
        return open(place, O_RDWR | O_NOCTTY);
    }
    port = socket(AF_INET, SOCK_DGRAM, 0);
    memset(&own, 0, sizeof own);
    own.sin_family = AF_INET;
    own.sin_port = htons((uint16_t)strtoul(place, NULL, 10));
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (port >= 0 && bind(port, (const struct sockaddr *)&own, sizeof own) != 0) {
        (void)close(port);
        return -1;
    }
    return port;
}

int main(int count, char **words)
{
    link_reader reader = {{0}, 0};
    const bool is_udp = count > 1 && strcmp(words[1], "udp") == 0;
    const long given = count > 3 ? strtol(words[3], NULL, 10) : 20;
    const uint32_t silence = given <= 0 ? 0 : (uint32_t)(given < LONGEST_SILENCE ? given : LONGEST_SILENCE) * 1000u;
    int port;
    if (count < 3 || (!is_udp && strcmp(words[1], "serial") != 0)) {
        fprintf(stderr, "controller udp PORT [SILENCE], or controller serial DEVICE [SILENCE]\n");
        return 2;
    }
    port = opened(words[1], words[2]);
    if (port < 0) {
        perror(words[2]);
        return 2;
    }
    printf("ready\n");
    (void)fflush(stdout);
    for (;;) {
        struct pollfd waiting = {port, POLLIN, 0};
        struct sockaddr_storage plant;
        socklen_t size = sizeof plant;
        uint8_t bytes[256];
        uint8_t out[LINK_ANSWER_BYTES];
        link_sample sample;
        ssize_t found;
        ssize_t at;
        const int came = poll(&waiting, 1, left(silence));
        if (left(silence) == 0) {
            is_begun = false; /* the plant is gone: a board vents here, and what comes too late changes nothing */
        }
        if (came == 0) {
            continue;
        }
        found = is_udp ? recvfrom(port, bytes, sizeof bytes, 0, (struct sockaddr *)&plant, &size)
                       : read(port, bytes, sizeof bytes);
        if (found <= 0 && !is_udp) {
            return 0; /* unplugged */
        }
        if (is_udp) {
            reader.count = 0;
        }
        for (at = 0; at < found; ++at) {
            if (link_take(&reader, bytes[at], &sample)) {
                answer(&sample, microseconds(), out);
                if (is_udp) {
                    (void)sendto(port, out, sizeof out, 0, (const struct sockaddr *)&plant, size);
                } else if (write(port, out, sizeof out) < 0) {
                    return 0;
                }
            }
        }
    }
}
