#include <stdbool.h>
#include <stdint.h>

#if (-1 >> 1) != -1
#error "a shift to the right must keep the sign"
#endif

#if defined(__GNUC__)
#define PPAFO_INLINE static __attribute__((unused))
#else
#define PPAFO_INLINE static
#endif

