/* What the functions of a run need of the mathematics of C, for a machine without a library: all are instructions or numbers. */
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
