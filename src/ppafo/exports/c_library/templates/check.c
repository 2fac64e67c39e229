/* @title@: compares the library with the numbers of Python in expected.csv, of the run as it was exported. */
#include "@name@.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_LINE = 16384, MOST_COLUMNS = 256 };

static const char *const CHANNEL[] = {@channel_names@};
static const char *const METRIC[] = {@metric_names@, ""};

/* The place of a name in a list, -1 where it is not there. */
static int place_of(const char *name, size_t length, const char *const *names, int count)
{
    int place;
    for (place = 0; place < count; ++place) {
        if (strlen(names[place]) == length && strncmp(names[place], name, length) == 0) {
            return place;
        }
    }
    return -1;
}

/* Read which channel each column is; the number of columns, 0 where one is unknown. */
static int read_head(const char *line, int *columns)
{
    int count = 0;
    while (*line != '\0' && *line != '\n' && count < MOST_COLUMNS) {
        const size_t length = strcspn(line, ",\r\n");
        columns[count] = place_of(line, length, CHANNEL, (int)(sizeof(CHANNEL) / sizeof(CHANNEL[0])));
        if (columns[count] < 0) {
            return 0;
        }
        ++count;
        line += length + strspn(line + length, ",\r\n");
    }
    return count;
}

/* Compare a sample with its line; false, with a word on it, where a channel has another bit. */
static bool is_same(const char *line, const @name@_outputs *outputs, const int *columns, int count)
{
    const double *values = (const double *)outputs;
    int column;
    for (column = 0; column < count; ++column) {
        char *end;
        const double expected = strtod(line, &end);
        const double found = values[columns[column]];
        if (columns[column] > 0 && found != expected) {
            fprintf(stderr, "at %.9g s %s is %.17g, Python has %.17g; see the flags in README.md\n", values[0],
                CHANNEL[columns[column]], found, expected);
            return false;
        }
        line = end + strspn(end, ",");
    }
    return true;
}

/* Compare a metric with its line, "# name = value"; Python sums in another order. */
static bool is_metric_same(const char *line, const double *metrics)
{
    const size_t length = strcspn(line + 2, " ");
    const int place = place_of(line + 2, length, METRIC, (int)(sizeof(METRIC) / sizeof(METRIC[0])) - 1);
    const double expected = strtod(line + 2 + length + 3, NULL);
    if (place < 0 || !(fabs(metrics[place] - expected) <= @allowed@ * fabs(expected))) {
        fprintf(stderr, "metric %.*s is %.17g, Python has %.17g\n", (int)length, line + 2,
            place < 0 ? 0.0 : metrics[place], expected);
        return false;
    }
    return true;
}

int main(int count, char **words)
{
    static char line[LONGEST_LINE];
    int columns[MOST_COLUMNS];
    @name@_settings settings;
    @name@_outputs outputs;
    @name@_run *run;
    @name@_status status;
    int compared = 0;
    int metrics_compared = 0;
    int width;
    bool good = true;
    FILE *file = fopen(count > 1 ? words[1] : "expected.csv", "r");
    if (file == NULL || fgets(line, LONGEST_LINE, file) == NULL || (width = read_head(line, columns)) == 0) {
        fprintf(stderr, "no table of Python's numbers: %s\n", count > 1 ? words[1] : "expected.csv");
        return 2;
    }
    @name@_defaults(&settings);
    run = (@name@_run *)malloc(@name@_size(&settings));
    if (run == NULL) {
        fprintf(stderr, "no memory\n");
        return 2;
    }
    status = @name@_initialise(run, &settings@check_inputs@);
@check_first@
    while (good && fgets(line, LONGEST_LINE, file) != NULL && line[0] != '#') {
        const double due = strtod(line, NULL) * (1.0 - 1.0e-9);
        while (status == @NAME@_GOING_ON && (@name@_read_outputs(run, &outputs), outputs.time < due)) {
            status = @name@_step(run@check_inputs@);
        }
        if (status != @NAME@_GOING_ON) {
            fprintf(stderr, "the run ended before %.9g s, which Python has\n", strtod(line, NULL));
            good = false;
        } else {
            good = is_same(line, &outputs, columns, width);
            ++compared;
        }
        line[0] = '\0';
    }
@check_metrics@
    (void)is_metric_same;
    fclose(file);
    free(run);
    if (good) {
        fprintf(stderr, "equal to Python: %d samples to the bit, %d metrics\n", compared, metrics_compared);
    }
    return good ? 0 : 1;
}
