// Derivatives of the ends of feasible arcs by the pose.
//
// At an end a joint is at its limit, q_j(pose, psi) = limit. Therefore dpsi/d(v, omega) = -(dq_j/d(v, omega))
// / (dq_j/dpsi). At a singularity margin the same holds for joint 2 or 6.
#pragma once

#include "../circle/derivatives.hpp"
#include "freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The derivatives of psi with respect to the twist (v, omega) for each end of a set of arcs: lower, upper.
/// NaN if an end does not move smoothly: a full circle has no end, and a jump has no derivative. It is
/// unbounded if a joint only touches its limit.
struct EndSlopes {
    double entry[ArcSet::capacity][2][6];
};

/// Leaves the derivative of an end at a singularity as it is, NaN: it is not known.
template <class AnyArm>
void singular_end_slope(const AnyArm&, const Pose<double>&, double, int, double (&)[6]) noexcept {}

/// Computes the derivatives of the ends of `arcs`, the feasible arcs of (pose, gc), with respect to the twist
/// of the pose.
template <class AnyArm>
void end_slopes(const AnyArm& arm, const Pose<double>& pose, int gc, const ArcSet& arcs,
                EndSlopes& out) noexcept {
    for (int i = 0; i < arcs.count; ++i)
        for (int side = 0; side < 2; ++side) {
            double (&slope)[6] = out.entry[i][side];
            for (double& s : slope) s = not_a_number;
            const Tag tag = side == 0 ? arcs.arc[i].lower_tag : arcs.arc[i].upper_tag;
            const int joint = tag_joint(tag) - 1;
            const Side what = tag_side(tag);
            if (arcs.full || joint < 0) continue;
            const double psi = side == 0 ? arcs.arc[i].lower : arcs.arc[i].upper;
            if (what == Side::near_singular || what == Side::far_singular) {
                singular_end_slope(arm, pose, psi, gc, slope);
                continue;
            }
            const Derivatives d = inverse_derivative(arm, pose, psi, gc);
            const double rate = d.entry[joint][joints - 1];
            if (!(abs(rate) > tolerance::angle && abs(rate) < infinity)) continue;
            for (int k = 0; k < 6; ++k) slope[k] = -d.entry[joint][k] / rate;
        }
}

/// Adds the derivative of the length of `arcs`, the feasible arcs of (pose, gc), with respect to the twist of
/// the pose to `out`: those of upper ends minus those of lower ends.
template <class AnyArm>
void add_length_slope(const AnyArm& arm, const Pose<double>& pose, int gc, const ArcSet& arcs,
                      double (&out)[6]) noexcept {
    if (arcs.full) return;
    EndSlopes slopes;
    end_slopes(arm, pose, gc, arcs, slopes);
    for (int i = 0; i < arcs.count; ++i)
        for (int k = 0; k < 6; ++k) out[k] += slopes.entry[i][1][k] - slopes.entry[i][0][k];
}

/// Writes to `out` the gradient of the total of freedom() with respect to the twist (v, omega) of the pose.
/// NaN if an end does not move smoothly; 0 without arcs, or with whole circles alone.
inline void freedom_gradient(const Arm& arm, const Pose<double>& pose, const LimitTable& t,
                             double (&out)[6]) noexcept {
    for (double& slope : out) slope = 0;
    const auto add = [&](int gc, const detail::Left&, const ArcSet& arcs, const auto&, const auto&) {
        add_length_slope(arm, pose, gc, arcs, out);
        return false;
    };
    detail::each_branch(arm, circle(arm, flange_pose(arm, pose)), t, all_pivots, detail::OneAxis::apart, add);
}

}  // namespace armangle

#include "../names/end.hpp"
