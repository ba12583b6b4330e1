// Lane<N> for nvcc, whose device code has no vector types: N doubles in an array. A device thread solves one
// pose on doubles. Lanes exist here only so that the functions that take them compile.
#pragma once

#if defined(__CUDACC__)

#include <bit>

#include "../scalar.hpp"

#include "../../names/begin.hpp"

namespace armangle {

inline constexpr int register_width = 2;

/// Result of a comparison of lanes: one bool per lane.
template <int N>
struct LaneMask {
    bool part[N];

    ARMANGLE_INLINE bool operator[](int i) const noexcept { return part[i]; }
};

/// N numbers that are added, multiplied and compared one by one.
template <int N>
struct Lane {
    double part[N];

    Lane() noexcept = default;
    ARMANGLE_INLINE Lane(double x) noexcept {
        for (double& r : part) r = x;
    }

    ARMANGLE_INLINE double operator[](int i) const noexcept { return part[i]; }
    /// Sets lane i to x.
    ARMANGLE_INLINE void set(int i, double x) noexcept { part[i] = x; }

    /// Reads N consecutive numbers.
    ARMANGLE_INLINE static Lane load(const double* from) noexcept {
        Lane out;
        for (int i = 0; i < N; ++i) out.part[i] = from[i];
        return out;
    }
    /// Builds a lane from values that were just computed one by one.
    ARMANGLE_INLINE static Lane of(const double (&values)[N]) noexcept { return load(values); }
    /// Writes N consecutive numbers.
    ARMANGLE_INLINE void store(double* to) const noexcept {
        for (int i = 0; i < N; ++i) to[i] = part[i];
    }

    // as in lane.hpp: every operator applies the same operator to each number
#define ARMANGLE_LANE_OPERATOR(Result, op)                                             \
    ARMANGLE_INLINE friend Result operator op(const Lane& a, const Lane& b) noexcept { \
        Result out;                                                                    \
        for (int i = 0; i < N; ++i) out.part[i] = a.part[i] op b.part[i];              \
        return out;                                                                    \
    }
    ARMANGLE_LANE_OPERATOR(Lane, +)
    ARMANGLE_LANE_OPERATOR(Lane, -)
    ARMANGLE_LANE_OPERATOR(Lane, *)
    ARMANGLE_LANE_OPERATOR(Lane, /)
    ARMANGLE_LANE_OPERATOR(LaneMask<N>, <)
    ARMANGLE_LANE_OPERATOR(LaneMask<N>, >)
    ARMANGLE_LANE_OPERATOR(LaneMask<N>, <=)
    ARMANGLE_LANE_OPERATOR(LaneMask<N>, >=)
    ARMANGLE_LANE_OPERATOR(LaneMask<N>, ==)
#undef ARMANGLE_LANE_OPERATOR

    ARMANGLE_INLINE friend Lane operator-(const Lane& a) noexcept {
        Lane out;
        for (int i = 0; i < N; ++i) out.part[i] = -a.part[i];
        return out;
    }
};

namespace detail {

/// f(i) of each lane.
template <template <int> class Result, int N, class F>
ARMANGLE_INLINE Result<N> each_lane(const F& f) noexcept {
    Result<N> out;
    for (int i = 0; i < N; ++i) out.part[i] = f(i);
    return out;
}

}  // namespace detail

template <int N>
ARMANGLE_INLINE LaneMask<N> operator&(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    return detail::each_lane<LaneMask, N>([&](int i) { return a.part[i] && b.part[i]; });
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator|(const LaneMask<N>& a, const LaneMask<N>& b) noexcept {
    return detail::each_lane<LaneMask, N>([&](int i) { return a.part[i] || b.part[i]; });
}

template <int N>
ARMANGLE_INLINE LaneMask<N> operator!(const LaneMask<N>& a) noexcept {
    return detail::each_lane<LaneMask, N>([&](int i) { return !a.part[i]; });
}

/// {x0, x1, x2, x3, x0, x1, x2, x3}
ARMANGLE_INLINE Lane<8> twice(const double (&x)[4]) noexcept {
    return detail::each_lane<Lane, 8>([&](int i) { return x[i % 4]; });
}

/// {x4, x5, x6, x7, x0, x1, x2, x3}
ARMANGLE_INLINE Lane<8> swap_halves(const Lane<8>& x) noexcept {
    return detail::each_lane<Lane, 8>([&](int i) { return x.part[(i + 4) % 8]; });
}

/// {x0, x1, x2, x3, y0, y1, y2, y3}
ARMANGLE_INLINE Lane<8> first_halves(const Lane<8>& x, const Lane<8>& y) noexcept {
    return detail::each_lane<Lane, 8>([&](int i) { return i < 4 ? x.part[i] : y.part[i - 4]; });
}

/// The mask as bits: bit i is lane i.
template <int N>
ARMANGLE_INLINE unsigned bits(const LaneMask<N>& mask) noexcept {
    unsigned out = 0;
    for (int i = 0; i < N; ++i) out |= static_cast<unsigned>(mask.part[i]) << i;
    return out;
}

/// For each lane, the value that the mask selects.
template <int N>
ARMANGLE_INLINE Lane<N> select(const LaneMask<N>& mask, const Lane<N>& yes, const Lane<N>& no) noexcept {
    return detail::each_lane<Lane, N>([&](int i) { return mask.part[i] ? yes.part[i] : no.part[i]; });
}

/// The square root of each lane.
template <int N>
ARMANGLE_INLINE Lane<N> sqrt(const Lane<N>& x) noexcept {
    return detail::each_lane<Lane, N>([&](int i) { return armangle::sqrt(x.part[i]); });
}

/// a b + c, rounded like mul_add of doubles.
template <int N>
ARMANGLE_INLINE Lane<N> mul_add(const Lane<N>& a, const Lane<N>& b, const Lane<N>& c) noexcept {
    return detail::each_lane<Lane, N>(
        [&](int i) { return armangle::mul_add(a.part[i], b.part[i], c.part[i]); });
}

/// The absolute value of each lane.
template <int N>
ARMANGLE_INLINE Lane<N> abs(const Lane<N>& x) noexcept {
    return detail::each_lane<Lane, N>([&](int i) { return armangle::abs(x.part[i]); });
}

/// In each lane, the magnitude of one number with the sign of the other.
template <int N>
ARMANGLE_INLINE Lane<N> copysign(const Lane<N>& magnitude, const Lane<N>& sign_of) noexcept {
    return detail::each_lane<Lane, N>(
        [&](int i) { return armangle::copysign(magnitude.part[i], sign_of.part[i]); });
}

}  // namespace armangle

#include "../../names/end.hpp"

#endif
