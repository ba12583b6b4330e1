// A sequence of poses followed by steps of the true chain: a loop around step(), nothing more.
#pragma once

#include "../motion/follow.hpp"
#include "step.hpp"

namespace armangle {

/// Follows n poses (16 doubles each, row-major) from `start`. `allowed` is null, one set, or one a pose. psi
/// is lifted.
inline void follow(const NearArm& arm, double margin, const double* start, const double* poses, std::size_t n,
                   StepOptions options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows) noexcept {
    double q[joints], psi = 0;
    for (int j = 0; j < joints; ++j) q[j] = start[j];
    bool stopped = false, begun = false;
    for (std::size_t i = 0; i < n; ++i) {
        if (stopped) {
            detail::open_row(rows, i, Status::NOT_REACHED);
            continue;
        }
        const Pose<double> pose = load_pose(poses + 16 * i);
        options.allowed = allowed.data ? allowed.at(i) : nullptr;
        const Step next = step(arm, margin, q, pose, options);
        const bool ok = next.status == Status::OK;
        stopped = !ok && on_fail == OnFail::stop;
        if (!ok && on_fail != OnFail::hold) {
            detail::open_row(rows, i, next.why);
            continue;
        }
        psi = begun ? lift(next.psi, psi) : next.psi;
        begun = true;
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        detail::fill_row(rows, i, next, psi, norm(forward(arm, q).pose.position - pose.position));
    }
}

}  // namespace armangle
