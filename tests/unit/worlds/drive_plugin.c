/* Runs a model with a plugin, without Python: prints the joint's angle before each step and the plugin's outputs after it.
 *
 *     drive_plugin MUJOCO PLUGIN MODEL ANGLE OUTPUTS < COMMANDS
 *
 * MUJOCO and PLUGIN are libraries, MODEL is a file. Commands come one a line; all numbers are in hexadecimal. The last
 * line has the angle at the end alone.
 */
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

#include <mujoco/mujoco.h>

#define TAKE(name) \
    __typeof__(&name) of_##name = (__typeof__(&name))(void *)GetProcAddress(mujoco, #name); \
    if (of_##name == NULL) { fprintf(stderr, "%s is missing\n", #name); return 1; }

int main(int count, char **given)
{
    if (count != 6) {
        return 2;
    }
    HMODULE mujoco = LoadLibraryA(given[1]);
    if (mujoco == NULL) {
        fprintf(stderr, "%s cannot be loaded: error %lu\n", given[1], GetLastError());
        return 1;
    }
    TAKE(mj_loadPluginLibrary) TAKE(mj_loadXML) TAKE(mj_makeData) TAKE(mj_step)
    char text[64], error[1000] = "";
    of_mj_loadPluginLibrary(given[2]);
    mjModel *model = of_mj_loadXML(given[3], NULL, error, sizeof(error));
    if (model == NULL) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    mjData *data = of_mj_makeData(model);
    const int outputs = atoi(given[5]);
    data->qpos[0] = strtod(given[4], NULL);
    while (fgets(text, sizeof(text), stdin) != NULL) {
        data->ctrl[0] = strtod(text, NULL);
        printf("%a", data->qpos[0]);
        of_mj_step(model, data);
        for (int place = 0; place < outputs; ++place) {
            printf(" %a", data->plugin_state[place]);
        }
        printf("\n");
    }
    printf("%a\n", data->qpos[0]);
    return 0;
}
