// Follows a sequence of poses by steps: a loop around step().
#pragma once

#include <cstddef>

#include "../numbers/arrays.hpp"
#include "family_step.hpp"
#include "lookahead.hpp"

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

/// Whether a step reaches its pose; the arm may still be in contact with an obstacle.
inline bool holds_pose(const Step& step) noexcept {
    return step.status == Status::OK || (step.status == Status::CLEARANCE && step.why == Status::OK);
}

/// Fills row i, which has no solution, with NaN, gc -1 and the reason.
inline void open_row(const FollowRows& rows, std::size_t i, Status status) noexcept {
    for (int j = 0; j < joints; ++j) rows.q[joints * i + static_cast<std::size_t>(j)] = not_a_number;
    rows.psi[i] = rows.margin[i] = rows.residual[i] = not_a_number;
    rows.gc[i] = -1;
    rows.status[i] = static_cast<std::int8_t>(status);
}

/// Fills row i with the result of a step, its continuous psi and its distance `residual` (m) from the pose.
inline void fill_row(const FollowRows& rows, std::size_t i, const Step& now, double psi,
                     double residual) noexcept {
    for (int j = 0; j < joints; ++j) rows.q[joints * i + static_cast<std::size_t>(j)] = now.q[j];
    rows.psi[i] = psi;
    rows.margin[i] = now.margin;
    rows.gc[i] = now.gc;
    rows.residual[i] = residual;
    rows.status[i] = static_cast<std::int8_t>(now.status);
}

/// Sets the present velocity in `bounds` to that of the step of one cycle between two configurations.
inline void carry_velocity(const double* to, const double* from, Bounds& bounds) noexcept {
    for (int j = 0; j < joints; ++j) bounds.velocity_now[j] = (to[j] - from[j]) / bounds.dt;
}

/// The state of a motion of an S-R-S arm along poses.
struct ExactWalk {
    const Arm& arm;
    const LimitTable& limits;
    double q[joint_slots];
    Chain now;
    Bounds bounds;  // with the velocity before the next step, if there are bounds

    /// The branch (0..7) of the present joints.
    int gc() const noexcept { return index(configuration(arm, now.theta)); }
    /// The distance (m) of the end effector from the position of a pose.
    double residual(const Pose<double>& pose) const noexcept { return position_error(arm, now, pose); }

    /// Makes a step to a pose and keeps its joints as the present ones.
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

/// The state of a motion of any other kind of arm along poses.
template <stepping_family F>
struct FamilyWalk {
    F family;
    double q[joint_slots];
    Bounds bounds;

    /// The branch (0..7) of the present joints.
    int gc() const noexcept { return family.on(q, identity_pose(), Carry::psi).gc; }
    /// The distance (m) of the end effector from the position of a pose.
    double residual(const Pose<double>& pose) const noexcept {
        return norm(tool_pose(family.arm(), q).position - pose.position);
    }

    /// Makes a step to a pose and keeps its joints as the present ones.
    Step on(const Pose<double>& pose, StepOptions options) noexcept {
        if (options.bounds) options.bounds = &bounds;
        const Step next = step(family, q, pose, options);
        if (options.bounds) carry_velocity(next.q, q, bounds);
        for (int j = 0; j < joints; ++j) q[j] = next.q[j];
        return next;
    }
};

/// Follows n poses with the steps of a walk and fills one row for each; psi is continuous, without jumps of 2
/// pi. `ahead` may be null.
template <class Walk, class Ahead>
void follow_rows(Walk walk, const double* poses, std::size_t n, StepOptions options, OnFail on_fail,
                 Strided<const ArcSet> allowed, const FollowRows& rows, Ahead* ahead,
                 Strided<const Scene* const> scenes) noexcept {
    const auto ask = [&](std::size_t i, StepOptions& asked) {
        if (scenes.data) asked.scene = *scenes.at(i);
        asked.allowed = allowed.data ? allowed.at(i) : nullptr;
    };
    double psi = 0;
    bool stopped = false, begun = false;
    for (std::size_t i = 0; i < n; ++i) {
        if (rows.ended && rows.ended(rows.who, i)) return;
        if (stopped) {
            open_row(rows, i, Status::NOT_REACHED);
            continue;
        }
        const Pose<double> pose = load_pose(poses + 16 * i);
        ask(i, options);
        if (ahead)
            options.ahead =
                ahead->at(i, walk.q, options.gc < 0 ? walk.gc() : options.gc, [&](std::size_t most) {
                    Walk along = walk;
                    StepOptions asked = options;
                    asked.ahead = nullptr;
                    for (std::size_t k = 0; k < most; ++k) {
                        ask(i + k, asked);
                        if (!holds_pose(along.on(load_pose(poses + 16 * (i + k)), asked))) return k;
                    }
                    return most;
                });
        const Step next = walk.on(pose, options);
        const bool ok = holds_pose(next);
        if (ahead && !ok) ahead->forget();
        stopped = !ok && on_fail == OnFail::stop;
        if (!ok && on_fail != OnFail::hold) {
            open_row(rows, i, next.why);
            continue;
        }
        psi = begun ? lift(next.psi, psi) : next.psi;
        begun = true;
        fill_row(rows, i, next, psi, walk.residual(pose));
    }
}

}  // namespace detail

/// Follows n poses (16 doubles each, row-major) from the joints `start` and fills one row for each. `allowed`
/// is null, one set, or one a pose; likewise `scenes`, which replaces options.scene. psi is continuous. Once
/// rows.ended returns true, the remaining rows stay as they are. options.bounds holds the velocity before the
/// first step. `ahead`, if not null, keeps the motion where the coming poses remain reachable; it needs
/// bounds.
inline void follow(const Arm& arm, const LimitTable& limits, const double* start, const double* poses,
                   std::size_t n, const StepOptions& options, OnFail on_fail, Strided<const ArcSet> allowed,
                   const FollowRows& rows, Lookahead<ExactSections>* ahead = nullptr,
                   Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    detail::ExactWalk walk{arm, limits, {}, {}, options.bounds ? *options.bounds : Bounds{}};
    for (int j = 0; j < joints; ++j) walk.q[j] = start[j];
    walk.now = chain(arm, walk.q);
    detail::follow_rows(walk, poses, n, options, on_fail, allowed, rows, ahead, scenes);
}

/// Follows n poses with any other kind of arm, as follow() of an S-R-S arm does.
template <stepping_family F>
void follow(const F& family, const double* start, const double* poses, std::size_t n,
            const StepOptions& options, OnFail on_fail, Strided<const ArcSet> allowed, const FollowRows& rows,
            Lookahead<FamilySections<F>>* ahead = nullptr,
            Strided<const Scene* const> scenes = {nullptr, 0}) noexcept {
    detail::FamilyWalk<F> walk{family, {}, options.bounds ? *options.bounds : Bounds{}};
    for (int j = 0; j < joints; ++j) walk.q[j] = start[j];
    detail::follow_rows(walk, poses, n, options, on_fail, allowed, rows, ahead, scenes);
}

}  // namespace armangle

#include "../names/end.hpp"
