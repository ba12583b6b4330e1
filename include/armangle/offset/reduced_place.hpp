// The cells of a reach map of an arm with an offset (limits/reduced_pose.hpp).
//
// A turn about axis 7, or 1 of a mirrored arm, shifts the free joint; one about the other axis shifts the
// joint there. So what all joints but 1 and 7 leave of the free joint is found once for a cell, and gives its
// length and both shares.
#pragma once

#include "../limits/reduced_pose.hpp"
#include "turn_arcs.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The distances (m) of the reduced pose's wrist from the shoulder between which poses can be reachable; the
/// offset widens those of the links.
inline ReducedReach reduced_reach(const OffsetArm& arm) noexcept {
    return {max(0.0, arm.own.inner_reach - abs(arm.a_6)), arm.own.reach + abs(arm.a_6)};
}

/// Computes the cells of one wrist position, each independently.
template <>
class ReducedPlace<OffsetArm> {
public:
    /// Computes for a wrist at radius r and height (m) in the arm's base whether its distance is within
    /// reach.
    ReducedPlace(const ReducedArm<OffsetArm>& arm, double r, double height) noexcept
        : arm_(arm), at_{r, height, 0, 0, 0, 0} {
        const ReducedReach reach = reduced_reach(arm.free);
        const double distance = hypot(r, height), slack = tolerance::reach * arm.free.own.size;
        any_ = distance >= reach.inner - slack && distance <= reach.outer + slack;
    }

    /// Whether the links can reach this wrist position; if not, all cells are empty.
    bool any() const noexcept { return any_; }

    /// Sets the tilt (rad) of the following cells.
    void tilt(double angle) noexcept { at_.tilt = angle; }

    /// The cell at a turn in [-pi, pi] (rad); yaw and roll are 0 unless requested.
    ReducedCell cell(double turn, bool with_yaw, bool with_roll) noexcept {
        ReducedPose at = at_;
        at.turn = turn;
        const Pose<double> pose = pose_of(arm_.free, at), exact{orthonormal(pose.rotation), pose.position};
        feasible_all(arm_.free, exact, arm_.free.own.limits, found_);
        const Freedom f = detail::freedom_of(arm_.free, exact, found_);
        ReducedCell out{f.gc, 0, 0, 0, static_cast<float>(f.total)};
        if (f.gc == 0) return out;
        const auto share = [&](const OffsetArm& arm, Turned turned) {
            ArcSet set;
            detail::OffsetTurns(arm, exact, turned, {}).find(found_, set);
            return detail::share_of_circle(set);
        };
        if (with_yaw) out.yaw = share(arm_.yawed, Turned::base);
        if (with_roll) out.roll = share(arm_.rolled, Turned::tool);
        return out;
    }

    /// Finds the middle of the widest interval of the free joint (rad) of the cell computed last, and its
    /// branch; gc is -1 if there is none.
    void widest(double, double& free, int& gc) const noexcept {
        double most = 0;
        gc = -1;
        for (int branch = 0; branch < configurations; ++branch)
            for (int i = 0; i < found_[branch].arcs.count; ++i) {
                const Arc& arc = found_[branch].arcs.arc[i];
                if (!(arc.upper - arc.lower > most)) continue;
                most = arc.upper - arc.lower;
                free = wrap(0.5 * (arc.lower + arc.upper));
                gc = branch;
            }
    }

private:
    const ReducedArm<OffsetArm>& arm_;
    ReducedPose at_;
    bool any_;
    ProvenArcs found_[configurations];
};

}  // namespace armangle

#include "../names/end.hpp"
