/* What a run needs of the strings of C: instructions of bulk memory. */
#define memcpy __builtin_memcpy
#define memset __builtin_memset
