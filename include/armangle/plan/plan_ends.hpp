// The start and the goal of a plan as places in a branch: where on the self-motion given joints are, and
// whether the branch, the limits, the margin and the obstacles permit them.
#pragma once

#include "crossing.hpp"
#include "descent.hpp"
#include "tube.hpp"
#include "anchor.hpp"
#include "../scene/proximity.hpp"

#include "../names/begin.hpp"

namespace armangle::detail {

/// What counts as the same posture at an end of a path.
struct PlanEndsTuning {
    static constexpr double end_move = 1e-3;  // largest move of a joint there (rad); more is a jump
    static constexpr double locked = 1e-3;    // range below which a joint determines phi (rad)
    static constexpr double beside = 0.2;     // of phi: range to search the solution nearest to a start (rad)
    static constexpr double near_singular = 0.02;  // |sin| of theta_2, theta_6 of an end that is led (rad)
    static constexpr double on_pose = 1e-6;        // m and rad: an end this near belongs to its pose
    static constexpr double straight = 1e-7;    // theta_4 to which rounding may bend a straight elbow (rad)
    static constexpr double widest_gap = 0.05;  // of an end from the solution that replaces it (rad)
};

/// The distance (rad) of theta of joint 2 or 6, from -pi to pi, from the nearest of 0 and +-pi.
inline double singularity_distance(double theta) noexcept {
    const double size = abs(theta);
    return min(size, pi - size);
}

/// The smaller distance of theta_2 and theta_6 from 0 and +-pi (rad). At 0 the arm angle does not determine
/// how the joints next to that one share their rotation.
inline double singularity_distance(const Arm& arm, const double* q) noexcept {
    return min(singularity_distance(wrap(to_theta(arm, 1, q[1]))),
               singularity_distance(wrap(to_theta(arm, 5, q[5]))));
}

/// The larger of |sin theta_2| and |sin theta_6|.
inline double singularity_sine(const Arm& arm, const double* q) noexcept {
    const Chain now = chain(arm, q);
    return max(abs(std::sin(now.theta[1])), abs(std::sin(now.theta[5])));
}

/// The start and goal of a plan, and whether a branch's tube contains them.
struct AnchoredEnds {
    Anchor start, goal;
    bool starts, arrives;

    /// Whether start and goal are both kept.
    bool held() const noexcept { return starts && arrives; }
};

/// The ends that a descent keeps fixed: those that have an anchor, with the joints q at the start.
inline FixedEnds fixed_ends(const AnchoredEnds& ends, const double* q) noexcept {
    FixedEnds out{ends.start.given, ends.goal.given, {}};
    std::copy(q, q + joints, out.q);
    return out;
}

/// Makes stretch x end at the exact joints of a goal, in the revolution of x, because phi determines only the
/// sum of the rotations of two joints if theta_2 or theta_6 is 0 there. Leaves x unchanged if a joint would
/// move by more than `end_move` (rad).
inline void end_at(const double* goal, Stretch& x) noexcept {
    double off[joints], most = 0;
    for (int j = 0; j < joints; ++j) {
        off[j] = wrap(goal[j] - x.q_end[j]);
        most = max(most, abs(off[j]));
    }
    for (int j = 0; j < joints && most <= PlanEndsTuning::end_move; ++j) x.q_end[j] += off[j];
}

/// Finds the anchors of given joints on sections of a path; docs/background/paths.md.
class PlanEnds {
public:
    /// Keeps a reference to the task; start and goal are arguments of the functions below.
    explicit PlanEnds(const Task& task) noexcept : task_(task) {}

    /// A joint, 1..7 but not 4, with a range below a thousandth of a radian, so that it determines phi; or 0.
    /// Among several, the one with the smallest range.
    int locked_joint() const noexcept {
        int out = 0;
        double least = PlanEndsTuning::locked;
        for (int j = 0; j < joints; ++j) {
            const double room = task_.limits.upper[j] - task_.limits.lower[j];
            if (j == 3 || !(room < least)) continue;
            least = room;
            out = j + 1;
        }
        return out;
    }

    /// Locks `joint` (1..7) in a crossing at its value in the end `end`, kept within the limits, or at the
    /// middle of its limits if `end` is null.
    void lock(CrossingTask& asked, int joint, const double* end) const noexcept {
        const int j = joint - 1;
        const double low = task_.limits.lower[j], high = task_.limits.upper[j];
        const double middle = 0.5 * (low + high), q = end ? min(max(end[j], low), high) : middle;
        asked.locked = joint;
        asked.theta = to_theta(task_.arm, j, q);
    }

    /// Whether a requested end q has an anchor and lies in a configuration with this sign of the elbow (bit 1
    /// of a branch: 0 or 2); true if q is null.
    bool hold(const Anchor& anchor, const double* q, int elbow) const noexcept {
        if (!q) return true;
        const Chain now = chain(task_.arm, q);
        const int own = index(configuration(task_.arm, now.theta));
        return anchor.given && (is_straight(now.theta) || (own & 2) == elbow);
    }

    /// Whether the elbow is stretched at model angles theta, up to rounding.
    bool is_straight(const double* theta) const noexcept {
        return abs(wrap(theta[3] - task_.arm.delta_angle)) <= PlanEndsTuning::straight;
    }

    /// The anchor of given joints on a section. It is not `given` if they are in another branch, forbidden,
    /// or singular.
    Anchor anchor(const Tube& tube, const Section& l, const double* q) const {
        const Chain now = chain(task_.arm, q);
        Anchor out;
        out.phi = arm_angle(l.motion.circle, now.z3);
        double most = placed(l, out.phi, q, out.q);
        if (most > tolerance::angle) {
            out.phi = nearest_phi(l, out.phi, q);
            most = placed(l, out.phi, q, out.q);
        }
        double clear = singularity_distance(task_.arm, out.q);
        if (norm(tool_pose(task_.arm, q).position - task_.pose(l.s).position) <= PlanEndsTuning::on_pose)
            clear = min(clear, singularity_distance(task_.arm, q));
        out.elsewhere = !is_of(now.theta, tube.gc);
        if (out.elsewhere) return out;
        if (most > tolerance::angle && clear < CurveProofTuning::least_margin) return out;
        out.gap = most;
        if (!open(l.s, l.motion, out.phi, out)) return out;
        const bool within = within_limits(task_.limits, out.q, tolerance::angle);
        const bool apart = !(clear < task_.table.margin - tolerance::angle);
        if (!within) out.why = Status::LIMITS;
        if (within && !apart) out.why = Status::NEAR_SINGULAR;
        if (l.status != Status::OK || !within || !apart) return out;
        out.arc = nearest_arc(tube, l, out.phi);
        const Arc& a = tube.arc(l)[out.arc];
        out.phi = lift(out.phi, 0.5 * (a.lower + a.upper));
        out.given = true;
        return out;
    }

    /// The anchor of given joints at s, an end of the path, also if theta_2 or theta_6 vanishes: then theta_1
    /// (theta_5), or the locked joint of `asked`, is kept, and phi follows from it. `elbow`: a branch with
    /// the sign of a stretched elbow.
    Anchor meeting_anchor(double s, const double* q, int elbow, const CrossingTask& asked) const {
        const Chain now = chain(task_.arm, q);
        Configuration<double> gc = configuration(task_.arm, now.theta);
        if (is_straight(now.theta)) gc.elbow = configuration(elbow).elbow;
        const SelfMotion<double> m = self_motion(task_.arm, task_.circle_at(s), gc);
        Anchor out;
        out.phi = arm_angle(m.circle, now.z3);
        const double shoulder = abs(std::sin(now.theta[1])), wrist = abs(std::sin(now.theta[5]));
        if (!asked.locked && min(shoulder, wrist) > PlanEndsTuning::near_singular) {
            Section l{};
            l.motion = m;
            if (placed(l, out.phi, q, out.q) > tolerance::angle) out.phi = nearest_phi(l, out.phi, q);
            out.gap = placed(l, out.phi, q, out.q);
        } else {
            const int beside = shoulder < wrist ? 1 : 5, joint = asked.locked ? asked.locked : beside;
            const SinCos<double> theta = sin_cos(asked.locked ? asked.theta : now.theta[joint - 1]);
            const JointFunctions<double> of = joint_functions(m);
            const Harmonic<double> f = joint_condition(of, joint, theta);
            out.gap = infinity;
            const auto take = [&](const SinCos<double>& phi) {
                Directions<double> d = directions_with_joint(m, phi, joint, theta);
                keep_shares(task_.arm, m, phi, joint, q, d);
                const Joints solved = joints_near(task_.arm, d, q);
                const double gap = largest_move(solved.q, q);
                if (!(gap < out.gap)) return;
                out.gap = gap;
                out.phi = atan2(phi.sin, phi.cos);
                std::copy(solved.q, solved.q + joints, out.q);
            };
            const int h = shoulder < wrist ? 0 : 1;
            if (!asked.locked && min(shoulder, wrist) <= tolerance::one_axis) {
                // if the hinge is at 0 (pi) its cosine is greatest (least), whatever leads
                const Harmonic<double>& cosine = of.hinge[h].H;
                const double end = std::cos(now.theta[hinge_joint[h]]) < 0 ? -1.0 : 1.0;
                take(sin_cos(atan2(end * cosine.s, end * cosine.c)));
            }
            if (!(out.gap <= tolerance::angle))
                for (const double side : {-1.0, 1.0}) take(psi_from_joint(f, side).psi);
        }
        out.given = out.gap <= PlanEndsTuning::widest_gap &&
                    within_limits(task_.limits, out.q, tolerance::angle) && open(s, m, out.phi, out);
        return out;
    }

    /// The anchors of a start and a goal in a branch's tube, and whether the tube contains them; null: that
    /// end is free.
    AnchoredEnds ends(const Tube& tube, const double* start, const double* goal) const {
        AnchoredEnds out;
        if (start) out.start = anchor(tube, tube.sections.front(), start);
        if (goal) out.goal = anchor(tube, tube.sections.back(), goal);
        out.starts = !start || out.start.given;
        out.arrives = !goal || out.goal.given;
        return out;
    }

private:
    /// Whether obstacles and the user permit phi at s. If not, writes the reason, and the pair of shapes that
    /// is too near, to `why`.
    bool open(double s, const SelfMotion<double>& m, double phi, Anchor& why) const {
        if (!task_.encumbered()) return true;
        ArcSet any, left;
        make_full(any);
        Tag blocking = 0;
        const Status status = task_.keep_open(s, m, any, left, blocking);
        if (contains(left, phi)) return true;
        why.why = Status::NOT_ALLOWED;  // if it is collision-free: the user forbids it
        if (!task_.scenes) return false;
        if (status == Status::POSE_BLOCKED) {
            why.why = status;
            why.touching = blocking;
        }
        for (int k = task_.scenes.first(s); k <= task_.scenes.last(s); ++k) {
            const Scene& scene = task_.scenes[k];
            const Proximity near = proximity(task_.arm, scene, m, phi);
            if (!(near.distance < scene.clearance)) continue;
            const double shortfall = scene.clearance - near.distance;
            if (shortfall <= why.shortfall) continue;
            why.why = status == Status::POSE_BLOCKED ? status : Status::CLEARANCE;
            why.touching = near.pair;
            why.shortfall = shortfall;
        }
        return false;
    }

    /// Writes the solution of phi on a section to q, in the revolution nearest to the joints `near`, and
    /// returns its largest difference (rad) of a joint from them.
    double placed(const Section& l, double phi, const double* near, double* q) const noexcept {
        const Joints solved = joints_near(task_.arm, directions(l.motion, sin_cos(phi)), near);
        for (int j = 0; j < joints; ++j) q[j] = solved.q[j];
        return largest_move(q, near);
    }

    /// The phi of the solution on a section that is nearest to given joints, within 0.2 rad of a first guess
    /// `phi`, by golden-section search.
    double nearest_phi(const Section& l, double phi, const double* near) const noexcept {
        const double share = 0.5 * (std::sqrt(5.0) - 1.0);
        double q[joints], low = phi - PlanEndsTuning::beside, high = phi + PlanEndsTuning::beside;
        double left = high - share * (high - low), right = low + share * (high - low);
        double at_left = placed(l, left, near, q), at_right = placed(l, right, near, q);
        while (high - low > tolerance::angle) {
            if (at_left < at_right) {
                high = right;
                right = left;
                at_right = at_left;
                left = high - share * (high - low);
                at_left = placed(l, left, near, q);
            } else {
                low = left;
                left = right;
                at_left = at_right;
                right = low + share * (high - low);
                at_right = placed(l, right, near, q);
            }
        }
        return 0.5 * (low + high);
    }

    /// Whether model angles belong to a branch. A stretched elbow belongs to both signs; theta_2 or theta_6
    /// at 0 (pi) also belongs to both.
    bool is_of(const double* theta, int gc) const noexcept {
        const int differ = index(configuration(task_.arm, theta)) ^ gc;
        return !(differ & ~shared_signs(theta) & ~(is_straight(theta) ? 2 : 0));
    }

    const Task& task_;
};

}  // namespace armangle::detail

#include "../names/end.hpp"
