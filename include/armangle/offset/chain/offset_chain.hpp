// An arm that is only nearly one with an offset wrist or shoulder: its own chain, and the nominal offset arm
// beside it, which lends the free joint and GC.
//
//     true     T(theta) = G_0 Rz(theta_1) G_1 ... Rz(theta_7) G_7      what the robot is
//     nominal  N(theta) = H_0 Rz(theta_1) H_1 ... Rz(theta_7) H_7      S-R-S but for one offset, near to it
//
// Every true posture of a pose P is the nominal posture, with the same theta, of a corrected pose
//
//     X(theta) = N(theta) T(theta)^-1 P = A_6 ... A_1 P,   A_k = F_k D_k F_k^-1,   D_k = H_k G_k^-1,
//
// where F_k is the nominal frame after joint k has turned. The formulas are those of the offset wrist: a
// mirrored arm is read from its tool, as in offset_arm.hpp. The first and the last link do not depend on
// theta: they are taken out of the pose exactly, so that D_0 = D_7 = 1.
#pragma once

#include "../../chain/chain_arm.hpp"
#include "../offset_posture.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// An arm with its own chain whose nominal arm has an offset. make_offset_chain is the only maker.
struct OffsetChain {
    OffsetArm nominal;
    Pose<double> link[joints + 1];        // G_k in the robot's order
    LinkDeviation deviation[joints + 1];  // of D_k in the robot's order
    // In the order of the formulas, base and tool taken out, the first and last link those of the nominal
    // arm:
    Pose<double> nominal_row[joints + 1], row[joints + 1];  // H_k, G_k
    Vec3<double> axis[joints + 1];                          // of the rotation of D_k, as long as its sine
    Vec3<double> moved[joints + 1];                         // position of D_k, m
    double versine[joints + 1];                             // (1 - cosine) / sine^2 of that rotation
    Pose<double> first, last;                               // flange pose = first (base^-1 P tool^-1) last
    double shift, turn;  // how far X is from P at most: m of the origin of frame 6, rad
};

/// The arm without the offset, which defines limits.
inline const Arm& nominal(const OffsetChain& arm) noexcept { return arm.nominal.own; }

/// The arm with the offset, which defines free joint and GC.
inline const OffsetArm& nominal_offset(const OffsetChain& arm) noexcept { return arm.nominal; }

namespace detail {

/// Writes the fixed transforms H_0 ... H_7 of the nominal arm, with the offset a_1 or a_6 (m), to `out`.
inline void nominal_links(const Arm& rows, double a_1, double a_6, Pose<double> (&out)[joints + 1]) noexcept {
    nominal_links(rows, out);
    out[1].position = out[1].position + out[1].rotation.x * a_1;
    out[6].position = out[6].position + out[6].rotation.x * a_6;
}

/// An upper bound (m) of the displacement that a deviation causes at points within a distance (m).
inline double farthest_moved_by(const LinkDeviation& d, double distance) noexcept {
    return d.position + d.rotation * distance;
}

/// Computes bounds of how far X is from P. Each deviation is taken from the frame before or after its link,
/// whichever moves frame 6 less.
inline void measure(OffsetChain& out) noexcept {
    out.shift = out.turn = 0;
    double before = 0;  // m from the frame before the link to the origin of frame 6, at most
    for (int k = joints - 1; k > 0; --k) {
        const Pose<double>&h = out.nominal_row[k], &g = out.row[k];
        const Pose<double> d = h * inverted(g), d_behind = inverted(g) * h;
        const LinkDeviation ahead{norm(d.position), turn_of(d.rotation)},
            behind{norm(d_behind.position), turn_of(d_behind.rotation)};
        const double after = before;
        before += norm(h.position);
        out.shift +=
            min(farthest_moved_by(ahead, before + out.shift), farthest_moved_by(behind, after + out.shift)) /
            (1.0 - ahead.rotation);
        out.turn += ahead.rotation;
        const Mat3<double>& r = d.rotation;
        out.axis[k] = Vec3<double>{r.y.z - r.z.y, r.z.x - r.x.z, r.x.y - r.y.x} * 0.5;
        out.versine[k] = 1.0 / (1.0 + sqrt(max(1.0 - dot(out.axis[k], out.axis[k]), 0.0)));
        out.moved[k] = d.position;
    }
}

}  // namespace detail

/// Makes an arm on its own chain L_0 Rz(q_1) L_1 ... Rz(q_7) L_7, from the frame of poses to the end
/// effector, with orthonormal rotations, and measures how far each of its links is from the nominal arm.
/// `parameters` and `offset` (m, that of the wrist; `mirrored`: of the shoulder) describe that nominal arm
/// (make_offset_arm).
inline OffsetChain make_offset_chain(const ArmParameters& parameters, double offset, bool mirrored,
                                     const Pose<double> (&links)[joints + 1]) noexcept {
    constexpr int sweeps = 32;  // neighbouring axes are nearly square: frames hardly disturb each other
    OffsetChain out{
        make_offset_arm(parameters, offset, mirrored), {}, {}, {}, {}, {}, {}, {}, {}, {}, 0.0, 0.0};
    const Arm& own = out.nominal.own;
    Pose<double> nominal[joints + 1];
    detail::nominal_links(own, mirrored ? offset : 0.0, mirrored ? 0.0 : offset, nominal);
    detail::links_in_theta(own, links, out.link);
    const auto align_frames = [](const Pose<double>(&wanted)[joints + 1],
                                 Pose<double>(&link)[joints + 1]) noexcept {
        for (int sweep = 0; sweep < sweeps; ++sweep)
            for (int k = 0; k < joints; ++k) detail::align_frame(wanted, link, k);
    };
    align_frames(nominal, out.link);
    for (int k = 0; k <= joints; ++k) {
        const Pose<double> off = nominal[k] * inverted(out.link[k]);
        out.deviation[k] = {norm(off.position), detail::turn_of(off.rotation)};
    }
    for (int k = 0; k <= joints; ++k) out.row[k] = out.link[k];
    out.row[0] = inverted(own.base) * out.row[0];
    out.row[joints] = out.row[joints] * inverted(own.tool);
    if (mirrored) {
        Pose<double> other[joints + 1];
        for (int k = 0; k <= joints; ++k) other[k] = mirrored_pose(out.row[joints - k]);
        for (int k = 0; k <= joints; ++k) out.row[k] = other[k];
    }
    detail::nominal_links(out.nominal.rest, 0.0, out.nominal.a_6, out.nominal_row);
    align_frames(out.nominal_row, out.row);  // a mirrored arm's frames are others
    out.first = out.nominal_row[0] * inverted(out.row[0]);
    out.last = inverted(out.row[joints]) * out.nominal_row[joints];
    out.row[0] = out.nominal_row[0];
    out.row[joints] = out.nominal_row[joints];
    detail::measure(out);
    return out;
}

/// The same chain with other limits, in the robot's order of joints.
inline OffsetChain with_limits(const OffsetChain& arm, const Limits& limits) noexcept {
    OffsetChain out = arm;
    out.nominal = with_limits(arm.nominal, limits);
    return out;
}

/// Converts joint j (0..6) of the formulas to the robot's joint, or the robot's to that of the formulas: both
/// are the same map.
inline int robot_joint(const OffsetChain& arm, int j) noexcept { return robot_joint(arm.nominal, j); }

/// The pose with an exact rotation. Its position is not moved into the reach, which depends on the free
/// joint.
inline Pose<double> within_rounding(const OffsetChain& arm, const Pose<double>& pose,
                                    double precision) noexcept {
    return within_rounding(arm.nominal, pose, precision);
}

/// The flange pose 0T7 of the formulas for a pose given by the user.
template <class T>
Pose<T> flange_pose(const OffsetChain& arm, const Pose<T>& pose) noexcept {
    return spread<T>(arm.first) * flange_pose(arm.nominal, pose) * spread<T>(arm.last);
}

/// Writes the true frames 0..7 at joint values q to `out`, in the frame that poses are given in: joint i
/// rotates about the z axis of frame i - 1, and frame 7 times the tool is the pose.
inline void frames(const OffsetChain& arm, const double* q, Pose<double> (&out)[joints + 1]) noexcept {
    const Arm& own = arm.nominal.own;
    Pose<double> frame = arm.link[0];
    for (int k = 0; k < joints; ++k) {
        out[k] = frame;
        frame = detail::turned_about_z(frame, sin_cos(to_theta(own, k, q[k]))) * arm.link[k + 1];
    }
    out[joints] = frame * own.tool_inverse;
}

/// The pose of the end effector at joint values q, in the frame that poses are given in, for any scalar.
template <class T>
Pose<T> tool_pose(const OffsetChain& arm, const T* q) noexcept {
    const Arm& own = arm.nominal.own;
    Pose<T> frame = spread<T>(arm.link[0]);
    for (int k = 0; k < joints; ++k) {
        const T theta = to_theta(q[k], T(own.sign[k]), T(own.offset[k]));
        frame = detail::turned_about_z(frame, sin_cos(theta)) * spread<T>(arm.link[k + 1]);
    }
    return frame;
}

/// The pose, the free joint's value and the GC of joint values q of the true chain; GC is that of the nominal
/// arm at the same theta.
inline OffsetPosture forward(const OffsetChain& arm, const double* q) noexcept {
    double theta[joints];
    for (int j = 0; j < joints; ++j) theta[j] = to_theta(arm.nominal.rest, j, q[robot_joint(arm, j)]);
    const double free = wrap(q[robot_joint(arm, 6)]);
    return {tool_pose(arm, q), free <= -pi ? pi : free, index(offset_branch(arm.nominal, theta))};
}

/// The geometric Jacobian of the true chain, as that of an arm with an offset (offset_posture.hpp).
inline Jacobian jacobian(const OffsetChain& arm, const double* q) noexcept {
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    return detail::jacobian_of(arm.nominal.own, frame);
}

namespace detail {

/// The corrected pose X(theta) of a flange pose; angle[k] is theta_{k+1} in the order of the formulas.
template <class T>
Pose<T> corrected_pose(const OffsetChain& arm, const Pose<T>& flange, const SinCos<T>* angle) noexcept {
    Pose<T> out = flange, frame = spread<T>(arm.nominal_row[0]);
    for (int k = 1; k < joints; ++k) {
        frame = turned_about_z(frame, angle[k - 1]);
        const Vec3<T> axis = frame.rotation * spread<T>(arm.axis[k]);
        const auto turned = [&](const Vec3<T>& v) noexcept {  // what the turn adds to v
            const Vec3<T> across = cross(axis, v);
            return mul_add(cross(axis, across), T(arm.versine[k]), across);
        };
        out.rotation.x = out.rotation.x + turned(out.rotation.x);
        out.rotation.y = out.rotation.y + turned(out.rotation.y);
        out.rotation.z = out.rotation.z + turned(out.rotation.z);
        out.position =
            out.position + turned(out.position - frame.position) + frame.rotation * spread<T>(arm.moved[k]);
        frame = frame * spread<T>(arm.nominal_row[k]);
    }
    return out;
}

/// The nominal self-motion of a corrected flange pose.
template <class T>
OffsetMotion<T> motion_of_flange(const OffsetArm& arm, const Pose<T>& flange,
                                 const OffsetBranch& branch) noexcept {
    const Vec3<T> at = mul_add(flange.rotation.z, T(-arm.rest.d_wf), flange.position);
    return {at - spread<T>(Vec3<double>{0, 0, arm.rest.d_bs}), flange.rotation, branch};
}

}  // namespace detail

}  // namespace armangle

#include "../../names/end.hpp"
