// Inverse kinematics, (pose, psi, GC) -> q, and the joint directions that it uses.
//
//     inverse(arm, pose, psi, gc, seed)   -> Inverse {q, status, margin}   eq. (12)-(24)
//
// The result reaches the pose in every case, also at singularities. forward.hpp has the inverse of this map.
#pragma once

#include "../arm/joint_map.hpp"
#include "../status.hpp"
#include "self_motion.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The seven model angles as direction vectors: theta_i = atan2(y[i], x[i]); the eighth slot is 0.
template <class T>
struct Directions {
    T y[joint_slots], x[joint_slots];
};

/// The entries that determine the joint angles: the columns of 0R3, the first two rows of 4R7, and the last
/// entry of its third row.
template <class T>
struct Frames {
    Vec3<T> x3, y3, z3, n1, n2;
    T n33;
};

/// Computes the entries of 0R3 and 4R7 at psi that determine the joints, eq. (15), (20).
template <class T>
ARMANGLE_INLINE Frames<T> frames(const SelfMotion<T>& m, const SinCos<T>& psi) noexcept {
    const Circle<T>& c = m.circle;
    const Elbow<T>& elbow = m.elbow;
    Frames<T> out;
    // shoulder: columns of 0R3, eq. (15)
    const Vec3<T> f = combine(c.e, psi.cos, c.z, -psi.sin);
    Vec3<T> w = c.w, z3 = combine(c.z, psi.cos, c.e, psi.sin);
    if (elbow.tilted) {
        w = combine(c.w, elbow.tilt.cos, z3, -elbow.tilt.sin);
        z3 = combine(c.w, elbow.tilt.sin, z3, elbow.tilt.cos);
    }
    out.x3 = combine(w, elbow.beta.sin, f, elbow.beta.cos);
    out.y3 = combine(w, elbow.beta.cos, f, -elbow.beta.sin);
    out.z3 = z3;
    // wrist: entries of 4R7, eq. (20)
    const Vec3<T> g = combine(c.tool_e, psi.cos, c.tool_z, -psi.sin);                 // f . tool axes
    Vec3<T> tool_w = c.tool_w, n2 = combine(c.tool_z, -psi.cos, c.tool_e, -psi.sin);  // second row
    if (elbow.tilted) {
        tool_w = combine(c.tool_w, elbow.tilt.cos, n2, elbow.tilt.sin);
        n2 = combine(c.tool_w, -elbow.tilt.sin, n2, elbow.tilt.cos);
    }
    out.n1 = combine(tool_w, elbow.gamma.sin, g, elbow.gamma.cos);  // first row
    out.n2 = n2;
    out.n33 = tool_w.z * elbow.gamma.cos - g.z * elbow.gamma.sin;
    return out;
}

/// Stores the directions of joints 1 to 3 in d, given theta_1 (a direction of any length) and sin(theta_2).
/// theta_3 follows from theta_1 and not from eq. (19), which loses theta_1 + theta_3 if theta_2 vanishes.
template <class T>
ARMANGLE_INLINE void put_shoulder(const Frames<T>& f, const SinCos<T>& theta_1, const T& sin_2,
                                  Directions<T>& d) noexcept {
    d.y[0] = theta_1.sin;
    d.x[0] = theta_1.cos;  // (17)
    d.y[1] = sin_2;
    d.x[1] = f.y3.z;  // (18)
    d.y[2] = theta_1.cos * f.x3.y - theta_1.sin * f.x3.x;
    d.x[2] = theta_1.sin * f.z3.x - theta_1.cos * f.z3.y;  // for (19)
}

/// Stores the directions of joints 5 to 7 in d, given theta_5 (of any length, like theta_1) and sin(theta_6);
/// theta_7 follows from theta_5.
template <class T>
ARMANGLE_INLINE void put_wrist(const Frames<T>& f, const SinCos<T>& theta_5, const T& sin_6,
                               Directions<T>& d) noexcept {
    d.y[4] = theta_5.sin;
    d.x[4] = theta_5.cos;  // (22)
    d.y[5] = sin_6;
    d.x[5] = f.n33;  // (23)
    d.y[6] = theta_5.cos * f.n2.x - theta_5.sin * f.n1.x;
    d.x[6] = theta_5.cos * f.n2.y - theta_5.sin * f.n1.y;  // for (24)
}

/// The directions of the seven joints on a self-motion at psi, eq. (16)-(23).
template <class T>
ARMANGLE_INLINE Directions<T> directions(const SelfMotion<T>& m, const SinCos<T>& psi) noexcept {
    const Configuration<T>& gc = m.gc;
    const T zero(0.0), one(1.0);
    const Frames<T> f = frames(m, psi);
    Directions<T> d;
    const T h2 = hypot(f.y3.x, f.y3.y);
    const auto singular_1 = shoulder_singular(m), flat_2 = h2 == zero;
    const auto lost_1 = singular_1 | flat_2;
    put_shoulder(
        f, SinCos<T>{select(lost_1, zero, gc.shoulder * f.y3.y), select(lost_1, one, gc.shoulder * f.y3.x)},
        gc.shoulder * h2, d);
    d.y[3] = m.elbow.theta_4.sin;
    d.x[3] = m.elbow.theta_4.cos;  // (4)
    const T h6 = hypot(f.n1.z, f.n2.z);
    const auto singular_5 = wrist_singular(m), flat_6 = h6 == zero;
    const auto lost_5 = singular_5 | flat_6;
    put_wrist(f, SinCos<T>{select(lost_5, zero, gc.wrist * f.n2.z), select(lost_5, one, gc.wrist * f.n1.z)},
              gc.wrist * h6, d);
    d.y[7] = zero;
    d.x[7] = one;
    return d;
}

/// Seven joint values (rad, robot coordinates), and an eighth that is 0.
struct Joints {
    double q[joint_slots];
};

/// The model angles theta (rad) of the directions, all joints in one vector.
ARMANGLE_INLINE JointLanes angles(const Directions<double>& d) noexcept {
    return atan2(JointLanes::of(d.y), JointLanes::of(d.x));
}

namespace detail {

/// The configuration q with the joint 7 of the configuration `near`; for an arm with free roll.
[[gnu::noinline, gnu::cold]] inline JointLanes with_held_roll(JointLanes q, JointLanes near) noexcept {
    double out[joint_slots], held[joint_slots];
    q.store(out);
    near.store(held);
    out[joints - 1] = held[joints - 1];
    return JointLanes::load(out);
}

}  // namespace detail

/// The joint values of the directions, each in the revolution within its limits nearest to `seed`, or to the
/// middle of the range if `seed` is null; nearest to the limits if no revolution is within them. With a free
/// roll, joint 7 is the seed's (or the middle).
inline Joints joints_within_limits(const Arm& arm, const Directions<double>& d, const double* seed) noexcept {
    const JointLanes near = seed ? joint_lanes(seed) : JointLanes::load(arm.joint_middle);
    JointLanes q = to_q(angles(d), JointLanes::load(arm.sign), JointLanes::load(arm.offset),
                        JointLanes::load(arm.limits.lower), JointLanes::load(arm.limits.upper), near);
    if (arm.roll_free) [[unlikely]]
        q = detail::with_held_roll(q, near);
    Joints out;
    q.store(out.q);
    return out;
}

/// The joint values of the directions, each in the revolution nearest to `near`, regardless of limits; for
/// continuity along a motion. With a free roll, joint 7 is that of `near`.
ARMANGLE_INLINE JointLanes joints_near(const Arm& arm, const Directions<double>& d,
                                       const JointLanes& near) noexcept {
    const JointLanes q =
        lift(to_q(angles(d), JointLanes::load(arm.sign), JointLanes::load(arm.offset)), near);
    if (arm.roll_free) [[unlikely]]
        return detail::with_held_roll(q, near);
    return q;
}

/// The joint values of the directions, each in the revolution nearest to `near` (seven values, rad),
/// regardless of limits. With a free roll, joint 7 is that of `near`.
inline Joints joints_near(const Arm& arm, const Directions<double>& d, const double* near) noexcept {
    Joints out;
    joints_near(arm, d, joint_lanes(near)).store(out.q);
    return out;
}

/// Result of inverse kinematics. q and margin are NaN unless the status is OK.
struct [[nodiscard]] Inverse {
    double q[joint_slots];  // seven joint values (rad, robot coordinates), and an eighth that is 0
    Status status;
    double margin;  // rad: distance to the nearest joint limit, negative outside the limits
};

/// Inverse kinematics: joint values of (pose, psi, branch gc). Each joint is in the revolution within its
/// limits nearest to the seed, or to the middle of its range without one. The status is OK even if q violates
/// the limits: `margin` reports that, and feasible() returns the psi within all limits. Otherwise
/// UNREACHABLE, FOLDED (wrist on shoulder) or BAD_INPUT: pose not rigid, gc not 0..7, psi or seed not finite
/// or beyond tolerance::largest_angle; q is then NaN.
inline Inverse inverse(const Arm& arm, const Pose<double>& pose, double psi, int gc,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (gc < 0 || gc >= configurations || !(abs(psi) <= tolerance::largest_angle)) return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const SelfMotion<double> m = self_motion(arm, pose, gc);
    out.status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (is_unreachable(m.circle) || is_folded(m.circle)) return out;
    const Joints solved = joints_within_limits(arm, directions(m, sin_cos(psi)), seed);
    for (int j = 0; j < joints; ++j) out.q[j] = solved.q[j];
    out.status = Status::OK;
    out.margin = limit_margin(arm.limits, solved.q);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
