// The arm: lengths, elbow offsets, joint map, limits, base and tool, and everything computed from them once.
#pragma once

#include <cstdint>

#include "../numbers/angles.hpp"
#include "../numbers/linalg.hpp"
#include "../numbers/tolerances.hpp"
#include "../numbers/lane.hpp"
#include "limits.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The zero of psi: the half-plane through the axis of joint 1, that of a user's vector, or a plane carried
/// over the sphere of directions (reference_plane.hpp).
enum class Reference : std::uint8_t { base, vector, stereographic };

/// The user's description of an arm. Lengths in m, angles in rad, limits in the robot's joint coordinates q.
/// theta_i = sign_i q_i + offset_i are the angles of the DH rows (Table 1, with a_3 and a_4 for an offset
/// elbow).
struct ArmParameters {
    double d_bs = 0, d_se = 0, d_ew = 0, d_wf = 0, a_3 = 0, a_4 = 0, d_4 = 0;
    double sign[joint_slots] = {1, 1, 1, 1, 1, 1, 1, 1};
    double offset[joint_slots] = {};
    Limits limits;
    Pose<double> base = identity_pose();
    Pose<double> tool = identity_pose();
    Reference reference = Reference::base;
    Vec3<double> reference_vector{0, 0, 1};  // for Reference::vector, in the frame that poses are given in
    // If true, joint 7 keeps its value and the roll of a pose about axis 7 is free; the limits of joint 7 are
    // then infinite.
    bool roll_free = false;
};

/// The parameters and all quantities that depend on them alone. Only make_arm creates an arm, and an arm
/// never changes. An arm without lengths therefore cannot exist.
struct Arm : ArmParameters {
    double upper_arm, forearm;  // La = |S-E|, Lb = |E-W|, across axis 4
    double reach, inner_reach;  // L = La + Lb, D = |La - Lb|; with a gap d_4 hypot(L, d_4), hypot(D, d_4)
    double size;                // m: sum of all lengths that contribute to a pose; scales its rounding error
    SinCos<double> shoulder_slant;  // of atan2(a_3, d_se)
    SinCos<double> wrist_slant;     // of atan2(a_4, d_ew)
    SinCos<double> delta;           // theta_4 of the stretched arm: wrist_slant - shoulder_slant
    double delta_angle;
    bool has_base, has_tool;
    Pose<double> base_inverse, tool_inverse;
    double joint_middle[joint_slots];  // middle of the limits
    Mat3<double> reference_frame;      // z along the reference vector, in the frame of the DH rows

private:
    Arm() noexcept = default;
    friend Arm make_arm(const ArmParameters&) noexcept;
};

namespace detail {

/// Whether a pose equals the identity exactly.
inline bool is_identity(const Pose<double>& p) noexcept {
    const auto same = [](const Vec3<double>& a, double x, double y, double z) {
        return a.x == x && a.y == y && a.z == z;
    };
    return same(p.rotation.x, 1, 0, 0) && same(p.rotation.y, 0, 1, 0) && same(p.rotation.z, 0, 0, 1) &&
           same(p.position, 0, 0, 0);
}

/// A frame whose z axis has the direction of v. Its x axis is near x or y, whichever is farther from v.
inline Mat3<double> frame_along(const Vec3<double>& v) noexcept {
    const Vec3<double> z = v * (1.0 / norm(v));
    const Vec3<double> near = abs(z.x) <= abs(z.y) ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0};
    const Vec3<double> across = near - z * dot(z, near), x = across * (1.0 / norm(across));
    return {x, cross(z, x), z};
}

/// Sine and cosine of the angle between a link and its axis, from its lateral offset, its part along the axis
/// and its length (m); (0, 1) for length 0.
inline SinCos<double> slant(double offset, double along, double length) noexcept {
    if (!(length > 0)) return {0.0, 1.0};
    return {offset / length, along / length};
}

}  // namespace detail

/// Creates the arm of these parameters. They must be finite (limits may be infinite) with lower <= upper, and
/// the reference vector must not be zero. If the upper arm hypot(a_3, d_se) or the forearm hypot(a_4, d_ew)
/// has no length, there is no elbow: forward kinematics works, and every pose is UNREACHABLE.
inline Arm make_arm(const ArmParameters& parameters) noexcept {
    Arm arm{};
    static_cast<ArmParameters&>(arm) = parameters;
    arm.upper_arm = hypot(arm.a_3, arm.d_se);
    arm.forearm = hypot(arm.a_4, arm.d_ew);
    if (arm.a_3 == 0) arm.upper_arm = arm.d_se;  // exact, not the root of a square
    if (arm.a_4 == 0) arm.forearm = arm.d_ew;
    arm.reach = arm.upper_arm + arm.forearm;
    arm.inner_reach = abs(arm.upper_arm - arm.forearm);
    if (arm.d_4 != 0) {
        arm.reach = hypot(arm.reach, arm.d_4);
        arm.inner_reach = hypot(arm.inner_reach, arm.d_4);
    }
    const bool linked = arm.upper_arm > 0 && arm.forearm > 0;
    if (!linked) arm.inner_reach = infinity;
    arm.size = arm.reach + abs(arm.d_bs) + abs(arm.d_wf) + norm(arm.base.position) + norm(arm.tool.position);
    arm.shoulder_slant = detail::slant(arm.a_3, arm.d_se, arm.upper_arm);
    arm.wrist_slant = detail::slant(arm.a_4, arm.d_ew, arm.forearm);
    const auto &s = arm.shoulder_slant, &w = arm.wrist_slant;
    arm.delta = {w.sin * s.cos - w.cos * s.sin, w.cos * s.cos + w.sin * s.sin};
    arm.delta_angle = atan2(arm.delta.sin, arm.delta.cos);
    arm.has_base = !detail::is_identity(arm.base);
    arm.has_tool = !detail::is_identity(arm.tool);
    arm.base_inverse = inverted(arm.base);
    arm.tool_inverse = inverted(arm.tool);
    arm.reference_frame = detail::frame_along(arm.base_inverse.rotation * arm.reference_vector);
    arm.sign[joints] = 1.0;  // the padding slot belongs to no joint
    arm.offset[joints] = 0.0;
    arm.limits.lower[joints] = -infinity;
    arm.limits.upper[joints] = infinity;
    for (int j = 0; j < joint_slots; ++j) arm.joint_middle[j] = middle(arm.limits, j);
    return arm;
}

/// The parameters of an arm whose joint 7 has no limits and keeps the value of the seed (roll_free): a solved
/// pose may have any roll about axis 7.
inline ArmParameters with_free_roll(ArmParameters p) noexcept {
    p.roll_free = true;
    p.limits.lower[joints - 1] = -infinity;
    p.limits.upper[joints - 1] = infinity;
    return p;
}
/// The arm with a joint 7 that has no limits and keeps the value of the seed: a solved pose may have any roll
/// about axis 7.
inline Arm with_free_roll(const Arm& arm) noexcept {
    return make_arm(with_free_roll(static_cast<const ArmParameters&>(arm)));
}

/// Creates an arm of the same kind with other parameters.
inline Arm remade(const Arm&, const ArmParameters& parameters) noexcept { return make_arm(parameters); }

/// The S-R-S arm that supplies limits, psi and branch. An S-R-S arm returns itself; other kinds have a
/// nominal arm.
inline const Arm& nominal(const Arm& arm) noexcept { return arm; }

/// The flange pose 0T7 in the frame of the DH rows, of an end effector pose in the user's frame: base^-1 pose
/// tool^-1.
template <class T>
ARMANGLE_INLINE Pose<T> flange_pose(const Arm& arm, Pose<T> pose) noexcept {
    if (arm.has_base) pose = spread<T>(arm.base_inverse) * pose;
    if (arm.has_tool) pose = pose * spread<T>(arm.tool_inverse);
    return pose;
}

/// The end effector pose in the user's frame, of a flange pose 0T7: base 0T7 tool.
template <class T>
ARMANGLE_INLINE Pose<T> user_pose(const Arm& arm, Pose<T> flange) noexcept {
    if (arm.has_base) flange = spread<T>(arm.base) * flange;
    if (arm.has_tool) flange = flange * spread<T>(arm.tool);
    return flange;
}

}  // namespace armangle

#include "../names/end.hpp"
