/* An actuator and a sensor for MuJoCo @mujoco@: @title@, by ppafo @version@.
 *
 * The gas goes on in advance(), once for each step of MuJoCo, along the motion that the joint made in it. All that
 * changes lies in plugin_state: the outputs first, then what the run is made of.
 */
#if !defined(_GNU_SOURCE)
#define _GNU_SOURCE /* dl_iterate_phdr */
#endif
#include "@name@.c"

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>

#include <mujoco/mujoco.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#include <link.h>
#endif

enum {
    AT_TORQUE = @torque@, /* of the outputs */
    AT_STEPS_DONE = OUTPUTS,
    AT_ANGLE,  /* where the vane stands [rad] */
    AT_BEFORE, /* torque one step before [N m] */
    AT_BEGUN,  /* 1 after the first step of MuJoCo; until then the joint may be put elsewhere */
    AT_STEP,   /* step of the engine that is counted by AT_STEPS_DONE [s] */
    AT_RUN,    /* states of the run, then late signals and commands */
    AT_HISTORY = AT_RUN + STATES
};

static const char PLUGIN[] = "@plugin@";
static const char *const ATTRIBUTES[] = {
@attributes@
};
enum { ATTRIBUTE_COUNT = sizeof(ATTRIBUTES) / sizeof(ATTRIBUTES[0]) };
/* Which settings these are; the last one is none. */
static const int PLACES[ATTRIBUTE_COUNT] = {@places@, -1};
#define NEUTRAL "neutral"

#define MOST_PARTS 1.0e12

/* In newer versions of MuJoCo controls and forces of an actuator have addresses of their own. */
#if @apart@
#define CONTROL_OF(m, number) (m)->actuator_ctrladr[number]
#define FORCE_OF(m, number) (m)->actuator_outadr[number]
#define ACTUATORS(m) (m)->nactuator
#else
#define CONTROL_OF(m, number) (number)
#define FORCE_OF(m, number) (number)
#define ACTUATORS(m) (m)->nu
#endif

/* One actuator of a model, with room for its run. */
typedef struct {
    @name@_settings settings;
    @name@_run *run;
    double timestep; /* of MuJoCo, for which the run was prepared [s] */
    double longest;  /* step of the engine that is allowed [s] */
    double neutral;  /* angle of the device where the joint is at 0 [rad] */
    int64_t parts;   /* steps of the engine in one of MuJoCo */
    int number;      /* of the actuator */
    int control;     /* places in ctrl, in actuator_force, and of its joint in qpos */
    int force;
    int place;
} device;

/* What is called of MuJoCo. Found in the library that is loaded already, so that nothing is linked. */
static struct {
    int (*version)(void);
    const char *(*version_text)(void);
    int (*plugin)(const mjpPlugin *);
    const mjpPlugin *(*registered)(const char *, int *);
    const char *(*config)(const mjModel *, int, const char *);
    void (*error)(const char *, ...);
} of_mujoco;

/* Numbers are read with a decimal point, whatever the program around has for its own. */
#if defined(_WIN32)
static _locale_t plain;
#define READ_NUMBER(text, end) _strtod_l(text, end, plain)
#else
static locale_t plain;
#define READ_NUMBER(text, end) strtod_l(text, end, plain)
#endif

@steps@
/* A number of the model's configuration; what is not given stays as it is. False where it is none. */
static bool read_number(const mjModel *m, int instance, const char *name, double *value)
{
    const char *text = of_mujoco.config(m, instance, name);
    char *end = NULL;
    if (text == NULL || text[0] == '\0') {
        return true;
    }
    *value = READ_NUMBER(text, &end);
    while (*end == ' ' || (*end >= '\t' && *end <= '\r')) {
        ++end;
    }
    return end != text && *end == '\0' && *value - *value == 0.0;
}

/* The path of a setting by its name in C. */
static const char *path_of(const char *name)
{
    int place;
    for (place = 0; place < ATTRIBUTE_COUNT; ++place) {
        const char *path = ATTRIBUTES[place];
        size_t at = 0;
        while (name[at] != '\0' && (name[at] == path[at] || (name[at] == '_' && path[at] == '.'))) {
            ++at;
        }
        if (name[at] == '\0' && path[at] == '\0') {
            return path;
        }
    }
    return name;
}

/* The settings under a step of MuJoCo, which is divided into the fewest equal steps of the engine. */
static void divide(device *item, double timestep)
{
    const double parts = timestep / item->longest + 1.0 - 1.0e-9;
    item->timestep = timestep;
    item->parts = parts < 1.0 ? 1 : (int64_t)(parts < MOST_PARTS ? parts : MOST_PARTS); /* more give no valid step */
    item->settings.run_step = timestep / (double)item->parts;
    item->settings.controller_period = item->settings.run_step;
    item->settings.run_output_interval = item->settings.run_step;
    item->settings.run_duration = 1000.0 * item->settings.run_step;
}

/* The angle of the vane for a length of the actuator; beyond its stops it stands at them. */
static double vane_angle(const device *item, double length)
{
    const double angle = item->neutral + length;
    const double low = item->settings.actuator_angle_min;
    const double high = item->settings.actuator_angle_max;
    return angle < low ? low : (angle > high ? high : angle);
}

/* Read the configuration of an instance; NULL where it is good, else what is wrong, in memory of the caller. */
static const char *configure(const mjModel *m, int instance, device *item, char *said, size_t room)
{
    double *settings = (double *)&item->settings;
    const char *bad;
    int place;
    item->neutral = @neutral@;
    @name@_defaults(&item->settings);
    if (!read_number(m, instance, NEUTRAL, &item->neutral)) {
        (void)snprintf(said, room, "%s: " NEUTRAL " is not a number", PLUGIN);
        return said;
    }
    for (place = 0; place < ATTRIBUTE_COUNT; ++place) {
        if (PLACES[place] >= 0 && !read_number(m, instance, ATTRIBUTES[place], &settings[PLACES[place]])) {
            (void)snprintf(said, room, "%s: %s is not a number", PLUGIN, ATTRIBUTES[place]);
            return said;
        }
    }
    item->longest = item->settings.run_step;
    if (!(item->longest > 0.0)) {
        (void)snprintf(said, room, "%s: run.step must be above 0", PLUGIN);
        return said;
    }
    divide(item, m->opt.timestep);
    item->settings.motion_angle = vane_angle(item, 0.0);
    bad = @name@_bad_setting(&item->settings);
    if (bad != NULL) {
        (void)snprintf(said, room, "%s: %s is out of range or contradicts another", PLUGIN, path_of(bad));
        return said;
    }
    if (@name@_size(&item->settings) == 0) {
        (void)snprintf(said, room,
            "%s: these numbers need other functions than the plugin has: export it from ppafo with them", PLUGIN);
        return said;
    }
    return NULL;
}

static int state_count(const device *item)
{
    const size_t bytes = @name@_size(&item->settings) - sizeof(@name@_run);
    return (int)(AT_HISTORY + bytes / sizeof(double));
}

/* The actuator of an instance, and where its joint is; NULL where they are good. */
static const char *find_joint(const mjModel *m, int instance, device *item, char *said, size_t room)
{
    int number;
    int joint;
    int own = -1;
    for (number = 0; number < ACTUATORS(m); ++number) {
        if (m->actuator_plugin[number] == instance) {
            if (own >= 0) {
                (void)snprintf(said, room, "%s: one instance cannot drive two actuators", PLUGIN);
                return said;
            }
            own = number;
        }
    }
    if (own < 0) {
        (void)snprintf(said, room, "%s: no actuator uses this instance of the plugin", PLUGIN);
        return said;
    }
    joint = m->actuator_trnid[2 * own];
    if (m->actuator_trntype[own] != mjTRN_JOINT || m->jnt_type[joint] != mjJNT_HINGE) {
        (void)snprintf(said, room, "%s: the actuator must drive a hinge joint", PLUGIN);
        return said;
    }
    item->number = own;
    item->control = CONTROL_OF(m, own);
    item->force = FORCE_OF(m, own);
    item->place = m->jnt_qposadr[joint];
    return NULL;
}

static void store(const device *item, double *state, double angle)
{
    const @name@_run *run = item->run;
    state[AT_BEFORE] = run->steps_done > 0 ? state[AT_TORQUE] : run->samples.last.torque;
    memcpy(state, (const double *)&run->samples.last + 1, OUTPUTS * sizeof(double)); /* without the time */
    state[AT_STEPS_DONE] = (double)run->steps_done;
    state[AT_STEP] = item->settings.run_step;
    state[AT_ANGLE] = angle;
    memcpy(state + AT_RUN, &run->states, sizeof(run->states));
    memcpy(state + AT_HISTORY, run + 1, (size_t)run->bytes - sizeof(*run));
}

static void restore(const device *item, const double *state)
{
    item->run->steps_done = (int64_t)state[AT_STEPS_DONE];
    memcpy(&item->run->states, state + AT_RUN, sizeof(item->run->states));
    memcpy(item->run + 1, state + AT_HISTORY, (size_t)item->run->bytes - sizeof(*item->run));
}

/* The vane on a straight line from a time on, under a command. */
static void lead(const device *item, double command, double time, double angle, double rate)
{
    run_parameters *parameters = &item->run->parameters;
    parameters->controller.command = command < -1.0 ? -1.0 : (command > 1.0 ? 1.0 : command);
    parameters->path.start = time;
    parameters->path.level = angle;
    parameters->path.rate = rate;
}

/* A run at its start, the vane at rest at an angle. */
static void begin(device *item, double angle)
{
    item->settings.motion_angle = angle;
    if (@name@_initialise(item->run, &item->settings) != @NAME@_GOING_ON) {
        of_mujoco.error("%s: the run cannot begin with a step of %g s", PLUGIN, item->timestep);
    }
    lead(item, 0.0, 0.0, angle, 0.0);
    (void)advance_steps(item->run, 0);
}

static const char *other_version(char *said, size_t room)
{
    if (of_mujoco.version() == mjVERSION_HEADER) {
        return NULL;
    }
    (void)snprintf(said, room, "%s was built for MuJoCo @mujoco@, this is %s: run 'ppafo export mujoco' where that is installed",
        PLUGIN, of_mujoco.version_text());
    return said;
}

static int count_states(const mjModel *m, int instance)
{
    device item;
    char said[256];
    const char *bad = other_version(said, sizeof(said));
    memset(&item, 0, sizeof(item));
    bad = bad != NULL ? bad : configure(m, instance, &item, said, sizeof(said));
    if (bad != NULL) {
        of_mujoco.error("%s", bad);
        return 0;
    }
    return state_count(&item);
}

static int count_outputs(const mjModel *m, int instance, int sensor)
{
    (void)m;
    (void)instance;
    (void)sensor;
    return OUTPUTS;
}

static int make(const mjModel *m, mjData *d, int instance)
{
    char said[256];
    device *item = (device *)calloc(1, sizeof(device));
    const char *bad = item == NULL ? "no memory" : other_version(said, sizeof(said));
    bad = bad != NULL ? bad : configure(m, instance, item, said, sizeof(said));
    bad = bad != NULL ? bad : find_joint(m, instance, item, said, sizeof(said));
    if (bad == NULL && state_count(item) != m->plugin_statenum[instance]) {
        (void)snprintf(said, sizeof(said),
            "%s: the model was compiled with another timestep, which the delay of the valve is counted in, or another export",
            PLUGIN);
        bad = said;
    }
    if (bad == NULL) {
        item->run = (@name@_run *)malloc(@name@_size(&item->settings));
        bad = item->run == NULL ? "no memory" : NULL;
    }
    if (bad != NULL) {
        free(item);
        of_mujoco.error("%s", bad);
        return -1;
    }
    d->plugin_data[instance] = (uintptr_t)item;
    return 0;
}

static void destroy(mjData *d, int instance)
{
    device *item = (device *)d->plugin_data[instance];
    if (item != NULL) {
        free(item->run);
        free(item);
        d->plugin_data[instance] = 0;
    }
}

/* Data that are copied get a device of their own; MuJoCo has put the pointer of the first into new ones. */
static void copy(mjData *to, const mjModel *m, const mjData *from, int instance)
{
    const device *first = (const device *)from->plugin_data[instance];
    @name@_run *run = (@name@_run *)malloc((size_t)first->run->bytes);
    device *made = (device *)malloc(sizeof(device));
    (void)m;
    if (run == NULL || made == NULL) {
        of_mujoco.error("%s: no memory", PLUGIN);
        return;
    }
    if (to->plugin_data[instance] != from->plugin_data[instance]) {
        destroy(to, instance);
    }
    memcpy(run, first->run, (size_t)first->run->bytes);
    *made = *first;
    made->run = run;
    to->plugin_data[instance] = (uintptr_t)made;
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance)
{
    device *item = (device *)data;
    const double length = m->actuator_gear[6 * item->force] * m->qpos0[item->place];
    const double angle = vane_angle(item, length);
    (void)instance;
    begin(item, angle);
    store(item, state, angle);
    state[AT_BEGUN] = 0.0;
}

/* Take another step of MuJoCo, or stop with the reason: delays are kept in steps. */
static void take_step(device *item, double timestep)
{
    const double before = item->timestep;
    const bool delays = item->run->signal_delay + item->run->command_delay != 0;
    bool possible = timestep > 0.0 && timestep <= 1000.0; /* the range of run.step; parts stay a number */
    divide(item, possible ? timestep : before);
    possible = possible && @name@_bad_setting(&item->settings) == NULL;
    if (possible && !delays && (int64_t)@name@_size(&item->settings) == item->run->bytes) {
        return;
    }
    divide(item, before); /* who goes on after the error is told again */
    if (possible) {
        of_mujoco.error("%s: the delay of the valve is counted in timesteps: compile the model with the new one", PLUGIN);
    } else {
        of_mujoco.error("%s: a timestep of %g s is out of range", PLUGIN, timestep);
    }
}

/* Whether MuJoCo has switched the actuator off, by itself or with its group. */
static bool is_off(const mjModel *m, const device *item)
{
    const int group = m->actuator_group[item->number];
    return (m->opt.disableflags & mjDSBL_ACTUATION) != 0
        || (group >= 0 && group <= 30 && ((unsigned)m->opt.disableactuator >> group & 1U) != 0);
}

/* The command in ctrl, within its range; 0 where it is off, and where it is not finite (MuJoCo then takes all as 0). */
static double command_of(const mjModel *m, const mjData *d, const device *item)
{
    const double given = d->ctrl[item->control];
    const double *range = m->actuator_ctrlrange + 2 * item->control;
    if (is_off(m, item) || given - given != 0.0) {
        return 0.0;
    }
    if (!m->actuator_ctrllimited[item->control] || (m->opt.disableflags & mjDSBL_CLAMPCTRL) != 0) {
        return given;
    }
    return given < range[0] ? range[0] : (given > range[1] ? range[1] : given);
}

static void advance_device(const mjModel *m, mjData *d, int instance)
{
    device *item = (device *)d->plugin_data[instance];
    double *state = d->plugin_state + m->plugin_stateadr[instance];
    const double end = vane_angle(item, m->actuator_gear[6 * item->force] * d->qpos[item->place]);
    double start = state[AT_ANGLE];
    double now;
    double then;
    if (end - end != 0.0) {
        return; /* MuJoCo resets a state that is no number */
    }
    if (m->opt.timestep != item->timestep) {
        take_step(item, m->opt.timestep);
        begin(item, start);
    }
    if (state[AT_STEP] != item->settings.run_step) {
        state[AT_STEPS_DONE] = floor(state[AT_STEPS_DONE] * state[AT_STEP] / item->settings.run_step + 0.5);
    }
    if (state[AT_BEGUN] == 0.0) {
        start = vane_angle(item, d->actuator_length[item->force]);
        begin(item, start);
    } else {
        restore(item, state);
    }
    now = state[AT_STEPS_DONE] * item->run->parameters.timing.period;
    then = (state[AT_STEPS_DONE] + (double)item->parts) * item->run->parameters.timing.period;
    lead(item, command_of(m, d, item), now, start, (end - start) / (then - now));
    if (!advance_steps(item->run, item->parts)) {
        of_mujoco.error("%s: the simulation diverged at %g s: try a smaller timestep, and check volumes and areas",
            PLUGIN, d->time);
    }
    store(item, state, end);
    state[AT_BEGUN] = 1.0;
}

static void compute(const mjModel *m, mjData *d, int instance, int capability)
{
    const device *item = (const device *)d->plugin_data[instance];
    const double *state = d->plugin_state + m->plugin_stateadr[instance];
    int sensor;
    if (capability == mjPLUGIN_ACTUATOR) {
        /* Semi-implicit steps are centred as they are, and RK4 wants the mean over the step, here from the last slope:
         * else a shut chamber would take energy from the joint, or give it some. */
        const double ahead = m->opt.integrator == mjINT_RK4 ? 0.5 : 0.0;
        d->actuator_force[item->force] =
            is_off(m, item) ? 0.0 : state[AT_TORQUE] + ahead * (state[AT_TORQUE] - state[AT_BEFORE]);
        return;
    }
    for (sensor = 0; sensor < m->nsensor; ++sensor) {
        if (m->sensor_type[sensor] == mjSENS_PLUGIN && m->sensor_plugin[sensor] == instance) {
            memcpy(d->sensordata + m->sensor_adr[sensor], state, OUTPUTS * sizeof(double));
        }
    }
}

#if defined(_WIN32)
static void *symbol(const char *name)
{
    return (void *)GetProcAddress(GetModuleHandleA("mujoco.dll"), name);
}
#else
static int find_library(struct dl_phdr_info *found, size_t size, void *kept)
{
    const char *last = strrchr(found->dlpi_name, '/');
    (void)size;
    if (strncmp(last != NULL ? last + 1 : found->dlpi_name, "libmujoco.so", 12) != 0) {
        return 0;
    }
    *(void **)kept = dlopen(found->dlpi_name, RTLD_LAZY | RTLD_NOLOAD);
    return 1;
}

static void *symbol(const char *name)
{
    void *library = NULL;
    (void)dl_iterate_phdr(find_library, &library);
    return dlsym(library != NULL ? library : RTLD_DEFAULT, name);
}
#endif

/* One symbol, into the place of a pointer to a function. */
static bool take(void *place, const char *name)
{
    void *found = symbol(name);
    memcpy(place, &found, sizeof(found));
    return found != NULL;
}

static const char *identity = "";

/* Which export this library is; nothing where MuJoCo has another plugin of its name. */
#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
const char *ppafo_plugin_identity(void)
{
    return identity;
}

__attribute__((constructor)) static void offer(void)
{
    mjpPlugin plugin;
    int slot;
#if defined(_WIN32)
    plain = _create_locale(LC_ALL, "C");
#else
    plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
#endif
    if (!take(&of_mujoco.version, "mj_version") || !take(&of_mujoco.version_text, "mj_versionString")
        || !take(&of_mujoco.plugin, "mjp_registerPlugin") || !take(&of_mujoco.config, "mj_getPluginConfig")
        || !take(&of_mujoco.registered, "mjp_getPlugin") || !take(&of_mujoco.error, "mju_error")) {
        (void)fprintf(stderr, "%s: MuJoCo is not loaded; load this library by mj_loadPluginLibrary\n", PLUGIN);
        return;
    }
    /* MuJoCo would leave this function by a jump, and the loader of the system would stay locked for ever. */
    if (of_mujoco.registered(PLUGIN, &slot) != NULL) {
        (void)fprintf(stderr, "%s: not loaded, for another library has given a plugin of this name\n", PLUGIN);
        return;
    }
    memset(&plugin, 0, sizeof(plugin));
    plugin.name = PLUGIN;
    plugin.nattribute = ATTRIBUTE_COUNT;
    plugin.attributes = ATTRIBUTES;
    plugin.capabilityflags = mjPLUGIN_ACTUATOR | mjPLUGIN_SENSOR;
    plugin.needstage = mjSTAGE_POS;
    plugin.nstate = count_states;
    plugin.nsensordata = count_outputs;
    plugin.init = make;
    plugin.destroy = destroy;
    plugin.copy = copy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.advance = advance_device;
    (void)of_mujoco.plugin(&plugin);
    identity = "@identity@";
}
