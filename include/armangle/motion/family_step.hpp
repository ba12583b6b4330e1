// One step of any arm with one redundant joint, with or without bounds: written once, on what a family says
// of itself.
//
// What a step may do is a box around the present joints: the largest step, velocities, accelerations, and
// room to brake. The values of the free number whose joints stay in a box are arcs again, of an arm whose
// limits are the box. The step tries in order:
//     - the value that the policy requests; near a hinge the solution next to the present one, if that value
//       sweeps joints around
//     - the nearest value whose joints stay in the box, in this branch or one that meets it
//     - a solution within the box from the joints themselves: where branches merge arcs leave it out
//     - under bounds: as far towards a solution as they allow; out of reach, if requested: the nearest pose
//
// With a free roll the pose is turned about its own z axis to the roll of the present joints, no condition
// holds joint 7, and in the result it keeps its value.
#pragma once

#include "../limits/approach.hpp"
#include "../limits/solve_locally.hpp"
#include "../scene/clear_cells.hpp"
#include "pace.hpp"
#include "stepping_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Computes one step of an arm of any kind: construct it, then call it once.
template <stepping_family F>
class FamilyStep {
public:
    /// Computes the redundant parameter and branch of joints q_now, and whether obstacles block the pose
    /// whatever the joints.
    FamilyStep(const F& family, const double* q_now, const Pose<double>& pose,
               const StepOptions& options) noexcept
        : family_(family),
          rows_(family.rows()),
          q_now_(q_now),
          roll_(rows_.roll_free ? roll_towards(tool_pose(family.arm(), q_now), pose) : 0.0),
          pose_(rolled(pose)),
          options_(options),
          bounds_(options.bounds ? *options.bounds : no_bounds),
          policy_(options.policy),
          here_(joint_lanes(q_now)),
          now_(family.on(q_now, pose_, options.carry)),
          own_(options.gc < 0 ? now_.gc : options.gc),
          scene_(options.scene),
          blocked_(options.scene && rest_contact(family.arm(), *options.scene, pose_) != 0),
          longest_(options.max_joint_step) {
        make_empty(open_);
    }

    /// The step; call it only once.
    Step operator()() noexcept {
        Lifted to;
        if (holds() && joints_at(own_, now_.lambda, to) == Status::OK && keeps(to))
            return arrived(to, now_.lambda, own_);
        if (policy_.rule == Rule::towards)
            policy_.towards = {Wish::psi, family_.towards(pose_, own_, policy_.towards), {}};
        double wish = now_.lambda;
        Status why = wanted(wish);
        if (why == Status::OUTSIDE || why == Status::UNREACHABLE || why == Status::POSE_BLOCKED)
            return without(why);
        Step out;
        if (why == Status::OK && (calm(wish, out) || requested(wish, why, out))) return out;
        if (arcs_.status == Status::OK && take(own_, wish, options_.allowed, out)) return out;
        const bool merging = (unproven_ && !(family_.margin() > 0)) || meeting() != 1u << own_;
        // near a hinge the arcs of other branches sweep joints around
        const bool is_singular = merging && singularity_sine() <= StepTuning::shut;
        if ((is_singular && solve_nearby(out)) || change_branch(out)) return out;
        if ((merging && !is_singular && solve_nearby(out)) || take_nearest(out)) return out;
        why = reason(why);
        // the straight way to the solution of another pose may collide
        if (options_.bounds && !options_.scene && advance(why, out)) return out;
        return without(why);
    }

private:
    /// A pose with an exact rotation and, if the roll is free, turned by roll_ about its own z axis.
    Pose<double> rolled(const Pose<double>& pose) const noexcept {
        const Pose<double> exact{orthonormal(pose.rotation), pose.position};
        return rows_.roll_free ? turned_about_z(exact, sin_cos(roll_)) : exact;
    }

    /// Puts joint 7 back to its present value in joints that solve the pose, if the roll is free.
    void hold_roll(double* q) const noexcept {
        if (rows_.roll_free) q[joints - 1] = q_now_[joints - 1];
    }

    /// Whether the redundant parameter may keep its value without computing the arcs, because the policy
    /// holds it.
    bool holds() const noexcept {
        return policy_.rule == Rule::hold && options_.carry == Carry::psi && !options_.allowed &&
               !options_.ahead && !(scene_ && scene_->soft > 0) && !(family_.margin() > 0);
    }

    /// The result of a step that reaches the pose with these joints.
    Step arrived(const Lifted& to, double lambda, int gc) const noexcept {
        return stepped(to, q_now_, options_.dt, lambda, gc);
    }

    /// Replaces `wish`, the present value, by the value that the policy requests within the arcs that are
    /// allowed and collision-free. Returns OK, or the reason if there is none; `wish` stays if no arc is
    /// left.
    Status wanted(double& wish) noexcept {
        look();
        if (arcs_.status != Status::OK) return arcs_.status;
        open_ = kept_ = arcs_.arcs;
        if (options_.allowed) intersect(arcs_.arcs, *options_.allowed, open_);
        if (open_.empty()) return Status::NOT_ALLOWED;
        kept_ = open_;
        Resolution next = resolve(policy_, open_, wish);
        ArcSet soft;
        const bool asked = scene_ && scene_->soft > 0 && next.status == Status::OK;
        if (asked && keep_soft(family_.arm(), *scene_, pose_, own_, open_, wish, soft)) {
            kept_ = soft;
            next = resolve_from_nearest_end(policy_, soft, wish);
        }
        wish = next.psi;
        return next.status;
    }

    /// Computes the collision-free arcs of the branch. In a scene, if the caller permits all arcs, only the
    /// one that contains the present value is kept, provided that value is collision-free.
    void look() noexcept {
        family_.arcs(pose_, own_, rows_.limits, arcs_);
        unproven_ = arcs_.unproven > 0 || arcs_.status == Status::NEAR_SINGULAR;
        if (!scene_ || arcs_.status != Status::OK) return;
        Tag blocking;
        const Place here = find(arcs_.arcs, now_.lambda);
        if (here.index >= 0 && !options_.allowed && arcs_.arcs.count > 1) {
            ProvenArcs own = arcs_;
            make_empty(own.arcs);
            own.arcs.arc[own.arcs.count++] = arcs_.arcs.arc[here.index];
            keep_clear(family_.arm(), *scene_, pose_, own_, own, blocking);
            if (contains(own.arcs, now_.lambda)) {
                arcs_ = own;
                return;
            }
        }
        keep_clear(family_.arm(), *scene_, pose_, own_, arcs_, blocking);
    }

    /// Writes the joints of a branch at value lambda of the redundant number to `to`, in the revolutions
    /// nearest to the present joints. JOINT_JUMP if one would move farther than `longest` (rad), CLEARANCE if
    /// the configuration collides, or the reason why there is none.
    Status joints_at(int gc, double lambda, Lifted& to, double longest) const noexcept {
        Directions<double> d;
        const Status solved = family_.at(pose_, gc, lambda, q_now_, d);
        if (solved != Status::OK) return solved;
        const Status turned = choose_windings(rows_, d, here_, to);
        if (turned != Status::OK) return turned;
        if (!(largest_move(to.q, here_) <= longest)) return Status::JOINT_JUMP;
        if (!scene_) return Status::OK;
        double q[joint_slots];
        to.q.store(q);
        return !blocked_ && is_clear(family_.arm(), *scene_, q) ? Status::OK : Status::CLEARANCE;
    }
    /// Writes the joints of a branch at value lambda of the redundant number to `to`, as the function above
    /// does if no joint may move farther than the largest permitted joint step.
    Status joints_at(int gc, double lambda, Lifted& to) const noexcept {
        return joints_at(gc, lambda, to, longest_);
    }

    /// Whether the bounds permit the joints q.
    bool keeps(const double* q) const noexcept {
        return !options_.bounds || detail::keeps(rows_, bounds_, q_now_, q, longest_);
    }
    /// Whether the bounds permit these joints.
    bool keeps(const Lifted& to) const noexcept {
        double q[joint_slots];
        to.q.store(q);
        return keeps(q);
    }

    /// Computes the joint ranges (rad) that a step may reach under the conditions that `kept` names, with
    /// joint 7 unlimited if the roll is free; false if a range is empty.
    bool box(Kept kept, Limits& out) const noexcept {
        const MoveBox moves = move_box(rows_, bounds_, q_now_, longest_, kept);
        for (int j = 0; j < joints; ++j) {
            if (!(moves.lower[j] <= moves.upper[j])) return false;
            out.lower[j] = q_now_[j] + moves.lower[j];
            out.upper[j] = q_now_[j] + moves.upper[j];
        }
        if (rows_.roll_free) {  // joint 7 is independent of the pose
            out.lower[joints - 1] = -infinity;
            out.upper[joints - 1] = infinity;
        }
        return true;
    }

    /// Writes the collision-free values of a branch whose joints stay in box(kept), intersected with
    /// `allowed` (may be null).
    void within(int gc, Kept kept, const ArcSet* allowed, ArcSet& out) noexcept {
        make_empty(out);
        Limits limits;
        if (!box(kept, limits)) return;
        ProvenArcs near;
        family_.arcs(pose_, gc, limits, near);
        unproven_ |= near.unproven > 0 || near.status == Status::NEAR_SINGULAR;
        Tag blocking;
        if (scene_) keep_clear(family_.arm(), *scene_, pose_, gc, near, blocking);
        out = near.arcs;
        if (allowed) intersect(near.arcs, *allowed, out);
    }

    /// Writes the step to the solution of a branch within all bounds whose value is nearest to `wish`; false
    /// if there is none. `allowed` may be null.
    bool take(int gc, double wish, const ArcSet* allowed, Step& out) noexcept {
        ArcSet set;
        within(gc, {}, allowed, set);
        Lifted to, best;
        const double found = nearest_kept(set, wish, [&](double lambda) {
            const bool kept = joints_at(gc, lambda, to) == Status::OK && keeps(to);
            if (kept) best = to;
            return kept;
        });
        if (is_nan(found)) return false;
        out = arrived(best, found, gc);
        return true;
    }

    /// Takes the value `wish` that the policy requests, or that on the part `ahead` if it is given. If the
    /// step cannot reach it, returns false, with the reason in `why` (OK: the bounds).
    bool requested(double& wish, Status& why, Step& out) noexcept {
        if (on_ahead(wish, out)) return true;
        Lifted to;
        why = joints_at(own_, wish, to);
        if (why != Status::OK || !keeps(to)) return false;
        out = arrived(to, wish, own_);
        return true;
    }

    /// Takes the solution on the part of the arcs from which the coming poses can be reached, and replaces
    /// `wish` by the value that the policy requests there; false if there is none, or no such part is given.
    bool on_ahead(double& wish, Step& out) noexcept {
        if (!options_.ahead) return false;
        ArcSet ahead = *options_.ahead, both;
        if (roll_ != 0) turn(ahead, family_.turned_by(roll_));
        intersect(ahead, kept_, both);
        const ArcSet& part = both.empty() ? ahead : both;
        const double there = wish_ahead(open_, policy_, &part, now_.lambda);
        if (is_nan(there)) return false;
        wish = there;
        Lifted to;
        if (joints_at(own_, there, to) != Status::OK || !keeps(to)) return take(own_, there, &part, out);
        out = arrived(to, there, own_);
        return true;
    }

    /// The own branch and, unless the caller fixed it, the branches that a single step can reach from the
    /// present joints: bit gc is set. A singularity margin separates those that meet at singular postures.
    unsigned meeting() const noexcept {
        unsigned found = 1u << own_;
        if (options_.gc >= 0) return found;
        const auto zeros = family_.meetings();
        for (int k = 0; k < 3; ++k) {
            const BranchMeeting& at = zeros[static_cast<std::size_t>(k)];
            if (at.is_singular && family_.margin() > 0) continue;
            const double off = to_theta(rows_, at.joint, q_now_[at.joint]) - at.zero;
            if (!(abs(off - pi * round(off / pi)) <= longest_)) continue;
            for (int gc = 0; gc < configurations; ++gc)
                if (found >> gc & 1u) found |= 1u << (gc ^ 1 << k);
        }
        return found;
    }

    /// Finds a solution within all bounds in another branch that one step can reach; of several, the one with
    /// the least joint motion. False if there is none.
    bool change_branch(Step& out) noexcept {
        const unsigned branches = meeting();
        double least = infinity;
        for (int gc = 0; gc < configurations; ++gc) {
            Step other;
            if (gc == own_ || !(branches >> gc & 1u)) continue;
            if (!take(gc, now_.lambda, options_.allowed, other)) continue;
            const double move = largest_move(other.q, q_now_);
            if (!(move < least) || !passes(family_.arm(), q_now_, other.q)) continue;
            least = move;
            out = other;
        }
        return least < infinity;
    }

    /// Finds a solution within all bounds numerically, starting from the present joints; false if there is
    /// none.
    bool solve_nearby(Step& out) const noexcept {
        Limits limits;
        if (!box({}, limits)) return false;
        const double margin = family_.margin();
        if (margin > 0 && !keep_off_singular(rows_, family_.meetings(), q_now_, margin, limits)) return false;
        Joints start{};
        for (int j = 0; j < joints; ++j) start.q[j] = q_now_[j];
        Relaxed found{start, infinity};
        with_either_bend(rows_, start, longest_, [&](const Joints& from) {
            int rounds = LocalSolveTuning::rounds;
            found = solve_locally(family_.arm(), limits, from, pose_, {}, 0.0, rounds);
            return meets(family_.arm(), found);
        });
        if (!meets(family_.arm(), found)) return false;
        hold_roll(found.at.q);
        return offer(found.at.q, out);
    }

    /// Writes the step to joints q, which solve the pose, to `out`; false if bounds, branch, allowed arcs or
    /// obstacles do not permit it.
    bool offer(const double* q, Step& out) const noexcept {
        if (!(largest_move(q, q_now_) <= longest_) || !keeps(q)) return false;
        const OnSelfMotion there = family_.on(q, pose_, Carry::psi);
        if (!(meeting() >> there.gc & 1u)) return false;
        if (options_.allowed && !contains(*options_.allowed, there.lambda)) return false;
        if (scene_ && (blocked_ || !is_clear(family_.arm(), *scene_, q))) return false;
        out = arrived({joint_lanes(q), limit_margin(rows_.limits, q)}, there.lambda, there.gc);
        return true;
    }

    /// Writes the solution nearest to the present joints to `out`, if it is within the box of moves;
    /// otherwise false. It is searched only if parts of the arcs are unproven and advance() is no alternative
    /// (bounds without a scene).
    bool take_nearest(Step& out) const noexcept {
        const bool approaches = options_.bounds && !options_.scene;
        if (!unproven_ || approaches) return false;
        const unsigned branches = meeting();
        NearestOptions asked;
        asked.near = q_now_;
        asked.branches = branches;
        asked.allowed = options_.allowed;
        for (const Metric metric : {Metric::l2, Metric::max}) {
            asked.metric = metric;
            Nearest found = family_.nearest(pose_, asked, scene_);
            if (!is_solved(found.status)) return false;
            hold_roll(found.q);
            const bool leaps = found.gc != own_ && !passes(family_.arm(), q_now_, found.q);
            if (!leaps && offer(found.q, out)) return true;
        }
        return false;
    }

    /// The smallest |sin| of the joints with a singular position (see hinges()); infinite if there is none.
    double singularity_sine() const noexcept {
        double bend = infinity;
        for (const int j : family_.hinges()) bend = min(bend, abs(std::sin(to_theta(rows_, j, q_now_[j]))));
        return bend;
    }

    /// Near a singular joint: writes the solution next to the present one to `out` if the requested value
    /// would move the neighbouring joints far. If the policy alone requests that, the joints move less. False
    /// if this does not apply.
    bool calm(double wish, Step& out) noexcept {
        const double bend = singularity_sine();
        if (!may_sweep(bend, options_)) return false;
        Step next;
        if (!solve_nearby(next)) return false;
        const bool parted = next.gc != own_ || !contains(arcs_.arcs, next.psi);
        if (family_.margin() > 0 && parted) return false;
        const double least = largest_move(next.q, q_now_);
        Lifted carried;
        const bool solved = joints_at(own_, now_.lambda, carried, pi) == Status::OK;
        const double move = largest_move(carried.q, here_);
        if (!solved || !(move <= damped_move(bend, least))) {
            out = next;
            return true;
        }
        const double most =
            max(StepTuning::sweep * least, move) + damped_drift(bend, options_.max_joint_step);
        if (!(most < options_.max_joint_step)) return false;
        longest_ = most;
        Status why;
        const bool slower = requested(wish, why, out) || take(own_, wish, options_.allowed, out);
        longest_ = options_.max_joint_step;
        if (!slower) out = next;
        return true;
    }

    /// The reason why there is no step: the first condition whose removal permits one. Call it last, since it
    /// drops the scene.
    Status reason(Status why) noexcept {
        if (arcs_.status != Status::OK) return arcs_.status;
        const auto leads = [&](Kept kept, const ArcSet* allowed) {
            ArcSet left;
            within(own_, kept, allowed, left);
            return !left.empty();
        };
        if (open_.empty() || (options_.allowed && leads({}, nullptr))) return Status::NOT_ALLOWED;
        if (scene_) {
            scene_ = nullptr;
            if (leads({}, options_.allowed)) return Status::CLEARANCE;
        }
        if (options_.bounds && leads({.acceleration = false}, options_.allowed))
            return Status::ACCELERATION_LIMIT;
        if (options_.bounds && leads({.velocity = false, .acceleration = false}, options_.allowed))
            return Status::VELOCITY_LIMIT;
        return why == Status::OK || why == Status::CLEARANCE ? Status::JOINT_JUMP : why;
    }

    /// Writes a step to `out` that moves as far as it may towards a solution of the pose: PARTIAL with the
    /// reason `why`, or OK if it arrives. False if there is none.
    bool advance(Status why, Step& out) noexcept {
        double to[joint_slots], way[joints];
        if (!choose_goal(to, why)) return false;
        hold_roll(to);
        if (offer(to, out)) return true;
        for (int j = 0; j < joints; ++j) way[j] = to[j] - q_now_[j];
        const double k = pace(way, bounds_.dt, bounds_.velocity, bounds_.acceleration);
        if (!(k > 0)) return false;
        go(rows_, bounds_, q_now_, options_.max_joint_step, way, k, out.q);
        out = finished(Status::PARTIAL, why, out);
        return true;
    }

    /// The step if no solution is found: to the nearest pose if that is requested, there is no scene, and
    /// `why` is the place of the pose (out of reach, limits, singular, no convergence). Otherwise the arm
    /// stays, or brakes if accelerations are bounded, with status `why`.
    Step without(Status why) const noexcept {
        return options_.nearest && !options_.scene && is_beyond(why) ? to_nearest(why) : stayed(why);
    }

    /// Moves to the nearest configuration with the orientation of the pose. If a limit other than joint 4's
    /// keeps it from there, moves to a configuration that no small change brings nearer to the pose. A
    /// configuration that is as near as that one rests.
    Step to_nearest(Status why) const noexcept {
        const Limits sides = on_these_sides(rows_, family_.meetings(), q_now_, family_.margin(), options_.gc);
        const ApproachTuning tuning;
        Joints start{};
        for (int j = 0; j < joints; ++j) start.q[j] = q_now_[j];
        const Twist off = difference(tool_pose(family_.arm(), q_now_), pose_);
        const bool is_level = norm(off.angular) <= tuning.parallel;
        const Joints from =
            is_level ? start
                     : approach(family_.arm(), sides, start, pose_, rows_.size, tuning.rounds, tuning).at;
        Parallel level = approach_parallel(family_.arm(), sides, from, pose_, infinity, tuning);
        // a stretched arm may turn without moving the end effector: nearby, the least turn is taken
        if (!is_level && largest_move(level.at.q, q_now_) <= tuning.longest)
            level = approach_parallel(family_.arm(), sides, start, pose_, infinity, tuning);
        Joints to = level.at;
        bool rests = is_level && norm(off.linear) <= level.gap + tuning.same;
        if (!level.kept || level.held) {
            const double length = StepTuning::length;
            const Relaxed nearest =
                approach(family_.arm(), sides, start, pose_, length, tuning.rounds, tuning);
            to = nearest.at;
            rests = size(off, length) <= nearest.distance + tuning.same;
        }
        hold_roll(to.q);
        double way[joints];
        for (int j = 0; j < joints; ++j) way[j] = rests ? 0.0 : to.q[j] - q_now_[j];
        Step out{};
        go(rows_, bounds_, q_now_, options_.max_joint_step, way,
           pace(way, bounds_.dt, bounds_.velocity, bounds_.acceleration), out.q);
        return finished(Status::PARTIAL, why, out);
    }

    /// Chooses the joints at which a step under bounds aims. First choice is the result of a step without
    /// bounds, if the end effector stays near its path; `why` then becomes the bound that forbids it.
    /// Otherwise the present value, or the end of the arcs nearest to it. If a joint would have to reverse
    /// for that, the solution nearest to the joints. False if there is none.
    bool choose_goal(double (&to)[joint_slots], Status& why) const noexcept {
        StepOptions free = options_;
        free.bounds = nullptr;
        free.ahead = nullptr;
        free.nearest = false;
        free.policy = {Rule::hold};
        FamilyStep unbounded(family_, q_now_, pose_, free);
        Step next;
        if (family_.margin() > 0 || !unbounded.solve_nearby(next)) next = unbounded();
        for (int j = 0; j < joint_slots; ++j) to[j] = next.q[j];
        if (next.status == Status::OK) {
            Bounds slow = bounds_;
            for (double& a : slow.acceleration) a = infinity;
            const bool kept = detail::keeps(rows_, slow, q_now_, to, options_.max_joint_step);
            if (why != Status::ACCELERATION_LIMIT)
                why = kept ? Status::ACCELERATION_LIMIT : Status::VELOCITY_LIMIT;
            return true;
        }
        Lifted held;
        const Resolution end = resolve_from_nearest_end(free.policy, open_, now_.lambda);
        if (end.status != Status::OK) return false;
        if (joints_at(own_, end.psi, held, pi) == Status::OK) {
            held.q.store(to);
            return true;
        }
        NearestOptions asked;
        asked.near = q_now_;
        asked.branches = 1u << own_;
        asked.allowed = &open_;
        const Nearest found = family_.nearest(pose_, asked, nullptr);
        for (int j = 0; j < joint_slots; ++j) to[j] = found.q[j];
        return is_solved(found.status);
    }

    /// The result without motion; if accelerations are bounded, every joint brakes.
    Step stayed(Status why) const noexcept {
        Step out{};
        for (int j = 0; j < joints; ++j)
            out.q[j] = q_now_[j] + (options_.bounds ? braked(rows_, bounds_, q_now_, j) : 0.0);
        return finished(why, why, out);
    }

    /// Completes a step with its parameter, branch, margin and status.
    Step finished(Status status, Status why, Step out) const noexcept {
        out.q[joints] = 0.0;
        const OnSelfMotion there = family_.on(out.q, pose_, Carry::psi);
        out.psi = there.lambda;
        out.gc = there.gc;
        complete(rows_, q_now_, options_.dt, status, why, out);
        return out;
    }

    const F& family_;
    const Arm& rows_;
    const double* q_now_;
    const double roll_;  // rad that the pose is turned about its own z axis
    const Pose<double> pose_;
    const StepOptions& options_;
    const Bounds& bounds_;
    Policy policy_;
    const JointLanes here_;
    const OnSelfMotion now_;
    const int own_;
    const Scene* scene_;  // that the joints must keep clear of; null: none
    const bool blocked_;  // by what rests, whatever the joints
    double longest_;      // rad: that a joint may move
    ProvenArcs arcs_;     // of the branch
    ArcSet open_;         // the part that the caller allows
    ArcSet kept_;         // the part on which the policy acts: with the soft clearance, or all of it
    bool unproven_ = false;
};

}  // namespace detail

/// The step from q_now to `pose` (in the user's frame); Step::psi is the family's free number. BAD_INPUT if
/// the pose is not rigid or q_now not finite.
template <stepping_family F>
Step step(const F& family, const double* q_now, const Pose<double>& pose,
          const StepOptions& options) noexcept {
    if (!is_rigid(pose) || !is_finite(q_now)) return detail::refused(family.rows(), q_now, options.dt);
    Step out = detail::FamilyStep<F>(family, q_now, pose, options)();
    if (family.rows().roll_free) out.psi = family.on(out.q, pose, Carry::psi).lambda;
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
