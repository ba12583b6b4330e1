// A sequence of poses followed by steps of the true chain: a loop around step(), nothing more.
#pragma once

#include "../motion/follow.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Follows n poses (16 doubles each, row-major) from `start`. `allowed` is null, one set, or one a pose;
/// `scenes` likewise. psi is lifted. options.bounds holds the velocity before the first step.
inline void follow(const ChainArm& arm, double margin, const double* start, const double* poses,
                   std::size_t n, StepOptions options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows, Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    Bounds bounds{};
    if (options.bounds) {
        bounds = *options.bounds;
        options.bounds = &bounds;
    }
    double q[joint_slots] = {};
    for (int j = 0; j < joints; ++j) q[j] = start[j];
    const auto take = [&](const Pose<double>& pose, std::size_t i, StepOptions& asked) {
        if (scenes.data) asked.scene = *scenes.at(i);
        const Step next = step(arm, margin, q, pose, asked);
        if (asked.bounds) detail::carry_velocity(next.q, q, bounds);
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        return next;
    };
    detail::follow_rows(poses, n, options, on_fail, allowed, rows, take, [&](const Pose<double>& pose) {
        return norm(forward(arm, q).pose.position - pose.position);
    });
}

}  // namespace armangle

#include "../names/end.hpp"
