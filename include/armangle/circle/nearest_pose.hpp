// The reach: the pose nearest to a given one whose wrist is neither too far from the shoulder nor too near.
#pragma once

#include "../numbers/rotations.hpp"
#include "circle.hpp"

namespace armangle {

/// A pose, and how far (m) it is from the one asked for.
struct NearestPose {
    Pose<double> pose;
    double gap;
};

/// The nearest pose of the same orientation within the reach, whatever the joint limits: the wrist moves
/// along its line from the shoulder, in to the reach L or out to the inner reach D. The wrists within the
/// reach are all between two spheres about the shoulder, so no other one is nearer.
inline NearestPose nearest_within_reach(const Arm& arm, const Pose<double>& pose) noexcept {
    const Circle<double> c = circle(arm, flange_pose(arm, pose));
    if (!is_unreachable(c)) return {pose, 0.0};
    const bool far = c.distance > arm.reach;
    const Vec3<double> outward = c.distance == 0 ? Vec3<double>{0, 0, 1} : c.w;
    const Vec3<double> shift = outward * (far ? -c.triangle.excess : c.triangle.excess);
    return {{pose.rotation, pose.position + (arm.has_base ? arm.base.rotation * shift : shift)},
            c.triangle.excess};
}

/// A pose whose numbers are rounded to `precision` (ratio): its rotation made exact, and taken to the reach
/// where it is out of it by no more than the rounding of position and rotation can make. What is no pose
/// stays.
inline Pose<double> within_rounding(const Arm& arm, const Pose<double>& pose, double precision) noexcept {
    if (!is_rigid(pose)) return pose;
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const NearestPose nearest = nearest_within_reach(arm, exact);
    return nearest.gap <= 2.0 * precision * arm.size ? nearest.pose : exact;
}

}  // namespace armangle
