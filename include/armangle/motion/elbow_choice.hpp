// Elbow motion while the end effector follows a target that is not known in advance.
//
//   psi carried      the psi of a new pose that moves the joints least
//   psi with room    near it, the psi whose joints are nearest to the middles of their ranges and away from
//                    limits and from theta_2, theta_6 = 0
//   psi through      the psi at which the arm will pass through theta_2 = 0 or theta_6 = 0
//   bend ahead       the bend that the elbow needs now to be in time for a target that comes closer:
//
//        bend |        .-- b(t + tau) of the target        near straight r ~ L (1 - b^2 / 8): a target that
//             |   ____/                                    comes in at constant speed requires b ~ sqrt(t),
//        now -|--/---- max (b(t + tau) - way(tau))         beyond joint 4's velocity and acceleration
//             +------------------ tau
#pragma once

#include <cmath>

#include "../circle/towards.hpp"
#include "../limits/joint_boxes.hpp"
#include "../limits/relaxed.hpp"
#include "hand_filter.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the elbow's motion while the target is followed.
struct ElbowChoiceTuning {
    static constexpr double longest = 0.2;  // rad: largest change of the carried psi in a control cycle
    static constexpr double unsure = 0.05;  // an elbow target this near to the shoulder-wrist line is ignored
    static constexpr double centre =
        0.03;  // cost of a joint off its middle: of x^2, x a share of half the range
    static constexpr double room = 0.05;         // cost of a joint near its limit
    static constexpr double edge = 1.05;         // that cost is x^2 / (edge - x^2)
    static constexpr double beyond = 100.0;      // cost of a joint that violates its limit
    static constexpr double singular = 0.1;      // cost of a rad^2 within the margin of theta_2, theta_6 = 0
    static constexpr double turning = 0.1;       // cost of a rad^2 of change in psi
    static constexpr double horizon = 0.6;       // s: time that the elbow looks ahead
    static constexpr int glances = 8;            // number of times checked within it
    static constexpr double acceleration = 0.7;  // share of joint 4's acceleration that is assumed ...
    static constexpr double under_way = 0.5;     // ... and of its present bending velocity
    static constexpr double most = 0.8;          // rad: largest bend in advance
    static constexpr double foresight = 0.5;     // s: time within which a crossing is predicted
    static constexpr int looks = 5;              // number of times checked within it
    static constexpr double detour = 0.8;        // rad: largest change of psi to pass through
    static constexpr double spin = 2.0;  // times their greatest velocity is too fast for a pivot's half
                                         // turn
};

/// Estimates the psi of a self-motion that moves the joints least from q, weighted by their velocity bounds
/// `fastest` (rad/s): the psi that keeps the elbow axis z3, corrected by one Gauss-Newton step.
inline double psi_carried(const Arm& arm, const SelfMotion<double>& m, const JointFunctions<double>& f,
                          const Vec3<double>& z3, const double* q, const double* fastest) noexcept {
    const double held = arm_angle(m.circle, z3);
    const SinCos<double> at = sin_cos(held);
    const Joints there = joints_near(arm, directions(m, at), q), slope = rate(arm, f, at);
    double along = 0, size = 0;
    for (int j = 0; j < joints; ++j) {
        if (!(abs(slope.q[j]) < infinity)) return held;
        const double weight = fastest[j] < infinity ? 1.0 / (fastest[j] * fastest[j]) : 1.0;
        along += weight * slope.q[j] * (there.q[j] - q[j]);
        size += weight * slope.q[j] * slope.q[j];
    }
    if (!(size > 0)) return held;
    return held - min(max(along / size, -ElbowChoiceTuning::longest), ElbowChoiceTuning::longest);
}

/// The psi that an elbow target requests, and its confidence: 0 if the target's point or direction lies along
/// the line shoulder-wrist, 1 if it is at a right angle to it.
struct ElbowChoice {
    double psi, confidence;
};

/// The arm angle nearest to a target point or direction of the elbow, with its confidence. Both are 0 if the
/// target is nearly on the line shoulder-wrist or no arm angle is nearer than others.
inline ElbowChoice hinted_psi(const Arm& arm, const SelfMotion<double>& m, const Towards& hint) noexcept {
    const WishedPsi wished = psi_towards(arm, m, hint);
    Vec3<double> v = arm.has_base ? arm.base_inverse.rotation * hint.target : hint.target;
    if (hint.wish == Wish::point) v = v + arm.base_inverse.position - Vec3<double>{0, 0, arm.d_bs};
    const double far = norm(v), across = norm(v - m.circle.w * dot(v, m.circle.w));
    if (wished.why != Indifferent::no || !(across > ElbowChoiceTuning::unsure * far) || !(far < infinity))
        return {0.0, 0.0};
    return {wished.psi, across / far};
}

namespace detail {

/// The costs of eight arm angles (sine and cosine) at once: for joints near their limits, in the revolutions
/// nearest to q, and for joints 2 and 6 within `margin` (rad) of 0 and pi.
inline Boxes crowding(const Arm& arm, const SelfMotion<double>& m, const JointFunctions<double>& f,
                      const SinCos<Boxes>& at, const double* q, double margin) noexcept {
    Boxes cost(0.0);
    const auto value = [&at](const Harmonic<double>& h) { return spread(h).at(at); };
    for (int side = 0; side < hinges; ++side) {
        const Pivot<double>&first = f.pivot[2 * side], &last = f.pivot[2 * side + 1];
        const double g = side == 0 ? m.gc.shoulder : m.gc.wrist;
        const Boxes u = value(first.U), v = value(first.V);
        const Boxes bend = atan2(hypot(u, v), value(f.hinge[side].H)), half_turn(g > 0 ? 0.0 : pi);
        const Boxes theta[3] = {atan2(u, v) + half_turn, Boxes(g) * bend,
                                atan2(value(last.U), value(last.V)) + half_turn};
        for (int k = 0; k < 3; ++k) {
            const int j = 4 * side + k;
            const double half = 0.5 * (arm.limits.upper[j] - arm.limits.lower[j]);
            if (!(half > 0) || !(half < infinity)) continue;
            const Boxes there = lift(to_q(theta[k], Boxes(arm.sign[j]), Boxes(arm.offset[j])), Boxes(q[j]));
            const Boxes share = (there - Boxes(arm.joint_middle[j])) * Boxes(1.0 / half), x = share * share;
            cost = cost + Boxes(ElbowChoiceTuning::centre) * x +
                   select(x < Boxes(1.0),
                          Boxes(ElbowChoiceTuning::room) * x / (Boxes(ElbowChoiceTuning::edge) - x),
                          Boxes(ElbowChoiceTuning::beyond) * x);
        }
        const Boxes near = max(Boxes(margin) - bend, Boxes(0.0)),
                    far = max(bend - Boxes(pi - margin), Boxes(0.0));
        cost = cost + Boxes(ElbowChoiceTuning::singular) * (near * near + far * far);
    }
    return cost;
}

}  // namespace detail

/// The change of psi (rad, -1.4 to 2.2) that moves the joints away from their limits, and joints 2 and 6 out
/// of the `margin` (rad) around 0 and pi: the least cost of sixteen changes, refined by the parabola through
/// it and its neighbours unless it is the first or the last. Without the parabola, a steadily moving target
/// would make psi switch between the sixteen values at full acceleration.
inline double turn_to_room(const Arm& arm, const SelfMotion<double>& m, double psi, const double* q,
                           double margin) noexcept {
    static constexpr int count = 2 * joint_slots;
    static constexpr double turns[count] = {-1.4, -0.9, -0.55, -0.3, -0.15, -0.06, -0.02, 0,
                                            0.02, 0.06, 0.15,  0.3,  0.55,  0.9,   1.4,   2.2};
    const JointFunctions<double> f = joint_functions(m);
    double cost[count];
    int best = 0;
    for (int part = 0; part < count; part += joint_slots) {
        const Boxes turn = Boxes::load(turns + part);
        const Boxes costs = detail::crowding(arm, m, f, sin_cos(Boxes(psi) + turn), q, margin) +
                            Boxes(ElbowChoiceTuning::turning) * turn * turn;
        costs.store(cost + part);
    }
    for (int i = 1; i < count; ++i) best = cost[i] < cost[best] ? i : best;
    if (best == 0 || best == count - 1) return turns[best];
    const double before = turns[best - 1], here = turns[best], after = turns[best + 1];
    const double rise = (cost[best] - cost[best - 1]) / (here - before),
                 next = (cost[best + 1] - cost[best]) / (after - here);
    if (!(next > rise)) return here;
    const double bottom = 0.5 * (before + here) - 0.5 * rise * (after - before) / (next - rise);
    return min(max(bottom, 0.5 * (before + here)), 0.5 * (here + after));
}

/// Whether the arm will pass through theta_2 = 0 or theta_6 = 0 if the elbow moves in time, and where.
struct Crossing {
    bool ahead = false;
    Vec3<double> axis{0, 0, 1};  // elbow axis z_3 at that time
};

namespace detail {

/// While psi varies, axis 3 of the shoulder (side 0; axis 5 of the wrist: side 1) moves on a cone around the
/// shoulder-wrist line, and axis 1 (7) rests. Positive if the resting axis lies inside that cone, negative
/// outside. Only at 0 can theta_2 (theta_6) vanish.
inline double inside_cone(const SelfMotion<double>& m, int side) noexcept {
    const SinCos<double> cone = lean(m.elbow, side == 0 ? m.elbow.beta : m.elbow.gamma);
    return (side == 0 ? m.circle.w.z : m.circle.tool_w.z) - cone.cos;
}

/// Whether the neighbours of joint 2 (side 0) or 6 (side 1) stay farther from their limits if this joint
/// passes through 0 than if each neighbour rotates by 180 degrees.
inline bool better_through(const Arm& arm, int side, const double* q) noexcept {
    double stay = 0, turn = 0;
    for (const int j : {4 * side, 4 * side + 2}) {
        const double half = 0.5 * (arm.limits.upper[j] - arm.limits.lower[j]);
        const double off = abs(q[j] - arm.joint_middle[j]);
        stay += off * off / (half * half);
        turn += (off - pi) * (off - pi) / (half * half);
    }
    return !(stay > turn);
}

}  // namespace detail

/// The crossing to which the target leads soon, if a change of psi takes the elbow there and the neighbouring
/// joints would otherwise rotate too fast; `ahead` is false if there is none. z3 is the present elbow axis,
/// `fastest` the velocity bounds (rad/s).
inline Crossing crossing_ahead(const Arm& arm, const Configuration<double>& gc, const Hand& hand,
                               const Vec3<double>& z3, const double* q, const double* fastest) noexcept {
    static constexpr double between = ElbowChoiceTuning::foresight / ElbowChoiceTuning::looks;
    const auto motion_of = [&](const Pose<double>& pose) {
        return self_motion(arm, circle(arm, flange_pose(arm, pose)), gc);
    };
    const Twist move = hand.velocity() * between;
    const Mat3<double> turned = from_rotation_vector(move.angular);
    Pose<double> pose = hand.pose();
    double before[hinges]{};
    for (int look = 0; look <= ElbowChoiceTuning::looks; ++look) {
        if (look > 0) pose = {turned * pose.rotation, pose.position + move.linear};
        const SelfMotion<double> m = motion_of(pose);
        if (is_folded(m.circle) || is_unreachable(m.circle)) return {};
        for (int side = 0; side < hinges; ++side) {
            const double last = before[side], now = before[side] = detail::inside_cone(m, side);
            if (look == 0 || !(last * now <= 0) || last == now) continue;
            if (!detail::better_through(arm, side, q)) continue;
            const double after = (look - now / (now - last)) * between;
            const SelfMotion<double> there = motion_of(hand.predicted(after));
            const Harmonic<double>& H = joint_functions(there).hinge[side].H;
            const double psi = atan2(H.s, H.c), way = abs(wrap(psi - arm_angle(there.circle, z3)));
            const SinCos<double> cone = lean(there.elbow, side == 0 ? there.elbow.beta : there.elbow.gamma);
            const double slowest = min(fastest[4 * side], fastest[4 * side + 2]);
            const double spin = abs(now - last) / between / (way * cone.sin * cone.sin);
            if (!(way <= ElbowChoiceTuning::detour) || spin < ElbowChoiceTuning::spin * slowest) continue;
            const SinCos<double> turn = sin_cos(psi);
            return {true, combine(there.circle.z, turn.cos, there.circle.e, turn.sin)};
        }
    }
    return {};
}

/// The bend (rad) that the elbow needs now, so that joint 4 can follow the wrist. The wrist continues at
/// `speed` (m/s) from `wrist` (m, relative to the shoulder). Joint 4 bends with `bending` (rad/s); `fastest`
/// and `hardest` bound its velocity and acceleration. 0 if both are infinite.
inline double bend_ahead(const Arm& arm, const Vec3<double>& wrist, const Vec3<double>& speed, double bending,
                         double fastest, double hardest) noexcept {
    const double start = ElbowChoiceTuning::under_way * min(max(bending, 0.0), fastest);
    const double a = ElbowChoiceTuning::acceleration * hardest, ramp = (fastest - start) / a;
    if (is_nan(ramp)) return 0.0;  // no bounds: always in time
    double need = 0;
    for (int i = 1; i <= ElbowChoiceTuning::glances; ++i) {
        const double after = ElbowChoiceTuning::horizon * i / ElbowChoiceTuning::glances;
        const double bend = detail::bend_of(arm, norm(wrist + speed * after));
        const double way = after < ramp ? (start + 0.5 * a * after) * after
                                        : fastest * after - 0.5 * (fastest - start) * ramp;
        need = max(need, bend - way);
    }
    return min(need, ElbowChoiceTuning::most);
}

}  // namespace armangle

#include "../names/end.hpp"
