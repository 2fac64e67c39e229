/* @title@: holds the valve open by half for a tenth of a second, and prints the plant after every step with 17 digits. */
#include "@name@.h"

#include <stdio.h>
#include <stdlib.h>

int main(void)
{
    @name@_settings settings;
    @name@_outputs outputs;
    @name@_run *run;
    @name@_status status;
    int steps;

    @name@_defaults(&settings);
    /* Change what you like here, for example: settings.@example@ */
    if (@name@_bad_setting(&settings) != NULL || @name@_size(&settings) == 0) {
        fprintf(stderr, "these settings are out of range, or need another program: see README.md\n");
        return 2;
    }
    run = (@name@_run *)malloc(@name@_size(&settings));
    if (run == NULL) {
        fprintf(stderr, "no memory\n");
        return 1;
    }
    status = @name@_initialise(run, &settings, @first_inputs@);
    printf("@csv_head@\n");
    for (steps = (int)(0.1 / settings.run_step + 0.5); status == @NAME@_GOING_ON && steps >= 0; --steps) {
        @name@_read_outputs(run, &outputs);
        printf("@csv_form@\n",
@csv_values@);
        status = @name@_step(run, @first_inputs@);
    }
    if (status != @NAME@_GOING_ON) {
        fprintf(stderr, "the run failed\n");
    }
    free(run);
    return status == @NAME@_GOING_ON ? 0 : 1;
}
