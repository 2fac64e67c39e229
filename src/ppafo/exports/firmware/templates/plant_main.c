/* @title@: the plant on a board of its own. It shows what its sensors see, waits for a command, and goes on. */
#include "@name@.c"

#include "board.h"

@steps@
enum { STEPS = @steps_of_sample@, MEMORY = @memory@ };

static double memory[MEMORY];

/* What the board of the controller is to see, and all that a recording has. */
static void show(const @name@_run *run, bool is_well)
{
    @name@_outputs outputs;
    double sampled[PLANT_VALUES];
    double converted[3];
    int place;
    plant_shown shown;
    @name@_read_outputs(run, &outputs);
    outputs.time = (double)run->steps_done * run->parameters[PARAMETER_TIMING_STEP];
    memcpy(sampled, &outputs, sizeof(sampled));
    shown_by_converter(array_of(sampled, PLANT_VALUES, 0, 0), array_of(converted, 3, 0, 0));
    shown.reference = (int16_t)converted[0];
    shown.pressure_1 = (int16_t)converted[1];
    shown.pressure_2 = (int16_t)converted[2];
    shown.is_well = (int16_t)(is_well ? 1 : 0);
    for (place = 0; place < PLANT_VALUES; ++place) {
        shown.values[place] = sampled[place];
    }
    board_show(&shown);
}

int main(void)
{
    @name@_settings settings;
    @name@_run *run = (@name@_run *)memory;
    bool is_well;
    board_begin();
    @name@_defaults(&settings);
    if (@name@_size(&settings) > sizeof(memory) || @name@_initialise(run, &settings) != @NAME@_GOING_ON) {
        board_give_up();
    }
    is_well = advance_steps(run, 0);
    for (;;) {
        show(run, is_well);
        run->parameters[PARAMETER_CONTROLLER_COMMAND] = (double)board_wait_for_command() / @command_steps@.0;
        is_well = is_well && advance_steps(run, STEPS);
    }
}
