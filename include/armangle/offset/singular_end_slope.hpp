// How the ends of the feasible intervals of an arm with an offset move with the pose.
//
// An end at a joint limit moves as limits/end_slopes.hpp says. At a fold, and at the end of the reach, the
// room of OffsetFamily::place is 0: its derivatives give the slope of the end (implicit function theorem).
#pragma once

#include "../limits/end_slopes.hpp"
#include "freedom.hpp"
#include "offset_family.hpp"
#include "psi_gradient.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Writes the derivative of the value `free` of the free joint (rad), at which an arc ends at a fold or at
/// the end of the reach, with respect to the twist (v, omega) of the pose to `slope`. Leaves it unchanged if
/// the end does not move smoothly.
inline void singular_end_slope(const OffsetArm& arm, const Pose<double>& pose, double free, int gc,
                               double (&slope)[6]) noexcept {
    using J = Jet<double, 1>;
    const Mat3<double> r = orthonormal(pose.rotation);
    const OffsetFamily family(arm);
    const auto rate = [&](const Vec3<double>& v, const Vec3<double>& omega, double turned) {
        const auto moving = [](const Vec3<double>& from, const Vec3<double>& by) {
            const auto jet = [](double value, double slope_of) {
                J out(value);
                out.coefficient[1] = slope_of;
                return out;
            };
            return Vec3<J>{jet(from.x, by.x), jet(from.y, by.y), jet(from.z, by.z)};
        };
        J at(free);
        at.coefficient[1] = turned;
        Directions<J> d;
        return family
            .place(Pose<J>{{moving(r.x, cross(omega, r.x)), moving(r.y, cross(omega, r.y)),
                            moving(r.z, cross(omega, r.z))},
                           moving(pose.position, v)},
                   gc, at, nullptr, d)
            .coefficient[1];
    };
    const double along = rate({0, 0, 0}, {0, 0, 0}, 1.0);
    if (!(abs(along) > tolerance::angle)) return;
    for (int k = 0; k < 6; ++k) {
        const Vec3<double> unit{k % 3 == 0 ? 1.0 : 0.0, k % 3 == 1 ? 1.0 : 0.0, k % 3 == 2 ? 1.0 : 0.0};
        const Vec3<double> none{0, 0, 0};
        slope[k] = -rate(k < 3 ? unit : none, k < 3 ? none : unit, 0.0) / along;
    }
}

/// Writes the gradient of the total of freedom() with respect to the twist (v, omega) of the pose to `out`;
/// NaN if an end of an arc does not move smoothly.
template <free_joint_arm AnyArm>
void freedom_gradient(const AnyArm& arm, const Pose<double>& pose, double (&out)[6]) noexcept {
    for (double& slope : out) slope = 0;
    ProvenArcs found[configurations];
    feasible_all(arm, pose, nominal(arm).limits, found);
    for (int gc = 0; gc < configurations; ++gc)
        add_length_slope(arm, pose, gc, in_robot_order(arm, found[gc].arcs), out);
}

}  // namespace armangle

#include "../names/end.hpp"
