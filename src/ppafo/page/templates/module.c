/* A run for a page: what JavaScript needs of the exported library, which is part of this file. */
#include "@name@.c"

#define SHOWN(name) __attribute__((export_name(#name))) page_##name

enum { PAGE = 65536 };

extern unsigned char __heap_base;
static @name@_settings chosen_of_page;
static @name@_settings used_of_page;
static @name@_metrics found_of_page;
/* Number of samples, and addresses of samples and metrics. */
static int32_t run_of_page[3];

static @name@_run *memory_of_run(void)
{
    return (@name@_run *)(((size_t)&__heap_base + 15) & ~(size_t)15);
}

/* The settings of the next run, as written, to be changed in place. */
@name@_settings *SHOWN(defaults)(void)
{
    @name@_defaults(&chosen_of_page);
    return &chosen_of_page;
}

/* The settings of the run: those left as written follow others, as in Python. */
const @name@_settings *SHOWN(used)(void)
{
    used_of_page = with_followers(&chosen_of_page);
    return &used_of_page;
}

/* The name of a setting with which no run can begin, or a null pointer. */
const char *SHOWN(bad)(void)
{
    return @name@_bad_setting(&chosen_of_page);
}

/* Why: 1 it is out of range, 2 it contradicts another setting, 3 it belongs to another program; 0 where a run begins. */
int32_t SHOWN(cause)(void)
{
    if (out_of_range(&chosen_of_page, page_used()) != NULL) {
        return 1;
    }
    return wrong_setting(&chosen_of_page) != NULL ? 2 : @name@_bad_setting(&chosen_of_page) != NULL ? 3 : 0;
}

/* Make sure that the memory reaches up to an address; false where there is no more. */
static bool page_reaches(size_t end)
{
    const size_t now = __builtin_wasm_memory_size(0) * PAGE;
    return end <= now || __builtin_wasm_memory_grow(0, (end - now) / PAGE + 16) != (size_t)-1;
}

/* Run; the samples lie one after the other behind the run itself, at the end of the memory. */
@name@_status SHOWN(run)(void)
{
    const size_t bytes = @name@_size(&chosen_of_page);
    @name@_run *run = memory_of_run();
    @name@_outputs *rows = (@name@_outputs *)((size_t)run + ((bytes + 15) & ~(size_t)15));
    @name@_status status = @NAME@_BAD_SETTING;
    int32_t taken = 0;
    if (bytes != 0 && page_reaches((size_t)rows)) {
        status = @name@_initialise(run, &chosen_of_page);
        while (status == @NAME@_GOING_ON && page_reaches((size_t)(rows + taken + 1))) {
            status = @name@_step(run);
            if (status == @NAME@_GOING_ON) {
                @name@_read_outputs(run, &rows[taken++]);
            }
        }
        @name@_read_metrics(run, &found_of_page);
    }
    run_of_page[0] = taken;
    run_of_page[1] = (int32_t)rows;
    run_of_page[2] = (int32_t)&found_of_page;
    return status;
}

const int32_t *SHOWN(found)(void)
{
    return run_of_page;
}
#if @REACH@

/* The torque nearest to a required one that the actuator of the run reaches at an angle. */
double SHOWN(reached)(double angle, double torque)
{
    run_reach ends;
    reach(&memory_of_run()->parameters, angle, &ends);
    return torque < ends.low ? ends.low : torque > ends.high ? ends.high : torque;
}
#endif
