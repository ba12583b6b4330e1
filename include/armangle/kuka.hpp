// The representation of a solution in a KUKA LBR's controller: pose, E1, Status, Turn.
//
// E1 is the value of axis A3, not an angle on the elbow's circle: this holds for all 1288 frames taught on
// robots in three public projects (docs/guides/kuka.md). With A3 given, the wrist in frame 2 is
//
//     (x2, y2, z2) = (-s4 c3 d_ew, -s4 s3 d_ew, d_se + c4 d_ew),
//
// which A1 and A2 carry to the wrist p of the pose. |y2| is its distance from the plane of A1 and A2. So x =
// +-sqrt(p_x^2 + p_y^2 - y2^2) is its distance in front of axis 1, behind it if Status bit 0 is set. A2 turns
// (x2, z2) into (x, p_z), and A1 turns (x, y2) into (p_x, p_y).
#pragma once

#include "armangle.hpp"

#include "names/begin.hpp"

namespace armangle::kuka {

/// Bits of Status: wrist behind axis 1 (overhead), A4 < 0, A6 < 0.
inline constexpr int overhead = 1, bent_back = 2, wrist_down = 4, status_bits = 8, turn_bits = 1 << joints;

/// Whether an arm is built as KUKA's controllers assume: no elbow offset, and stretched if all joints are 0.
inline bool is_alike(const Arm& arm) noexcept {
    bool alike = arm.a_3 == 0 && arm.a_4 == 0 && arm.d_4 == 0;
    for (int j = 0; j < joints; ++j) alike &= arm.offset[j] == 0;
    return alike;
}

/// The number Turn of joints q: bit i - 1 is set where A_i < 0.
inline int turn(const double* q) noexcept {
    int bits = 0;
    for (int j = 0; j < joints; ++j) bits |= (q[j] < 0) << j;
    return bits;
}

/// The number Status of joints q, the sum of its bits.
inline int status(const Arm& arm, const double* q) noexcept {
    const Chain c = chain(arm, q);
    const Vec3<double> wrist = c.flange.position - c.flange.rotation.z * arm.d_wf;
    const SinCos<double> first = sin_cos(c.theta[0]);
    const bool behind = wrist.x * first.cos + wrist.y * first.sin < -tolerance::reference * arm.reach;
    return behind * overhead + (q[3] < 0) * bent_back + (q[5] < 0) * wrist_down;
}

namespace detail {

/// The cosine (1 or -1) of the theta of a joint (0..6) if theta is 0 or pi; 0 otherwise.
inline double straight(const Arm& arm, const double* q, int joint) noexcept {
    const SinCos<double> at = sin_cos(to_theta(arm, joint, q[joint]));
    if (abs(at.sin) > tolerance::angle) return 0.0;
    return at.cos < 0 ? -1.0 : 1.0;
}

/// A range of values (rad).
struct Range {
    double lower, upper;
};

/// Joints that rotate around one axis; only the sum of their rotations is fixed.
struct OneAxis {
    static constexpr int most = 3;
    int count = 0;
    int joint[most];
    double way[most];  // +1 or -1: direction in which q of the joint turns the axis

    /// Adds joint j (0..6). Its axis has the direction of the others if `alike` is 1, the opposite one if -1.
    void add(const Arm& arm, int j, double alike) noexcept {
        joint[count] = j;
        way[count++] = arm.sign[j] * alike;
    }
};

/// Redistributes the rotation of some joints around one axis. In order, each joint takes its value in `near`
/// if all can then keep their limits, with the signs of Turn if one is given. Otherwise it takes the middle
/// of the range that permits this. Returns false, and changes nothing, if no distribution is possible.
inline bool share_turn(const Arm& arm, const OneAxis& axis, const double* near, const int* turn,
                       double* q) noexcept {
    // range of each joint's turn, and of the sum of it and all later joints
    double lower[OneAxis::most], upper[OneAxis::most], least[OneAxis::most + 1] = {},
                                                                             most[OneAxis::most + 1] = {};
    double whole = 0;
    for (int i = axis.count - 1; i >= 0; --i) {
        const int j = axis.joint[i];
        double low = max(arm.limits.lower[j], -two_pi), high = min(arm.limits.upper[j], two_pi);
        if (turn && *turn >> j & 1) high = min(high, -2 * tolerance::angle);
        if (turn && !(*turn >> j & 1)) low = max(low, 0.0);
        if (low > high) return false;
        lower[i] = min(axis.way[i] * low, axis.way[i] * high);
        upper[i] = max(axis.way[i] * low, axis.way[i] * high);
        least[i] = least[i + 1] + lower[i];
        most[i] = most[i + 1] + upper[i];
        whole += axis.way[i] * q[j];
    }
    // among the possible turns of the sum, the one that keeps the first joint at `near` or leaves most room
    const auto stretch = [&](int i, double rest) {
        return Range{max(lower[i], rest - most[i + 1]), min(upper[i], rest - least[i + 1])};
    };
    const auto wanted = [&](int i) { return axis.way[i] * near[axis.joint[i]]; };
    double room = -1, rest = 0;
    for (int turns = -5; turns <= 5; ++turns) {
        const double now = whole + two_pi * turns;
        const Range of = stretch(0, now);
        const bool fits = wanted(0) >= of.lower && wanted(0) <= of.upper;
        const double here = fits ? infinity : of.upper - of.lower;
        if (here <= room) continue;
        room = here;
        rest = now;
    }
    if (room < 0) return false;
    for (int i = 0; i < axis.count; ++i) {
        const Range of = stretch(i, rest);
        const bool fits = wanted(i) >= of.lower && wanted(i) <= of.upper;
        const double value = fits ? wanted(i) : 0.5 * (of.lower + of.upper);
        q[axis.joint[i]] = axis.way[i] * value;
        rest -= value;
    }
    return true;
}

}  // namespace detail

/// Redistributes the rotations that pose, E1 and Status leave undetermined. If A6 is 0, A5 and A7 rotate
/// around one axis. If A2 and A4 are 0, A1 and A5 do. If all are 0, all three do. A1, then A5, takes the
/// seed's value (default: the middle of its range) if all can then keep their limits, and the signs of Turn
/// if given. Otherwise it takes the middle of the range that permits this. Returns false, and changes
/// nothing, if nothing is undetermined or no distribution exists.
inline bool share_turns(const Arm& arm, const double* seed, const int* turn, double* q) noexcept {
    const double upright = detail::straight(arm, q, 1) * detail::straight(arm, q, 3),
                 wrist = detail::straight(arm, q, 5);
    if (upright == 0 && wrist == 0) return false;
    detail::OneAxis axis;
    if (upright != 0) axis.add(arm, 0, upright);
    axis.add(arm, 4, 1.0);
    if (wrist != 0) axis.add(arm, 6, wrist);
    return detail::share_turn(arm, axis, seed ? seed : arm.joint_middle, turn, q);
}

/// The unique solution of a pose with A3 = e1 (rad) and Status `asked`. Each joint is in the revolution
/// within its limits nearest to the seed. LIMITS if no solution with this Status has that A3, regardless of
/// limits; BAD_INPUT also if is_alike() is false.
inline Inverse inverse(const Arm& arm, const Pose<double>& pose, double e1, int asked,
                       const double* seed = nullptr) noexcept {
    constexpr double no = not_a_number;
    Inverse out{{no, no, no, no, no, no, no, 0.0}, Status::BAD_INPUT, no};
    if (!is_alike(arm) || asked < 0 || asked >= status_bits || !(abs(e1) <= tolerance::largest_angle))
        return out;
    if (!is_rigid(pose) || (seed && !is_finite(seed))) return out;
    const auto side = [&](int bit, int joint) { return asked & bit ? -arm.sign[joint] : arm.sign[joint]; };
    Configuration<double> gc{1.0, side(bent_back, 3), side(wrist_down, 5)};
    const SelfMotion<double> m = self_motion(arm, pose, gc);
    out.status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (out.status == Status::UNREACHABLE || is_folded(m.circle)) return out;
    const SinCos<double> third = sin_cos(to_theta(arm, 2, e1)), &fourth = m.elbow.theta_4;
    const double x2 = -fourth.sin * third.cos * arm.d_ew, y2 = -fourth.sin * third.sin * arm.d_ew,
                 z2 = arm.d_se + fourth.cos * arm.d_ew;
    const Vec3<double> p = m.circle.w * m.circle.distance;
    const double room = p.x * p.x + p.y * p.y - y2 * y2,
                 rounding = 2 * tolerance::reach * arm.size * arm.reach;
    out.status = Status::LIMITS;
    if (room < -rounding) return out;
    const double x = (asked & overhead ? -1.0 : 1.0) * sqrt(max(room, 0.0));
    const double theta_1 = wrap(atan2(p.y, p.x) - atan2(y2, x)),
                 theta_2 = atan2(x * z2 - p.z * x2, x * x2 + p.z * z2);
    double q[joint_slots] = {to_q(arm, 0, theta_1), to_q(arm, 1, theta_2), e1,
                             to_q(arm, 3, atan2(fourth.sin, fourth.cos))};
    gc.shoulder = theta_2 < 0 ? -1.0 : 1.0;
    const double psi = arm_angle(m.circle, chain(arm, q).z3);
    out = armangle::inverse(arm, pose, psi, index(gc), seed);
    if (out.status != Status::OK) return out;
    // if A2 is 0, the inverse sets A1 to 0: A1 and A3 rotate about one axis, and E1 fixes their shares
    if (abs(sin_cos(theta_2).sin) <= tolerance::angle) {
        const double near = seed ? seed[0] : arm.joint_middle[0];
        out.q[0] = to_q(theta_1, arm.sign[0], arm.offset[0], arm.limits.lower[0], arm.limits.upper[0], near);
        out.q[2] = e1;
    }
    share_turns(arm, seed, nullptr, out.q);
    out.margin = limit_margin(arm.limits, out.q);
    return out;
}

namespace detail {

/// Adds the values of A3 over one arc of psi, if the wrist is behind axis 1 there (`behind`), or else in
/// front of it.
inline void add_values(const Arm& arm, const SelfMotion<double>& m, const JointFunctions<double>& f,
                       double lower, double upper, bool behind, UnionOfArcs& out) noexcept {
    const Directions<double> d = directions(m, sin_cos(0.5 * (lower + upper)));
    const double size = hypot(d.x[0], d.y[0]);
    const double ahead = (m.circle.w.x * d.x[0] + m.circle.w.y * d.y[0]) / (size > 0 ? size : 1.0);
    if ((ahead < 0) != behind) return;
    const armangle::detail::Swings s = armangle::detail::swings(f.pivot[1], f.hinge[0], lower, upper);
    for (int k = 0; k < s.count; ++k) {
        const double a = to_q(arm, 2, s.least[k]), b = to_q(arm, 2, s.most[k]);
        out.add({min(a, b), max(a, b), 0, 0});
    }
}

/// Adds the values of A3 if A2 is 0, so that A1 and A3 rotate around one axis and share a fixed rotation
/// within their ranges. The sign of -sin(A4) cos(A3) decides whether the wrist is in front of axis 1.
inline void add_shared(const Arm& arm, const armangle::detail::Needle& n, bool behind,
                       UnionOfArcs& out) noexcept {
    constexpr int first = 0, third = 2, fourth = 3;
    if (n.along[0] == 0 || !armangle::detail::holds(arm, n, -1)) return;
    const ThetaRange a = theta_range(arm, arm.limits, first), b = theta_range(arm, arm.limits, third);
    const double along = n.along[0], from = n.theta[third] - along * a.lower,
                 to = n.theta[third] - along * a.upper;
    const bool forward = -sin_cos(n.theta[fourth]).sin > 0;
    const double middle = forward == behind ? pi : 0.0;
    ArcSet shared, own, before, both, all;
    make_arc(shared, min(from, to), max(from, to), 0, 0);
    make_arc(own, b.lower, b.upper, 0, 0);
    make_arc(before, middle - half_pi, middle + half_pi, 0, 0);
    intersect(shared, own, both);
    intersect(both, before, all);
    for (int i = 0; i < all.count; ++i) {
        const double p = to_q(arm, third, all.arc[i].lower), q = to_q(arm, third, all.arc[i].upper);
        out.add({min(p, q), max(p, q), 0, 0});
    }
}

}  // namespace detail

/// Computes the values of E1 (rad) for which a pose has a solution with Status `asked` within all limits;
/// empty, with the reason, if there is none.
inline armangle::Status e1_arcs(const Arm& arm, const Pose<double>& pose, int asked, const LimitTable& t,
                                ArcSet& out) noexcept {
    make_empty(out);
    if (!is_alike(arm) || asked < 0 || asked >= status_bits) return Status::BAD_INPUT;
    UnionOfArcs values;
    Status why = Status::UNREACHABLE;
    for (const double shoulder : {1.0, -1.0}) {
        const Configuration<double> gc{shoulder, (asked & bent_back ? -1.0 : 1.0) * arm.sign[3],
                                       (asked & wrist_down ? -1.0 : 1.0) * arm.sign[5]};
        const SelfMotion<double> m = self_motion(arm, pose, gc);
        const JointFunctions<double> f = joint_functions(m);
        ArcSet arcs;
        why = armangle::detail::nearer_reason(why, feasible(m, f, t, arcs));
        // the wrist crosses the plane beside axis 1 if A1 is perpendicular to it
        const Pivot<double>& first = f.pivot[0];
        const auto square = [&](double u, double v) { return m.circle.w.y * u + m.circle.w.x * v; };
        const Roots sides =
            roots({square(first.U.s, first.V.s), square(first.U.c, first.V.c), square(first.U.k, first.V.k)});
        for (int i = 0; i < arcs.count; ++i) {
            armangle::detail::Walk cuts;
            cuts.psi[cuts.count++] = arcs.arc[i].lower;
            cuts.psi[cuts.count++] = arcs.arc[i].upper;
            for (int k = 0; k < sides.count; ++k)
                cuts.insert(sides.psi[k], arcs.arc[i].lower, arcs.arc[i].upper);
            for (int k = 1; k < cuts.count; ++k)
                detail::add_values(arm, m, f, cuts.psi[k - 1], cuts.psi[k], asked & overhead, values);
        }
        if (t.margin > 0 || is_unreachable(m.circle) || is_folded(m.circle)) continue;
        armangle::detail::each_needle(arm, m, f, f, [&](const armangle::detail::Needle& n) {
            detail::add_shared(arm, n, asked & overhead, values);
        });
    }
    values.finish(out);
    if (!out.empty()) return Status::OK;
    return why == Status::OK ? Status::LIMITS : why;
}

}  // namespace armangle::kuka

#include "names/end.hpp"
