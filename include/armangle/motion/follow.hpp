// Follows a sequence of poses by steps: a loop around step().
#pragma once

#include <cstddef>

#include "../numbers/arrays.hpp"
#include "lookahead.hpp"
#include "step.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What to do if a step does not reach its pose: end; keep the result of the step and continue; or leave the
/// row empty and continue.
enum class OnFail : std::uint8_t { stop, hold, skip };

/// Rows of the result, one a pose; arrays of n (q: 7 n).
struct FollowRows {
    double *q, *psi, *margin, *residual;
    long long* gc;
    std::int8_t* status;
    bool (*ended)(void* who, std::size_t row) noexcept = nullptr;  // called before each row: whether to end
    void* who = nullptr;
};

namespace detail {

/// Whether a step reaches its pose, possibly still in contact with an obstacle.
inline bool holds_pose(const Step& step) noexcept {
    return step.status == Status::OK || (step.status == Status::CLEARANCE && step.why == Status::OK);
}

/// Fills a row without a solution.
inline void open_row(const FollowRows& rows, std::size_t i, Status status) noexcept {
    for (int j = 0; j < joints; ++j) rows.q[joints * i + static_cast<std::size_t>(j)] = not_a_number;
    rows.psi[i] = rows.margin[i] = rows.residual[i] = not_a_number;
    rows.gc[i] = -1;
    rows.status[i] = static_cast<std::int8_t>(status);
}

/// Fills a row with the result of a step.
inline void fill_row(const FollowRows& rows, std::size_t i, const Step& now, double psi,
                     double residual) noexcept {
    for (int j = 0; j < joints; ++j) rows.q[joints * i + static_cast<std::size_t>(j)] = now.q[j];
    rows.psi[i] = psi;
    rows.margin[i] = now.margin;
    rows.gc[i] = now.gc;
    rows.residual[i] = residual;
    rows.status[i] = static_cast<std::int8_t>(now.status);
}

/// Sets the velocity before the next step to that of this step; 0 if the joints did not move.
inline void carry_velocity(const double* to, const double* from, Bounds& bounds) noexcept {
    for (int j = 0; j < joints; ++j) bounds.velocity_now[j] = (to[j] - from[j]) / bounds.dt;
}

/// Computes the rows of n poses. take(pose, i, options) advances one step and returns the Step.
/// `residual(pose)` is the distance (m) of the end effector from its pose. psi is continuous.
template <class Take, class Residual>
void follow_rows(const double* poses, std::size_t n, StepOptions options, OnFail on_fail,
                 Strided<const ArcSet> allowed, const FollowRows& rows, const Take& take,
                 const Residual& residual) noexcept {
    double psi = 0;
    bool stopped = false, begun = false;
    for (std::size_t i = 0; i < n; ++i) {
        if (rows.ended && rows.ended(rows.who, i)) return;
        if (stopped) {
            open_row(rows, i, Status::NOT_REACHED);
            continue;
        }
        const Pose<double> pose = load_pose(poses + 16 * i);
        options.allowed = allowed.data ? allowed.at(i) : nullptr;
        const Step next = take(pose, i, options);
        const bool ok = holds_pose(next);
        stopped = !ok && on_fail == OnFail::stop;
        if (!ok && on_fail != OnFail::hold) {
            open_row(rows, i, next.why);
            continue;
        }
        psi = begun ? lift(next.psi, psi) : next.psi;
        begun = true;
        fill_row(rows, i, next, psi, residual(pose));
    }
}

/// Computes the rows of n poses, each by step_on(q, pose, options) from the joints before. These do not
/// change if a pose is not reached. `position(q)` is the position of the end effector (m).
template <class StepOn, class Position>
void follow_steps(const double* start, const double* poses, std::size_t n, const StepOptions& options,
                  OnFail on_fail, Strided<const ArcSet> allowed, const FollowRows& rows,
                  const StepOn& step_on, const Position& position,
                  Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    double q[joint_slots] = {};
    for (int j = 0; j < joints; ++j) q[j] = start[j];
    const auto take = [&](const Pose<double>& pose, std::size_t i, StepOptions& asked) {
        if (scenes.data) asked.scene = *scenes.at(i);
        const Step next = step_on(q, pose, asked);
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        return next;
    };
    follow_rows(poses, n, options, on_fail, allowed, rows, take,
                [&](const Pose<double>& pose) { return norm(position(q) - pose.position); });
}

/// The state of a motion, and its next steps.
struct Follower {
    const Arm& arm;
    const LimitTable& limits;
    double q[joint_slots];
    Chain now;
    Bounds bounds;  // with the velocity before the next step, if there are bounds

    Step on(const Pose<double>& pose, StepOptions options) noexcept {
        const bool bounded = options.bounds != nullptr;
        if (bounded) options.bounds = &bounds;
        const Step next = step_from(arm, limits, q, now, pose, options);
        if (bounded) carry_velocity(next.q, q, bounds);
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        if (holds_pose(next) || bounded || options.nearest) now = chain(arm, q);
        return next;
    }
};

}  // namespace detail

/// Follows n poses (16 doubles each, row-major) from `start`. `allowed` is null, one set, or one a pose;
/// likewise `scenes`, which replaces options.scene. psi is continuous. options.bounds holds the velocity
/// before the first step. `ahead`, if not null, keeps the motion in the tube of the coming poses and needs
/// bounds.
inline void follow(const Arm& arm, const LimitTable& limits, const double* start, const double* poses,
                   std::size_t n, StepOptions options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows, Lookahead* ahead = nullptr,
                   Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    detail::Follower walk{arm, limits, {}, {}, options.bounds ? *options.bounds : Bounds{}};
    for (int j = 0; j < joints; ++j) walk.q[j] = start[j];
    walk.now = chain(arm, walk.q);
    const auto plain = [&](std::size_t from, std::size_t most) {
        detail::Follower along = walk;
        StepOptions asked = options;
        for (std::size_t k = 0; k < most; ++k) {
            if (scenes.data) asked.scene = *scenes.at(from + k);
            asked.allowed = allowed.data ? allowed.at(from + k) : nullptr;
            if (!detail::holds_pose(along.on(load_pose(poses + 16 * (from + k)), asked))) return k;
        }
        return most;
    };
    const auto take = [&](const Pose<double>& pose, std::size_t i, StepOptions& asked) {
        if (scenes.data) asked.scene = *scenes.at(i);
        if (ahead)
            asked.ahead = ahead->at(
                i, walk.q, asked.gc < 0 ? configuration(arm, walk.now.theta) : configuration(asked.gc),
                [&](std::size_t most) { return plain(i, most); });
        const Step next = walk.on(pose, asked);
        if (ahead && !detail::holds_pose(next)) ahead->forget();
        return next;
    };
    detail::follow_rows(poses, n, options, on_fail, allowed, rows, take,
                        [&](const Pose<double>& pose) { return position_error(arm, walk.now, pose); });
}

}  // namespace armangle

#include "../names/end.hpp"
