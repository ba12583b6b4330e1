// Status codes: the outcome for a pose, as a value and as one sentence.
#pragma once

#include <cstdint>

#include "names/begin.hpp"

namespace armangle {

/// Outcome of a query; `sentence` explains each.
enum class Status : std::int8_t {
    OK = 0,
    UNREACHABLE = 1,
    FOLDED = 2,
    ELBOW_LIMIT = 3,
    ELBOW_MARGIN = 4,
    LIMITS = 5,
    OUTSIDE = 6,
    JOINT_JUMP = 7,
    WINDING_EXHAUSTED = 8,
    VELOCITY_LIMIT = 9,
    ACCELERATION_LIMIT = 10,
    NOT_REACHED = 11,
    BAD_INPUT = 12,
    NOT_ALLOWED = 13,
    POSE_BLOCKED = 14,
    CLEARANCE = 15,
    NEAR_SINGULAR = 16,
    NO_CONVERGENCE = 17,
    PARTIAL = 18,
    NO_POSTURE = 19,
    UNPROVEN = 20,
};

inline constexpr int status_count = 21;

/// Whether a status means that a solution within all limits was found for the requested pose.
constexpr bool is_solved(Status status) noexcept {
    return status == Status::OK || status == Status::UNPROVEN;
}

/// The sentence that explains a status.
constexpr const char* sentence(Status status) noexcept {
    switch (status) {
        case Status::OK: return "The pose is solved within all limits.";
        case Status::UNREACHABLE:
            return "The wrist is out of reach: too far from the shoulder, or too near to it.";
        case Status::FOLDED: return "The wrist lies on the shoulder, so the arm angle does not exist.";
        case Status::ELBOW_LIMIT:
            return "The pose requires the elbow joint to leave its limits, at every arm angle.";
        case Status::ELBOW_MARGIN:
            return "The elbow is nearer to stretched or folded than the singularity margin.";
        case Status::LIMITS:
            return "No available arm angle keeps all joints within their limits and margins.";
        case Status::OUTSIDE:
            return "The present arm angle lies in no feasible interval, and the policy stops there.";
        case Status::JOINT_JUMP: return "A joint would move further than the largest permitted step.";
        case Status::WINDING_EXHAUSTED:
            return "A joint with more than one turn would leave its range: no turn is left.";
        case Status::VELOCITY_LIMIT: return "A joint would move faster than its velocity limit.";
        case Status::ACCELERATION_LIMIT: return "A joint would accelerate beyond its acceleration limit.";
        case Status::NOT_REACHED: return "The pose was not tried, because the motion stopped before it.";
        case Status::NOT_ALLOWED:
            return "The branches or intervals that the caller allows leave no arm angle.";
        case Status::NEAR_SINGULAR: return "Branches meet here, so no single solution is certain.";
        case Status::NO_CONVERGENCE:
            return "The iteration did not find the solution of the nearly S-R-S arm.";
        case Status::POSE_BLOCKED:
            return "The gripper or the base collides with an obstacle at this pose, at every arm angle.";
        case Status::CLEARANCE: return "No arm angle keeps clear of the obstacles within all limits.";
        case Status::PARTIAL:
            return "The step moves as far towards the pose as the bounds, or the reach, allow.";
        case Status::NO_POSTURE: return "The pose has no solution at this value of the free joint.";
        case Status::UNPROVEN:
            return "The pose is solved within all limits, but it is not proven that no solution is nearer.";
        case Status::BAD_INPUT: return "The pose is not a rigid transform, or a number is not finite.";
    }
    return "";
}

}  // namespace armangle

#include "names/end.hpp"
