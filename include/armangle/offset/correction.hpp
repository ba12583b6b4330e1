// The loop for hands of an arm with an offset: the tracker of its rows without the offset, shown the hand
// where those have to go for the true tool to be there.
//
// The rows N and the arm T differ by a shift: along x of frame 6 behind the wrist, or of frame 1 before the
// shoulder. It depends on the free joint alone, so that a tick is one equation in one number, and the secant
// solves it in a few passes; what it does not, beside theta_6 = 0 (theta_2 of a mirrored arm), comes late.
#pragma once

#include "../chain/corrected_tracker.hpp"
#include "nearest_posture.hpp"
#include "straight_cells.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace offset_rule {
inline constexpr double farthest_secant = 20.0;  // of the last change of what was found
}  // namespace offset_rule

/// The rigid transform, in the user's frame, from the end effector's pose at joints q to the pose that the
/// arm without the offset would have.
inline Pose<double> correction(const OffsetArm& arm, const double* q) noexcept {
    return tool_pose(arm.own, q) * inverted(tool_pose(arm, q));
}

/// The arm whose links must avoid obstacles: the arm with its offset.
inline const OffsetArm& body(const OffsetArm& arm) noexcept { return arm; }

/// The next target for the tracker of the arm without the offset, by a secant step through the last two
/// guesses.
inline Pose<double> next_guess(const OffsetArm&, const Guess& last, const Guess& now) noexcept {
    const Vec3<double> off = now.found.position - now.shown.position;
    const Vec3<double> change = off - (last.found.position - last.shown.position);
    const double size = dot(change, change), share = dot(off, change) / size;
    Pose<double> next = now.found;
    if (size > 0 && abs(share) <= offset_rule::farthest_secant)
        next.position = next.position - (now.found.position - last.found.position) * share;
    return next;
}

/// The elbow's target for the arm without the offset. With the offset before the shoulder, a point is shifted
/// like the tool.
inline Towards seen_hint(const OffsetArm& arm, const Pose<double>& seen, Towards elbow) noexcept {
    if (arm.mirrored && elbow.wish == Wish::point) elbow.target = elbow.target + seen.position;
    return elbow;
}

/// A collision-free solution of a target in branch gc within these limits that the joints reach in a short
/// time.
inline Nearest resting_solution(const OffsetArm& arm, const Limits& limits, const Scene* scene,
                                const Pose<double>& pose, int gc, const NearestOptions& options) noexcept {
    const Pose<double> exact{orthonormal(pose.rotation), pose.position};
    ProvenArcs found;
    Tag blocking = 0;
    feasible(arm, exact, gc, limits, found);
    if (scene) keep_clear(arm, *scene, exact, gc, found, blocking);
    const double held = forward(arm, options.near).free;
    const Nearest out = detail::sampled_solution(arm, limits, exact, gc, found.arcs, held, options);
    const bool doubtful = found.unproven > 0 || found.status == Status::NEAR_SINGULAR;
    if (is_solved(out.status) || !doubtful) return out;
    ArmParameters rows = arm.own;  // a solution that arcs do not tell
    rows.limits = limits;
    const double offset = arm.mirrored ? -arm.a_6 : arm.a_6;
    return nearest_posture(make_offset_arm(rows, offset, arm.mirrored), pose, options, scene);
}

}  // namespace armangle

#include "../names/end.hpp"
