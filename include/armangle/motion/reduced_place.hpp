// The cells of a reach map of an arm on its own chain (limits/reduced_pose.hpp), from what is proven of it.
#pragma once

#include "../limits/reduced_pose.hpp"
#include "freedom.hpp"
#include "proven_turns.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Arms whose answers are proven along self-motions, or not at all.
template <class AnyArm>
concept proven_arm = requires(const AnyArm& arm, const ReducedArm<AnyArm>& map) {
    { steps_of(arm, map.free_table) } -> stepping_family;
};

/// Computes the cells of one wrist position, each independently. Only what is found or proven counts, and a
/// branch that is neither found to solve a cell nor excluded is unproven.
template <proven_arm AnyArm>
class ReducedPlace<AnyArm> {
public:
    /// Computes for a wrist at radius r and height (m), seen from the arm's own axis 1, whether its distance
    /// is within reach.
    ReducedPlace(const ReducedArm<AnyArm>& arm, double r, double height) noexcept
        : arm_(arm), at_{r, height, 0, 0, 0, 0} {
        const ReducedReach reach = reduced_reach(arm.free);
        const double distance = hypot(r, height), slack = tolerance::reach * nominal(arm.free).size;
        any_ = distance >= reach.inner - slack && distance <= reach.outer + slack;
    }

    /// Whether the links can reach this wrist position; if not, all cells are empty.
    bool any() const noexcept { return any_; }

    /// Sets the tilt (rad) of the following cells.
    void tilt(double angle) noexcept { at_.tilt = angle; }

    /// The cell at a turn in [-pi, pi] (rad); yaw and roll are 0 unless requested.
    ReducedCell cell(double turn, bool with_yaw, bool with_roll) const noexcept {
        ReducedPose at = at_;
        at.turn = turn;
        const Pose<double> pose = pose_of(arm_.free, at), exact{orthonormal(pose.rotation), pose.position};
        ProvenArcs found[configurations];
        const Freedom f = detail::freedom_of(steps_of(arm_.free, arm_.free_table), exact, found);
        ReducedCell out{f.gc, 0, 0, 0, static_cast<float>(f.total)};
        for (int gc = 0; gc < configurations; ++gc)
            out.unproven =
                static_cast<std::uint8_t>(out.unproven | (found[gc].unproven > 0 && !(f.gc >> gc & 1)) << gc);
        if (f.gc == 0) return out;
        const auto share = [&](const auto& family, Turned turned) {
            ArcSet set;
            double unproven = 0;
            detail::ProvenTurns(family, exact, turned).find(found, set, unproven);
            return detail::share_of_circle(set);
        };
        if (with_yaw) out.yaw = share(steps_of(arm_.yawed, arm_.yawed_table), Turned::base);
        if (with_roll) out.roll = share(steps_of(arm_.rolled, arm_.rolled_table), Turned::tool);
        return out;
    }

private:
    const ReducedArm<AnyArm>& arm_;
    ReducedPose at_;
    bool any_;
};

}  // namespace armangle

#include "../names/end.hpp"
