/* @title@: hands the law the samples of a run in expected.csv, and compares its commands with those of this run. */
#include "@name@.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_LINE = 4096, COLUMNS = @columns@ };

int main(int count, char **words)
{
    static char line[LONGEST_LINE];
    static @name@_settings settings;
    static @name@_state state;
    int compared = 0;
    FILE *file = fopen(count > 1 ? words[1] : "expected.csv", "r");
    if (file == NULL || fgets(line, LONGEST_LINE, file) == NULL) {
        fprintf(stderr, "no table of samples: %s\n", count > 1 ? words[1] : "expected.csv");
        return 2;
    }
    @name@_defaults(&settings);
    @name@_reset(&state);
    while (fgets(line, LONGEST_LINE, file) != NULL) {
        @name@_measurement measurement;
        double values[COLUMNS];
        double command;
        char *at = line;
        int place;
        for (place = 0; place < COLUMNS; ++place) {
            values[place] = strtod(at, &at);
            at += strspn(at, ",");
        }
@read@
        command = @name@_update(&settings, &state, values[1], &measurement);
        if (command != values[COLUMNS - 1]) {
            fprintf(stderr, "at %.9g s the command is %.17g, the run has %.17g; see the flags in README.md\n", values[0],
                command, values[COLUMNS - 1]);
            return 1;
        }
        ++compared;
    }
    fclose(file);
    fprintf(stderr, "equal to ppafo: %d commands to the bit\n", compared);
    return 0;
}
