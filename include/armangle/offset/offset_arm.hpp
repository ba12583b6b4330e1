// An arm with one offset more than S-R-S allows: between the axes of joints 6 and 7 (a_6), or of 1 and 2
// (a_1).
//
//     shoulder S, elbow, W: axes 5 and 6 meet          W ----a_6---- axis 7
//     a_1 is the same arm read from its tool: C T^-1 C = chain of theta_7 ... theta_1, C = half turn about x,
//     the lengths in turn, the offsets a with the other sign
//
// All formulas are written for a_6. An arm with a_1 is mirrored on its way in and out.
#pragma once

#include "../arm/frames.hpp"
#include "../circle/elbow.hpp"
#include "../circle/inverse.hpp"
#include "../limits/relaxed.hpp"
#include "../numbers/rotations.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// An arm with an offset, whose free joint, 7 (1 if mirrored), takes the place of psi. Only make_offset_arm
/// creates one.
struct OffsetArm {
    Arm own;            // the rows but for the offset, as the robot has them
    Arm rest;           // the same in the order of the formulas, without base and tool
    double a_6;         // m, in that order
    bool mirrored;      // whether that order is the robot's from joint 7 to joint 1
    double margin = 0;  // rad that every solution keeps from singular postures, see limits_about()
};

/// The S-R-S arm without the offset, which supplies limits and parameters.
inline const Arm& nominal(const OffsetArm& arm) noexcept { return arm.own; }

/// The arm whose formulas give the free joint and GC: it itself.
inline const OffsetArm& nominal_offset(const OffsetArm& arm) noexcept { return arm; }

/// An arm whose redundancy is the value of joint 7 (1 if mirrored): an OffsetArm or OffsetChain.
template <class AnyArm>
concept free_joint_arm = requires(const AnyArm& arm) {
    { nominal_offset(arm) } -> std::same_as<const OffsetArm&>;
};

/// The pose with an exact rotation. Its position is not moved into the reach, which depends on the free
/// joint.
inline Pose<double> within_rounding(const OffsetArm&, const Pose<double>& pose, double) noexcept {
    return {orthonormal(pose.rotation), pose.position};
}

/// Converts joint j (0..6) of the formulas to the robot's joint, or the robot's to that of the formulas: both
/// are the same map.
inline int robot_joint(const OffsetArm& arm, int j) noexcept { return arm.mirrored ? joints - 1 - j : j; }

/// Creates an arm from DH parameters with an offset (m) between axes 6 and 7, or, if `mirrored`, between axes
/// 1 and 2. Its solutions keep a singularity margin (rad).
inline OffsetArm make_offset_arm(const ArmParameters& parameters, double offset, bool mirrored,
                                 double margin = 0) noexcept {
    ArmParameters rest = parameters;
    rest.base = rest.tool = identity_pose();
    rest.roll_free = false;  // the formulas have all joints
    if (mirrored) {
        rest.d_bs = parameters.d_wf;
        rest.d_se = parameters.d_ew;
        rest.d_ew = parameters.d_se;
        rest.d_wf = parameters.d_bs;
        rest.a_3 = -parameters.a_4;
        rest.a_4 = -parameters.a_3;
        for (int j = 0; j < joints; ++j) {
            const int from = joints - 1 - j;
            rest.sign[j] = parameters.sign[from];
            rest.offset[j] = parameters.offset[from];
            rest.limits.lower[j] = parameters.limits.lower[from];
            rest.limits.upper[j] = parameters.limits.upper[from];
        }
    }
    return {make_arm(parameters), make_arm(rest), mirrored ? -offset : offset, mirrored, margin};
}

/// Creates an arm with other parameters, and the same offset and singularity margin.
inline OffsetArm remade(const OffsetArm& arm, const ArmParameters& parameters) noexcept {
    return make_offset_arm(parameters, arm.mirrored ? -arm.a_6 : arm.a_6, arm.mirrored, arm.margin);
}

/// The arm whose robot's joint 7 has no limits and keeps the value of the seed: a solved pose may have any
/// roll about axis 7.
inline OffsetArm with_free_roll(const OffsetArm& arm) noexcept {
    return remade(arm, with_free_roll(static_cast<const ArmParameters&>(arm.own)));
}

/// Returns the same arm (offset, margin, frames) within other limits of q, in the robot's order.
inline OffsetArm with_limits(const OffsetArm& arm, const Limits& limits) noexcept {
    ArmParameters parameters = arm.own;
    parameters.limits = limits;
    return remade(arm, parameters);
}

/// Where branches meet: theta_2, theta_4 - delta, and theta_5 + pi/2 of the formulas are 0. At the first two
/// postures are singular: with the free joint held, the others cannot move the tool in all directions. At the
/// third, a fold, an arc only ends.
template <free_joint_arm AnyArm>
BranchMeetings branch_meetings(const AnyArm& any) noexcept {
    const OffsetArm& arm = nominal_offset(any);
    return {{{robot_joint(arm, 1), 0.0},
             {robot_joint(arm, 3), arm.rest.delta_angle},
             {robot_joint(arm, 4), -half_pi, false}}};
}

/// Writes to `out` the limits around the robot's joints q within which theta_2 and the elbow keep the arm's
/// singularity margin; false if the arm's limits permit no such joints.
inline bool limits_about(const OffsetArm& arm, const double* q, Limits& out) noexcept {
    out = arm.own.limits;
    return !(arm.margin > 0) || keep_off_singular(arm.own, branch_meetings(arm), q, arm.margin, out);
}

/// Whether joints q are within the limits and keep the arm's singularity margin, up to `slack` (rad).
inline bool is_kept(const OffsetArm& arm, const double* q, double slack) noexcept {
    Limits about;
    return limits_about(arm, q, about) && within_limits(about, q, slack);
}

/// The rotation C by 180 degrees around x.
inline constexpr Pose<double> half_turn_about_x{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 0}};

/// The pose C p^-1 C, which a mirrored arm's formulas use; the function is its own inverse.
template <class T>
Pose<T> mirrored_pose(const Pose<T>& p) noexcept {
    const Pose<T> half_turn = spread<T>(half_turn_about_x);
    return half_turn * inverted(p) * half_turn;
}

/// The pose 0T7 that the formulas use for a pose given by the user.
template <class T>
Pose<T> flange_pose(const OffsetArm& arm, const Pose<T>& pose) noexcept {
    const Pose<T> flange = flange_pose(arm.own, pose);
    return arm.mirrored ? mirrored_pose(flange) : flange;
}

/// Computes the DH frames 0..7 at joint values q, in the frame in which poses are given, with the offset in
/// its row. The last one is the flange, without the tool.
inline void frames(const OffsetArm& arm, const double* q, Pose<double> (&out)[joints + 1]) noexcept {
    frames(arm.own, q, out);
    const int row = arm.mirrored ? 1 : 6;
    const Vec3<double> shift = out[row].rotation.x * (arm.mirrored ? -arm.a_6 : arm.a_6);
    for (int i = row; i <= joints; ++i) out[i].position = out[i].position + shift;
}

/// The pose of the end effector at joint values q, in the user's frame.
inline Pose<double> tool_pose(const OffsetArm& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    return frame[joints] * arm.own.tool;
}

}  // namespace armangle

#include "../names/end.hpp"
