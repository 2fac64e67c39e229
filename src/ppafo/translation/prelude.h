#if !defined(PPAFO_INLINE)
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#endif

#if defined(__FAST_MATH__) || (defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0)
#error "strict arithmetic in 64 bits is needed: no -ffast-math, no x87"
#endif

#if defined(PPAFO_INLINE)
/* Said by the file around this, which has what the headers have. */
#elif defined(__GNUC__)
#define PPAFO_INLINE static inline __attribute__((always_inline, unused))
#elif defined(_MSC_VER)
#define PPAFO_INLINE static __forceinline
#else
#define PPAFO_INLINE static inline
#endif

#if defined(PPAFO_SIDE_BY_SIDE)
/* Said by the file around this. */
#elif defined(__clang__)
#define PPAFO_SIDE_BY_SIDE _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define PPAFO_SIDE_BY_SIDE _Pragma("GCC ivdep")
#else
#define PPAFO_SIDE_BY_SIDE
#endif

#if defined(PPAFO_ALIGNED)
/* Said by the file around this. */
#elif defined(__CUDA_ARCH__)
#define PPAFO_ALIGNED
#elif defined(__GNUC__)
#define PPAFO_ALIGNED __attribute__((aligned(64)))
#elif defined(_MSC_VER)
#define PPAFO_ALIGNED __declspec(align(64))
#else
#define PPAFO_ALIGNED
#endif

#if defined(PPAFO_ENTRY)
/* Said by the file around this. */
#elif defined(__cplusplus)
#define PPAFO_ENTRY extern "C"
#else
#define PPAFO_ENTRY extern
#endif

/* Numbers one after another, the last index running quickest. */
typedef struct {
    double *values;
    int64_t extent[3];
} ppafo_array;

/* The second where it is smaller, else the first: also where they are equal, or one is no number. */
PPAFO_INLINE double ppafo_smaller(double first, double second)
{
    return second < first ? second : first;
}

/* The second where it is larger, else the first. */
PPAFO_INLINE double ppafo_larger(double first, double second)
{
    return second > first ? second : first;
}

/* The whole part; the lowest integer for what has none or is beyond all of them, as processors of PCs have it. */
PPAFO_INLINE int64_t ppafo_whole_part(double value)
{
    return value >= -9223372036854775808.0 && value < 9223372036854775808.0 ? (int64_t)value : INT64_MIN;
}

PPAFO_INLINE int64_t ppafo_whole_size(int64_t value)
{
    return value < 0 ? (int64_t)(0 - (uint64_t)value) : value;
}

/* A product that wraps at 64 bits. */
PPAFO_INLINE int64_t ppafo_wrapped_product(int64_t left, int64_t right)
{
    return (int64_t)((uint64_t)left * (uint64_t)right);
}

/* The quotient rounded down, unlike that of C; 0 where the divisor is. */
PPAFO_INLINE int64_t ppafo_floor_quotient(int64_t left, int64_t right)
{
    if (right == 0 || right == -1) {
        return right == 0 ? 0 : (int64_t)(0 - (uint64_t)left);
    }
    return left / right - (left % right != 0 && (left % right < 0) != (right < 0) ? 1 : 0);
}

/* What a quotient rounded down leaves: of the divisor's sign, unlike that of C. */
PPAFO_INLINE int64_t ppafo_floor_remainder(int64_t left, int64_t right)
{
    if (right == 0 || right == -1) {
        return 0;
    }
    return left % right + (left % right != 0 && (left % right < 0) != (right < 0) ? right : 0);
}
