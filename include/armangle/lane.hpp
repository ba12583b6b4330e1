// Lane<N>: N doubles that take every operation together, in the compiler's own vector types.
//
// Each operation is per lane the same IEEE operation as on a double, so a lane's result does not depend on its
// neighbours, and equals the result of the scalar formula bit for bit (compiled without contraction).
#pragma once

#include <cstdint>

#include "scalar.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace armangle {

#if defined(__AVX512F__)
inline constexpr int register_width = 8;
#elif defined(__AVX__)
inline constexpr int register_width = 4;
#else
inline constexpr int register_width = 2;
#endif

namespace detail {

typedef double Register __attribute__((vector_size(8 * register_width)));
typedef std::int64_t RegisterMask __attribute__((vector_size(8 * register_width)));

ARMANGLE_INLINE Register register_sqrt(Register x) noexcept {
#if defined(__AVX512F__)
    return _mm512_mask_sqrt_pd(x, 0xff, x);  // the plain form trips -Wmaybe-uninitialized in g++ 12
#elif defined(__AVX__)
    return _mm256_sqrt_pd(x);
#elif defined(__x86_64__)
    return _mm_sqrt_pd(x);
#elif defined(__aarch64__)
    return (Register)vsqrtq_f64((float64x2_t)x);
#else
    return Register{std::sqrt(x[0]), std::sqrt(x[1])};
#endif
}

ARMANGLE_INLINE Register register_mul_add(Register a, Register b, Register c) noexcept {
#if defined(__AVX512F__)
    return _mm512_fmadd_pd(a, b, c);
#elif defined(__AVX__) && defined(__FMA__)
    return _mm256_fmadd_pd(a, b, c);
#elif defined(__FMA__)
    return _mm_fmadd_pd(a, b, c);
#elif defined(__aarch64__)
    return (Register)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b);
#else
    return a * b + c;
#endif
}

ARMANGLE_INLINE Register broadcast(double x) noexcept { return x - Register{}; }

/// One bit a lane.
ARMANGLE_INLINE unsigned register_bits(RegisterMask mask) noexcept {
#if defined(__AVX512F__)
    return _cvtmask8_u32(_mm512_movepi64_mask((__m512i)mask));
#elif defined(__AVX__)
    return static_cast<unsigned>(_mm256_movemask_pd((__m256d)mask));
#elif defined(__x86_64__)
    return static_cast<unsigned>(_mm_movemask_pd((__m128d)mask));
#else
    return (mask[0] ? 1u : 0u) | (mask[1] ? 2u : 0u);
#endif
}

/// Values put together in registers: a load right behind the stores of single values would wait for all of them.
ARMANGLE_INLINE Register assemble(const double* v) noexcept {
#if defined(__AVX512F__)
    return Register{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
#elif defined(__AVX__)
    return Register{v[0], v[1], v[2], v[3]};
#else
    return Register{v[0], v[1]};
#endif
}

}  // namespace detail

template <int N>
struct Lane;

template <int N>
struct LaneMask {
    static constexpr int registers = N / register_width;
    detail::RegisterMask part[registers];

    bool operator[](int i) const noexcept { return part[i / register_width][i % register_width] != 0; }
};

template <int N>
struct Lane {
    static_assert(N % register_width == 0, "a Lane is a whole number of registers");
    static constexpr int registers = N / register_width;
    detail::Register part[registers];

    Lane() noexcept = default;
    Lane(double x) noexcept {
        for (auto& r : part) r = detail::broadcast(x);
    }

    double operator[](int i) const noexcept { return part[i / register_width][i % register_width]; }
    void set(int i, double x) noexcept { part[i / register_width][i % register_width] = x; }

    static Lane load(const double* from) noexcept {
        Lane out;
        __builtin_memcpy(out.part, from, sizeof(out.part));
        return out;
    }
    /// Of values that were just computed one by one.
    ARMANGLE_INLINE static Lane of(const double (&values)[N]) noexcept {
        Lane out;
        for (int i = 0; i < registers; ++i) out.part[i] = detail::assemble(values + i * register_width);
        return out;
    }
    void store(double* to) const noexcept { __builtin_memcpy(to, part, sizeof(part)); }

    // `#define` and not twenty hand-written bodies: every operator is "for each register, the same operator".
#define ARMANGLE_LANE_ARITHMETIC(op)                                             \
    ARMANGLE_INLINE friend Lane operator op(const Lane& a, const Lane& b) noexcept {             \
        Lane out;                                                                \
        for (int i = 0; i < registers; ++i) out.part[i] = a.part[i] op b.part[i]; \
        return out;                                                              \
    }
    ARMANGLE_LANE_ARITHMETIC(+)
    ARMANGLE_LANE_ARITHMETIC(-)
    ARMANGLE_LANE_ARITHMETIC(*)
    ARMANGLE_LANE_ARITHMETIC(/)
#undef ARMANGLE_LANE_ARITHMETIC

#define ARMANGLE_LANE_COMPARISON(op)                                             \
    ARMANGLE_INLINE friend LaneMask<N> operator op(const Lane& a, const Lane& b) noexcept {      \
        LaneMask<N> out;                                                         \
        for (int i = 0; i < registers; ++i) out.part[i] = a.part[i] op b.part[i]; \
        return out;                                                              \
    }
    ARMANGLE_LANE_COMPARISON(<)
    ARMANGLE_LANE_COMPARISON(>)
    ARMANGLE_LANE_COMPARISON(<=)
    ARMANGLE_LANE_COMPARISON(>=)
    ARMANGLE_LANE_COMPARISON(==)
#undef ARMANGLE_LANE_COMPARISON

    ARMANGLE_INLINE friend Lane operator-(const Lane& a) noexcept {
        Lane out;
        for (int i = 0; i < registers; ++i) out.part[i] = -a.part[i];
        return out;
    }
};

template <int N>
ARMANGLE_INLINE LaneMask<N> operator&(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = a.part[i] & b.part[i];
    return out;
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator|(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = a.part[i] | b.part[i];
    return out;
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator!(const LaneMask<N>& a) noexcept {
    LaneMask<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = ~a.part[i];
    return out;
}

/// {x0, x1, x2, x3, x0, x1, x2, x3}
ARMANGLE_INLINE Lane<8> twice(const double (&x)[4]) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    out.part[0] = _mm512_broadcast_f64x4(_mm256_set_pd(x[3], x[2], x[1], x[0]));
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i) out.part[i] = out.part[half + i] = detail::assemble(x + i * register_width);
#endif
    return out;
}

/// {x4, x5, x6, x7, x0, x1, x2, x3}
ARMANGLE_INLINE Lane<8> swap_halves(const Lane<8>& x) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    out.part[0] = _mm512_shuffle_f64x2(x.part[0], x.part[0], 0x4e);
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i) out.part[i] = x.part[half + i], out.part[half + i] = x.part[i];
#endif
    return out;
}

/// {x0, x1, x2, x3, y0, y1, y2, y3}
ARMANGLE_INLINE Lane<8> first_halves(const Lane<8>& x, const Lane<8>& y) noexcept {
    Lane<8> out;
#if defined(__AVX512F__)
    out.part[0] = _mm512_insertf64x4(x.part[0], _mm512_castpd512_pd256(y.part[0]), 1);
#else
    constexpr int half = Lane<8>::registers / 2;
    for (int i = 0; i < half; ++i) out.part[i] = x.part[i], out.part[half + i] = y.part[i];
#endif
    return out;
}

/// Bit i is lane i.
template <int N>
ARMANGLE_INLINE unsigned bits(const LaneMask<N>& mask) noexcept {
    unsigned out = 0;
    for (int i = 0; i < mask.registers; ++i) out |= detail::register_bits(mask.part[i]) << (i * register_width);
    return out;
}

template <int N>
ARMANGLE_INLINE bool any(const LaneMask<N>& mask) noexcept { return bits(mask) != 0; }

template <int N>
ARMANGLE_INLINE bool all(const LaneMask<N>& mask) noexcept { return !any(!mask); }

template <int N>
ARMANGLE_INLINE Lane<N> select(const LaneMask<N>& mask, const Lane<N>& yes, const Lane<N>& no) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = mask.part[i] ? yes.part[i] : no.part[i];
    return out;
}

/// The least of eight.
ARMANGLE_INLINE double least(const Lane<8>& x) noexcept {
    const Lane<8> four = min(x, swap_halves(x));
    const double a = four[0], b = four[1], c = four[2], d = four[3];
    return min(min(a, b), min(c, d));
}

template <int N>
ARMANGLE_INLINE Lane<N> sqrt(const Lane<N>& x) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = detail::register_sqrt(x.part[i]);
    return out;
}

template <int N>
ARMANGLE_INLINE Lane<N> mul_add(const Lane<N>& a, const Lane<N>& b, const Lane<N>& c) noexcept {
    Lane<N> out;
    for (int i = 0; i < out.registers; ++i) out.part[i] = detail::register_mul_add(a.part[i], b.part[i], c.part[i]);
    return out;
}

template <int N>
ARMANGLE_INLINE Lane<N> abs(const Lane<N>& x) noexcept {
    Lane<N> out;
    const detail::RegisterMask sign = detail::RegisterMask{} + INT64_MIN;
    for (int i = 0; i < out.registers; ++i) out.part[i] = (detail::Register)((detail::RegisterMask)x.part[i] & ~sign);
    return out;
}

template <int N>
ARMANGLE_INLINE Lane<N> copysign(const Lane<N>& magnitude, const Lane<N>& sign_of) noexcept {
    Lane<N> out;
    const detail::RegisterMask sign = detail::RegisterMask{} + INT64_MIN;
    for (int i = 0; i < out.registers; ++i)
        out.part[i] = (detail::Register)(((detail::RegisterMask)magnitude.part[i] & ~sign) |
                                         ((detail::RegisterMask)sign_of.part[i] & sign));
    return out;
}

}  // namespace armangle
