// A sequence of poses followed by steps of the true chain: a loop around step(), nothing more.
#pragma once

#include "../motion/follow.hpp"
#include "step.hpp"

namespace armangle {

/// Follows n poses (16 doubles each, row-major) from `start`. `allowed` is null, one set, or one a pose. psi
/// is lifted.
inline void follow(const NearArm& arm, double margin, const double* start, const double* poses, std::size_t n,
                   const StepOptions& options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows) noexcept {
    detail::follow_steps(
        start, poses, n, options, on_fail, allowed, rows,
        [&](const double* q, const Pose<double>& pose, const StepOptions& asked) {
            return step(arm, margin, q, pose, asked);
        },
        [&](const double* q) { return forward(arm, q).pose.position; });
}

}  // namespace armangle
