// How near a posture is to a second one of the same psi and branch.
//
// The postures of a psi on the two sides of theta_2 = 0 meet where the seven equations' Jacobian vanishes. On
// the nominal arm that is at theta_2 = 0 itself, and the second posture is the mirrored one, of the other
// branch. On the true arm its determinant is that of the nominal one times 1 - a / sin theta_2, up to
// squares of the deviation: the postures meet at the sine a, and the second one has the sine 2 a - sin
// theta_2. It is of the same branch where that has the same sign, so where a / sin theta_2 is above one half.
// theta_4 - delta and theta_6 are alike.
//
//     ---|-----------|-----------|---> sin theta_2
//        0           a          2 a
//        second posture, posture   <- one half and above: both of one branch
//
// Beside theta_2 = 0 joints 1 and 3 turn about one axis. While they share a turn p the hand hardly moves, and
// a = b + c cos 2 (p - p_0): up to four postures of a psi are on that circle, and one of the branch alone
// where sin theta_2 > 2 (b + c). So it is with joints 5 and 7.
#pragma once

#include <initializer_list>

#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the distance from a second posture of the same psi.
struct MeetingShareTuning {
    /// Of one half, less what squares of the deviation add: a posture is the only one of its psi and branch.
    static constexpr double alone = 0.4;
};

namespace detail {

/// How near a posture is to a second one, as the share a / sin theta_2, where a is the sine at which both
/// meet: of joints 1-4, of joints 5-7 (theta_6), and of all joints, from determinants of the true chain and
/// the nominal arm.
template <class T>
struct MeetingShare {
    T of_rest, of_turn, of_all;

    /// Computes the shares at a posture with these angles.
    MeetingShare(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                 const SinCos<T>* angle) noexcept {
        const Arm& nominal = arm.nominal;
        const double La = nominal.upper_arm, Lb = nominal.forearm, reach = nominal.reach;
        const Reduced<T> of(seven_equations(arm, pose, plane, angle));
        const SinCos<T>& elbow = angle[3];
        const T sine = elbow.sin * T(nominal.delta.cos) - elbow.cos * T(nominal.delta.sin),
                cosine = elbow.cos * T(nominal.delta.cos) + elbow.sin * T(nominal.delta.sin);
        const T across = sqrt(mul_add(cosine, T(2.0 * La * Lb), T(La * La + Lb * Lb)));  // S-W, across axis 4
        // both are -1 of the nominal arm
        const T rest = T(reach * reach * reach / (La * Lb)) / (angle[1].sin * sine * across * of.per),
                turn = T(1.0) / (angle[5].sin * of.per_det);
        of_rest = T(1.0) + rest;
        of_turn = T(1.0) + turn;
        of_all = T(1.0) - rest * turn;
    }
};

/// The largest share if joints j and j + 2 (j: 0 or 4) rotate together about nearly one axis (sin of the
/// joint between is small): `here`, and at three other values of that common rotation.
template <class T>
ARMANGLE_INLINE T share_all_round(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                  const SinCos<T>* angle, int j, const T& here) noexcept {
    const T half(0.70710678118654752);  // sine and cosine of an eighth
    const T side = select(angle[j + 1].cos > T(0.0), T(-1.0), T(1.0));
    SinCos<T> at[joints];
    for (int k = 0; k < joints; ++k) at[k] = angle[k];
    T share[4] = {here, here, here, here};
    for (int k = 1; k < 4; ++k) {
        const SinCos<T> a = at[j], b = at[j + 2];
        at[j] = {(a.sin + a.cos) * half, (a.cos - a.sin) * half};
        at[j + 2] = {(b.sin + side * b.cos) * half, (b.cos - side * b.sin) * half};
        share[k] = MeetingShare<T>(arm, pose, plane, at).of_all;
    }
    const T middle = T(0.25) * (share[0] + share[1] + share[2] + share[3]),
            swing = T(0.5) * hypot(share[0] - share[2], share[1] - share[3]);
    return middle + swing;
}

/// The largest share of a posture. Only above about one half is there a second posture of its psi in its
/// branch; see is_alone().
template <class T>
ARMANGLE_INLINE T meeting_share(const ChainArm& arm, const Pose<T>& pose, const PsiPlane<T>& plane,
                                const SinCos<T>* angle) noexcept {
    const MeetingShare<T> own(arm, pose, plane, angle);
    T out = max(max(own.of_rest, own.of_turn), own.of_all);
    for (const int j : {0, 4}) {
        const auto straight = abs(angle[j + 1].sin) < T(ChainInverseTuning::band_sine);
        if (any(straight))
            out = select(straight, max(out, share_all_round(arm, pose, plane, angle, j, own.of_all)), out);
    }
    return out;
}

/// Whether the postures within `reach` (rad, of each joint) of theta are the only ones of their psi and
/// branch; `share` is that at theta.
inline bool is_alone(const Arm& nominal, double share, const double (&theta)[joints],
                     const double (&reach)[joints]) noexcept {
    if (share <= 0) return true;
    const double zero[] = {0.0, nominal.delta_angle, 0.0};
    double most = 1.0;
    for (int i = 0; i < 3; ++i) {
        const int j = 2 * i + 1;
        const double sine = abs(sin_cos(theta[j] - zero[i]).sin);
        if (!(sine > reach[j])) return false;
        most = max(most, sine / (sine - reach[j]));
    }
    return share * most < MeetingShareTuning::alone;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
