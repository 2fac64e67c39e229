/* What a run needs of the mathematics of C: all are instructions or numbers. */
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define floor __builtin_floor
#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
