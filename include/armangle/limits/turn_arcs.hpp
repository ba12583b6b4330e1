// All turns of the base, and all rolls of the tool, at which a pose is reachable: exact arcs.
//
// If a pose is turned by alpha about axis 1, its solutions change by theta_1 + alpha only: the yaw affects
// F_1 alone. A solution at psi is within the limits if lower <= theta_1(psi) + alpha <= upper. So an arc of
// psi that all other joints permit contributes the turns
//
//     alpha in [lower - max theta_1, upper - min theta_1].
//
// The extremes of the continuous theta_1 over the arc are at its ends or where theta_1' = 0, eq. (30). The
// result is the union over arcs and branches. A roll about axis 7 uses joint 7 in the same way.
#pragma once

#include "freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Which part rotates: the base around axis 1, or the tool around axis 7.
enum class Turned : std::uint8_t { base, tool };

/// Parameters of the arcs of turns of base and tool.
struct TurnArcsTuning {
    static constexpr double noise =
        1e-6;  // rad: a motion against the slope up to this is rounding near a jump
};

namespace detail {

/// The ranges of a continuous angle over an arc; one more for each jump within the arc.
struct Swings {
    int count = 0;
    double least[3], most[3];
};

/// The psi at which an arc is sampled, in rising order: its ends, quarters, stationary psi and jumps.
struct Walk {
    static constexpr int capacity = 8;
    int count = 0;
    double psi[capacity];
    bool is_jump[capacity] = {};

    /// Inserts psi = `at` in order if it lies between the ends, marked as a jump if `jumps`; if it is at an
    /// end, that is marked.
    void insert(double at, double lower, double upper, bool jumps = false) noexcept {
        if (jumps && abs(wrap(at - lower)) <= tolerance::angle) is_jump[0] = true;
        if (jumps && abs(wrap(at - upper)) <= tolerance::angle) is_jump[count - 1] = true;
        at += two_pi * std::ceil((lower - at) / two_pi);
        if (!(at - lower > tolerance::angle && upper - at > tolerance::angle) || count == capacity) return;
        int k = count++;
        for (; k > 0 && psi[k - 1] > at; --k) {
            psi[k] = psi[k - 1];
            is_jump[k] = is_jump[k - 1];
        }
        psi[k] = at;
        is_jump[k] = jumps;
    }
};

/// The range of theta of a pivot joint next to joint 2 or 6 over [lower, upper] of psi, continuous from the
/// principal value at the lower end. theta jumps by pi where theta_2 or theta_6 reaches 0 or pi, or nearly
/// so; the range across the jump is left out.
inline Swings swings(const Pivot<double>& p, const Hinge<double>& h, double lower, double upper) noexcept {
    using Lanes = Lane<Walk::capacity>;
    Walk walk;
    walk.psi[walk.count++] = lower;
    walk.psi[walk.count++] = upper;
    for (int k = 1; k < 4; ++k) walk.insert(lower + k * half_pi, lower, upper);
    const bool above = h.high.below_one <= tolerance::touching,
               below = h.low.above_minus_one <= tolerance::touching;
    if (!is_constant(h) && (above || below)) {
        const double top = atan2(h.H.s, h.H.c);
        for (const double jump : {top, top + pi})
            if (jump == top ? above : below) walk.insert(jump, lower, upper, true);
    } else {
        const Profile special = profile(p);
        for (int k = 0; k < special.stationary.count; ++k)
            walk.insert(special.stationary.psi[k], lower, upper);
    }
    for (int k = walk.count; k < Walk::capacity; ++k) walk.psi[k] = upper;
    const SinCos<Lanes> at = sin_cos(Lanes::load(walk.psi));
    const auto over = [&at](const Harmonic<double>& wave) {
        return mul_add(Lanes(wave.s), at.sin, mul_add(Lanes(wave.c), at.cos, Lanes(wave.k)));
    };
    double theta[Walk::capacity];
    atan2(Lanes(p.g) * over(p.U), Lanes(p.g) * over(p.V)).store(theta);
    const Harmonic<double> slope = slope_numerator(p);
    Swings out;
    // at a jump (U, V) vanishes: its direction is that of the tangent, before or after
    const auto tangent = [&](double psi, double sign) {
        const SinCos<double> jump = sin_cos(psi);
        return atan2(sign * p.g * p.U.slope(jump), sign * p.g * p.V.slope(jump));
    };
    double now = walk.is_jump[0] ? tangent(lower, 1.0) : theta[0];
    const auto open = [&out, &now] {
        out.least[out.count] = out.most[out.count] = now;
        ++out.count;
    };
    open();
    for (int k = 1; k < walk.count; ++k) {
        const double from = walk.is_jump[k - 1] ? tangent(walk.psi[k - 1], 1.0) : theta[k - 1],
                     to = walk.is_jump[k] ? tangent(walk.psi[k], -1.0) : theta[k];
        if (walk.is_jump[k - 1] && k > 1) {
            now = from;
            open();
        }
        double moved = wrap(to - from);
        const bool rising = slope.at(sin_cos(0.5 * (walk.psi[k - 1] + walk.psi[k]))) > 0;
        if (moved < -TurnArcsTuning::noise && rising) moved += two_pi;
        if (moved > TurnArcsTuning::noise && !rising) moved -= two_pi;
        now += moved;
        out.least[out.count - 1] = min(out.least[out.count - 1], now);
        out.most[out.count - 1] = max(out.most[out.count - 1], now);
    }
    return out;
}

/// Computes the rotations of the base or tool at which a pose is reachable, within the range of its joint.
class TurnArcs {
public:
    /// Keeps its arguments; the rotations are about joint 1's axis (Turned::base) or joint 7's
    /// (Turned::tool).
    TurnArcs(const Arm& arm, const LimitTable& t, Turned turned) noexcept
        : arm_(arm), t_(t), side_(turned == Turned::base ? 0 : 1), end_(side_ == 0 ? 0 : pivots - 1) {}

    /// Computes the rotations for a pose, or the reason if there are none.
    Status find(const Pose<double>& pose, const Circle<double>& c, ArcSet& out) noexcept {
        Status reason = is_folded(c) ? Status::FOLDED : Status::UNREACHABLE;
        bool hides = t_.locked;
        const auto add = [&](int gc, const Left& left, const ArcSet& arcs, const auto& shoulder,
                             const auto& wrist) {
            reason = nearer_reason(reason, left.status);
            hides |= may_hide(t_, c, left.status, shoulder) || may_meet(c, shoulder, left.gap, arcs.empty());
            if (!arcs.empty())
                add_arcs(self_motion(arm_, c, configuration(gc)), arcs, side_ ? wrist : shoulder);
            if (t_.margin == 0 && (left.status == Status::OK || left.status == Status::LIMITS) &&
                (may_jump(shoulder.hinge[0]) || may_jump(wrist.hinge[1])))
                add_needles(self_motion(arm_, c, configuration(gc)), shoulder, wrist);
            return turns_.full();
        };
        each_branch(arm_, c, t_, all_pivots & ~pivot_bits(end_), OneAxis::shared, add);
        turns_.finish(out);
        if (hides && !contains(out, 0.0)) [[unlikely]] {
            add_hidden(arm_, t_, pose);
            if (out.empty()) add_hidden_elsewhere(pose);
            turns_.finish(out);
        }
        return out.empty() ? reason : Status::OK;
    }

private:
    const Arm& arm_;
    const LimitTable& t_;
    int side_, end_;
    UnionOfArcs turns_;

    /// Adds the rotations at which a joint (0..6) is within these limits if its theta lies between `least`
    /// and `most`. `along` is -1 if the rotation lowers theta, else 1.
    void add(const Limits& limits, int joint, double along, double least, double most) noexcept {
        const ThetaRange range = theta_range(arm_, limits, joint);
        if (!(range.upper - range.lower < two_pi)) return turns_.add_full();
        const double a = along * (range.lower - most), b = along * (range.upper - least);
        turns_.add({min(a, b), max(a, b), make_tag(joint + 1, limit_side(arm_, joint, along > 0)),
                    make_tag(joint + 1, limit_side(arm_, joint, along < 0))});
    }

    /// Adds the rotations that the arcs of one branch permit.
    void add_arcs(const SelfMotion<double>& m, const ArcSet& arcs, const JointFunctions<double>& f) noexcept {
        const bool lost = side_ == 0 ? shoulder_singular(m) : wrist_singular(m);
        const double along = lost ? lost_side(f, side_) : 1.0;
        const Limits limits = lost ? shared_limits(arm_, arm_.limits, side_, along) : arm_.limits;
        const int pivot = lost ? 2 * side_ + 1 : end_;
        for (int i = 0; i < arcs.count && !turns_.full(); ++i) {
            const Arc& arc = arcs.arc[i];
            if (is_isolated(arc) && !lost) {
                add_needle(needle(arm_, m, 0.5 * (arc.lower + arc.upper)));
                continue;
            }
            const Swings s = swings(f.pivot[pivot], f.hinge[side_], arc.lower, arc.upper);
            for (int k = 0; k < s.count; ++k)
                add(limits, pivot_joint[pivot], side_ == 0 ? along : 1.0, s.least[k], s.most[k]);
        }
    }

    /// Adds the rotations that the first solution of some_posture() permits, since the arcs may miss it.
    [[gnu::noinline, gnu::cold]] void add_hidden(const Arm& arm, const LimitTable& t,
                                                 const Pose<double>& pose) noexcept {
        const Nearest found = some_posture(arm, t, pose);
        if (found.status != Status::OK) return;
        const int joint = pivot_joint[end_];
        const double theta = to_theta(arm_, joint, found.q[joint]);
        add(arm_.limits, joint, 1.0, theta, theta);
    }

    /// Adds the rotation at which a solution that the arcs miss solves the pose if the turned joint may have
    /// any value, if a search finds one.
    [[gnu::noinline, gnu::cold]] void add_hidden_elsewhere(const Pose<double>& pose) noexcept {
        ArmParameters p = arm_;
        p.limits.lower[pivot_joint[end_]] = -infinity;
        p.limits.upper[pivot_joint[end_]] = infinity;
        const Arm free = make_arm(p);
        add_hidden(free, limit_table(free, t_.margin), pose);
    }

    /// Adds the rotation at which an isolated configuration solves the pose; joint 2 or 6 may be 0 or pi
    /// there. Nothing if it violates another limit.
    void add_needle(const Needle& n) noexcept {
        const double along = n.along[side_];
        const int joint = along != 0 ? 4 * side_ + 2 : pivot_joint[end_];
        if (!holds(arm_, n, joint)) return;
        add(n.limits, joint, along < 0 && side_ == 0 ? -1.0 : 1.0, n.theta[joint], n.theta[joint]);
    }

    /// Adds the isolated psi at which two joints rotate around one axis.
    void add_needles(const SelfMotion<double>& m, const JointFunctions<double>& shoulder,
                     const JointFunctions<double>& wrist) noexcept {
        if (elbow_status(m, t_) != Status::OK) return;
        each_needle(arm_, m, shoulder, wrist, [this](const Needle& n) { add_needle(n); });
    }
};

}  // namespace detail

/// Computes the angles alpha (rad) such that some branch and arm angle solves the pose, rotated by alpha
/// around axis 1 of the base or axis 7 (the flange's z), within the limits. The ends are tagged with joint 1
/// or 7 and its limit (joint 3 if joints 1 and 3 rotate around one axis). OK, or the obstruction by the other
/// joints.
inline Status turn_arcs(const Arm& arm, const Pose<double>& pose, const LimitTable& t, Turned turned,
                        ArcSet& out) noexcept {
    return detail::TurnArcs(arm, t, turned).find(pose, circle(arm, flange_pose(arm, pose)), out);
}

}  // namespace armangle

#include "../names/end.hpp"
