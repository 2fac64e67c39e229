#include <stdbool.h>
#include <stdint.h>

#if (-1 >> 1) != -1
#error "a shift to the right must keep the sign"
#endif

/* What takes rows is put in its place, so that they are not copied: a stack of some hundred bytes has no room for it.
   What takes numbers alone is called. */
#if defined(__GNUC__)
#define PPAFO_INLINE static inline __attribute__((always_inline, unused))
#define PPAFO_CALLED static __attribute__((unused))
#else
#define PPAFO_INLINE static inline
#define PPAFO_CALLED static
#endif

