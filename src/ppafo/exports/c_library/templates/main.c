/* @title@: prints every sample, then the metrics, each number with the 17 digits that tell it from all others. */
#include "@name@.h"

#include <stdio.h>
#include <stdlib.h>

static void print_metric(const char *name, double value, const char *unit, const char *summary)
{
    if (value == value) {
        printf("# %s = %.17g %s: %s\n", name, value, unit, summary);
    } else {
        printf("# %s: none here: %s\n", name, summary);
    }
}

int main(void)
{
    @name@_settings settings;
    @name@_outputs outputs;
    @name@_metrics metrics;
    @name@_run *run;
    @name@_status status;

    @name@_defaults(&settings);
    /* Change what you like here, for example: settings.@example@ */
    if (@name@_bad_setting(&settings) != NULL) {
        fprintf(stderr, "%s is out of range, contradicts another or needs another program, see README.md\n",
            @name@_bad_setting(&settings));
        return 2;
    }
    run = (@name@_run *)malloc(@name@_size(&settings));
    if (run == NULL) {
        fprintf(stderr, "no memory\n");
        return 1;
    }
    (void)@name@_initialise(run, &settings);
    printf("@csv_head@\n");
    while ((status = @name@_step(run)) == @NAME@_GOING_ON) {
        @name@_read_outputs(run, &outputs);
        printf("@csv_form@\n",
@csv_values@);
    }
    if (status == @NAME@_FINISHED) {
        @name@_read_metrics(run, &metrics);
@print_metrics@
    } else {
        fprintf(stderr, "the run failed\n");
    }
    free(run);
    return status == @NAME@_FINISHED ? 0 : 1;
}
