// How psi leaves a configuration with theta_2 = 0 or theta_6 = 0.
//
//       psi < held      held      psi > held
//     ------------------. | .------------------
//          pivot at a    \|/    at a + half a turn
//
// There the two pivots next to the hinge rotate about one axis: turning them against each other moves neither
// end effector nor elbow. psi can leave only at two of their values, one for each direction; the branch that
// meets exchanges the two. To change psi, the pivots must therefore turn first, while psi is constant.
//
// Near such a configuration the same happens within a small range of psi, d pivot / d psi ~ 1 / theta_2. psi
// must move slowly while the pivots turn, and they must be at rest before psi moves fast.
#pragma once

#include "../circle/forward.hpp"
#include "../circle/inverse.hpp"
#include "../circle/joint_function.hpp"
#include "../limits/arcs.hpp"
#include "../limits/limit_table.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the way out of a singular posture.
struct LeavingTuning {
    static constexpr double singular =
        1e-10;                             // |sin| of theta_2, theta_6 at which pivots leave the tool still
    static constexpr double off = 1e-7;    // rad by which psi leaves
    static constexpr double nearly = 0.2;  // |sin| below which psi slows down for the coming motion
    static constexpr double coarsest = 0.02;  // share of that sine at which psi is sampled
    static constexpr double offs[] = {0.25, 0.5, 1, 2, 4, 8, 16, 32, 64};  // times that: rad of psi ahead
};

/// Whether theta_2 (side 0) or theta_6 (side 1) is 0 or pi.
inline bool is_singular(const Chain& now, int side) noexcept {
    return abs(sin_cos(now.theta[4 * side + 1]).sin) <= LeavingTuning::singular;
}
/// Whether theta_2 or theta_6 is 0 or pi.
inline bool is_singular(const Chain& now) noexcept { return is_singular(now, 0) || is_singular(now, 1); }

/// The smaller |sin| of theta_2 and theta_6; 0 at a singularity.
inline double singularity_sine(const Chain& now) noexcept {
    return min(abs(sin_cos(now.theta[1]).sin), abs(sin_cos(now.theta[5]).sin));
}
/// Whether theta_2 or theta_6 is so near to 0 or pi that their neighbours move fast as psi changes.
inline bool is_nearly_singular(const Chain& now) noexcept {
    return singularity_sine(now) < LeavingTuning::nearly;
}

/// The greatest velocity of psi (rad/s) near a singularity. From it the joints can brake, with `share` of
/// their accelerations, to the permitted velocity at each place up to `way` rad from `held`, the present psi.
/// The condition is v_j^2 <= (v_psi q_j')^2 + 2 a_j |q_j there - q_j|. v_psi is the velocity that the joints
/// permit there, at most what psi can have gained until then.
inline double speed_near_singular(const Arm& arm, const SelfMotion<double>& m,
                                  const JointFunctions<double>& f, const Chain& now, double held, double way,
                                  const double* q, const double* velocity_now, const double* velocity,
                                  const double* acceleration, double share) noexcept {
    const SinCos<double> here = sin_cos(held);
    const Joints from = joints_near(arm, directions(m, here), q), slope = rate(arm, f, here);
    double along = 0, square = 0, fastest = infinity;
    for (int j = 0; j < joints; ++j) {
        along += velocity_now[j] * slope.q[j];
        square += slope.q[j] * slope.q[j];
    }
    const double present = along / square, bend = min(singularity_sine(now), LeavingTuning::coarsest);
    for (const double off : LeavingTuning::offs) {
        const double by = off * bend;
        if (!(by < abs(way))) break;
        const SinCos<double> at = sin_cos(held + copysign(by, way));
        const Joints there = joints_near(arm, directions(m, at), q), then = rate(arm, f, at);
        double may = infinity, gains = infinity;
        for (int j = 0; j < joints; ++j) {
            may = min(may, 0.5 * velocity[j] / abs(then.q[j]));
            gains = min(gains, share * acceleration[j] / abs(then.q[j]));
        }
        may = min(may, sqrt(present * present + 2.0 * gains * by));
        for (int j = 0; j < joints; ++j) {
            const double v = may * then.q[j], room = abs(there.q[j] - from.q[j]);
            fastest = min(fastest, sqrt(v * v + 2.0 * share * acceleration[j] * room) / abs(slope.q[j]));
        }
    }
    return fastest;
}

/// A way out of a singularity: the psi that becomes reachable, and the motion of the neighbouring joints that
/// comes first.
struct Leaving {
    double missed = infinity;   // rad: smallest possible distance of psi from the requested one
    double longest = infinity;  // rad: largest turn of a pivot
    double psi = not_a_number;
    int gc = -1;            // -1: there is none
    Joints to{};            // a solution of the pose near the singular one
    double d[joints] = {};  // rad that pivots turn first, with end effector and psi constant
};

namespace detail {

/// How far (rad, at most pi) psi may move from `held` to one side (1 or -1) within the arcs; 0 if it may not.
inline double room_on_side(const ArcSet& arcs, double held, double side) noexcept {
    if (arcs.full) return pi;
    const Place place = find(arcs, held + side * LeavingTuning::off, 0.0);
    if (place.index < 0) return 0.0;
    const Arc& arc = arcs.arc[place.index];
    const double way = side > 0 ? arc.upper - place.psi : place.psi - arc.lower;
    return min(max(way, 0.0) + LeavingTuning::off, pi);
}

/// The nearest configuration to one side (1 or -1) of `held`, at most `room` (rad) away, that is no longer
/// singular; `psi` is its arm angle, NaN if there is none.
inline Joints posture_on_side(const Arm& arm, const SelfMotion<double>& m, const double* q, double held,
                              double side, double room, double& psi) noexcept {
    Joints out;
    for (double off = LeavingTuning::off; off <= room; off *= 10.0) {
        psi = held + side * off;
        const Directions<double> d = directions(m, sin_cos(psi));
        out = joints_within_limits(arm, d, q);
        if (min(abs(d.y[1]), abs(d.y[5])) > 10.0 * LeavingTuning::singular) return out;
    }
    psi = not_a_number;
    return out;
}

}  // namespace detail

/// Replaces `best` by a better joint motion out of the singular configuration q, whose psi is `held`, within
/// the arcs of a self-motion: one whose psi is nearer to `wish`, or as near with less motion.
inline void offer_ways_on(const Arm& arm, const SelfMotion<double>& m, const ArcSet& arcs, const Chain& now,
                          double held, double wish, const double* q, Leaving& best) noexcept {
    for (const double side : {1.0, -1.0}) {
        const double room = detail::room_on_side(arcs, held, side);
        if (!(room > LeavingTuning::off)) continue;
        const double towards = side * wrap(wish - held);
        const double far = min(towards, room);  // beyond that the other side is shorter
        if (!(far > LeavingTuning::off)) continue;
        Leaving one;
        one.missed = towards - far;
        one.gc = index(m.gc);
        one.to = detail::posture_on_side(arm, m, q, held, side, room, one.psi);
        bool within = !is_nan(one.psi);
        one.longest = 0;
        for (int k = 0; k < hinges; ++k) {
            if (!is_singular(now, k)) continue;
            const int first = 4 * k, last = first + 2;
            one.d[first] = one.to.q[first] - q[first];
            const double opposite = sin_cos(now.theta[first + 1]).cos < 0 ? -1.0 : 1.0;  // theta = pi
            one.d[last] = -opposite * arm.sign[first] * arm.sign[last] * one.d[first];
            one.longest = max(one.longest, abs(one.d[first]));
            const double end = q[last] + one.d[last];
            within &= end >= arm.limits.lower[last] && end <= arm.limits.upper[last];
        }
        const bool nearer = one.missed < best.missed - LeavingTuning::off,
                   shorter = one.missed <= best.missed + LeavingTuning::off && one.longest < best.longest;
        if (within && (nearer || shorter)) best = one;
    }
}

/// The share of the joint motion `way.d`, nearest to `wanted`, that keeps every joint within a box of moves
/// from lower to upper (rad); any value if the box is empty.
inline double share_within(const Leaving& way, double wanted, const double* lower,
                           const double* upper) noexcept {
    double least = -infinity, most = infinity;
    for (int j = 0; j < joints; ++j) {
        const double d = way.d[j];
        if (!(abs(d) > 0)) continue;
        least = max(least, (d > 0 ? lower[j] : upper[j]) / d);
        most = min(most, (d > 0 ? upper[j] : lower[j]) / d);
    }
    return min(max(wanted, least), most);
}

/// Whether the rest of the joint motion `way.d` is so short that the joints can stop and psi can move from
/// the next step on: at most half of the moves lower <= 0 <= upper (rad) that one step permits.
inline bool has_arrived(const Leaving& way, const double* lower, const double* upper) noexcept {
    for (int j = 0; j < joints; ++j)
        if (!(abs(way.d[j]) <= 0.5 * min(upper[j], -lower[j]))) return false;
    return true;
}

}  // namespace armangle

#include "../names/end.hpp"
