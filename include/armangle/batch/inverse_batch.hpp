// The same over arrays: validation, lanes and threads. The only file that knows batches.
#pragma once

#include <cstddef>
#include <thread>

#include "../circle/arm_angle.hpp"
#include "../circle/posture.hpp"

namespace armangle {

/// An array of elements `stride` doubles (or integers) apart; stride 0 repeats one element.
template <class T>
struct Strided {
    T* data;
    std::ptrdiff_t stride;

    T* at(std::size_t i) const noexcept { return data + static_cast<std::ptrdiff_t>(i) * stride; }
    Strided from(std::size_t i) const noexcept { return {at(i), stride}; }
};

/// What can be wrong with an element of a batch.
enum class Problem : int {
    none = 0,
    pose_not_finite,
    pose_last_row,      // a 4x4 pose ends with 0 0 0 1
    pose_not_rotation,  // value: largest entry of |R^T R - I|
    pose_reflection,
    psi_not_finite,  // or beyond tolerance::largest_angle; of joints too
    gc_range,        // value: the gc
    joints_not_finite,
    unreachable,  // value: m beyond the reach, or inside the inner reach
    folded,
    joint_limit,  // value: joint 1..7
};

/// The first problem of a batch: which, where, and the value that shows it.
struct Outcome {
    Problem problem = Problem::none;
    std::size_t index = 0;
    double value = 0;

    void report(Problem p, std::size_t i, double v) noexcept {
        if (problem == Problem::none || i < index) problem = p, index = i, value = v;
    }
};

/// A 4x4 row-major homogeneous matrix as a pose.
inline Pose<double> load_pose(const double* m) noexcept {
    return {{{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}}, {m[3], m[7], m[11]}};
}

inline void store_pose(const Pose<double>& p, double* m) noexcept {
    const auto& [x, y, z] = p.rotation;
    const double rows[16] = {x.x, y.x, z.x, p.position.x, x.y, y.y, z.y, p.position.y, x.z, y.z, z.z, p.position.z, 0, 0, 0, 1};
    for (int i = 0; i < 16; ++i) m[i] = rows[i];
}

/// What is wrong with a 4x4 pose, and the value that shows it.
inline Problem check_pose(const double* m, double& value) noexcept {
    for (int i = 0; i < 16; ++i)
        if (!std::isfinite(m[i])) return value = m[i], Problem::pose_not_finite;
    for (int i = 0; i < 4; ++i)
        if (m[12 + i] != (i == 3 ? 1.0 : 0.0)) return value = m[12 + i], Problem::pose_last_row;
    const Mat3<double> r = load_pose(m).rotation;
    value = orthonormality_error(r);
    if (!(value <= tolerance::rotation)) return Problem::pose_not_rotation;
    if (dot(cross(r.x, r.y), r.z) < 0) return Problem::pose_reflection;
    return Problem::none;
}

enum class Enforce : int { ignore, raise, nan };

/// Arguments of a batched inverse. seed may be null. `gc` in 0..7.
struct InverseBatch {
    Strided<const double> pose, psi, seed;
    Strided<const long long> gc;
    Strided<double> out;  // 7 joint values an element
    Enforce limits = Enforce::ignore;
    Enforce unreachable = Enforce::raise;
};

namespace detail {

using Batch = Lane<register_width>;

/// Element-wise check, on the slow path: a lane saw that something is wrong.
inline Problem check_element(const Arm& arm, const InverseBatch& b, std::size_t i, double& value) noexcept {
    const Problem pose = check_pose(b.pose.at(i), value);
    if (pose != Problem::none) return pose;
    if (!(abs(*b.psi.at(i)) <= tolerance::largest_angle)) return value = *b.psi.at(i), Problem::psi_not_finite;
    const long long gc = *b.gc.at(i);
    if (gc < 0 || gc >= configurations) return value = static_cast<double>(gc), Problem::gc_range;
    if (b.seed.data)
        for (int j = 0; j < joints; ++j)
            if (!(abs(b.seed.at(i)[j]) <= tolerance::largest_angle)) return value = b.seed.at(i)[j], Problem::joints_not_finite;
    const Circle<double> c = circle(arm, flange_pose(arm, load_pose(b.pose.at(i))));
    if (is_unreachable(arm, c)) return value = c.triangle.excess, Problem::unreachable;
    if (is_folded(arm, c)) return Problem::folded;
    return Problem::none;
}

struct LaneInput {
    Pose<Batch> pose;
    Batch psi, bad;
    Configuration<Batch> gc;
    Batch near[joints];
};

/// The value that each joint shall be near, and a seed that is not finite as a bad lane.
inline void load_seed(const Arm& arm, const InverseBatch& b, const std::size_t* at, LaneInput& in) noexcept {
    for (int j = 0; j < joints; ++j) {
        in.near[j] = Batch(arm.joint_middle[j]);
        if (!b.seed.data) continue;
        for (int k = 0; k < register_width; ++k) in.near[j].set(k, b.seed.at(at[k])[j]);
        in.bad = select(abs(in.near[j]) <= Batch(tolerance::largest_angle), in.bad, Batch(1.0));
    }
}

/// A block of elements transposed to lanes; `bad` is not 0 in a lane whose numbers need the slow path.
inline LaneInput load_block(const Arm& arm, const InverseBatch& b, const std::size_t* at) noexcept {
    alignas(64) double m[16][register_width], psi[register_width], bad[register_width];
    alignas(64) double shoulder[register_width], elbow[register_width], wrist[register_width];
    for (int k = 0; k < register_width; ++k) {
        const double* pose = b.pose.at(at[k]);
        for (int i = 0; i < 16; ++i) m[i][k] = pose[i];
        psi[k] = *b.psi.at(at[k]);
        const long long gc = *b.gc.at(at[k]);
        bad[k] = gc < 0 || gc >= configurations;
        shoulder[k] = gc & 1 ? -1.0 : 1.0, elbow[k] = gc & 2 ? -1.0 : 1.0, wrist[k] = gc & 4 ? -1.0 : 1.0;
    }
    const auto row = [&](int i) { return Batch::load(m[i]); };
    LaneInput in;
    in.pose = {{{row(0), row(4), row(8)}, {row(1), row(5), row(9)}, {row(2), row(6), row(10)}}, {row(3), row(7), row(11)}};
    in.psi = Batch::load(psi);
    in.gc = {Batch::load(shoulder), Batch::load(elbow), Batch::load(wrist)};
    const auto& r = in.pose.rotation;
    const Vec3<Batch>& p = in.pose.position;
    // NaN and infinity make these comparisons false
    const auto finite = (abs(p.x) + abs(p.y) + abs(p.z) < Batch(infinity)) & (abs(in.psi) <= Batch(tolerance::largest_angle));
    const auto rigid = (orthonormality_error(r) <= Batch(tolerance::rotation)) & (dot(cross(r.x, r.y), r.z) > Batch(0.0));
    const auto row_ok = (abs(row(12)) + abs(row(13)) + abs(row(14)) + abs(row(15) - Batch(1.0)) == Batch(0.0));
    in.bad = select(finite & rigid & row_ok, Batch::load(bad), Batch(1.0));
    load_seed(arm, b, at, in);
    return in;
}

/// Solves a block; the lanes of the result are q of each joint.
inline void solve_block(const Arm& arm, const LaneInput& in, const Circle<Batch>& c, Batch* q) noexcept {
    const Directions<Batch> d = directions(c, fold(arm, c.triangle, in.gc.elbow), in.gc, sin_cos(in.psi));
    for (int j = 0; j < joints; ++j) {
        q[j] = joint_value(atan2(d.y[j], d.x[j]), Batch(arm.joint_sign[j]), Batch(arm.joint_offset[j]), Batch(arm.joint_lower[j]),
                           Batch(arm.joint_upper[j]), in.near[j]);
    }
}

inline void fill_nan(double* q) noexcept {
    for (int j = 0; j < joints; ++j) q[j] = not_a_number;
}

/// The lanes that were not plain: reports or fills with NaN, as asked.
inline void settle_element(const Arm& arm, const InverseBatch& b, std::size_t i, Outcome& outcome) noexcept {
    double value = 0;
    const Problem problem = check_element(arm, b, i, value);
    if (problem == Problem::none) return;
    const bool geometry = problem == Problem::unreachable || problem == Problem::folded;
    fill_nan(b.out.at(i));
    if (!geometry || b.unreachable != Enforce::nan) outcome.report(problem, i, value);
}

inline void enforce_limits(const Arm& arm, const InverseBatch& b, std::size_t i, Outcome& outcome) noexcept {
    double* q = b.out.at(i);
    for (int j = 0; j < joints; ++j) {
        if (q[j] >= arm.lower[j] - tolerance::angle && q[j] <= arm.upper[j] + tolerance::angle) continue;
        if (std::isnan(q[j])) return;
        if (b.limits == Enforce::raise) outcome.report(Problem::joint_limit, i, j + 1);
        return fill_nan(q);
    }
}

}  // namespace detail

/// Inverse kinematics of elements [begin, end): checks, solves and stores each in one pass.
inline void inverse_range(const Arm& arm, const InverseBatch& b, std::size_t begin, std::size_t end, Outcome& outcome) noexcept {
    using detail::Batch;
    constexpr std::size_t width = register_width;
    for (std::size_t first = begin; first < end; first += width) {
        const std::size_t count = end - first < width ? end - first : width;
        std::size_t at[width];
        for (std::size_t k = 0; k < width; ++k) at[k] = first + (k < count ? k : count - 1);
        const detail::LaneInput in = detail::load_block(arm, b, at);
        const Circle<Batch> c = circle(arm, flange_pose(arm, in.pose));
        Batch q[joints];
        detail::solve_block(arm, in, c, q);
        for (std::size_t k = 0; k < count; ++k)
            for (int j = 0; j < joints; ++j) b.out.at(at[k])[j] = q[j][static_cast<int>(k)];
        const auto plain = (in.bad == Batch(0.0)) & !(is_folded(arm, c) | is_unreachable(arm, c));
        if (!all(plain))
            for (std::size_t k = 0; k < count; ++k)
                if (!plain[static_cast<int>(k)]) detail::settle_element(arm, b, at[k], outcome);
        if (b.limits != Enforce::ignore)
            for (std::size_t k = 0; k < count; ++k) detail::enforce_limits(arm, b, at[k], outcome);
    }
}

/// Splits [0, n) into one range a thread; work(begin, end, thread).
template <class Work>
void parallel(std::size_t n, int threads, const Work& work) {
    // the system is asked how many cores it has only where it matters: the answer takes longer than many poses
    std::size_t count = threads > 0 ? static_cast<std::size_t>(threads) : std::thread::hardware_concurrency();
    if (count == 0) count = 1;
    if (count > n) count = n ? n : 1;
    constexpr std::size_t most = 64;
    if (count > most) count = most;
    std::thread pool[most];
    for (std::size_t t = 1; t < count; ++t) pool[t] = std::thread([&work, n, count, t] { work(n * t / count, n * (t + 1) / count, t); });
    work(0, n / count, 0);
    for (std::size_t t = 1; t < count; ++t) pool[t].join();
}

inline constexpr std::size_t most_threads = 64;

/// The problem with the lowest index of all threads.
inline Outcome first_problem(const Outcome* outcomes, std::size_t count) noexcept {
    Outcome first;
    for (std::size_t t = 0; t < count; ++t)
        if (outcomes[t].problem != Problem::none) first.report(outcomes[t].problem, outcomes[t].index, outcomes[t].value);
    return first;
}

}  // namespace armangle
