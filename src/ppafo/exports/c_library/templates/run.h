/* A run under way: memory of the caller, aligned as for a double, of the size that @name@_size returns.
 * It has no pointer in it and nothing outside it changes: runs do not know of each other, and a copy goes on as the
 * first would. */
typedef struct @name@_run @name@_run;

/* The settings of the scenario. */
void @name@_defaults(@name@_settings *settings);

/* The name of the first setting that is out of range or contradicts another; a null pointer where all are good. */
const char *@name@_bad_setting(const @name@_settings *settings);

/* Bytes of a run; it depends on delays. 0 for settings with which no run can begin. */
size_t @name@_size(const @name@_settings *settings);
