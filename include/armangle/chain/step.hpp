// One pass of fig. 10 on the true chain: proven arcs, eq. (36), inverse, and the checks of continuity.
#pragma once

#include "../motion/bounds.hpp"
#include "../motion/pace.hpp"
#include "../motion/step.hpp"
#include "hull_cells.hpp"
#include "nearest_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace chain_tuning {
inline constexpr int shortenings = 24;  // halvings of a move of psi that takes a joint too far
}  // namespace chain_tuning

namespace detail {

/// A step of the true chain as far as the pose and the present joints decide it.
struct ChainStep {
    const ChainArm& arm;
    const Pose<double>& pose;
    const Triad<double>& on;
    Configuration<double> gc;
    const double* q_now;
    JointLanes here;
    double max_joint_step;

    /// The joints at psi next to the present ones; JOINT_JUMP where one would move too far.
    Status at(double psi, Lifted& out) const noexcept {
        SinCos<double> angle[joints];
        const Status solved = solve_angles(arm, pose, {on, sin_cos(psi)}, gc, angle);
        if (solved != Status::OK) return solved;
        Directions<double> d{};
        for (int j = 0; j < joints; ++j) {
            d.y[j] = angle[j].sin;
            d.x[j] = angle[j].cos;
        }
        d.x[joints] = 1.0;
        const Status turned = choose_windings(arm.nominal, d, here, out);
        if (turned != Status::OK) return turned;
        return largest_move(out.q, here) <= max_joint_step ? Status::OK : Status::JOINT_JUMP;
    }

    /// The psi between `from`, in an arc, and a wish of the same arc that is nearest to the wish and moves no
    /// joint too far, by halving: where the wish moves one too far, and `from` none.
    double shortened(const ArcSet& arcs, double from, double wish) const noexcept {
        const Place start = find(arcs, from), end = find(arcs, wish);
        if (start.index < 0 || start.index != end.index) return from;
        double kept = start.psi, beyond = arcs.full ? lift(end.psi, start.psi) : end.psi;
        Lifted tried;
        for (int pass = 0; pass < chain_tuning::shortenings; ++pass) {
            const double middle = 0.5 * (kept + beyond);
            (at(middle, tried) == Status::OK ? kept : beyond) = middle;
        }
        return wrap(kept);
    }

    /// Whether the step to psi keeps bounds.
    bool keeps(const Bounds& bounds, double psi) const noexcept {
        Lifted to;
        double q[joint_slots];
        if (at(psi, to) != Status::OK) return false;
        to.q.store(q);
        return detail::keeps(arm.nominal, bounds, q_now, q, max_joint_step);
    }

    /// Of these arcs what keeps bounds: proven arcs of an arm whose limits are the moves that they leave.
    void within(const Bounds& bounds, Kept kept, const ArcSet& arcs, ArcSet& out) const noexcept {
        const MoveBox box = move_box(arm.nominal, bounds, q_now, max_joint_step, kept);
        Limits narrow{};
        for (int i = 0; i < joints; ++i) {
            if (!(box.lower[i] <= box.upper[i])) return make_empty(out);
            narrow.lower[i] = q_now[i] + box.lower[i];
            narrow.upper[i] = q_now[i] + box.upper[i];
        }
        ProvenArcs found;
        feasible(arm, pose, index(gc), narrow, 0.0, found);
        intersect(found.arcs, arcs, out);
    }

    /// The branches that meet that of the present joints within a step, a bit for each: where theta_2,
    /// theta_4 - delta or theta_6 is 0 or pi there, and its own.
    unsigned meeting() const noexcept {
        static constexpr int hinge[] = {1, 3, 5};
        const Arm& nominal = arm.nominal;
        const double zero[] = {0.0, nominal.delta_angle, 0.0};
        unsigned bits = 1u << index(gc);
        for (int k = 0; k < 3; ++k) {
            const double off = to_theta(nominal, hinge[k], q_now[hinge[k]]) - zero[k];
            if (abs(off - pi * round(off / pi)) > max_joint_step) continue;
            for (int branch = 0, found = static_cast<int>(bits); branch < configurations; ++branch)
                if (found >> branch & 1) bits |= 1u << (branch ^ 1 << k);
        }
        return bits;
    }

    /// A posture beside the present joints that one step leads to, looked for in the joints themselves: where
    /// branches merge arcs leave it out.
    bool settled_step(unsigned branches, const StepOptions& options, Nearest& out) const noexcept {
        Limits box = arm.nominal.limits;
        Joints start;
        for (int j = 0; j < joint_slots; ++j) start.q[j] = j < joints ? q_now[j] : 0.0;
        for (int j = 0; j < joints; ++j) {
            const double reach = max_joint_step - tolerance::bound;
            box.lower[j] = max(box.lower[j], q_now[j] - reach);
            box.upper[j] = min(box.upper[j], q_now[j] + reach);
            if (!(box.lower[j] <= box.upper[j])) return false;
        }
        Relaxed found{start, infinity};
        with_either_bend(arm.nominal, start, max_joint_step, [&](const Joints& from) {
            int rounds = settled_rule::rounds;
            found = settled(arm, box, from, pose, {}, 0.0, rounds);
            return meets(arm, found);
        });
        if (!meets(arm, found)) return false;
        const Posture there = forward(arm, found.at.q);
        if (!(branches >> there.gc & 1)) return false;
        if (options.allowed && !contains(*options.allowed, there.psi)) return false;
        if (options.scene && !is_clear(arm, *options.scene, found.at.q)) return false;
        for (int j = 0; j < joint_slots; ++j) out.q[j] = found.at.q[j];
        out.psi = there.psi;
        out.gc = there.gc;
        return true;
    }

    /// The posture that the joints are nearest to, where one step leads to it: in the branches asked, and
    /// beside where they merge.
    bool nearest_step(double margin, unsigned branches, const StepOptions& options,
                      Nearest& out) const noexcept {
        if (!(margin > 0) && settled_step(branches, options, out)) return true;
        NearestOptions asked;
        asked.near = q_now;
        asked.branches = branches;
        asked.allowed = options.allowed;
        for (const Metric metric : {Metric::l2, Metric::max}) {
            asked.metric = metric;
            out = nearest_posture(arm, margin, pose, asked, options.scene);
            if (out.status != Status::OK && out.status != Status::UNPROVEN) return false;
            const bool leaps = out.gc != index(gc) && !passes(arm, q_now, out.q);
            if (largest_move(out.q, q_now) <= max_joint_step && !leaps) return true;
        }
        return false;
    }

    /// Where theta_2 = 0 or theta_6 = 0 is near: the posture beside the present one, if psi carried on would
    /// sweep the joints next to that hinge round. How far a joint may move: less, if the policy would.
    double calm(double margin, const ArcSet& open, double psi, const StepOptions& options,
                Nearest& out) const noexcept {
        double theta[joints];
        theta_of(arm.nominal, q_now, theta);
        out.status = Status::JOINT_JUMP;
        if (!may_sweep(theta[1], theta[5], options)) return max_joint_step;
        const unsigned branches = options.gc < 0 ? meeting() : 1u << index(gc);
        if (!settled_step(branches, options, out)) return max_joint_step;
        const bool apart = margin > 0 && out.gc != index(gc);  // the margin parts the two
        if (apart || (margin > 0 && !contains(open, out.psi))) return max_joint_step;
        const double least = largest_move(out.q, q_now);
        const ChainStep any{arm, pose, on, gc, q_now, here, pi};
        Lifted carried;
        const bool kept = any.at(psi, carried) == Status::OK &&
                          largest_move(carried.q, here) <= calm_move(hinge_bend(theta[1], theta[5]), least);
        const bool bound =
            options.bounds && !detail::keeps(arm.nominal, *options.bounds, q_now, out.q, max_joint_step);
        if (!kept && !bound) out.status = Status::OK;
        if (!kept) return max_joint_step;
        const double most = max(step_rule::sweep * least, largest_move(carried.q, here));
        return min(max_joint_step, most + calm_drift(hinge_bend(theta[1], theta[5]), max_joint_step));
    }

    /// Why no step within bounds leads to these arcs.
    Status refusal(const Bounds& bounds, const ArcSet& arcs) const noexcept {
        ArcSet left;
        within(bounds, {.acceleration = false}, arcs, left);
        if (!left.empty()) return Status::ACCELERATION_LIMIT;
        within(bounds, {.velocity = false, .acceleration = false}, arcs, left);
        return left.empty() ? Status::JOINT_JUMP : Status::VELOCITY_LIMIT;
    }
};

}  // namespace detail

/// The step from q_now to `pose` (as the user sees it) within the arm's limits and a margin (rad) around
/// singularities. A policy that asks for more than max_joint_step gets the psi on its way that fits. Where
/// its branch has no step, that to the nearest posture is taken: of the branch, of one that meets it within
/// a step, or beside where they merge. Where bounds leave no step to the pose the joints go as far towards
/// it as they allow (PARTIAL), and nothing moves but what has to brake where a scene is asked too. Else
/// nothing moves where the pose is not met; what is ahead is not asked. A wish for the elbow is one for that
/// of the nominal arm.
inline Step step(const ChainArm& arm, double margin, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    const Arm& nominal = arm.nominal;
    const JointLanes here = joint_lanes(q_now);
    if (!is_rigid(pose) || !is_finite(here)) return detail::refused(nominal, q_now, options.dt);
    const Posture now = forward(arm, q_now);
    const auto stay = [&](Status why) {
        Step out{};
        for (int i = 0; i < joints; ++i)
            out.q[i] = q_now[i] + (options.bounds ? detail::braked(nominal, *options.bounds, q_now, i) : 0.0);
        const Posture there = options.bounds ? forward(arm, out.q) : now;
        out.psi = there.psi;
        out.gc = there.gc;
        detail::complete(nominal, q_now, options.dt, why, why, out);
        return out;
    };
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const Triad<double> on = triad(nominal, flange_pose(nominal, exact));
    const int gc = options.gc < 0 ? now.gc : options.gc;
    detail::ChainStep way{arm, exact, on, configuration(gc), q_now, here, options.max_joint_step};
    const auto approach_joints = [&](const double* q, Status why) {
        double d[joints];
        for (int j = 0; j < joints; ++j) d[j] = q[j] - q_now[j];
        const Bounds& b = *options.bounds;
        Step out{};
        detail::go(nominal, b, q_now, options.max_joint_step, d, pace(d, b.dt, b.velocity, b.acceleration),
                   out.q);
        const Posture there = forward(arm, out.q);
        out.psi = there.psi;
        out.gc = there.gc;
        detail::complete(nominal, q_now, options.dt, Status::PARTIAL, why, out);
        return out;
    };
    const auto approach = [&](double psi, Status why) {
        const detail::ChainStep any{arm, exact, on, configuration(gc), q_now, here, pi};
        detail::Lifted to;
        if (options.scene) return stay(why);
        if (any.at(psi, to) != Status::OK) {  // a joint would have to go round: another psi is nearer
            Nearest found;
            NearestOptions asked;
            asked.near = q_now;
            asked.branches = 1u << gc;
            asked.allowed = options.allowed;
            found = nearest_posture(arm, margin, exact, asked, options.scene);
            const bool known = found.status == Status::OK || found.status == Status::UNPROVEN;
            return known ? approach_joints(found.q, why) : stay(why);
        }
        double q[joint_slots];
        to.q.store(q);
        return approach_joints(q, why);
    };
    const auto to_posture = [&](const Nearest& found) {
        Step out{};
        for (int j = 0; j < joint_slots; ++j) out.q[j] = found.q[j];
        out.psi = found.psi;
        out.gc = found.gc;
        detail::complete(nominal, q_now, options.dt, Status::OK, Status::OK, out);
        return out;
    };
    const auto beside = [&](Status why, double wish = not_a_number) {
        Nearest found;
        way.max_joint_step = options.max_joint_step;
        const unsigned branches = options.gc < 0 ? way.meeting() : 1u << gc;
        if (!way.nearest_step(margin, branches, options, found))
            return options.bounds && !is_nan(wish) ? approach(wish, why) : stay(why);
        if (options.bounds &&
            !detail::keeps(nominal, *options.bounds, q_now, found.q, options.max_joint_step))
            return options.scene ? stay(why) : approach_joints(found.q, why);
        return to_posture(found);
    };
    double psi = now.psi;
    if (options.carry == Carry::elbow || is_nan(psi)) {
        double theta[joints];
        SinCos<double> angle[joints];
        detail::theta_of(nominal, q_now, theta);
        detail::sin_cos_all(theta, angle);
        psi = arm_angle(on, detail::elbow_axis(angle));
    }
    ProvenArcs found;
    feasible(arm, exact, gc, nominal.limits, margin, found);
    if (found.status == Status::UNREACHABLE) return stay(found.status);
    if (found.status != Status::OK) return beside(found.status);
    if (options.allowed) {
        const ArcSet own = found.arcs;
        intersect(own, *options.allowed, found.arcs);
        if (found.arcs.empty()) return beside(Status::NOT_ALLOWED);
    }
    if (options.scene) {
        Tag blocking;
        keep_clear(arm, *options.scene, exact, gc, found, blocking);
        if (found.status != Status::OK) return beside(found.status);
    }
    const ArcSet& open = found.arcs;
    const Policy policy = detail::policy_on(
        options, nominal,
        self_motion(nominal, circle_on(nominal, on, flange_pose(nominal, exact)), configuration(gc)));
    Resolution next = resolve(policy, open, psi);
    if (next.status != Status::OK) return stay(next.status);
    Nearest calm{};
    way.max_joint_step = way.calm(margin, open, psi, options, calm);
    if (calm.status == Status::OK) return to_posture(calm);
    ArcSet soft;
    const bool asked = options.scene && options.scene->soft > 0;
    if (asked && keep_soft(arm, *options.scene, exact, gc, open, psi, soft)) next = led(policy, soft, psi);
    detail::Lifted to;
    next.status = way.at(next.psi, to);
    if (next.status == Status::JOINT_JUMP) {
        next.psi = way.shortened(open, nearest(open, psi), next.psi);
        next.status = way.at(next.psi, to);
    }
    if (options.bounds && !(next.status == Status::OK && way.keeps(*options.bounds, next.psi))) {
        const double wish = next.psi;
        ArcSet kept;
        way.within(*options.bounds, {}, open, kept);
        next.psi =
            detail::nearest_kept(kept, next.psi, [&](double at) { return way.keeps(*options.bounds, at); });
        if (is_nan(next.psi)) {
            const Status why = way.refusal(*options.bounds, open);
            return why == Status::JOINT_JUMP ? beside(why, wish) : approach(wish, why);
        }
        next.status = way.at(next.psi, to);
    }
    if (next.status != Status::OK) return beside(next.status);
    Step out;
    to.q.store(out.q);
    out.psi = next.psi;
    out.gc = gc;
    detail::complete(nominal, q_now, options.dt, Status::OK, Status::OK, out);
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
