/* What a run needs of the mathematics and strings of C: all are instructions or numbers. */
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define floor __builtin_floor
#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define memcpy __builtin_memcpy
#define memset __builtin_memset
