// One step of a control loop, from the present joints to the next pose: the value of the free joint that the
// policy wants, nearly always; else the nearest to it that one step leads to, in this branch or in one that
// meets it.
//
// What one step may do is a box around the present joints. The values whose joints stay in the box are arcs
// again, of an arm whose limits are the box: feasible.hpp, with little to prove.
#pragma once

#include "../motion/follow.hpp"
#include "nearest.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// A step as far as the pose and the present joints decide it.
class OffsetStep {
public:
    OffsetStep(const OffsetArm& arm, const double* q_now, const Pose<double>& pose,
               const StepOptions& options) noexcept
        : arm_(arm),
          pose_{orthonormal(pose.rotation), pose.position},
          options_(options),
          q_now_(q_now),
          here_(joint_lanes(q_now)),
          now_(forward(arm, q_now)),
          own_(options.gc < 0 ? now_.gc : options.gc),
          scene_(options.scene),
          blocked_(options.scene && rest_contact(arm, *options.scene, pose_) != 0) {}

    Step operator()() noexcept {
        double wish = now_.free;
        Status why = wanted(wish);
        Lifted to;
        if (why == Status::OK) {
            why = at(own_, wish, to);
            if (why == Status::OK) return stepped(to, q_now_, options_.dt, wish, own_);
        } else if (why == Status::OUTSIDE) {
            return stayed(why);
        }
        Step out;
        if (near_wish(wish, out) || shared_turn(out)) return out;
        return stayed(reason(why));
    }

private:
    /// Where the policy wants the free joint; of a policy that holds it nothing need be proven for that.
    Status wanted(double& wish) noexcept {
        Lifted to;
        if (options_.policy.rule == Rule::hold && !options_.allowed && at(own_, wish, to) == Status::OK)
            return Status::OK;
        look();
        if (arcs_.status != Status::OK) return arcs_.status;
        ArcSet open = arcs_.arcs, soft;
        if (options_.allowed) intersect(arcs_.arcs, *options_.allowed, open);
        if (open.empty()) return Status::NOT_ALLOWED;
        Resolution next = resolve(options_.policy, open, wish);
        const bool asked = scene_ && scene_->soft > 0;
        if (asked && keep_soft(arm_, *scene_, pose_, own_, open, wish, soft))
            next = led(options_.policy, soft, wish);
        wish = next.psi;
        return next.status;
    }

    /// The arcs of the branch; among obstacles that alone which holds the present value, where it is clear.
    void look() noexcept {
        if (looked_) return;
        looked_ = true;
        feasible(arm_, pose_, own_, arcs_);
        if (!scene_) return;
        Tag blocking;
        const Place here = find(arcs_.arcs, now_.free);
        if (here.index >= 0 && !options_.allowed && arcs_.arcs.count > 1) {
            ProvenArcs own = arcs_;
            make_empty(own.arcs);
            own.arcs.arc[own.arcs.count++] = arcs_.arcs.arc[here.index];
            keep_clear(arm_, *scene_, pose_, own_, own, blocking);
            if (contains(own.arcs, now_.free)) {
                arcs_ = own;
                return;
            }
        }
        keep_clear(arm_, *scene_, pose_, own_, arcs_, blocking);
    }

    /// The joints of a branch and a value of the free joint next to the present ones; JOINT_JUMP where one
    /// would move too far, CLEARANCE where something touches.
    Status at(int gc, double free, Lifted& to) const noexcept {
        Directions<double> d;
        const Status solved = directions(arm_, pose_, free, gc, q_now_, d);
        if (solved != Status::OK) return solved;
        const Status turned = choose_windings(arm_.own, d, here_, to);
        if (turned != Status::OK) return turned;
        if (!(largest_move(to.q, here_) <= options_.max_joint_step)) return Status::JOINT_JUMP;
        double q[joint_slots];
        to.q.store(q);
        const bool clear = !scene_ || StraightMove(arm_, *scene_).is_clear_at(q);
        return clear && !blocked_ ? Status::OK : Status::CLEARANCE;
    }

    /// The bits of branches that meet this one within a step: at theta_2 = 0 or pi, at the stretched or
    /// folded elbow, and at the fold.
    int meeting() const noexcept {
        static constexpr int joint[] = {1, 3, 4};
        const double zero[] = {0.0, arm_.rest.delta_angle, half_pi};
        int bits = 0;
        for (int k = 0; k < 3; ++k) {
            const double theta = to_theta(arm_.rest, joint[k], q_now_[robot_joint(arm_, joint[k])]) - zero[k];
            if (abs(theta - pi * round(theta / pi)) <= options_.max_joint_step) bits |= 1 << k;
        }
        return bits;
    }

    /// Of the values that one step leads to the nearest to a wish; of branches that meet the own one that
    /// whose joints move least.
    bool near_wish(double wish, Step& out) noexcept {
        const bool found = take(own_, wish, options_.allowed, out);
        if (found || options_.gc >= 0) return found;
        double least = infinity;
        const int bits = meeting();
        for (int flip = 1; flip < configurations; ++flip) {
            Step other;
            if ((flip & ~bits) != 0 || !take(own_ ^ flip, now_.free, options_.allowed, other)) continue;
            const double move = largest_move(other.q, q_now_);
            if (!(move < least) || !passes(arm_, q_now_, other.q)) continue;
            least = move;
            out = other;
        }
        return least < infinity;
    }

    /// The value of one branch that is nearest to a wish and one step away; of those allowed, if not null.
    bool take(int gc, double wish, const ArcSet* allowed, Step& out) noexcept {
        static constexpr double inside[] = {0, 1e-6, 1e-3, 0.1, 0.5};  // shares of the way to the middle
        Limits box;
        for (int j = 0; j < joints; ++j) {
            box.lower[j] = max(arm_.own.limits.lower[j], q_now_[j] - options_.max_joint_step);
            box.upper[j] = min(arm_.own.limits.upper[j], q_now_[j] + options_.max_joint_step);
            if (!(box.lower[j] <= box.upper[j])) return false;
        }
        ProvenArcs near;
        feasible(arm_, pose_, gc, box, near);
        Tag blocking;
        if (scene_) keep_clear(arm_, *scene_, pose_, gc, near, blocking);
        ArcSet open = near.arcs;
        if (allowed) intersect(near.arcs, *allowed, open);
        double best = infinity;
        for (int i = 0; i < open.count; ++i) {
            const Arc& arc = open.arc[i];
            const double middle = 0.5 * (arc.lower + arc.upper);
            const double from = min(max(lift(wish, middle), arc.lower), arc.upper);
            for (const double share : inside) {
                const double free = wrap(from + share * (middle - from)), off = abs(wrap(free - wish));
                Lifted to;
                if (off >= best) break;
                if (at(gc, free, to) != Status::OK) continue;
                best = off;
                out = stepped(to, q_now_, options_.dt, free, gc);
            }
        }
        return best < infinity;
    }

    /// A posture at theta_2 = 0, where joints 1 and 3 share their turn, which no arc holds.
    bool shared_turn(Step& out) const noexcept {
        if ((meeting() & 1) == 0 || options_.allowed) return false;
        const unsigned branches = options_.gc < 0 ? 3u << (own_ & ~1) : 1u << own_;
        const OffsetNearest found = nearest(arm_, pose_, q_now_, nullptr, branches, scene_);
        if (found.status != Status::OK && found.status != Status::UNPROVEN) return false;
        if (!(largest_move(found.q, q_now_) <= options_.max_joint_step)) return false;
        out = stepped({joint_lanes(found.q), found.margin}, q_now_, options_.dt, found.free, found.gc);
        return true;
    }

    /// Why there is no step: the pose has no posture in the branch, or none that is one step away.
    Status reason(Status why) noexcept {
        look();
        if (arcs_.status != Status::OK) return arcs_.status;
        Step other;
        if (options_.allowed && take(own_, now_.free, nullptr, other)) return Status::NOT_ALLOWED;
        if (scene_) {
            scene_ = nullptr;
            if (take(own_, now_.free, options_.allowed, other)) return Status::CLEARANCE;
        }
        return why == Status::WINDING_EXHAUSTED ? why : Status::JOINT_JUMP;
    }

    Step stayed(Status why) const noexcept {
        Step out{};
        for (int j = 0; j < joints; ++j) out.q[j] = q_now_[j];
        out.psi = now_.free;
        out.gc = now_.gc;
        complete(arm_.own, q_now_, options_.dt, why, why, out);
        return out;
    }

    const OffsetArm& arm_;
    const Pose<double> pose_;
    const StepOptions& options_;
    const double* q_now_;
    const JointLanes here_;
    const OffsetPosture now_;
    const int own_;
    const Scene* scene_;  // to be kept clear of; null: none
    const bool blocked_;  // by what rests, whatever the joints
    bool looked_ = false;
    ProvenArcs arcs_;
};

}  // namespace detail

/// The step from q_now to `pose` (as the user sees it) within the arm's limits; Step::psi is the free joint's
/// value. Nothing moves where the pose is not met; bounds and what is ahead are not asked.
inline Step step(const OffsetArm& arm, const double* q_now, const Pose<double>& pose,
                 const StepOptions& options) noexcept {
    if (!is_rigid(pose) || !is_finite(q_now)) return detail::refused(arm.own, q_now, options.dt);
    return detail::OffsetStep(arm, q_now, pose, options)();
}

/// Follows n poses (16 doubles each, row-major) from `start`: a loop around step(), nothing more.
inline void follow(const OffsetArm& arm, const double* start, const double* poses, std::size_t n,
                   const StepOptions& options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows, Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    detail::follow_steps(
        start, poses, n, options, on_fail, allowed, rows,
        [&](const double* q, const Pose<double>& pose, const StepOptions& asked) {
            return step(arm, q, pose, asked);
        },
        [&](const double* q) { return forward(arm, q).pose.position; }, scenes);
}

}  // namespace armangle

#include "../names/end.hpp"
