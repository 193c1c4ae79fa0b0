/* FASTEST: compile a function twice, for processors with AVX2 and for all others; the processor
   that runs it chooses. A header of the C library comes first, as it says that this is glibc. */
#include <stdlib.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__GLIBC__)
#define FASTEST __attribute__((target_clones("avx2", "default")))
#else
#define FASTEST
#endif
