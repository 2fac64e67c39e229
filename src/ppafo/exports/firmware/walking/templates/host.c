/* The controller on this computer: a line of five readings in, command, level and sign out. "begin" begins anew. */
#include <stdio.h>
#include <string.h>

#include "controller.h"

int main(void)
{
    char line[128];
    controller_begin();
    while (fgets(line, (int)sizeof line, stdin) != NULL) {
        int given[5];
        if (strncmp(line, "begin", 5) == 0) {
            controller_begin();
            continue;
        }
        if (sscanf(line, "%d %d %d %d %d", &given[0], &given[1], &given[2], &given[3], &given[4]) != 5) {
            fprintf(stderr, "five readings are needed, not: %s", line);
            return 2;
        }
        const controller_readings readings = {
            (int16_t)given[0], (int16_t)given[1], (int16_t)given[2], (int16_t)given[3], (int16_t)given[4]};
        const int16_t command = controller_sample(readings);
        printf("%d %d %d\n", command, controller_level(), controller_sign());
    }
    return 0;
}
