// How the ends of feasible arcs move with the pose.
//
// An end is where a joint stands at its limit, q_j(pose, psi) = limit, so that
// dpsi/d(v, omega) = -(dq_j/d(v, omega)) / (dq_j/dpsi); at a margin the same of joint 2 or 6, which is held.
#pragma once

#include "../circle/derivatives.hpp"
#include "freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// dpsi by the twist (v, omega) of each end of a set of arcs: lower, upper. NaN where an end does not move
/// smoothly: a full circle has none, a jump none, and where a joint only touches its limit the slope has no
/// bound.
struct EndSlopes {
    double entry[ArcSet::capacity][2][6];
};

/// Slopes of the ends of feasible arcs of (pose, gc), which `arcs` holds.
inline void end_slopes(const Arm& arm, const Pose<double>& pose, int gc, const ArcSet& arcs,
                       EndSlopes& out) noexcept {
    for (int i = 0; i < arcs.count; ++i)
        for (int side = 0; side < 2; ++side) {
            double (&slope)[6] = out.entry[i][side];
            for (double& s : slope) s = not_a_number;
            const Tag tag = side == 0 ? arcs.arc[i].lower_tag : arcs.arc[i].upper_tag;
            const int joint = tag_joint(tag) - 1;
            const Side what = tag_side(tag);
            if (arcs.full || joint < 0 || what == Side::near_singular || what == Side::far_singular) continue;
            const double psi = side == 0 ? arcs.arc[i].lower : arcs.arc[i].upper;
            const Derivatives d = inverse_derivative(arm, pose, psi, gc);
            const double rate = d.entry[joint][joints - 1];
            if (!(abs(rate) > tolerance::angle && abs(rate) < infinity)) continue;
            for (int k = 0; k < 6; ++k) slope[k] = -d.entry[joint][k] / rate;
        }
}

/// How the total of freedom() moves with the twist (v, omega) of the pose: upper less lower ends of all arcs.
/// NaN where an end does not move smoothly; 0 where the pose has no arc, or whole circles alone.
inline void freedom_gradient(const Arm& arm, const Pose<double>& pose, const LimitTable& t,
                             double (&out)[6]) noexcept {
    for (double& slope : out) slope = 0;
    EndSlopes slopes;
    const auto add = [&](int gc, const detail::Left&, const ArcSet& arcs, const auto&, const auto&) {
        if (arcs.full) return false;
        end_slopes(arm, pose, gc, arcs, slopes);
        for (int i = 0; i < arcs.count; ++i)
            for (int k = 0; k < 6; ++k) out[k] += slopes.entry[i][1][k] - slopes.entry[i][0][k];
        return false;
    };
    detail::each_branch(arm, circle(arm, flange_pose(arm, pose)), t, all_pivots, detail::OneAxis::apart, add);
}

}  // namespace armangle

#include "../names/end.hpp"
