// The tracker of an arm with its own chain, or with an offset: it runs the tracker of the nominal arm on a
// corrected target.
//
// With K(theta) = N(theta) T(theta)^-1, the true end effector is at the target P if the nominal one is at
// K(theta) P. A control cycle begins with the K of the present joints. It is repeated from the same state
// with the K of the joints that it leads to, until K no longer changes. The moves of one cycle are small, so
// each repetition reduces the error by about the ratio of deviation to lever. Joints and bounds are always
// those of the true arm: if a cycle does not converge, the arm is late, never wrong.
#pragma once

#include "../motion/tracker.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of a tracker with a corrected target.
struct CorrectedTrackerTuning {
    static constexpr int passes = 10;       // repetitions of one control cycle
    static constexpr double stays = 1e-12;  // m: a smaller change of the corrected target ends them
};

/// The transform N T^-1 of the tool poses N of the nominal and T of the true arm at joint values q, which
/// takes a target of the true tool to that of the nominal tool.
template <class AnyArm>
Pose<double> correction(const AnyArm& arm, const double* q) noexcept {
    return tool_pose(nominal(arm), q) * inverted(tool_pose(arm, q));
}

/// The target of the elbow, a point or direction, transformed by `seen` like the target of the end effector.
inline Towards seen_hint(const ChainArm&, const Pose<double>& seen, Towards elbow) noexcept {
    elbow.target = seen.rotation * elbow.target;
    if (elbow.wish == Wish::point) elbow.target = elbow.target + seen.position;
    return elbow;
}

/// A collision-free solution of a target in branch gc within these limits, not necessarily the nearest, but
/// found in a bounded time; the status says why there is none. The options must have a seed.
template <class AnyArm>
Nearest resting_solution(const AnyArm& arm, const Limits& limits, const Scene* scene,
                         const Pose<double>& pose, int gc, const NearestOptions& options) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found;
    Tag blocking = 0;
    steps_of(arm).arcs(exact, gc, limits, found);
    if (scene) keep_clear(arm, *scene, exact, gc, found, blocking);
    const double held = redundancy(forward(arm, options.near));
    const Nearest out = detail::sampled_solution(arm, limits, exact, gc, found.arcs, held, options);
    const bool doubtful = found.unproven > 0 || found.status == Status::NEAR_SINGULAR;
    if (is_solved(out.status) || !doubtful) return out;
    const AnyArm narrow = with_limits(arm, limits);  // whose solution may be outside all proven intervals
    return steps_of(narrow).nearest(pose, options, scene);
}

/// The correction with which a cycle was computed, and the correction at the joints that it gave.
struct Guess {
    Pose<double> shown, found;
};

/// The next correction to try: the one at the joints found, which suffices if the deviation is small.
inline Pose<double> next_guess(const ChainArm&, const Guess&, const Guess& now) noexcept { return now.found; }

/// Tracks with the Tracker of the nominal arm, whose target is corrected for the true arm. The arm's type
/// must have seen_hint(arm, seen, elbow), next_guess, nominal(arm), steps_of(arm) and forward(arm, q).
template <class AnyArm>
class CorrectedTracker {
public:
    using Inner = Tracker<AnyArm>;

    /// A loop at rest at the middles of the joint ranges. The options' scene is that of the nominal arm,
    /// `about` the same scene prepared for the true arm; or both are null.
    CorrectedTracker(const AnyArm& arm, const TrackerOptions& options, const Scene* about = nullptr) noexcept
        : arm_(arm), length_(options.length), dt_(options.dt), tracker_(nominal(arm), options, arm, about) {
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = nominal(arm).joint_middle[j];
        start(middle);
    }

    /// Starts at rest at joints q.
    void start(const double* q) noexcept {
        tracker_.start(q, forward(arm_, q).pose);
        drift_ = {0, 0, 0};
    }

    /// The present joint values (rad), valid as long as the tracker is not changed.
    const double* q() const noexcept { return tracker_.q(); }
    /// The true arm.
    const AnyArm& arm() const noexcept { return arm_; }
    /// The nearest pair of shapes of the true arm and its obstacles within `reach` (m); see Tracker.
    NearestPair nearest_pair(double reach) const noexcept { return tracker_.nearest_pair(reach); }

    /// Makes the next cycle treat the target as moved, because obstacles have changed; see Tracker.
    void look_again() noexcept { tracker_.look_again(); }
    /// Calls visit(member) for the state that one cycle passes to the next; see Tracker.
    template <class Visit>
    void each_number(Visit& visit) {
        visit(drift_);
        tracker_.each_number(visit);
    }

    /// Computes the next cycle: repeats the nominal tracker's cycle until its target agrees with the joints.
    Tracked step(const Command& command) noexcept {
        const Inner before = tracker_;
        const double time = command.dt > 0 && command.dt < infinity ? command.dt : dt_;
        const Pose<double> start = correction(arm_, tracker_.q());
        Pose<double> seen = start;
        Guess last{};
        Tracked out{};
        for (int pass = 0; pass < CorrectedTrackerTuning::passes; ++pass) {
            Towards elbow;
            Command corrected = command;
            corrected.seen = &seen;
            corrected.drift = drift_;
            if (command.elbow) {
                elbow = seen_hint(arm_, seen, *command.elbow);
                corrected.elbow = &elbow;
            }
            tracker_ = before;
            out = tracker_.tick(corrected);
            const Pose<double> then = correction(arm_, out.q), &hand = tracker_.hand();
            if (size(difference(seen * hand, then * hand), length_) <= CorrectedTrackerTuning::stays) break;
            const Guess now{seen, then};
            seen = pass == 0 ? then : next_guess(arm_, last, now);
            last = now;
        }
        drift_ = (correction(arm_, out.q).position - start.position) * (1.0 / time);
        correct(out);
        tracker_.record_distance(out.distance, command.dt);
        return out;
    }

private:
    /// Replaces psi, branch and distance to the target in `out` by those of the true arm; if this distance is
    /// too large, the status becomes LAGGING.
    void correct(Tracked& out) const noexcept {
        const auto now = forward(arm_, out.q);
        out.psi = redundancy(now);
        out.gc = now.gc;
        out.distance = size(difference(now.pose, tracker_.hand()), length_);
        if (out.status != Tracking::FOLLOWING || out.distance <= TrackerTuning::exact) return;
        out.status = Tracking::LAGGING;
        out.why = Status::NO_CONVERGENCE;
    }

    AnyArm arm_;
    double length_, dt_;
    Vec3<double> drift_{};  // m/s: of the corrected target if the target rests
    Inner tracker_;
};

}  // namespace armangle

#include "../names/end.hpp"
