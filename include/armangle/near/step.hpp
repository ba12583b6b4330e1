// One pass of fig. 10 on the true chain: proven arcs, eq. (36), inverse, and the checks of continuity.
#pragma once

#include "../motion/step.hpp"
#include "feasible.hpp"

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
};

}  // namespace detail

/// The step from q_now to `pose` (as the user sees it) within the arm's limits and a margin (rad) around
/// singularities. A policy that asks for more than max_joint_step gets the psi on its way that fits. Nothing
/// moves where the pose is not met, and the branch is kept; bounds, scenes and what is ahead are not asked.
inline Step step(const NearArm& arm, double margin, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    const Arm& nominal = arm.nominal;
    const JointLanes here = joint_lanes(q_now);
    if (!is_rigid(pose) || !is_finite(here)) return detail::refused(nominal, q_now, options.dt);
    const Posture now = forward(arm, q_now);
    const auto stay = [&](Status why) {
        Step out{};
        for (int i = 0; i < joints; ++i) out.q[i] = q_now[i];
        out.psi = now.psi;
        out.gc = now.gc;
        detail::complete(nominal, q_now, options.dt, why, why, out);
        return out;
    };
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    const Triad<double> on = triad(nominal, flange_pose(nominal, exact));
    double psi = now.psi;
    if (options.carry == Carry::elbow || is_nan(psi)) {
        double theta[joints];
        SinCos<double> angle[joints];
        detail::theta_of(nominal, q_now, theta);
        detail::sin_cos_all(theta, angle);
        psi = arm_angle(on, detail::elbow_axis(angle));
    }
    const int gc = options.gc < 0 ? now.gc : options.gc;
    ProvenArcs found;
    feasible(arm, exact, gc, nominal.limits, margin, found);
    if (found.status != Status::OK) return stay(found.status);
    ArcSet open = found.arcs;
    if (options.allowed) {
        intersect(found.arcs, *options.allowed, open);
        if (open.empty()) return stay(Status::NOT_ALLOWED);
    }
    Resolution next = resolve(options.policy, open, psi);
    if (next.status != Status::OK) return stay(next.status);
    const detail::NearStep way{arm, exact, on, configuration(gc), here, options.max_joint_step};
    detail::Lifted to;
    next.status = way.at(next.psi, to);
    if (next.status == Status::JOINT_JUMP) {
        next.psi = way.shortened(open, nearest(open, psi), next.psi);
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
