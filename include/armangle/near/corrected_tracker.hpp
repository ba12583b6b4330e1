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
#include "forward.hpp"

namespace armangle {

namespace near_rule {
inline constexpr int passes = 6;        // of one tick
inline constexpr double stays = 1e-12;  // m, of the hand as the nominal arm sees it
}  // namespace near_rule

/// N(theta) T(theta)^-1 at joint values q: where the nominal tool is, seen from the true one.
inline Pose<double> correction(const NearArm& arm, const double* q) noexcept {
    double theta[joints];
    SinCos<double> angle[joints];
    detail::theta_of(arm.nominal, q, theta);
    detail::sin_cos_all(theta, angle);
    return user_pose(arm.nominal, chain(arm.nominal, q).flange) * inverted(detail::tip(arm, angle));
}

/// A Tracker of the nominal arm, led so that the true tool is where the hand is.
class CorrectedTracker {
public:
    CorrectedTracker(const NearArm& arm, const TrackerOptions& options) noexcept
        : arm_(arm), length_(options.length), tracker_(arm.nominal, options) {
        double middle[joint_slots];
        for (int j = 0; j < joint_slots; ++j) middle[j] = arm.nominal.joint_middle[j];
        start(middle);
    }

    /// At rest at q, as Tracker.
    void start(const double* q) noexcept { tracker_.start(q, forward(arm_, q).pose); }

    const double* q() const noexcept { return tracker_.q(); }

    Tracked step(const Command& command) noexcept {
        const Tracker before = tracker_;
        Pose<double> seen = correction(arm_, tracker_.q());
        Tracked out{};
        for (int pass = 0; pass < near_rule::passes; ++pass) {
            Towards elbow;
            Command nominal = command;
            nominal.seen = &seen;
            if (command.elbow) {
                elbow = *command.elbow;
                elbow.target = seen.rotation * elbow.target;
                if (elbow.wish == Wish::point) elbow.target = elbow.target + seen.position;
                nominal.elbow = &elbow;
            }
            tracker_ = before;
            out = tracker_.step(nominal);
            const Pose<double> then = correction(arm_, out.q), &hand = tracker_.hand();
            if (size(difference(seen * hand, then * hand), length_) <= near_rule::stays) break;
            seen = then;
        }
        tell(out);
        return out;
    }

private:
    /// Tells of the true tool what was told of the nominal one.
    void tell(Tracked& out) const noexcept {
        const Posture now = forward(arm_, out.q);
        out.psi = now.psi;
        out.gc = now.gc;
        out.distance = size(difference(now.pose, tracker_.hand()), length_);
        if (out.status != Tracking::FOLLOWING || out.distance <= track_rule::exact) return;
        out.status = Tracking::LAGGING;
        out.why = Status::NO_CONVERGENCE;
    }

    NearArm arm_;
    double length_;
    Tracker tracker_;
};

}  // namespace armangle
