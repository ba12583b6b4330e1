// Sums over samples of a curve: its cost, its travel, its least margins and the branches that it uses.
#pragma once

#include "branch_search.hpp"
#include "curve.hpp"
#include "objective.hpp"
#include "plan_ends.hpp"

#include "../names/begin.hpp"

namespace armangle::detail {

/// How densely curves are sampled, and what counts as constant or as a jump.
struct CurveCostTuning {
    static constexpr double home = 5e-3;  // of theta_2, theta_6 from 0 or pi: the home position (rad)
    static constexpr int looks = 8;       // samples of a stretch for its travel and its least margin
    static constexpr double in_plane =
        0.05;  // largest move of joints 1, 3, 5, 7 if the arm stays in its plane (rad)
    static constexpr int held_steps = 200;    // to test whether an arm angle can be held constant ...
    static constexpr double held_move = 0.2;  // ... and the largest move of a joint in one (rad)
};

/// Rates curves of a task by an objective.
class CurveCost {
public:
    /// Keeps references to a task and the weights of the objective.
    CurveCost(const Task& task, const Objective& objective) noexcept : task_(task), objective_(objective) {}

    /// The integral of `cost` of dq/ds along a curve, by differences.
    template <class Cost>
    double summed(const Curve& drawn, const Cost& cost) const noexcept {
        double sum = 0;
        for (const Stretch& x : drawn.stretches) {
            double before[joints];
            std::copy(x.q, x.q + joints, before);
            const double step = (x.end - x.start) / CurveCostTuning::looks;
            for (int i = 1; i <= CurveCostTuning::looks; ++i) {
                const PlacedPosture now = curve_at(drawn, x, x.start + i * step);
                double rate[joints];
                for (int j = 0; j < joints; ++j) {
                    rate[j] = (now.q[j] - before[j]) / step;
                    before[j] = now.q[j];
                }
                sum += step * cost(rate);
            }
        }
        return sum;
    }

    /// The sum of squares of seven rates.
    static double square(const double* rate) noexcept {
        double sum = 0;
        for (int j = 0; j < joints; ++j) sum += rate[j] * rate[j];
        return sum;
    }

    /// The joint travel of a curve: the integral of |dq/ds|^2 (rad^2).
    double travel(const Curve& drawn) const noexcept { return summed(drawn, square); }

    /// The cost of a motion with joint rates dq/ds.
    double moving(const double* rate) const noexcept {
        return objective_.travel * square(rate) + hurry(objective_, task_.length, rate);
    }

    /// The weighted cost of an angle of a self-motion at s for its distance from the target; 0 without a
    /// target.
    double unwished(const SelfMotion<double>& m, double angle, double s) const noexcept {
        if (!task_.wish) return 0;
        const Pose<double> flange = flange_pose(task_.arm, task_.pose(s));
        return task_.wish_scale() * objective_.psi *
               wish_cost(angle - wished_angle(task_.arm, *task_.wish, flange, m, s));
    }

    /// The objective of a curve: its integral over s, from samples in each stretch; finite beyond limits too.
    double objective(const Curve& drawn) const noexcept {
        double near = 0;
        for (const Stretch& x : drawn.stretches)
            for (int i = 0; i < CurveCostTuning::looks; ++i) {
                const double s = x.start + (x.end - x.start) * (i + 0.5) / CurveCostTuning::looks;
                const PlacedDirections<double> here = drawn.place(x, s, phi_at(x, s));
                near += (x.end - x.start) / CurveCostTuning::looks *
                        (task_.margin_scale() * rating(task_, objective_, curve_at(drawn, x, s).q).cost +
                         unwished(here.motion, atan2(here.phi.sin, here.phi.cos), s));
            }
        const double moved = summed(drawn, [this](const double* rate) { return moving(rate); });
        return moved + near;
    }

    /// The configuration of a curve at s on a stretch.
    static PlacedPosture curve_at(const Curve& drawn, const Stretch& x, double s) noexcept {
        return drawn.solve(x, s, phi_at(x, s), s < 0.5 * (x.start + x.end) ? x.q : x.q_end, x.psi);
    }

    /// The cost of a path with the arm angle of the start (or goal, `back`) held constant, for one definition
    /// of psi. Infinite if that is out of reach, violates a limit or margin, or a joint jumps.
    double held_cost(Reference reference, const double* end, bool back) const noexcept {
        Arm arm = task_.arm;
        arm.reference = reference;
        double psi = 0, q[joints], sum = 0;
        std::copy(end, end + joints, q);
        const Chain now = chain(arm, q);
        for (int i = 0; i <= CurveCostTuning::held_steps; ++i) {
            const double share = static_cast<double>(i) / CurveCostTuning::held_steps;
            const Circle<double> c = circle(arm, flange_pose(arm, task_.pose(back ? 1 - share : share)));
            if (is_unreachable(c) || is_folded(c)) return infinity;
            if (i == 0) psi = arm_angle(c, now.z3);
            const SelfMotion<double> m = self_motion(arm, c, configuration(arm, now.theta));
            const Joints here = joints_near(arm, directions(m, sin_cos(psi)), q);
            if (!(largest_move(here.q, q) <= CurveCostTuning::held_move)) return infinity;
            double rate[joints];
            for (int j = 0; j < joints; ++j) {
                rate[j] = (here.q[j] - q[j]) * CurveCostTuning::held_steps;
                q[j] = here.q[j];
            }
            if (i > 0) sum += moving(rate) / CurveCostTuning::held_steps;
            if (!within_limits(task_.limits, q, 0.0) || singularity_distance(arm, q) < task_.table.margin)
                return infinity;
            const double half = i == 0 || i == CurveCostTuning::held_steps ? 0.5 : 1.0;
            const double here_cost = task_.margin_scale() * rating(task_, objective_, q).cost +
                                     unwished(m, psi, back ? 1 - share : share);
            sum += half / CurveCostTuning::held_steps * here_cost;
        }
        return sum;
    }

    /// The branches that a curve uses, one bit each.
    unsigned passed(const Curve& drawn) const noexcept {
        unsigned out = 0;
        for (const Stretch& x : drawn.stretches)
            for (int i = 0; i <= CurveCostTuning::looks; ++i)
                out |= 1u << curve_at(drawn, x, x.start + (x.end - x.start) * i / CurveCostTuning::looks).gc;
        return out;
    }

    /// Whether joints 1, 3, 5 and 7 are nearly constant, so that the others move the arm in its plane.
    bool stays_in_plane(const Curve& drawn) const noexcept {
        double low[joints], high[joints];
        std::fill(low, low + joints, infinity);
        std::fill(high, high + joints, -infinity);
        for (const Stretch& x : drawn.stretches)
            for (int i = 0; i <= CurveCostTuning::looks; ++i) {
                const PlacedPosture here =
                    curve_at(drawn, x, x.start + (x.end - x.start) * i / CurveCostTuning::looks);
                for (int j = 0; j < joints; ++j) {
                    low[j] = min(low[j], here.q[j]);
                    high[j] = max(high[j], here.q[j]);
                }
            }
        for (const int j : pivot_joint)
            if (high[j] - low[j] > CurveCostTuning::in_plane) return false;
        return true;
    }

    /// Whether a joint moves by more than `held_move` (rad) between two neighbouring samples.
    bool hurries(const Curve& drawn) const noexcept {
        double most = 0;
        for (const Stretch& x : drawn.stretches)
            for (int i = 0; i < CurveCostTuning::looks; ++i) {
                const double step = (x.end - x.start) / CurveCostTuning::looks, s = x.start + i * step;
                const PlacedPosture here = curve_at(drawn, x, s), next = curve_at(drawn, x, s + step);
                most = max(most, largest_move(next.q, here.q));
            }
        return most > CurveCostTuning::held_move;
    }

    /// The least margin (rad) along a curve, sampled in every stretch, without joint 4.
    double least_margin(const Curve& drawn) const noexcept {
        double least = infinity;
        const auto look = [&](const double* q) { least = min(least, rating(task_, objective_, q).margin); };
        for (const Stretch& x : drawn.stretches) {
            look(x.q);
            for (int i = 1; i < CurveCostTuning::looks; ++i)
                look(drawn.at(x.start + (x.end - x.start) * i / CurveCostTuning::looks).q);
        }
        look(drawn.stretches.back().q_end);
        return least;
    }

    /// The least margin (rad) of joint 4 along a path.
    double least_elbow_margin(const SearchedBranch& branch) const noexcept {
        double least = infinity;
        for (std::size_t k = 0; k < branch.way.size(); ++k)
            least = min(least, elbow_margin(task_, objective_, branch.way[k].q[3],
                                            task_.circle_at(branch.sections[k].s).triangle.eta));
        return least;
    }

    /// Whether to prefer a path through several branches over a proven one: if it costs less. Also, without
    /// a target for psi, if it has less than half the joint travel in one of two cases. In the first case the
    /// arm begins (ends) in its home position and the path costs no more than a constant arm angle. In the
    /// second it changes branches in the arm's plane and no constant arm angle is possible.
    bool calmer(const Curve& crossing, const Curve& proven, const double* start,
                const double* goal) const noexcept {
        const double cost = objective(crossing);
        if (cost < objective(proven)) return true;
        if (task_.wish || !(2 * travel(crossing) < travel(proven))) return false;
        const double* end = start ? start : goal;
        const double naive =
            min(held_cost(Reference::base, end, !start), held_cost(Reference::stereographic, end, !start));
        double home = infinity;
        for (const double* q : {start, goal})
            if (q) home = min(home, singularity_distance(task_.arm, q));
        if (home < CurveCostTuning::home && naive < infinity) return cost <= naive;
        const unsigned through = passed(crossing);
        return (through & (through - 1)) && naive == infinity && stays_in_plane(crossing);
    }

private:
    const Task& task_;
    const Objective& objective_;
};

}  // namespace armangle::detail

#include "../names/end.hpp"
