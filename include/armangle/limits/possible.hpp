// The psi at which a solution is possible, whatever the rounding of a pose. A branch without such psi has no
// solution for certain.
//
// A solved pose may be off by LocalSolveTuning::meets. Near a straight elbow its bend is then known to the
// root of that, and the frames on both sides of the elbow turn with it. Each boundary function B(psi) of a
// limit is therefore widened by this turn: where B + slack < 0, the limit is violated for certain. A pivot's
// direction (V, U) is as long as sin(theta) of its hinge, so the same slack forbids little near a
// singularity.
#pragma once

#include "feasible.hpp"
#include "solve_locally.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// The bend of the elbow (rad) for a distance n (m) of wrist and shoulder, clamped to the reach.
inline double bend_at(const Arm& arm, double n) noexcept {
    const double L = arm.reach, D = arm.inner_reach;
    return 2.0 * atan2(sqrt(max((L - n) * (L + n), 0.0)), sqrt(max((n - D) * (n + D), 0.0)));
}

/// The angle (rad) at the shoulder between upper arm and wrist, for a bend of the elbow.
inline double shoulder_angle(const Arm& arm, const SinCos<double>& eta) noexcept {
    return atan2(arm.forearm * eta.sin, arm.upper_arm + arm.forearm * eta.cos);
}

/// The bends (rad) at which a pose with this wrist distance counts as solved.
struct BendRange {
    double least, most;
};
/// The range of the elbow angle (rad) for a distance n (m) of the wrist, with the tolerance of the search:
/// the position of a solved pose and its rotation may both be off.
inline BendRange bends_of(const Arm& arm, double n) noexcept {
    const double off = sqrt(2.0) * LocalSolveTuning::meets * arm.size;
    return {bend_at(arm, n + off), bend_at(arm, max(n - off, 0.0))};
}

/// The circle of a pose with its elbow bent by another angle (rad).
inline Circle<double> with_bend(const Arm& arm, Circle<double> c, double bend) noexcept {
    c.triangle.eta = sin_cos(bend);
    c.triangle.kappa = sin_cos(shoulder_angle(arm, c.triangle.eta));
    return c;
}

/// How far (rad) the frames of upper arm and forearm, and theta_4, may rotate while a pose stays solved.
struct TurnSlack {
    double arm[hinges], elbow;
};
/// The rotations if the elbow bends by any angle of `range` instead of `here` (rad), with the tolerance of a
/// solved pose.
inline TurnSlack turn_slack(const Arm& arm, const Circle<double>& c, double here,
                            const BendRange& range) noexcept {
    const double rest = 4.0 * LocalSolveTuning::meets * (1.0 + arm.size / c.distance);
    TurnSlack out{{0.0, 0.0}, 0.0};
    for (const double end : {range.least, range.most}) {
        const double elbow = end - here,
                     upper = shoulder_angle(arm, sin_cos(end)) - shoulder_angle(arm, sin_cos(here));
        out.arm[0] = max(out.arm[0], abs(upper));
        out.arm[1] = max(out.arm[1], abs(elbow - upper));
        out.elbow = max(out.elbow, abs(elbow));
    }
    for (double& slack : out.arm) slack += rest;
    out.elbow += rest;
    return out;
}

/// The rotations over all bends at which the pose counts as solved. If the elbow may be stretched or folded,
/// this includes its other sign.
inline TurnSlack turn_slack(const Arm& arm, const Circle<double>& c) noexcept {
    const BendRange bends = bends_of(arm, c.distance);
    TurnSlack out = turn_slack(arm, c, atan2(c.triangle.eta.sin, c.triangle.eta.cos), bends);
    if (bends.least > 0 && bends.most < pi) return out;
    const TurnSlack across = turn_slack(arm, c, bends.least, bends);
    for (int side = 0; side < 2; ++side) out.arm[side] = 2.0 * (out.arm[side] + across.arm[side]);
    out.elbow = 2.0 * (out.elbow + across.elbow);
    return out;
}

/// The arc where a boundary function is negative; empty or full if it has no root.
inline Arc negative_arc(const Harmonic<double>& B) noexcept {
    const double h = hypot(B.s, B.c);
    if (B.k >= h) return {0, 0, 0, 0};
    if (B.k <= -h) return {-pi, pi, 0, 0};
    const double half = half_between_roots(B, h), start = wrap(atan2(B.s, B.c) + half);
    const double lower = start >= pi ? -pi : start;
    return {lower, lower + two_pi - 2.0 * half, 0, 0};
}

/// Writes the psi at which no joint but the fourth violates its limits by more than the slack (rad). The
/// signs of theta_2 and theta_6 are those of the branch, whatever the joint functions have.
inline void possible(const LimitTable& t, const SelfMotion<double>& m, const JointFunctions<double>& f,
                     const TurnSlack& slack, ArcSet& out) noexcept {
    const bool lost[hinges] = {shoulder_singular(m), wrist_singular(m)};
    const double sign[hinges] = {m.gc.shoulder, m.gc.wrist};
    Blocked blocked;
    const auto block = [&](bool wide, const Arc& a, const Arc& b) {
        if (wide) return block_both(a, b, blocked);
        blocked.add(a);
        blocked.add(b);
    };
    for (int p = 0; p < pivots; ++p) {
        if (t.cone[p].free || lost[p / 2]) continue;
        const Harmonic<double>&U = f.pivot[p].U, &V = f.pivot[p].V;
        const auto beyond = [&](int limit) {
            const double u = sign[p / 2] * t.u[limit], v = sign[p / 2] * t.v[limit];
            const double s = u * U.s + v * V.s, c = u * U.c + v * V.c;
            // so that no gap is lost as too narrow
            const double apart = 2.0 * tolerance::angle * hypot(s, c);
            return negative_arc({s, c, u * U.k + v * V.k + slack.arm[p / 2] + apart});
        };
        block(t.cone[p].wide, beyond(p), beyond(pivots + p));
    }
    for (int h = 0; h < hinges; ++h) {
        // the cosine of a hinge is rounded too
        const double off = slack.arm[h] + 2.0 * tolerance::angle + sqrt(2.0 * tolerance::touching);
        const int negative = sign[h] < 0, count = t.piece_count[h][negative];
        const HingePiece* piece = t.piece[h][negative];
        const Harmonic<double>& H = f.hinge[h].H;
        const auto nearer = [&](const HingeEnd& end) {
            return negative_arc({-H.s, -H.c, sin_cos(max(end.angle - off, 0.0)).cos - H.k});
        };
        const auto farther = [&](const HingeEnd& end) {
            return negative_arc({H.s, H.c, H.k - sin_cos(min(end.angle + off, pi)).cos});
        };
        blocked.all |= count == 0;
        if (count > 0 && piece[0].near.tag && piece[0].near.angle > off) blocked.add(nearer(piece[0].near));
        if (count == 2) block_both(farther(piece[0].far), nearer(piece[1].near), blocked);
        if (count > 0 && piece[count - 1].far.tag && piece[count - 1].far.angle < pi - off)
            blocked.add(farther(piece[count - 1].far));
    }
    free_arcs(blocked, out);
}

/// Writes the psi at which a branch may have solutions with the slack of turn_slack(). Elsewhere there is
/// certainly none, with all rounding of the pose.
[[gnu::noinline, gnu::cold]] inline void possible(const LimitTable& t, const SelfMotion<double>& m,
                                                  const TurnSlack& slack, ArcSet& out) noexcept {
    make_empty(out);
    if (t.elbow.contains(m.elbow.theta_4, slack.elbow)) possible(t, m, joint_functions(m), slack, out);
}
/// The same with the slack of all bends of the elbow.
inline void possible(const Arm& arm, const LimitTable& t, const SelfMotion<double>& m, ArcSet& out) noexcept {
    possible(t, m, turn_slack(arm, m.circle), out);
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
