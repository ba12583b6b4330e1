// Inverse kinematics over arrays: each block of poses is checked, solved in lanes and stored in one pass.
#pragma once

#include "../arm/check_joints.hpp"
#include "../circle/inverse.hpp"
#include "../numbers/arrays.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Action if limits or reach are violated: nothing, report a problem, or write NaN.
enum class Enforce : int { ignore, raise, nan };

/// Arguments of a batched inverse. seed may be null. `gc` is in 0..7.
struct InverseBatch {
    Strided<const double> pose, psi, seed;
    Strided<const long long> gc;
    Strided<double> out;  // 7 joint values an element
    Enforce limits = Enforce::ignore;
    Enforce unreachable = Enforce::raise;
};

namespace detail {

using Batch = Lane<register_width>;

/// Checks the numbers of element i after a lane detected a fault (slow path); returns the problem, or none,
/// and stores the offending number in `value`.
template <class AnyArm>
Problem check_numbers(const AnyArm& arm, const InverseBatch& b, std::size_t i, double& value) noexcept {
    const Problem pose = check_pose(arm, b.pose.at(i), value);
    if (pose != Problem::none) return pose;
    if (!(abs(*b.psi.at(i)) <= tolerance::largest_angle)) {
        value = *b.psi.at(i);
        return Problem::psi_not_finite;
    }
    const long long gc = *b.gc.at(i);
    if (gc < 0 || gc >= configurations) {
        value = static_cast<double>(gc);
        return Problem::gc_range;
    }
    if (b.seed.data) {
        const Problem seed = check_joints(arm, b.seed.at(i), value);
        if (seed != Problem::none) return seed;
    }
    return Problem::none;
}

/// The problem of element i of a batch for an S-R-S arm, or none, with the `value` that shows it: invalid
/// numbers, or a pose out of reach.
inline Problem check_element(const Arm& arm, const InverseBatch& b, std::size_t i, double& value) noexcept {
    const Problem numbers = check_numbers(arm, b, i, value);
    if (numbers != Problem::none) return numbers;
    const Circle<double> c = circle(arm, flange_pose(arm, load_pose(b.pose.at(i))));
    if (is_unreachable(c)) {
        value = c.triangle.excess;
        return Problem::unreachable;
    }
    if (is_folded(c)) return Problem::folded;
    return Problem::none;
}

/// The arguments of one block of elements, one element a lane.
struct LaneInput {
    Pose<Batch> pose;
    Batch psi, bad;
    Configuration<Batch> gc;
    Batch near[joints];
};

/// Loads into `in` the value that each joint should be near: the seed, or the middle of the range. Marks a
/// lane as bad if its seed is not finite or more than 2 pi outside the limits.
inline void load_seed(const Arm& arm, const InverseBatch& b, const std::size_t* at, LaneInput& in) noexcept {
    for (int j = 0; j < joints; ++j) {
        in.near[j] = Batch(arm.joint_middle[j]);
        if (!b.seed.data) continue;
        for (int k = 0; k < register_width; ++k) in.near[j].set(k, b.seed.at(at[k])[j]);
        const auto within = (in.near[j] >= Batch(arm.limits.lower[j] - two_pi)) &
                            (in.near[j] <= Batch(arm.limits.upper[j] + two_pi));
        in.bad = select(within & (abs(in.near[j]) <= Batch(tolerance::largest_angle)), in.bad, Batch(1.0));
    }
}

/// Loads a block of elements, one a lane; `bad` is not 0 in a lane that needs the slow path.
inline LaneInput load_block(const Arm& arm, const InverseBatch& b, const std::size_t* at) noexcept {
    alignas(64) double m[16][register_width], psi[register_width], bad[register_width];
    alignas(64) double shoulder[register_width], elbow[register_width], wrist[register_width];
    for (int k = 0; k < register_width; ++k) {
        const double* pose = b.pose.at(at[k]);
        for (int i = 0; i < 16; ++i) m[i][k] = pose[i];
        psi[k] = *b.psi.at(at[k]);
        const long long gc = *b.gc.at(at[k]);
        bad[k] = gc < 0 || gc >= configurations;
        shoulder[k] = gc & 1 ? -1.0 : 1.0;
        elbow[k] = gc & 2 ? -1.0 : 1.0;
        wrist[k] = gc & 4 ? -1.0 : 1.0;
    }
    const auto row = [&](int i) { return Batch::load(m[i]); };
    LaneInput in;
    in.pose = {{{row(0), row(4), row(8)}, {row(1), row(5), row(9)}, {row(2), row(6), row(10)}},
               {row(3), row(7), row(11)}};
    in.psi = Batch::load(psi);
    in.gc = {Batch::load(shoulder), Batch::load(elbow), Batch::load(wrist)};
    const auto& r = in.pose.rotation;
    const Vec3<Batch>& p = in.pose.position;
    // NaN and infinity make these comparisons false
    const auto near = abs(p.x) + abs(p.y) + abs(p.z) <= Batch(tolerance::farthest);
    const auto finite = near & (abs(in.psi) <= Batch(tolerance::largest_angle));
    const auto rigid =
        (orthonormality_error(r) <= Batch(tolerance::rotation)) & (dot(cross(r.x, r.y), r.z) > Batch(0.0));
    const auto row_ok =
        (abs(row(12)) + abs(row(13)) + abs(row(14)) + abs(row(15) - Batch(1.0)) == Batch(0.0));
    in.bad = select(finite & rigid & row_ok, Batch::load(bad), Batch(1.0));
    load_seed(arm, b, at, in);
    return in;
}

/// Solves a block of poses; lane i of q[j] is joint j of element i (rad).
inline void solve_block(const Arm& arm, const LaneInput& in, const SelfMotion<Batch>& m, Batch* q) noexcept {
    const Directions<Batch> d = directions(m, sin_cos(in.psi));
    for (int j = 0; j < joints; ++j) {
        q[j] = to_q(atan2(d.y[j], d.x[j]), Batch(arm.sign[j]), Batch(arm.offset[j]),
                    Batch(arm.limits.lower[j]), Batch(arm.limits.upper[j]), in.near[j]);
    }
}

/// Writes seven NaN to q.
inline void fill_nan(double* q) noexcept {
    for (int j = 0; j < joints; ++j) q[j] = not_a_number;
}

/// Fills an element that is invalid or has no solution with NaN and reports the problem in `outcome`, unless
/// NaN alone is requested for a pose out of reach. Leaves an element without a problem as it is.
inline void handle_irregular(const Arm& arm, const InverseBatch& b, std::size_t i,
                             Outcome& outcome) noexcept {
    double value = 0;
    const Problem problem = check_element(arm, b, i, value);
    if (problem == Problem::none) return;
    const bool geometry = problem == Problem::unreachable || problem == Problem::folded;
    fill_nan(b.out.at(i));
    if (!geometry || b.unreachable != Enforce::nan) outcome.report(problem, i, value);
}

/// If an element is outside its limits, fills it with NaN and, if b.limits is `raise`, reports it in
/// `outcome`.
inline void enforce_limits(const Arm& arm, const InverseBatch& b, std::size_t i, Outcome& outcome) noexcept {
    double* q = b.out.at(i);
    for (int j = 0; j < joints; ++j) {
        if (q[j] >= arm.limits.lower[j] - tolerance::angle && q[j] <= arm.limits.upper[j] + tolerance::angle)
            continue;
        if (std::isnan(q[j])) return;
        if (b.limits == Enforce::raise) outcome.report(Problem::joint_limit, i, j + 1);
        return fill_nan(q);
    }
}

}  // namespace detail

/// Inverse kinematics of elements [begin, end): checks, solves and stores each in one pass; the first problem
/// comes in `outcome`.
inline void inverse_range(const Arm& arm, const InverseBatch& b, std::size_t begin, std::size_t end,
                          Outcome& outcome) noexcept {
    using detail::Batch;
    constexpr std::size_t width = register_width;
    for (std::size_t first = begin; first < end; first += width) {
        const std::size_t count = end - first < width ? end - first : width;
        std::size_t at[width];
        for (std::size_t k = 0; k < width; ++k) at[k] = first + (k < count ? k : count - 1);
        const detail::LaneInput in = detail::load_block(arm, b, at);
        const SelfMotion<Batch> m = self_motion(arm, in.pose, in.gc);
        Batch q[joints];
        detail::solve_block(arm, in, m, q);
        for (std::size_t k = 0; k < count; ++k)
            for (int j = 0; j < joints; ++j) b.out.at(at[k])[j] = q[j][static_cast<int>(k)];
        const auto plain = (in.bad == Batch(0.0)) & !(is_folded(m.circle) | is_unreachable(m.circle));
        if (!all(plain))
            for (std::size_t k = 0; k < count; ++k)
                if (!plain[static_cast<int>(k)]) detail::handle_irregular(arm, b, at[k], outcome);
        if (b.limits != Enforce::ignore)
            for (std::size_t k = 0; k < count; ++k) detail::enforce_limits(arm, b, at[k], outcome);
    }
}

}  // namespace armangle

#include "../names/end.hpp"
