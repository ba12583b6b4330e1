// The target for the arm angle along a path: psi over s, or a place for the elbow at every s.
//
//     psi | --.     target            cost = 2 - 2 cos(psi - target): the square of the angle between, near
//         |  .-`----------            the target, and without a jump at half a turn
//         +--------------- s
#pragma once

#include <cstddef>

#include "../circle/forward.hpp"
#include "../circle/towards.hpp"
#include "../numbers/angles.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A target along a path: psi at equal steps of s from 0 to 1, linear between; or one point or direction for
/// the elbow.
struct WishAlong {
    Wish kind = Wish::psi;
    Vec3<double> target{};        // for Wish::point, Wish::direction
    const double* psi = nullptr;  // for Wish::psi: `count` of them, one or more
    std::size_t count = 0;

    /// The target psi at s, for Wish::psi; that of the nearer end if s is outside [0, 1].
    double psi_at(double s) const noexcept {
        if (count == 1) return psi[0];
        const double x = min(max(s, 0.0), 1.0) * static_cast<double>(count - 1);
        const std::size_t whole = static_cast<std::size_t>(x), k = whole < count - 2 ? whole : count - 2;
        const double share = x - static_cast<double>(k);
        return (1 - share) * psi[k] + share * psi[k + 1];
    }
};

/// The target at s as an angle of a self-motion, in the reference in which that self-motion is counted;
/// flange: its pose. NaN if all angles are equally good.
inline double wished_angle(const Arm& arm, const WishAlong& wish, const Pose<double>& flange,
                           const SelfMotion<double>& m, double s) noexcept {
    if (wish.kind != Wish::psi) return psi_towards(arm, m, {wish.kind, not_a_number, wish.target}).psi;
    return wish.psi_at(s) - arm_angle(triad(arm, flange), m.circle.z);
}

}  // namespace armangle

#include "../names/end.hpp"
