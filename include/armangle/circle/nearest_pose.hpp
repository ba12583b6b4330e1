// The reach: the pose nearest to a given one whose wrist is neither too far from the shoulder nor too near.
#pragma once

#include <initializer_list>

#include "../numbers/rotations.hpp"
#include "circle.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A pose, and how far (m) it is from the one asked for.
struct NearestPose {
    Pose<double> pose;
    double gap;
};

namespace detail {

/// A pose whose wrist is `by` (m) farther from the shoulder, on the same line.
inline Pose<double> stretched_by(const Arm& arm, const Pose<double>& pose, const Circle<double>& c,
                                 double by) noexcept {
    const Vec3<double> shift = (c.distance == 0 ? Vec3<double>{0, 0, 1} : c.w) * by;
    return {pose.rotation, pose.position + (arm.has_base ? arm.base.rotation * shift : shift)};
}

/// How much farther (m) the wrist is where joint 4 stands on the limit that it is beyond; 0 where it is
/// beyond none, or by more than `rounding` (m). A limit at straight is that of the other bend: not beyond.
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

/// The nearest pose of the same orientation within the reach, whatever the joint limits: the wrist moves
/// along its line from the shoulder, in to the reach L or out to the inner reach D. The wrists within the
/// reach are all between two spheres about the shoulder, so no other one is nearer.
inline NearestPose nearest_within_reach(const Arm& arm, const Pose<double>& pose) noexcept {
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    if (!is_unreachable(c)) return {pose, 0.0};
    const double excess = c.triangle.excess;
    return {detail::stretched_by(arm, pose, c, c.distance > arm.reach ? -excess : excess), excess};
}

/// A pose whose numbers are rounded to `precision` (ratio): its rotation made exact, and taken to the reach,
/// and to the limit of joint 4, where it is beyond by no more than the rounding of position and rotation can
/// make: psi, which leaves the other joints some room, does not move that one. What is no pose stays.
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
