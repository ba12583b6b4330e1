// Joint functions theta_i(psi) on one circle and branch: coefficients, value, derivative, special values. Eq.
// (26)-(31), (33), (34).
#pragma once

#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// s sin(psi) + c cos(psi) + k
template <class T>
struct Harmonic {
    T s, c, k;

    /// The value of the function at psi.
    T at(const SinCos<T>& psi) const noexcept { return mul_add(s, psi.sin, mul_add(c, psi.cos, k)); }
    /// The derivative of the function at psi.
    T slope(const SinCos<T>& psi) const noexcept { return s * psi.cos - c * psi.sin; }
};

/// Joint 1, 3, 5 or 7: theta = atan2(g U, g V), eq. (26).
template <class T>
struct Pivot {
    Harmonic<T> U, V;
    T g;
};

/// Joint 2 or 6: cos(theta) = H, and g is the sign of theta, eq. (27).
template <class T>
struct Hinge {
    Harmonic<T> H;
    T g;
    struct Gap {
        T below_one, above_minus_one;  // 1 - x, 1 + x
    };
    Gap high, low;  // of max H and min H, computed without cancellation (theta near 0 or pi)
    T swing;        // |theta| varies by at most about twice this
};

/// Whether joint 2 or 6 does not depend on psi up to rounding. Rounding alone can move theta by some 1e-13
/// rad, which would block arcs at its limit.
inline bool is_constant(const Hinge<double>& h) noexcept { return h.swing <= tolerance::vanishing; }
/// Whether a pivot joint's direction vector does not depend on psi. A very short direction also counts as
/// constant.
template <class T>
ARMANGLE_INLINE auto is_constant(const Pivot<T>& p) noexcept {
    const auto &u = p.U, &v = p.V;
    const T moving = u.s * u.s + u.c * u.c + v.s * v.s + v.c * v.c, still = u.k * u.k + v.k * v.k;
    return moving <= min(T(tolerance::vanishing * tolerance::vanishing),
                         T(tolerance::angle * tolerance::angle) * still);
}

/// All six joints that move with psi: pivots 1, 3, 5, 7 and hinges 2, 6. theta_4 is independent of psi.
template <class T>
struct JointFunctions {
    Pivot<T> pivot[4];
    Hinge<T> hinge[2];
};

/// For each coefficient, the value that the mask selects.
template <class M, class T>
ARMANGLE_INLINE Harmonic<T> select(const M& mask, const Harmonic<T>& yes, const Harmonic<T>& no) noexcept {
    return {select(mask, yes.s, no.s), select(mask, yes.c, no.c), select(mask, yes.k, no.k)};
}

namespace detail {

/// The angle of joint 2 or 6 whose axis rotates around another axis at the angle `tilt`. `along` and `across`
/// are cosine and sine (>= 0) of the angle between that axis and the zero direction of theta. |theta| lies
/// between the difference and the sum of the two angles.
template <class T>
ARMANGLE_INLINE Hinge<T> hinge(const Harmonic<T>& H, const T& g, const SinCos<T>& tilt, const T& along,
                               const T& across) noexcept {
    const T one(1.0), sine = abs(tilt.sin);
    const T high = mul_add(along, tilt.cos, across * sine), low = mul_add(along, tilt.cos, -(across * sine));
    const T sine_high = mul_add(across, tilt.cos, -(along * sine)),
            sine_low = mul_add(across, tilt.cos, along * sine);
    const auto gap = [&one](const T& cosine, const T& s) {
        const T far = one + abs(cosine), near = s * s / far;
        const auto acute = T(0.0) < cosine;
        return typename Hinge<T>::Gap{select(acute, near, far), select(acute, far, near)};
    };
    return {H, g, gap(high, sine_high), gap(low, sine_low), min(sine, across)};
}

}  // namespace detail

/// Computes all joint functions of a self-motion, from eq. (16), (21) in triad coordinates. If shoulder or
/// wrist is singular at every psi, theta_1 (theta_5) is 0 and theta_3 (theta_7) has the form that the inverse
/// uses there.
template <class T>
ARMANGLE_INLINE JointFunctions<T> joint_functions(const SelfMotion<T>& m) noexcept {
    const Circle<T>& c = m.circle;
    const Elbow<T>& elbow = m.elbow;
    const Configuration<T>& gc = m.gc;
    const T sb = elbow.beta.sin, cb = elbow.beta.cos, sg = elbow.gamma.sin, cg = elbow.gamma.cos;
    const T zero(0.0), one(1.0);
    const Harmonic<T> nought{zero, zero, zero}, unity{zero, zero, one};
    // If S-W leans out of the plane across axis 4, w ct - (z cos + e sin) st replaces w, and
    // z_3 = (z cos + e sin) ct + w st.
    const bool tilted = elbow.tilted;
    const T st = elbow.tilt.sin, ct = elbow.tilt.cos;
    const auto leant = [&](const Harmonic<T>& a, const T& e, const T& z, const T& factor) {
        return Harmonic<T>{a.s - e * st * factor, a.c - z * st * factor, a.k * ct};
    };
    // columns of 0R3: y_3 = w cb - f sb, x_3 = w sb + f cb, with f = e cos - z sin; z_3 = z cos + e sin
    const auto y3 = [&](const T& w, const T& e, const T& z) {
        const Harmonic<T> plain{z * sb, -(e * sb), w * cb};
        return tilted ? leant(plain, e, z, cb) : plain;
    };
    const auto x3 = [&](const T& w, const T& e, const T& z) {
        const Harmonic<T> plain{-(z * cb), e * cb, w * sb};
        return tilted ? leant(plain, e, z, sb) : plain;
    };
    const auto z3 = [&](const T& w, const T& e, const T& z) {
        return tilted ? Harmonic<T>{e * ct, z * ct, w * st} : Harmonic<T>{e, z, zero};
    };
    const auto negative = [](const Harmonic<T>& a) { return Harmonic<T>{-a.s, -a.c, -a.k}; };
    // rows of 4R7: x_4 = w sg + f cg, y_4 = -z_3, z_4 = w cg - f sg, each times a tool axis
    const auto x4 = [&](const T& w, const T& e, const T& z) {
        const Harmonic<T> plain{-(z * cg), e * cg, w * sg};
        return tilted ? leant(plain, e, z, sg) : plain;
    };
    const auto z4 = [&](const T& w, const T& e, const T& z) {
        const Harmonic<T> plain{z * sg, -(e * sg), w * cg};
        return tilted ? leant(plain, e, z, cg) : plain;
    };
    const auto &w = c.w, &e = c.e, &z = c.z, &tw = c.tool_w, &te = c.tool_e, &tz = c.tool_z;
    JointFunctions<T> j;
    j.pivot[0] = {y3(w.y, e.y, z.y), y3(w.x, e.x, z.x), gc.shoulder};
    j.hinge[0] = detail::hinge(y3(w.z, e.z, z.z), gc.shoulder, lean(elbow, elbow.beta), w.z, hypot(w.x, w.y));
    j.pivot[1] = {negative(z3(w.z, e.z, z.z)), negative(x3(w.z, e.z, z.z)), gc.shoulder};
    j.pivot[2] = {negative(z3(tw.z, te.z, tz.z)), x4(tw.z, te.z, tz.z), gc.wrist};
    j.hinge[1] =
        detail::hinge(z4(tw.z, te.z, tz.z), gc.wrist, lean(elbow, elbow.gamma), tw.z, hypot(te.z, tz.z));
    j.pivot[3] = {z4(tw.y, te.y, tz.y), negative(z4(tw.x, te.x, tz.x)), gc.wrist};
    const auto lost = [&one](const auto& mask, Pivot<T>& p, const Harmonic<T>& U, const Harmonic<T>& V) {
        p = {select(mask, U, p.U), select(mask, V, p.V), select(mask, one, p.g)};
    };
    const auto lost_1 = shoulder_singular(m);
    if (any(lost_1)) {
        lost(lost_1, j.pivot[0], nought, unity);
        lost(lost_1, j.pivot[1], x3(w.y, e.y, z.y), negative(z3(w.y, e.y, z.y)));
    }
    const auto lost_5 = wrist_singular(m);
    if (any(lost_5)) {
        lost(lost_5, j.pivot[2], nought, unity);
        lost(lost_5, j.pivot[3], negative(z3(tw.x, te.x, tz.x)), negative(z3(tw.y, te.y, tz.y)));
    }
    return j;
}

/// The numerator of dtheta/dpsi of a pivot joint, eq. (29), without the paper's GC (GC^2 = 1).
template <class T>
ARMANGLE_INLINE Harmonic<T> slope_numerator(const Pivot<T>& p) noexcept {
    const auto &u = p.U, &v = p.V;
    return {v.k * -u.c + u.k * v.c, v.k * u.s - u.k * v.s, v.c * u.s - u.c * v.s};
}

/// The derivative dtheta/dpsi of a pivot joint, eq. (28); infinite if its direction (V, U) vanishes.
inline double derivative(const Pivot<double>& p, const SinCos<double>& psi) noexcept {
    const double u = p.U.at(psi), v = p.V.at(psi), size = u * u + v * v;
    if (size <= tolerance::singular * tolerance::singular) return infinity;
    return (v * p.U.slope(psi) - u * p.V.slope(psi)) / size;
}

/// The derivative dtheta/dpsi of joint 2 or 6, eq. (33). |sin(theta)| is the length hypot(U, V) of the
/// direction of joint 1 (5), given as `pivot`. Infinite if theta is 0 or pi, unless theta is constant.
inline double derivative(const Hinge<double>& h, const Pivot<double>& pivot,
                         const SinCos<double>& psi) noexcept {
    const double slope = h.H.slope(psi);
    if (is_constant(h)) return 0.0;
    const double sine = hypot(pivot.U.at(psi), pivot.V.at(psi));
    if (sine <= tolerance::singular) return infinity;
    return -slope / (h.g * sine);
}

/// The derivatives dq/dpsi (rad/rad) of all joints along the self-motion, infinite where they do not exist;
/// joint 4 does not move.
inline Joints rate(const Arm& arm, const JointFunctions<double>& f, const SinCos<double>& psi) noexcept {
    const double slope[joints] = {derivative(f.pivot[0], psi), derivative(f.hinge[0], f.pivot[0], psi),
                                  derivative(f.pivot[1], psi), 0.0,
                                  derivative(f.pivot[2], psi), derivative(f.hinge[1], f.pivot[2], psi),
                                  derivative(f.pivot[3], psi)};
    Joints out{};
    for (int i = 0; i < joints; ++i) out.q[i] = arm.sign[i] * slope[i];
    return out;
}

/// The roots (rad) of s sin + c cos + k = 0 on the circle. The two-root form also works at psi = pi and for
/// zero coefficients.
struct Roots {
    int count;
    double psi[2];
};

/// Whether a harmonic of amplitude h has roots; false for a constant one.
template <class T>
ARMANGLE_INLINE auto has_roots(const Harmonic<T>& f, const T& h) noexcept {
    const T off = abs(f.k);
    return !((h <= T(tolerance::singular) * off) | (h == T(0.0)) | (off > h));
}

/// Half the angle (rad) between both roots of a harmonic of amplitude h that has_roots(), measured from its
/// maximum at atan2(s, c).
template <class T>
ARMANGLE_INLINE T half_between_roots(const Harmonic<T>& f, const T& h) noexcept {
    return atan2(sqrt((h - f.k) * (h + f.k)), -f.k);
}

/// Computes the roots of a harmonic; count is 0, 1 or 2.
inline Roots roots(const Harmonic<double>& f) noexcept {
    const double h = hypot(f.s, f.c);
    if (!has_roots(f, h)) return {0, {}};
    const double middle = atan2(f.s, f.c), half = half_between_roots(f, h);
    if (half == 0 || half == pi) return {1, {wrap(middle + half), 0}};
    return {2, {wrap(middle - half), wrap(middle + half)}};
}

/// The paper's cases of a joint function, sections 5.1.1-5.1.3 and 5.2, and the constant case that it omits.
enum class Case : int { stationary, monotonic, singular, constant };

/// Special values of one joint function.
struct Profile {
    Case kind;
    Roots stationary;  // dtheta/dpsi = 0
    Roots singular;    // theta jumps by pi (pivot), or touches 0 or pi with a corner (hinge)
};

/// Special values of a pivot joint: eq. (30) without its zero denominators. The cases are a_t^2 + b_t^2 -
/// c_t^2 > 0, < 0 or = 0.
inline Profile profile(const Pivot<double>& p) noexcept {
    const Harmonic<double> n = slope_numerator(p);
    const double size = n.s * n.s + n.c * n.c + n.k * n.k, discriminant = n.s * n.s + n.c * n.c - n.k * n.k;
    if (is_constant(p)) return {Case::constant, {0, {}}, {0, {}}};
    if (discriminant > tolerance::vanishing * size) return {Case::stationary, roots(n), {0, {}}};
    if (discriminant < -tolerance::vanishing * size) return {Case::monotonic, {0, {}}, {0, {}}};
    return {Case::singular, {0, {}}, {1, {wrap(atan2(n.s, n.c) + (n.k > 0 ? pi : 0.0)), 0}}};  // eq. (31)
}

/// Special values of joint 2 or 6, eq. (34) with two roots; H is largest at atan2(s, c) and smallest
/// opposite.
inline Profile profile(const Hinge<double>& h) noexcept {
    const double top = atan2(h.H.s, h.H.c);
    if (is_constant(h)) return {Case::constant, {0, {}}, {0, {}}};
    Profile out{Case::stationary, {0, {}}, {0, {}}};
    const auto put = [&](double psi, double gap) {
        Roots& to = gap <= tolerance::vanishing ? out.singular : out.stationary;
        to.psi[to.count++] = wrap(psi);
    };
    put(top, h.high.below_one);
    put(top + pi, h.low.above_minus_one);
    if (out.singular.count) out.kind = Case::singular;
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
