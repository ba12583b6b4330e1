// Derivatives of the inverse over arrays, in lanes: gradients (reverse mode) and Jacobian matrices.
#pragma once

#include "../circle/pose_gradient.hpp"
#include "inverse_batch.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Processes elements [begin, end) of a batch. For each block calls lanes(at, count, input, rates), then
/// one(i) for those of its elements that are not regular: bad input, no solution, or no derivative.
template <class Lanes, class One>
ARMANGLE_INLINE void for_rates(const Arm& arm, const InverseBatch& b, std::size_t begin, std::size_t end,
                               const Lanes& lanes, const One& one) noexcept {
    constexpr std::size_t width = register_width;
    for (std::size_t first = begin; first < end; first += width) {
        const std::size_t count = end - first < width ? end - first : width;
        std::size_t at[width];
        for (std::size_t k = 0; k < width; ++k) at[k] = first + (k < count ? k : count - 1);
        const LaneInput in = load_block(arm, b, at);
        const Pose<Batch> flange = flange_pose(arm, in.pose);
        const SelfMotion<Batch> m = self_motion(arm, circle(arm, flange), in.gc);
        const Rates<Batch> r = rates(arm, flange, m, sin_cos(in.psi));
        lanes(at, count, in, r);
        const auto plain = (in.bad == Batch(0.0)) & !(is_folded(m.circle) | is_unreachable(m.circle)) &
                           r.shoulder & r.wrist & r.elbow & r.plane;
        if (!all(plain))
            for (std::size_t k = 0; k < count; ++k)
                if (!plain[static_cast<int>(k)]) one(at[k]);
    }
}

/// Writes `size` lanes as the rows of a block's elements.
template <int size>
inline void store_rows(const Batch (&lane)[size], const std::size_t* at, std::size_t count,
                       const Strided<double>& out) noexcept {
    for (std::size_t k = 0; k < count; ++k)
        for (int c = 0; c < size; ++c) out.at(at[k])[c] = lane[c][static_cast<int>(k)];
}

}  // namespace detail

/// Writes inverse_derivative() of elements [begin, end) into b.out, 49 numbers an element, a row (v, omega,
/// psi) per joint; NaN without a solution, infinite without a derivative. Reports bad input in `outcome`, and
/// geometry without a solution unless b.unreachable requests NaN.
inline void derivative_range(const Arm& arm, const InverseBatch& b, std::size_t begin, std::size_t end,
                             Outcome& outcome) noexcept {
    using detail::Batch;
    const auto lanes = [&](const std::size_t* at, std::size_t count, const detail::LaneInput&,
                           const Rates<Batch>& r) {
        Batch row[joints], one[joints];
        for (int j = 0; j < joints; ++j) {
            for (int i = 0; i < joints; ++i) one[i] = Batch(i == j ? 1.0 : 0.0);
            store_pull(pulled(arm, r, one), row);
            detail::store_rows(row, at, count, {b.out.data + j * joints, b.out.stride});
        }
    };
    detail::for_rates(arm, b, begin, end, lanes, [&](std::size_t i) {
        double value = 0;
        const Problem problem = detail::check_element(arm, b, i, value);
        const bool geometry = problem == Problem::unreachable || problem == Problem::folded;
        const Derivatives d =
            inverse_derivative(arm, load_pose(b.pose.at(i)), *b.psi.at(i), static_cast<int>(*b.gc.at(i)));
        for (int j = 0; j < joints; ++j)
            for (int k = 0; k < joints; ++k) b.out.at(i)[joints * j + k] = d.entry[j][k];
        if (problem != Problem::none && !(geometry && b.unreachable == Enforce::nan))
            outcome.report(problem, i, value);
    });
}

/// Gradients by the joints, pulled back to poses and arm angles.
struct PullbackBatch {
    InverseBatch at;  // b.out is not used
    Strided<const double> by_q;
    Strided<double> by_pose, by_psi;
};

namespace detail {

/// Computes inverse_pullback() of element i. Reports an invalid pose in `outcome`, and a missing gradient
/// unless `at.unreachable` requests NaN.
template <class AnyArm>
void pull_element(const AnyArm& arm, const PullbackBatch& b, std::size_t i, Outcome& outcome) noexcept {
    double value = 0;
    Problem problem = check_pose(b.at.pose.at(i), value);
    const Hindrance why =
        inverse_pullback(arm, load_pose(b.at.pose.at(i)), *b.at.psi.at(i), static_cast<int>(*b.at.gc.at(i)),
                         b.by_q.at(i), b.by_pose.at(i), *b.by_psi.at(i));
    if (problem == Problem::none && why != Hindrance::none && b.at.unreachable != Enforce::nan) {
        problem = Problem::no_derivative;
        value = static_cast<double>(why);
    }
    if (problem != Problem::none) outcome.report(problem, i, value);
}

}  // namespace detail

/// Computes inverse_pullback() of elements [begin, end) of an arm without lanes.
template <class AnyArm>
void pullback_range(const AnyArm& arm, const PullbackBatch& b, std::size_t begin, std::size_t end,
                    Outcome& outcome) noexcept {
    for (std::size_t i = begin; i < end; ++i) detail::pull_element(arm, b, i, outcome);
}

/// Computes inverse_pullback() of elements [begin, end). Reports invalid poses in `outcome`, and missing
/// gradients unless `at.unreachable` requests NaN.
inline void pullback_range(const Arm& arm, const PullbackBatch& b, std::size_t begin, std::size_t end,
                           Outcome& outcome) noexcept {
    using detail::Batch;
    const auto lanes = [&](const std::size_t* at, std::size_t count, const detail::LaneInput& in,
                           const Rates<Batch>& r) {
        constexpr int width = register_width;
        alignas(64) double by_q[joints][width];
        for (int k = 0; k < width; ++k)
            for (int j = 0; j < joints; ++j) by_q[j][k] = b.by_q.at(at[k])[j];
        Batch given[joints];
        for (int j = 0; j < joints; ++j) given[j] = Batch::load(by_q[j]);
        const Pull<Batch> p = pulled(arm, r, given);
        const Pose<Batch> g = pose_gradient(in.pose, p.linear, p.angular);
        const auto& [x, y, z] = g.rotation;
        const Batch none(0.0);
        const Batch entries[16] = {x.x, y.x, z.x, g.position.x, x.y,  y.y,  z.y,  g.position.y,
                                   x.z, y.z, z.z, g.position.z, none, none, none, none};
        detail::store_rows(entries, at, count, b.by_pose);
        const Batch by_psi[1] = {p.psi};
        detail::store_rows(by_psi, at, count, b.by_psi);
    };
    detail::for_rates(arm, b.at, begin, end, lanes,
                      [&](std::size_t i) { detail::pull_element(arm, b, i, outcome); });
}

}  // namespace armangle

#include "../names/end.hpp"
