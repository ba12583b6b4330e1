// The tracker of an arm with an offset, with or without its own chain: it runs the tracker of the arm without
// the offset on a corrected target (chain/corrected_tracker.hpp).
//
// The two arms differ by a shift along x of frame 6 behind the wrist, or of frame 1 before the shoulder. The
// shift depends on the free joint only, so a control cycle is one equation in one number. The secant method
// solves it in a few steps. Near theta_6 = 0 (theta_2 of a mirrored arm) it does not converge, and the arm is
// late.
#pragma once

#include "../chain/corrected_tracker.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the tracker's guess of the next posture.
struct NextGuessTuning {
    static constexpr double farthest_secant = 20.0;  // of the last change of what was found
};

/// The next correction of the target to try, by a secant step through the last two guesses.
template <free_joint_arm AnyArm>
Pose<double> next_guess(const AnyArm&, const Guess& last, const Guess& now) noexcept {
    const Vec3<double> off = now.found.position - now.shown.position;
    const Vec3<double> change = off - (last.found.position - last.shown.position);
    const double size = dot(change, change), share = dot(off, change) / size;
    Pose<double> next = now.found;
    if (size > 0 && abs(share) <= NextGuessTuning::farthest_secant)
        next.position = next.position - (now.found.position - last.found.position) * share;
    return next;
}

/// The elbow's target for the arm without the offset. With the offset before the shoulder, a point is shifted
/// by the correction `seen`, like the target.
template <free_joint_arm AnyArm>
Towards seen_hint(const AnyArm& arm, const Pose<double>& seen, Towards elbow) noexcept {
    if (nominal_offset(arm).mirrored && elbow.wish == Wish::point)
        elbow.target = elbow.target + seen.position;
    return elbow;
}

}  // namespace armangle

#include "../names/end.hpp"
