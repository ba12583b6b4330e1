// Robot placement: for one base position, the yaw of the base at which most poses are reachable.
//
// Each pose gives exact arcs of yaw (turn_arcs.hpp). One sweep over all their ends finds the yaw interval
// with the greatest total weight of poses. The sum is constant between ends, so no scan can find more.
#pragma once

#include "turn_arcs.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// At this yaw, in (-pi, pi], the sweep adds a pose's weight (positive) or removes it (negative).
struct YawEvent {
    double yaw, weight;
};

/// Best yaw of a base position.
struct BestYaw {
    double yaw;      // rad: middle of the widest of the best intervals
    double stretch;  // rad: length of that interval, 2 pi if all yaws are equal
    double reached;  // total weight of the reachable poses
};

/// Computes the yaw angles of a base, counted from its present orientation, at which a pose is reachable if
/// the base moves to `at` (m, in the frame of poses). Yaw is a rotation around axis 1, counted around the z
/// axis of that frame. Axis 1 must be along z, up or down. find(pose, turns) writes the turns of a pose
/// around axis 1 at which it is reachable and returns their status, which is that of the yaw angles.
template <class Find>
Status yaw_arcs(const Pose<double>& base, const Pose<double>& pose, const Vec3<double>& at, const Find& find,
                ArcSet& out) noexcept {
    ArcSet turns;
    const Status status = find(Pose<double>{pose.rotation, pose.position - at + base.position}, turns);
    // turning the base by alpha equals turning the pose by -alpha
    make_empty(out);
    if (turns.full) {
        make_full(out);
        return status;
    }
    const bool upright = base.rotation.z.z > 0;
    for (int i = 0; i < turns.count; ++i) {
        Arc arc = turns.arc[i];
        if (upright) arc = {-arc.upper, -arc.lower, arc.upper_tag, arc.lower_tag};
        detail::put(out, arc);
    }
    return status;
}

/// The best yaw of events in rising order; `before` is the total weight just before the first. Intervals
/// shorter than the angular tolerance count only if there are no others.
inline BestYaw best_yaw(const YawEvent* events, int count, double before) noexcept {
    if (count == 0) return {0.0, two_pi, before};
    const auto length = [&](int i) {
        return i + 1 < count ? events[i + 1].yaw - events[i].yaw : events[0].yaw + two_pi - events[i].yaw;
    };
    double now = before, best = -infinity, peak = -infinity;
    for (int i = 0; i < count; ++i) {
        now += events[i].weight;
        if (length(i) >= tolerance::angle) best = max(best, now);
        peak = max(peak, now);
    }
    if (!(best > 0)) best = peak;                   // locked joints: poses are reachable at single yaws only
    const double enough = best - 1e-9 * abs(best);  // sums of weights are rounded
    // a run of best sections may cross the seam: begin after a section that is not best
    int first = 0;
    now = before;
    for (int i = 0; i < count; ++i) {
        now += events[i].weight;
        if (now < enough) first = i + 1;
    }
    if (first == 0) return {0.0, two_pi, best};
    now = before;
    for (int i = 0; i < first; ++i) now += events[i].weight;
    BestYaw out{0.0, -1.0, best};
    double run = 0;
    for (int k = 0; k < count; ++k) {
        const int i = (first + k) % count;
        now = i == 0 ? before + events[0].weight : now + events[i].weight;
        run = now < enough ? 0.0 : run + length(i);
        if (run <= out.stretch || now < enough) continue;
        out.stretch = run;
        out.yaw = wrap(events[i].yaw + length(i) - 0.5 * run);
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
