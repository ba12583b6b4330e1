// One step of a control loop of an arm on its own chain with an offset nominal arm: Newton's method from the
// present joints, at the value of the free joint that the policy wants.
//
// Where that is more than a step away, or the branch ends, another joint is held in place of the free one:
// the posture next to the present one is then found also where the free joint turns back.
#pragma once

#include "../../motion/follow.hpp"
#include "nearest_posture.hpp"

#include "../../names/begin.hpp"

namespace armangle {

/// The same chain within other limits, in the robot's order.
inline OffsetChain with_limits(const OffsetChain& arm, const Limits& limits) noexcept {
    OffsetChain out = arm;
    ArmParameters own = arm.nominal.own;
    own.limits = limits;
    out.nominal =
        make_offset_arm(own, arm.nominal.mirrored ? -arm.nominal.a_6 : arm.nominal.a_6, arm.nominal.mirrored);
    return out;
}

namespace detail {

/// A step as far as the pose and the present joints decide it.
class OffsetChainStep {
public:
    OffsetChainStep(const OffsetChain& arm, const double* q_now, const Pose<double>& pose,
                    const StepOptions& options) noexcept
        : arm_(arm),
          pose_{orthonormal(pose.rotation), pose.position},
          flange_(flange_pose(arm, pose_)),
          options_(options),
          q_now_(q_now),
          here_(joint_lanes(q_now)),
          now_(forward(arm, q_now)),
          own_(options.gc < 0 ? now_.gc : options.gc) {
        for (int j = 0; j < joints; ++j)
            start_.angle[j] = sin_cos(to_theta(arm.nominal.rest, j, q_now[robot_joint(arm, j)]));
    }

    Step operator()() noexcept {
        double wish = now_.free;
        Step out;
        Status why = wanted(wish);
        if (why == Status::OUTSIDE || why == Status::NOT_ALLOWED) return stayed(why);
        if (why == Status::OK) {
            why = at_free(own_, wish, out);
            if (why == Status::OK) return out;
        }
        if (beside(wish, out) || within_box(out)) return out;
        if (options_.allowed && why == Status::OK) why = Status::NOT_ALLOWED;
        return stayed(why == Status::OK || why == Status::NEAR_SINGULAR ? Status::JOINT_JUMP : why);
    }

private:
    /// Where the policy wants the free joint; what holds it needs no interval.
    Status wanted(double& wish) const noexcept {
        if (options_.policy.rule == Rule::hold && !options_.allowed) return Status::OK;
        ProvenArcs arcs;
        feasible(arm_, pose_, own_, arcs);
        if (arcs.status != Status::OK) return arcs.status;
        ArcSet open = arcs.arcs;
        if (options_.allowed) intersect(arcs.arcs, *options_.allowed, open);
        if (open.empty()) return Status::NOT_ALLOWED;
        const Resolution next = resolve(options_.policy, open, wish);
        wish = next.psi;
        return next.status;
    }

    /// The step to a posture; JOINT_JUMP where a joint would move too far.
    Status to(const ChainPosture& at, int gc, double free, Step& out) const noexcept {
        if (options_.allowed && !contains(*options_.allowed, free)) return Status::NOT_ALLOWED;
        Lifted found;
        const Status turned = choose_windings(arm_.nominal.own, directions_of(arm_, at), here_, found);
        if (turned != Status::OK) return turned;
        if (!(largest_move(found.q, here_) <= options_.max_joint_step)) return Status::JOINT_JUMP;
        out = stepped(found, q_now_, options_.dt, free, gc);
        return Status::OK;
    }

    /// The step to a value of the free joint in a branch.
    Status at_free(int gc, double free, Step& out) const noexcept {
        const SinCos<double> theta_7 = sin_cos(to_theta(arm_.nominal.rest, 6, free));
        const OffsetBranch branch = configuration(gc);
        ChainPosture at = start_;
        at.angle[6] = theta_7;
        settle(arm_, flange_, 6, tuning_, at);
        if (is_of(arm_, branch, at, tuning_) && to(at, gc, free, out) == Status::OK) return Status::OK;
        const Status found = find_posture(arm_, flange_, theta_7, branch, nullptr, at, tuning_);
        return found == Status::OK ? to(at, gc, free, out) : found;
    }

    /// The step with another joint held, whose free joint is nearest to a wish.
    bool beside(double wish, Step& out) const noexcept {
        double least = infinity;
        for (int held = 0; held < 6; ++held) {
            ChainPosture at = start_;
            settle(arm_, flange_, held, tuning_, at);
            if (!(at.left <= tuning_.residual)) continue;
            const int gc = index(branch_of(arm_, at.angle));
            if (options_.gc >= 0 && gc != own_) continue;
            const double theta = atan2(at.angle[6].sin, at.angle[6].cos),
                         free = wrap(to_q(arm_.nominal.rest, 6, theta)), off = abs(wrap(free - wish));
            Step other;
            if (!(off < least) || to(at, gc, free, other) != Status::OK) continue;
            if (gc != own_ && !passes(arm_, q_now_, other.q)) continue;
            least = off;
            out = other;
        }
        return least < infinity;
    }

    /// The posture of the branch nearest to the present joints, one step away.
    bool within_box(Step& out) const noexcept {
        const Limits& limits = arm_.nominal.own.limits;
        Limits box;
        for (int j = 0; j < joints; ++j) {
            box.lower[j] = max(limits.lower[j], q_now_[j] - options_.max_joint_step);
            box.upper[j] = min(limits.upper[j], q_now_[j] + options_.max_joint_step);
            if (!(box.lower[j] <= box.upper[j])) return false;
        }
        const OffsetChain near = with_limits(arm_, box);
        NearestOptions asked;
        asked.near = q_now_;
        asked.branches = 1u << own_;
        asked.allowed = options_.allowed;
        const Nearest found = nearest_posture(near, pose_, asked);
        if (!is_solved(found.status)) return false;
        out = stepped({joint_lanes(found.q), limit_margin(limits, found.q)}, q_now_, options_.dt, found.psi,
                      found.gc);
        return true;
    }

    Step stayed(Status why) const noexcept {
        Step out{};
        for (int j = 0; j < joints; ++j) out.q[j] = q_now_[j];
        out.psi = now_.free;
        out.gc = now_.gc;
        complete(arm_.nominal.own, q_now_, options_.dt, why, why, out);
        return out;
    }

    const OffsetChain& arm_;
    const Pose<double> pose_, flange_;
    const StepOptions& options_;
    const OffsetChainTuning tuning_;
    const double* q_now_;
    const JointLanes here_;
    const OffsetPosture now_;
    const int own_;
    ChainPosture start_;
};

}  // namespace detail

/// The step from q_now to `pose` (as the user sees it) within the arm's limits; Step::psi is the free joint's
/// value. Nothing moves where the pose is not met; scene, bounds and what is ahead are not asked.
inline Step step(const OffsetChain& arm, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    if (!is_rigid(pose) || !is_finite(q_now)) return detail::refused(arm.nominal.own, q_now, options.dt);
    return detail::OffsetChainStep(arm, q_now, pose, options)();
}

namespace detail {

/// The joints of a motion along poses, as follow_rows() moves them on.
struct OffsetChainWalk {
    const OffsetChain& arm;
    double q[joint_slots];

    int gc() const noexcept { return forward(arm, q).gc; }
    double residual(const Pose<double>& pose) const noexcept {
        return norm(tool_pose(arm, q).position - pose.position);
    }
    Step on(const Pose<double>& pose, const StepOptions& options) noexcept {
        const Step next = step(arm, q, pose, options);
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        return next;
    }
};

}  // namespace detail

/// Follows n poses (16 doubles each, row-major) from `start`: a loop around step(), nothing more.
inline void follow(const OffsetChain& arm, const double* start, const double* poses, std::size_t n,
                   const StepOptions& options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows) noexcept {
    detail::OffsetChainWalk walk{arm, {}};
    for (int j = 0; j < joints; ++j) walk.q[j] = start[j];
    Lookahead<ExactSections>* const none = nullptr;
    detail::follow_rows(walk, poses, n, options, on_fail, allowed, rows, none,
                        Strided<const Scene* const>{nullptr, 0});
}

}  // namespace armangle

#include "../../names/end.hpp"
