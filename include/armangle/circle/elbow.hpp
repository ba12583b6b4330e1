// The elbow: theta_4 and the triangle shoulder-elbow-wrist from the wrist's distance. Eq. (4), (6).
#pragma once

#include "../arm/joint_map.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The triangle S-E-W, independent of GC: eta and kappa are in [0, pi].
template <class T>
struct Triangle {
    T excess;         // m beyond the reach or inside the inner reach; <= 0 if the wrist is reachable
    double rounding;  // m: a smaller excess is rounding
    SinCos<T> eta;    // bend of the elbow: theta_4 - delta = GC_4 eta
    SinCos<T> kappa;  // angle at the shoulder between S-E and S-W
};

/// Returns 0 if a gap is at most `rounding`, else the given value.
template <class T>
ARMANGLE_INLINE T cut_off(const T& gap, const T& rounding, const T& value) noexcept {
    return select(gap <= rounding, T(0.0), value);
}

/// Computes the triangle of a wrist n = |S-W| (m) from the shoulder. Out of reach it is that of the nearer
/// end of the reach, with its `excess`. Half-angle forms give bend and shoulder angle; unlike acos of eq. (4)
/// they are exact also when stretched or folded. A gap d_4 along axis 4 changes the reach alone: |S-W|^2 =
/// d_4^2 + (length across axis 4)^2. Each direction is normalized by its own length, so the frames remain
/// rotations whatever the rounding of n.
template <class T>
ARMANGLE_INLINE Triangle<T> triangle(const Arm& arm, T n) noexcept {
    const double L = arm.reach, D = arm.inner_reach, La = arm.upper_arm, Lb = arm.forearm;
    const T zero(0.0), one(1.0), rounding(tolerance::stretched * L);
    const T s2 = cut_off(L - n, rounding, (L - n) * (L + n));  // 4 La Lb sin^2(eta/2)
    const T c2 = cut_off(n - D, rounding, (n - D) * (n + D));  // 4 La Lb cos^2(eta/2)
    const T scale = one / (s2 + c2);
    Triangle<T> t;
    t.excess = max(n - L, D - n);
    t.rounding = tolerance::reach * arm.size;
    t.eta = {2.0 * sqrt(s2 * c2) * scale, (c2 - s2) * scale};
    const T x = (La - Lb) + 2.0 * Lb * (c2 * scale), y = Lb * t.eta.sin;
    const T side = hypot(x, y);
    const auto shut = side == zero;
    const T inverse_side = one / select(shut, one, side);
    t.kappa = {y * inverse_side, select(shut, one, x * inverse_side)};
    return t;
}

/// The elbow on the side given by GC_4 (+1 or -1).
template <class T>
struct Elbow {
    SinCos<T> theta_4;
    SinCos<T> beta;   // direction of S-W in the x-y plane of frame 3, from its y axis
    SinCos<T> gamma;  // the same in frame 4: beta + theta_4
    SinCos<T> tilt;   // of S-W against that plane, sin = d_4 / |S-W|
    bool tilted;      // whether d_4 is not 0
};

/// The angle between S-W and the y axis of frame 3 (frame 4), where beta (gamma) is its direction in the
/// plane across axis 4. The sine is >= 0 if S-W leans out of that plane.
template <class T>
ARMANGLE_INLINE SinCos<T> lean(const Elbow<T>& elbow, const SinCos<T>& in_plane) noexcept {
    if (!elbow.tilted) return in_plane;
    return {hypot(in_plane.sin, in_plane.cos * elbow.tilt.sin), in_plane.cos * elbow.tilt.cos};
}

/// The angle between S-W and the plane across axis 4 (sine and cosine): its sine is d_4 / |S-W|.
template <class T>
ARMANGLE_INLINE SinCos<T> tilt(const Arm& arm, const Triangle<T>& t) noexcept {
    if (arm.d_4 == 0) return {T(0.0), T(1.0)};
    const T side = hypot(arm.upper_arm + arm.forearm * t.eta.cos, arm.forearm * t.eta.sin);
    const T inverse_length = T(1.0) / hypot(side, T(arm.d_4));
    return {arm.d_4 * inverse_length, side * inverse_length};
}

/// Computes the elbow of a triangle for GC_4 (1 or -1), in one expression. A struct filled in two steps is
/// copied in registers wider than its stores and waits for them (7 % of a step, benchmarks/run_cpp.py).
template <class T>
ARMANGLE_INLINE Elbow<T> elbow(const Arm& arm, const Triangle<T>& t, T gc_4) noexcept {
    // mul_add and not a * b + c * d: g++ 12 fuses such pairs of sum and difference despite -ffp-contract=off
    const auto sum = [](const SinCos<double>& fixed, const T& s, const T& c) {
        return SinCos<T>{mul_add(T(fixed.sin), c, fixed.cos * s), mul_add(T(fixed.cos), c, -(fixed.sin * s))};
    };
    const T sin_lower =
        mul_add(t.eta.sin, t.kappa.cos, -(t.eta.cos * t.kappa.sin));  // of eta - kappa, at the wrist
    const T cos_lower = mul_add(t.eta.cos, t.kappa.cos, t.eta.sin * t.kappa.sin);
    return {sum(arm.delta, gc_4 * t.eta.sin, t.eta.cos),
            sum(arm.shoulder_slant, -(gc_4 * t.kappa.sin), t.kappa.cos),
            sum(arm.wrist_slant, gc_4 * sin_lower, cos_lower), tilt(arm, t), arm.d_4 != 0};
}

namespace detail {

/// The bend of the elbow (rad): theta_4 - delta of a joint value, wrapped to (-pi, pi]; 0 for the stretched
/// arm.
inline double elbow_bend(const Arm& arm, double q_4) noexcept { return bend(arm, 3, q_4); }

/// The distance |S-W| (m) from shoulder to wrist for a bend of the elbow (rad).
inline double wrist_distance(const Arm& arm, double bend) noexcept {
    const double half = sin_cos(0.5 * bend).sin;
    return sqrt(max(arm.reach * arm.reach - 4.0 * arm.upper_arm * arm.forearm * half * half, 0.0));
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
