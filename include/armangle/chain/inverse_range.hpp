// The inverse of a nearly S-R-S arm over arrays: corrections as lanes, what they leave one by one.
#pragma once

#include "../batch/inverse_batch.hpp"
#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// The problem of a batch element with this status; near_singular for a status that has none of its own.
constexpr Problem problem_of(Status status) noexcept {
    switch (status) {
        case Status::OK: return Problem::none;
        case Status::FOLDED: return Problem::folded;
        case Status::UNREACHABLE: return Problem::unreachable;
        case Status::NO_POSTURE: return Problem::no_posture;
        case Status::NO_CONVERGENCE: return Problem::no_convergence;
        default: return Problem::near_singular;
    }
}

/// Solves element i of a batch; on failure fills it with NaN and reports the problem in `outcome`. If the
/// batch asks for NaN alone, it reports only invalid numbers.
inline void solve_element(const ChainArm& arm, const InverseBatch& b, std::size_t i,
                          Outcome& outcome) noexcept {
    double value = 0;
    double* q = b.out.at(i);
    const Problem wrong = check_numbers(arm.nominal, b, i, value);
    if (wrong != Problem::none) {
        fill_nan(q);
        return outcome.report(wrong, i, value);
    }
    const Pose<double> pose = load_pose(b.pose.at(i));
    const Inverse found =
        inverse(arm, pose, *b.psi.at(i), static_cast<int>(*b.gc.at(i)), b.seed.data ? b.seed.at(i) : nullptr);
    for (int j = 0; j < joints; ++j) q[j] = found.q[j];
    if (found.status == Status::OK || b.unreachable == Enforce::nan) return;
    if (found.status == Status::UNREACHABLE) value = reach_excess(arm, pose);
    outcome.report(problem_of(found.status), i, value);
}

/// Tells for each of several postures (one in each lane) whether it reaches its pose within
/// ChainInverseTuning::held, up to which a seed counts as a posture of the pose.
template <class T>
ARMANGLE_INLINE auto meets(const ChainArm& arm, const T (&q)[joints], const Pose<T>& pose) noexcept {
    SinCos<T> angle[joints];
    for (int j = 0; j < joints; ++j)
        angle[j] = sin_cos(T(arm.nominal.sign[j]) * q[j] + T(arm.nominal.offset[j]));
    return remainder(from_to(tip(arm, angle), pose), max(1.0, arm.nominal.size)) <=
           T(ChainInverseTuning::held);
}

}  // namespace detail

/// Solves elements [begin, end) of a batch, each with the same result as inverse(); problems come in
/// `outcome`.
inline void inverse_range(const ChainArm& arm, const InverseBatch& b, std::size_t begin, std::size_t end,
                          Outcome& outcome) noexcept {
    using detail::Batch;
    constexpr std::size_t width = register_width;
    const Arm& nominal = arm.nominal;
    for (std::size_t first = begin; first < end; first += width) {
        const std::size_t count = end - first < width ? end - first : width;
        std::size_t at[width];
        for (std::size_t k = 0; k < width; ++k) at[k] = first + (k < count ? k : count - 1);
        const detail::LaneInput in = detail::load_block(nominal, b, at);
        const Pose<Batch> exact{orthonormal(in.pose.rotation), in.pose.position};
        const Triad<Batch> on = triad(nominal, flange_pose(nominal, exact));
        const detail::Found<Batch> found =
            detail::find_posture(arm, exact, detail::PsiPlane<Batch>(on, sin_cos(in.psi)), in.gc);
        for (int j = 0; j < joints; ++j) {
            const Batch q = to_q(atan2(found.angle[j].sin, found.angle[j].cos), Batch(nominal.sign[j]),
                                 Batch(nominal.offset[j]), Batch(nominal.limits.lower[j]),
                                 Batch(nominal.limits.upper[j]), in.near[j]);
            for (std::size_t k = 0; k < count; ++k) b.out.at(at[k])[j] = q[static_cast<int>(k)];
        }
        auto plain =
            (in.bad == Batch(0.0)) & !is_folded(on) & (found.left <= Batch(ChainInverseTuning::settled));
        if (b.seed.data) plain = plain & !detail::meets(arm, in.near, exact);
        for (std::size_t k = 0; k < count; ++k) {
            if (!plain[static_cast<int>(k)]) detail::solve_element(arm, b, at[k], outcome);
            if (b.limits != Enforce::ignore) detail::enforce_limits(nominal, b, at[k], outcome);
        }
    }
}

}  // namespace armangle

#include "../names/end.hpp"
