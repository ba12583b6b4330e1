// Self-motion parametrized by a joint: the angle of a leading joint is given, and the arm angle follows.
//
//          axis 1                            y_3  direction of the upper arm
//            |  . ' theta_1 = const          At theta_2 = 0 the upper arm points along axis 1 and theta_1
//     -------o------- y_3 over psi           is free: theta_1(psi) jumps by half a turn there, and
//        . ' |                               psi(theta_1) is smooth, with theta_2 of either sign.
//
// Near theta_2 = 0 (theta_6 = 0) joint 1 or 3 (5 or 7) leads, and the two branches that meet there form one
// sheet. If a joint is locked, it leads. The arm angle is a root of U cos - V sin = 0 (pivot) or H - cos = 0
// (hinge), which are harmonics of psi: eq. (26), (27).
#pragma once

#include <initializer_list>
#include <type_traits>

#include "joint_function.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The harmonic in psi that vanishes where a joint (1..7, but 4) has the angle theta (sine and cosine). For
/// joints 1, 3, 5 and 7 it also vanishes where the joint has theta + pi.
template <class T>
Harmonic<T> joint_condition(const JointFunctions<T>& f, int joint, const SinCos<T>& theta) noexcept {
    if (joint % 2 == 0) {
        Harmonic<T> out = f.hinge[joint / 4].H;
        out.k = out.k - theta.cos;
        return out;
    }
    const Pivot<T>& p = f.pivot[joint / 2];
    return {p.U.s * theta.cos - p.V.s * theta.sin, p.U.c * theta.cos - p.V.c * theta.sin,
            p.U.k * theta.cos - p.V.k * theta.sin};
}

/// An arm angle that follows from a prescribed joint angle. `slope_square` is the squared slope of the
/// equation there; near 0 the joint does not determine psi.
template <class T>
struct PsiFromJoint {
    SinCos<T> psi;
    T slope_square;
};

/// Solves the harmonic equation f = 0 for the root where f falls (side 1) or rises (side -1) with psi. A
/// double without a root gives the psi at which |f| is least.
template <class T>
PsiFromJoint<T> psi_from_joint(const Harmonic<T>& f, const T& side) noexcept {
    const T square = f.s * f.s + f.c * f.c;
    T room = square - f.k * f.k;
    if constexpr (std::is_same_v<T, double>) room = max(room, 0.0);
    const T root = side * sqrt(room), inverse = T(1.0) / square;
    return {{(f.c * root - f.s * f.k) * inverse, -(f.s * root + f.c * f.k) * inverse}, room};
}

/// The neighbour (0: joint 2, 1: joint 6) of a prescribed joint 1, 3, 5 or 7, whose sign follows from that
/// joint; -1 if joint 2 or 6, or no joint, is prescribed.
constexpr int hinge_crossed_by(int joint) noexcept { return joint % 2 == 1 ? joint / 4 : -1; }

/// The directions of all joints at psi if `joint` has the prescribed angle theta. If joint 1 or 3 (5 or 7) is
/// prescribed, the sign of theta_2 (theta_6) results. If joint 3 (7) is prescribed, joint 1 (5) follows from
/// it.
template <class T>
Directions<T> directions_with_joint(const SelfMotion<T>& m, const SinCos<T>& psi, int joint,
                                    const SinCos<T>& theta) noexcept {
    Directions<T> d = directions(m, psi);
    const Frames<T> f = frames(m, psi);
    const T s = theta.sin, c = theta.cos;
    if (joint == 1 || joint == 3) {
        const SinCos<T> one =
            joint == 1 ? theta : SinCos<T>{f.z3.x * c - f.x3.x * s, f.x3.y * s - f.z3.y * c};
        put_shoulder(f, one, f.y3.x * one.cos + f.y3.y * one.sin, d);
    }
    if (joint == 5 || joint == 7) {
        const SinCos<T> five =
            joint == 5 ? theta : SinCos<T>{-(f.n1.x * s + f.n1.y * c), f.n2.x * s + f.n2.y * c};
        put_wrist(f, five, f.n1.z * five.cos + f.n2.z * five.sin, d);
    }
    return d;
}

/// Whether the joints before and behind joint 2 or 6 (`hinge`: index 1 or 5) rotate around one axis, since
/// its |sin(theta)| is at most `sine`.
inline bool makes_one_axis(const Directions<double>& d, int hinge,
                           double sine = tolerance::one_axis) noexcept {
    return abs(d.y[hinge]) <= sine * hypot(d.x[hinge], d.y[hinge]);
}

/// If theta_2 (theta_6) is 0 or pi, replaces the directions of its neighbours in d: joint 1 (5) keeps its
/// value in `near` and joint 3 (7) follows, unless one of them is the prescribed joint `lead` (1..7; 0:
/// none). The arm angle determines only the sum of their rotations. A |sin| up to `sine` counts as 0.
inline void keep_shares(const Arm& arm, const SelfMotion<double>& m, const SinCos<double>& psi, int lead,
                        const double* near, Directions<double>& d,
                        double sine = tolerance::one_axis) noexcept {
    for (const int joint : {1, 5}) {
        if (joint / 4 == hinge_crossed_by(lead) || !makes_one_axis(d, joint, sine)) continue;
        const SinCos<double> theta = sin_cos(to_theta(arm, joint - 1, near[joint - 1]));
        const Directions<double> led = directions_with_joint(m, psi, joint, theta);
        for (int j = joint - 1; j <= joint + 1; ++j) {
            d.x[j] = led.x[j];
            d.y[j] = led.y[j];
        }
    }
}

}  // namespace armangle

#include "../names/end.hpp"
