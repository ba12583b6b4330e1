// An arm that is only nearly S-R-S: its own chain, and the nominal arm beside it that lends psi and GC.
//
//     true     T(theta) = G_0 Rz(theta_1) G_1 ... Rz(theta_7) G_7      what the robot is
//     nominal  N(theta) = H_0 Rz(theta_1) H_1 ... Rz(theta_7) H_7      exactly S-R-S, near to it
//
// Both take the same theta. A true frame may slide and turn along its joint's axis without changing T: the
// frames are put where the link deviations D_k = H_k G_k^-1 are least.
#pragma once

#include "../arm/frames.hpp"
#include "../numbers/rotations.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// By how much a link differs from the nominal one: translation (m) and rotation (rad).
struct LinkDeviation {
    double position, rotation;
};

/// An arm with its own chain. make_near_arm is the only maker.
struct ChainArm {
    Arm nominal;
    Pose<double> link[joints + 1];        // G_k
    LinkDeviation deviation[joints + 1];  // of D_k
    double wrist_shift, turn;  // how far the wrist of N(theta) can be from that of T(theta), m, rad
    // the same of the links between the joints; the first and the last move X by the same for all theta:
    // where they are alone X = first pose last
    double joint_shift, joint_turn;
    Pose<double> first, last;
    Vec3<double> wrist;        // the nominal wrist in the frame of the end effector, m
    double swing[joints + 1];  // m: by how much of its turning frame a link's deviation moves the wrist
    double ahead[joints],
        behind[joints];  // m: of links from a joint's frame to the wrist, and from the first
};

/// The nominal arm, which defines limits, psi and GC.
inline const Arm& nominal(const ChainArm& arm) noexcept { return arm.nominal; }

namespace detail {

/// A translation along the z axis (m).
inline Pose<double> along_z(double shift) noexcept {
    Pose<double> out = identity_pose();
    out.position.z = shift;
    return out;
}

/// Writes the fixed transforms H_0 ... H_7 of the nominal arm, between its joints, to `out`.
inline void nominal_links(const Arm& arm, Pose<double> (&out)[joints + 1]) noexcept {
    const Pose<double> origin = identity_pose();
    out[0] = arm.base;
    out[1] = dh_step<-1>(origin, 0.0, 1.0, arm.d_bs, 0.0);
    out[2] = dh_step<1>(origin, 0.0, 1.0, 0.0, 0.0);
    out[3] = dh_step<1>(origin, 0.0, 1.0, arm.d_se, arm.a_3);
    out[4] = dh_step<-1>(origin, 0.0, 1.0, arm.d_4, arm.a_4);
    out[5] = dh_step<-1>(origin, 0.0, 1.0, arm.d_ew, 0.0);
    out[6] = dh_step<1>(origin, 0.0, 1.0, 0.0, 0.0);
    out[7] = dh_step<0>(origin, 0.0, 1.0, arm.d_wf, 0.0) * arm.tool;
}

/// Converts the links of T = L_0 Rz(q_1) L_1 ... into links with theta as angles: Rz(s (theta - o)) = S
/// Rz(theta) Rz(-o) S, where S is the identity, or a rotation by pi about x for s = -1.
inline void links_in_theta(const Arm& arm, const Pose<double> (&in_q)[joints + 1],
                           Pose<double> (&out)[joints + 1]) noexcept {
    constexpr Pose<double> flip{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 0}};
    for (int k = 0; k <= joints; ++k) {
        out[k] = in_q[k];
        if (k > 0 && arm.sign[k - 1] < 0) out[k] = flip * out[k];
        if (k > 0 && arm.offset[k - 1] != 0)
            out[k] = turned_about_z(identity_pose(), sin_cos(-arm.offset[k - 1])) * out[k];
        if (k < joints && arm.sign[k] < 0) out[k] = out[k] * flip;
    }
}

/// Rotates and moves the frame of joint k (0..6) about and along its axis, such that the two links at it come
/// as near as possible to the nominal ones. The pose of the end effector is unchanged.
inline void align_frame(const Pose<double> (&nominal)[joints + 1], Pose<double> (&link)[joints + 1],
                        int k) noexcept {
    Pose<double>& before = link[k];
    Pose<double>& after = link[k + 1];
    const Pose<double>& wanted = nominal[k];
    const Pose<double>& then = nominal[k + 1];
    // tr(Rz(r)^T A) is greatest for A = before^T wanted + after then^T
    const Mat3<double>&b = before.rotation, &w = wanted.rotation, &a = after.rotation, &t = then.rotation;
    const double weight_before = k > 0 ? 1.0 : 0.0, weight_after = k + 1 < joints ? 1.0 : 0.0;
    const double cosine = weight_before * (dot(b.x, w.x) + dot(b.y, w.y)) +
                          weight_after * (a.x.x * t.x.x + a.y.x * t.y.x + a.z.x * t.z.x + a.x.y * t.x.y +
                                          a.y.y * t.y.y + a.z.y * t.z.y);
    const double sine = weight_before * (dot(b.y, w.x) - dot(b.x, w.y)) +
                        weight_after * (a.x.y * t.x.x + a.y.y * t.y.x + a.z.y * t.z.x - a.x.x * t.x.y -
                                        a.y.x * t.y.y - a.z.x * t.z.y);
    const double length = hypot(sine, cosine);
    if (!(length > 0)) return;  // no turn is better than another
    const SinCos<double> turn{sine / length, cosine / length};
    before = turned_about_z(before, turn);
    after = turned_about_z(identity_pose(), SinCos<double>{-turn.sin, turn.cos}) * after;
    const double slide = (weight_before * dot(b.z, wanted.position - before.position) +
                          weight_after * (after.position.z - then.position.z)) /
                         (weight_before + weight_after);
    before = before * along_z(slide);
    after = along_z(-slide) * after;
}

/// The angle (rad) of a rotation, accurate also if small.
inline double turn_of(const Mat3<double>& r) noexcept {
    const Vec3<double> x = r.x - Vec3<double>{1, 0, 0}, y = r.y - Vec3<double>{0, 1, 0},
                       z = r.z - Vec3<double>{0, 0, 1};
    return 2.0 * std::asin(min(sqrt((dot(x, x) + dot(y, y) + dot(z, z)) / 8.0), 1.0));
}

/// An upper bound (m) of the displacement that a pose causes at points within a distance (m) of its origin.
inline double farthest_moved(const Pose<double>& by, double distance) noexcept {
    const Mat3<double>& r = by.rotation;
    const Vec3<double> axis{r.y.z - r.z.y, r.z.x - r.x.z, r.x.y - r.y.x};
    const double length = norm(axis), along = length > 0 ? dot(axis, by.position) / length : 0.0;
    return hypot(along,
                 turn_of(r) * distance + sqrt(max(dot(by.position, by.position) - along * along, 0.0)));
}

/// Computes the deviations of the links from the nominal ones, and bounds of what they cause at the wrist.
inline void measure(ChainArm& out) noexcept {
    const Arm& arm = out.nominal;
    Pose<double> nominal[joints + 1];
    nominal_links(arm, nominal);
    out.wrist_shift = out.turn = out.joint_shift = out.joint_turn = 0;
    out.ahead[joints - 1] = out.behind[0] = 0;
    out.wrist = (arm.tool_inverse * along_z(-arm.d_wf)).position;
    // N T^-1 is the product of F_k D_k F_k^-1, where F_k is the nominal frame of joint k: each moves the
    // wrist by |D_k - 1| there, the wrist being off by what came before. Behind the elbow it stays in F_k.
    const double lever[joints + 1] = {norm(arm.base.position) + arm.d_bs + arm.reach,
                                      abs(arm.d_bs) + arm.reach,
                                      arm.reach,
                                      arm.reach,
                                      hypot(arm.forearm, arm.d_4),
                                      arm.forearm,
                                      0.0,
                                      0.0};
    const Vec3<double> none{0, 0, 0}, of_5 = nominal[5].position,
                                      of_4 = nominal[4].rotation * of_5 + nominal[4].position;
    const Vec3<double> to_wrist[joints + 1] = {none, none, none, none, of_4, of_5, none, none};
    out.first = nominal[0] * inverted(out.link[0]);
    out.last = inverted(out.link[joints]) * nominal[joints];
    for (int k = joints; k >= 0; --k) {
        const Pose<double> off = nominal[k] * inverted(out.link[k]);
        LinkDeviation& by = out.deviation[k];
        by = {norm(off.position), turn_of(off.rotation)};
        double moved = norm(off.rotation * to_wrist[k] + off.position - to_wrist[k]);
        out.swing[k] = moved;
        if (k < 4) {
            moved = farthest_moved(off, lever[k]);
            out.swing[k] = by.position + by.rotation * lever[k];
        }
        moved += by.rotation * out.wrist_shift;
        out.wrist_shift += moved;
        out.turn += by.rotation;
        if (k > 0 && k < joints) {
            out.joint_shift += moved;
            out.joint_turn += by.rotation;
        }
    }
    for (int k = 0; k <= joints; ++k) out.swing[k] += out.deviation[k].rotation * out.wrist_shift;
    out.ahead[joints - 1] = norm(out.link[joints].rotation * out.wrist + out.link[joints].position);
    for (int k = joints - 1; k > 0; --k) out.ahead[k - 1] = out.ahead[k] + norm(out.link[k].position);
    for (int k = 1; k < joints; ++k) out.behind[k] = out.behind[k - 1] + norm(out.link[k].position);
}

}  // namespace detail

/// Makes an arm on its own chain L_0 Rz(q_1) L_1 ... Rz(q_7) L_7, from the frame of poses to the end
/// effector, with orthonormal rotations. The parameters are those of the nominal arm.
inline ChainArm make_near_arm(const ArmParameters& parameters,
                              const Pose<double> (&links)[joints + 1]) noexcept {
    constexpr int sweeps =
        32;  // neighbouring axes are nearly square, so that frames hardly disturb each other
    ChainArm out{make_arm(parameters), {}, {}, 0.0, 0.0, 0.0, 0.0, {}, {}, {}, {}, {}, {}};
    Pose<double> nominal[joints + 1];
    detail::nominal_links(out.nominal, nominal);
    detail::links_in_theta(out.nominal, links, out.link);
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (int k = 0; k < joints; ++k) detail::align_frame(nominal, out.link, k);
    detail::measure(out);
    return out;
}

/// The same chain, with a nominal arm on another base.
inline ChainArm with_base(const ChainArm& arm, const Pose<double>& base) noexcept {
    ArmParameters parameters = arm.nominal;
    parameters.base = base;
    ChainArm out = arm;
    out.nominal = make_arm(parameters);
    detail::measure(out);
    return out;
}

/// The same chain with other limits.
inline ChainArm with_limits(const ChainArm& arm, const Limits& limits) noexcept {
    ArmParameters parameters = arm.nominal;
    parameters.limits = limits;
    ChainArm out = arm;
    out.nominal = make_arm(parameters);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
