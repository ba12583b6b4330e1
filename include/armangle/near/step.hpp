// One pass of fig. 10 on the true chain: proven arcs, eq. (36), inverse, and the checks of continuity.
#pragma once

#include "../motion/bounds.hpp"
#include "../motion/pace.hpp"
#include "../motion/step.hpp"
#include "clear_proof.hpp"

namespace armangle {

namespace near_rule {
inline constexpr int shortenings = 24;  // halvings of a move of psi that takes a joint too far
}  // namespace near_rule

namespace detail {

/// A step of the true chain as far as the pose and the present joints decide it.
struct NearStep {
    const NearArm& arm;
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
        for (int pass = 0; pass < near_rule::shortenings; ++pass) {
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
/// bounds leave no step to the pose the joints go as far towards it as they allow (PARTIAL), and nothing
/// moves but what has to brake where a scene is asked too. Else nothing moves where the pose is not met; the
/// branch is kept, and what is ahead is not asked. A wish for the elbow is one for that of the nominal arm.
inline Step step(const NearArm& arm, double margin, const double* q_now, const Pose<double>& pose,
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
    const auto approach = [&](double psi, Status why) {
        const detail::NearStep any{arm, exact, on, configuration(gc), q_now, here, pi};
        detail::Lifted to;
        if (options.scene || any.at(psi, to) != Status::OK) return stay(why);
        double q[joint_slots], d[joints];
        to.q.store(q);
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
    if (found.status != Status::OK) return stay(found.status);
    if (options.allowed) {
        const ArcSet own = found.arcs;
        intersect(own, *options.allowed, found.arcs);
        if (found.arcs.empty()) return stay(Status::NOT_ALLOWED);
    }
    if (options.scene) {
        Tag blocking;
        keep_clear(arm, *options.scene, exact, gc, found, blocking);
        if (found.status != Status::OK) return stay(found.status);
    }
    const ArcSet& open = found.arcs;
    const Policy policy = detail::policy_on(
        options, nominal,
        self_motion(nominal, circle_on(nominal, on, flange_pose(nominal, exact)), configuration(gc)));
    Resolution next = resolve(policy, open, psi);
    if (next.status != Status::OK) return stay(next.status);
    ArcSet soft;
    const bool asked = options.scene && options.scene->soft > 0;
    if (asked && keep_soft(arm, *options.scene, exact, gc, open, psi, soft)) next = led(policy, soft, psi);
    const detail::NearStep way{arm, exact, on, configuration(gc), q_now, here, options.max_joint_step};
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
        if (is_nan(next.psi)) return approach(wish, way.refusal(*options.bounds, open));
        next.status = way.at(next.psi, to);
    }
    if (next.status != Status::OK) return stay(next.status);
    Step out;
    to.q.store(out.q);
    out.psi = next.psi;
    out.gc = gc;
    detail::complete(nominal, q_now, options.dt, Status::OK, Status::OK, out);
    return out;
}

}  // namespace armangle
