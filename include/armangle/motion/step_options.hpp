// What a step takes besides the pose, and what it returns.
#pragma once

#include "../scene/scene.hpp"
#include "bounds.hpp"
#include "resolution.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The quantity carried from one pose to the next: the number psi (the paper), or the elbow axis itself.
enum class Carry : std::uint8_t { psi, elbow };

/// Arguments of a step besides the pose.
struct StepOptions {
    Policy policy;
    Carry carry = Carry::psi;
    double max_joint_step = 0.2;  // rad; a larger move of any joint is JOINT_JUMP
    double dt = not_a_number;     // s, of this step; NaN if unknown
    // 0..7; or -1: the branch of the present joints, or one that meets it where they pass theta_2 = 0,
    // theta_6 = 0 or the straight elbow
    int gc = -1;
    const ArcSet* allowed = nullptr;  // arcs given by the user, intersected
    const Scene* scene = nullptr;     // obstacles that the links must avoid
    const Bounds* bounds = nullptr;   // on velocities and accelerations
    const ArcSet* ahead =
        nullptr;           // with bounds: the part of the arcs from which the coming poses can be reached
    bool nearest = false;  // move to the nearest pose if the pose has no solution within the limits
};

/// Result of a step. OK: the configuration solves the pose. PARTIAL: it is as far towards it as bounds, or
/// the reach, allow. CLEARANCE with `why` OK: it solves the pose, still in contact on its way out
/// (Outside::escape). Any other status: no joint moves or, if accelerations are bounded, every joint brakes.
struct Step {
    double q[joint_slots];
    double psi;  // in (-pi, pi]
    int gc;
    Status status;
    double margin;            // rad: distance to the nearest joint limit, negative outside
    double velocity[joints];  // rad/s: (q - q_now) / dt; NaN without dt
    Status why;               // why q does not reach the pose
};

/// The default of the largest joint motion (rad) in a step of dt s that does not count as a jump: 20 rad/s,
/// or 0.2 rad if dt is long or unknown.
inline double default_joint_step(double dt) noexcept { return dt < 0.01 ? 20.0 * dt : 0.2; }

}  // namespace armangle

#include "../names/end.hpp"
