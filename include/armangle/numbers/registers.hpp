// Vector registers of this processor, in the compiler's own types. No other file asks which processor it runs
// on.
#pragma once

#include <cstdint>

#include "scalar.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#include "../names/begin.hpp"

namespace armangle {

#if defined(__AVX512F__)
inline constexpr int register_width = 8;
#elif defined(__AVX__)
inline constexpr int register_width = 4;
#else
inline constexpr int register_width = 2;
#endif

namespace detail {

/// W doubles in one register, and the result type of a comparison.
template <int W>
struct Vector {
    typedef double Values __attribute__((vector_size(8 * W)));
    typedef std::int64_t Mask __attribute__((vector_size(8 * W)));
};
using Values2 = Vector<2>::Values;
using Mask2 = Vector<2>::Mask;

#if defined(__x86_64__)
/// Square roots of the numbers of a register.
ARMANGLE_INLINE Values2 register_sqrt(Values2 x) noexcept { return _mm_sqrt_pd(x); }
/// Packs the Boolean values of a register into bits; the first value is the lowest bit.
ARMANGLE_INLINE unsigned register_bits(Mask2 mask) noexcept {
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
}
#elif defined(__aarch64__)
/// The square root of each lane.
ARMANGLE_INLINE Values2 register_sqrt(Values2 x) noexcept {
    return reinterpret_cast<Values2>(vsqrtq_f64(reinterpret_cast<float64x2_t>(x)));
}
#else
ARMANGLE_INLINE Values2 register_sqrt(Values2 x) noexcept {
    return Values2{std::sqrt(x[0]), std::sqrt(x[1])};
}
#endif
#if !defined(__x86_64__)
/// One bit for each lane of a mask.
ARMANGLE_INLINE unsigned register_bits(Mask2 mask) noexcept {
    return (mask[0] ? 1u : 0u) | (mask[1] ? 2u : 0u);
}
#endif

/// a b + c, in one instruction if the processor has one.
ARMANGLE_INLINE Values2 register_mul_add(Values2 a, Values2 b, Values2 c) noexcept {
#if defined(__x86_64__) && defined(__FMA__)
    return _mm_fmadd_pd(a, b, c);
#elif defined(__aarch64__)
    return reinterpret_cast<Values2>(vfmaq_f64(reinterpret_cast<float64x2_t>(c),
                                               reinterpret_cast<float64x2_t>(a),
                                               reinterpret_cast<float64x2_t>(b)));
#else
    return a * b + c;
#endif
}

#if defined(__AVX__)
using Values4 = Vector<4>::Values;
using Mask4 = Vector<4>::Mask;

/// The square root of each lane.
ARMANGLE_INLINE Values4 register_sqrt(Values4 x) noexcept { return _mm256_sqrt_pd(x); }
/// One bit for each lane of a mask.
ARMANGLE_INLINE unsigned register_bits(Mask4 mask) noexcept {
    return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
}
/// a b + c of each lane.
ARMANGLE_INLINE Values4 register_mul_add(Values4 a, Values4 b, Values4 c) noexcept {
#if defined(__FMA__)
    return _mm256_fmadd_pd(a, b, c);
#else
    return a * b + c;
#endif
}
#endif

#if defined(__AVX512F__)
using Values8 = Vector<8>::Values;
using Mask8 = Vector<8>::Mask;

// the plain form of the square root triggers -Wmaybe-uninitialized in g++ 12
/// The square root of each lane.
ARMANGLE_INLINE Values8 register_sqrt(Values8 x) noexcept { return _mm512_mask_sqrt_pd(x, 0xff, x); }
/// One bit for each lane of a mask.
ARMANGLE_INLINE unsigned register_bits(Mask8 mask) noexcept {
    return _cvtmask8_u32(_mm512_movepi64_mask(reinterpret_cast<__m512i>(mask)));
}
/// a b + c of each lane.
ARMANGLE_INLINE Values8 register_mul_add(Values8 a, Values8 b, Values8 c) noexcept {
    return _mm512_fmadd_pd(a, b, c);
}
#endif

/// Assembles values in registers. A load right after stores of single values would wait for all of them.
template <int W>
ARMANGLE_INLINE typename Vector<W>::Values assemble(const double* v) noexcept {
    using Values = typename Vector<W>::Values;
    if constexpr (W == 8) {
        return Values{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
    } else if constexpr (W == 4) {
        return Values{v[0], v[1], v[2], v[3]};
    } else {
        return Values{v[0], v[1]};
    }
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
