// The loop for hands on a true chain: the nominal arm's tracker, shown the hand where the nominal arm has to
// go for the true tool to be there.
//
// With K(theta) = N(theta) T(theta)^-1, the tool is at the hand P where the nominal tool is at K(theta) P. A
// tick is taken with K of the joints that it leads to: begun with that of the present ones and taken again,
// from the same state, until K stays; the moves of one tick are small, so that each pass leaves about the
// deviation over the lever of what was left. Joints, and with them all bounds, are those of the true arm
// throughout: a tick that does not settle is late, never wrong.
#pragma once

#include "../motion/tracker.hpp"
#include "hull_cells.hpp"
#include "nearest_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace chain_tuning {
inline constexpr int passes = 6;        // of one tick
inline constexpr double stays = 1e-12;  // m, of the hand as the nominal arm sees it
}  // namespace chain_tuning

/// N(theta) T(theta)^-1 at joint values q: where the nominal tool is, seen from the true one.
inline Pose<double> correction(const ChainArm& arm, const double* q) noexcept {
    return tool_pose(arm.nominal, q) * inverted(tool_pose(arm, q));
}

/// An elbow hint as the nominal arm sees it.
inline Towards seen_hint(const ChainArm&, const Pose<double>& seen, Towards elbow) noexcept {
    elbow.target = seen.rotation * elbow.target;
    if (elbow.wish == Wish::point) elbow.target = elbow.target + seen.position;
    return elbow;
}

/// What of a nearly S-R-S arm keeps clear of obstacles: its true chain.
inline const ChainArm& body(const ChainArm& arm) noexcept { return arm; }

/// A solution of a target in branch gc within these limits, collision-free, that is near in time.
inline Nearest resting_solution(const ChainArm& arm, const Limits& limits, const Scene* scene,
                                const Pose<double>& pose, int gc, const NearestOptions& options) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found;
    Tag blocking = 0;
    feasible(arm, exact, gc, limits, 0.0, found);
    if (scene) keep_clear(arm, *scene, exact, gc, found, blocking);
    const double held = forward(arm, options.near).psi;
    const Nearest out = detail::sampled_solution(arm, limits, exact, gc, found.arcs, held, options);
    const bool doubtful = found.unproven > 0 || found.status == Status::NEAR_SINGULAR;
    if (is_solved(out.status) || !doubtful) return out;
    ArmParameters parameters = arm.nominal;  // a solution that arcs do not tell
    parameters.limits = limits;
    ChainArm narrow = arm;
    narrow.nominal = make_arm(parameters);
    return nearest_posture(narrow, 0.0, pose, options, scene);
}

/// Where the nominal arm was shown the hand to be, and where the joints that this led to say that it is.
struct Guess {
    Pose<double> shown, found;
};

/// What to show next: of an arm whose deviation is small what was found.
inline Pose<double> next_guess(const ChainArm&, const Guess&, const Guess& now) noexcept { return now.found; }

/// A Tracker of the nominal arm, led so that the true tool is where the hand is, of an arm that has
/// correction(arm, q), seen_hint(arm, seen, elbow), next_guess, nominal(arm), body(arm) and forward(arm, q).
template <class AnyArm>
class CorrectedTracker {
public:
    using Inner = Tracker<std::remove_cvref_t<decltype(body(std::declval<const AnyArm&>()))>>;

    /// The options' scene is that of the nominal arm, `about` the same made ready for the body; or both null.
    CorrectedTracker(const AnyArm& arm, const TrackerOptions& options, const Scene* about = nullptr) noexcept
        : arm_(arm),
          length_(options.length),
          dt_(options.dt),
          tracker_(nominal(arm), options, body(arm), about) {
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = nominal(arm).joint_middle[j];
        start(middle);
    }

    /// At rest at q, as Tracker.
    void start(const double* q) noexcept {
        tracker_.start(q, forward(arm_, q).pose);
        drift_ = {0, 0, 0};
    }

    const double* q() const noexcept { return tracker_.q(); }
    const AnyArm& arm() const noexcept { return arm_; }
    /// As Tracker, of the body.
    NearestPair nearest_pair(double reach) const noexcept { return tracker_.nearest_pair(reach); }

    /// As Tracker.
    void look_again() noexcept { tracker_.look_again(); }
    /// As Tracker.
    template <class Visit>
    void each_number(Visit& visit) {
        visit(drift_);
        tracker_.each_number(visit);
    }

    Tracked step(const Command& command) noexcept {
        const Inner before = tracker_;
        const double time = command.dt > 0 && command.dt < infinity ? command.dt : dt_;
        const Pose<double> start = correction(arm_, tracker_.q());
        Pose<double> seen = start;
        Guess last{};
        Tracked out{};
        for (int pass = 0; pass < chain_tuning::passes; ++pass) {
            Towards elbow;
            Command told = command;
            told.seen = &seen;
            told.drift = drift_;
            if (command.elbow) {
                elbow = seen_hint(arm_, seen, *command.elbow);
                told.elbow = &elbow;
            }
            tracker_ = before;
            out = tracker_.tick(told);
            const Pose<double> then = correction(arm_, out.q), &hand = tracker_.hand();
            if (size(difference(seen * hand, then * hand), length_) <= chain_tuning::stays) break;
            const Guess now{seen, then};
            seen = pass == 0 ? then : next_guess(arm_, last, now);
            last = now;
        }
        drift_ = (correction(arm_, out.q).position - start.position) * (1.0 / time);
        tell(out);
        tracker_.note(out.distance, command.dt);
        return out;
    }

private:
    /// Tells of the true tool what was told of the nominal one.
    void tell(Tracked& out) const noexcept {
        const auto now = forward(arm_, out.q);
        out.psi = redundancy(now);
        out.gc = now.gc;
        out.distance = size(difference(now.pose, tracker_.hand()), length_);
        if (out.status != Tracking::FOLLOWING || out.distance <= track_rule::exact) return;
        out.status = Tracking::LAGGING;
        out.why = Status::NO_CONVERGENCE;
    }

    AnyArm arm_;
    double length_, dt_;
    Vec3<double> drift_{};  // m/s: of where the nominal arm sees a hand that stays
    Inner tracker_;
};

}  // namespace armangle

#include "../names/end.hpp"
