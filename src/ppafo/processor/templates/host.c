/* The controller on this computer: a line of three readings in, a line of command and soundness out. "begin" begins anew. */
#include <stdio.h>
#include <string.h>

#include "controller.h"

int main(void)
{
    char line[128];
    controller_begin();
    while (fgets(line, (int)sizeof line, stdin) != NULL) {
        int reference;
        int pressure_1;
        int pressure_2;
        if (strncmp(line, "begin", 5) == 0) {
            controller_begin();
            continue;
        }
        if (sscanf(line, "%d %d %d", &reference, &pressure_1, &pressure_2) != 3) {
            fprintf(stderr, "three readings are needed, not: %s", line);
            return 2;
        }
        const int16_t command = controller_sample((int16_t)reference, (int16_t)pressure_1, (int16_t)pressure_2);
        printf("%d %d\n", command, controller_is_sound() ? 1 : 0);
    }
    return 0;
}
