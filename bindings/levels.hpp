// The instruction sets of this processor and its operating system. Compiled for the most basic one.
//
// Uses cpuid directly instead of __builtin_cpu_supports, which needs a symbol that some compilers' libraries
// lack.
#pragma once

#include <cstring>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace binding {

#if defined(__x86_64__)

struct Levels {
    bool v3 = false, v4 = false;  // of the x86-64 ABI: x86-64-v3 and -v4
};

/// Whether all wanted bits are set.
constexpr bool has(unsigned flags, unsigned wanted) noexcept { return (flags & wanted) == wanted; }

/// The register state that the operating system saves (XCR0).
inline unsigned saved_state() noexcept {
    unsigned low, high;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

/// Which x86-64 levels processor and operating system support.
inline Levels levels() noexcept {
    constexpr unsigned ymm = 0x6, zmm = 0xe6;
    constexpr unsigned in_leaf_1 =
        bit_OSXSAVE | bit_AVX | bit_FMA | bit_F16C | bit_MOVBE | bit_SSE4_2 | bit_POPCNT;
    constexpr unsigned in_leaf_7 = bit_AVX2 | bit_BMI | bit_BMI2;
    constexpr unsigned of_v4 = bit_AVX512F | bit_AVX512DQ | bit_AVX512CD | bit_AVX512BW | bit_AVX512VL;
    unsigned a, b, c, d;
    Levels out;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !has(c, in_leaf_1) || !has(saved_state(), ymm)) return out;
    if (!__get_cpuid(0x80000001u, &a, &b, &c, &d) || !has(c, bit_LZCNT)) return out;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return out;
    out.v3 = has(b, in_leaf_7);
    out.v4 = out.v3 && has(b, of_v4) && has(saved_state(), zmm);
    return out;
}

/// Whether the processor supports a level, such as "avx2".
inline bool supports(const char* level) noexcept {
    const auto is = [level](const char* name) { return std::strcmp(level, name) == 0; };
    return is("sse2") || (is("avx2") && levels().v3) || (is("avx512") && levels().v4);
}

#else

/// Whether the processor supports a level: only "base" is known here.
inline bool supports(const char* level) noexcept { return std::strcmp(level, "base") == 0; }

#endif

}  // namespace binding
