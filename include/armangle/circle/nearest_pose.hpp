// Reachability: the nearest pose whose wrist is neither too far from the shoulder nor too close.
#pragma once

#include <initializer_list>

#include "../numbers/rotations.hpp"
#include "circle.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A pose, and its distance (m) from the requested one.
struct NearestPose {
    Pose<double> pose;
    double gap;
};

namespace detail {

/// The pose with its wrist moved away from the shoulder by `by` (m; negative: towards it) on the same line,
/// or along z if the two coincide. `c` is the circle of the pose.
inline Pose<double> stretched_by(const Arm& arm, const Pose<double>& pose, const Circle<double>& c,
                                 double by) noexcept {
    const Vec3<double> shift = (c.distance == 0 ? Vec3<double>{0, 0, 1} : c.w) * by;
    return {pose.rotation, pose.position + (arm.has_base ? arm.base.rotation * shift : shift)};
}

/// If joint 4 violates a limit, the distance (m) from the wrist to the place where it keeps that limit,
/// positive away from the shoulder. 0 if it keeps its limits, or violates them by more than `rounding` (m).
inline double beyond_elbow_limit(const Arm& arm, const Circle<double>& c, double rounding) noexcept {
    const double lower = arm.limits.lower[3], upper = arm.limits.upper[3],
                 eta = atan2(c.triangle.eta.sin, c.triangle.eta.cos);
    for (const double side : {1.0, -1.0}) {
        const double q =
            to_q(arm.delta_angle + side * eta, arm.sign[3], arm.offset[3], lower, upper, arm.joint_middle[3]);
        const double inside = min(max(q, lower), upper), bend = elbow_bend(arm, inside);
        const double farther = wrist_distance(arm, bend) - c.distance;
        if (inside != q && side * bend > 0 && abs(farther) <= rounding) return farther;
    }
    return 0.0;
}

}  // namespace detail

/// The nearest pose of the same orientation within reach, ignoring joint limits. The wrist moves on its line
/// from the shoulder to the reach L or the inner reach D. Reachable wrists lie between these two spheres, so
/// no other one is nearer.
inline NearestPose nearest_within_reach(const Arm& arm, const Pose<double>& pose) noexcept {
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    if (!is_unreachable(c)) return {pose, 0.0};
    const double excess = c.triangle.excess;
    return {detail::stretched_by(arm, pose, c, c.distance > arm.reach ? -excess : excess), excess};
}

/// Corrects a pose rounded to `precision` (ratio). Makes its rotation exact, and moves the wrist to the reach
/// and to the limit of joint 4 if rounding explains the violation. Only joint 4 needs this, since psi cannot
/// move it. A pose that is not rigid is returned unchanged.
inline Pose<double> within_rounding(const Arm& arm, const Pose<double>& pose, double precision) noexcept {
    if (!is_rigid(pose)) return pose;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const double rounding = 2.0 * precision * arm.size;
    const NearestPose nearest = nearest_within_reach(arm, exact);
    if (!(nearest.gap <= rounding)) return exact;
    const Circle<double> c = circle(arm, flange_pose(arm, nearest.pose));
    const double farther = is_folded(c) ? 0.0 : detail::beyond_elbow_limit(arm, c, rounding);
    return farther == 0 ? nearest.pose : detail::stretched_by(arm, nearest.pose, c, farther);
}

}  // namespace armangle

#include "../names/end.hpp"
