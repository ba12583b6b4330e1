// One function over the elements of broadcast arrays, in threads.
#pragma once

#include "refusal.hpp"

namespace binding {

/// Applies one(inputs..., outputs...) to each element; the first problem is refused as one of `argument`.
template <int N, class One>
void for_each(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
              const One& one) {
    const Grid<N> grid(buffers, inner);
    armangle::Outcome outcomes[armangle::most_threads];
    {
        nb::gil_scoped_release release;
        armangle::parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            grid.for_runs(
                begin, end,
                [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                    for (std::size_t i = 0; i < count; ++i) {
                        Py_ssize_t here[N];
                        for (int k = 0; k < N; ++k) here[k] = at[k] + static_cast<Py_ssize_t>(i) * step[k];
                        double value = 0;
                        const armangle::Problem problem = one(here, value);
                        if (problem != armangle::Problem::none)
                            outcomes[thread].report(problem, flat + i, value);
                    }
                });
        });
    }
    refuse(armangle::first_problem(outcomes, armangle::most_threads), *buffers[0], inner[0], argument);
}

/// Applies run(at, step, count, outcome) to runs of elements with constant strides; the first problem is
/// refused as one of `argument`.
template <int N, class Run>
void for_each_run(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
                  const Run& run) {
    const Grid<N> grid(buffers, inner);
    armangle::Outcome outcomes[armangle::most_threads];
    {
        nb::gil_scoped_release release;
        armangle::parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            grid.for_runs(
                begin, end,
                [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                    armangle::Outcome here;
                    run(at, step, count, here);
                    if (here.problem != armangle::Problem::none)
                        outcomes[thread].report(here.problem, flat + here.index, here.value);
                });
        });
    }
    refuse(armangle::first_problem(outcomes, armangle::most_threads), *buffers[0], inner[0], argument);
}

/// Poses, arm angles and branches of a run, the first three buffers of a grid.
inline armangle::InverseBatch asked_batch(const Buffer& pose, const Buffer& psi, const Buffer& gc,
                                          const Py_ssize_t* at, const Py_ssize_t* step, bool nan) {
    armangle::InverseBatch b;
    b.pose = {pose.data<double>() + at[0], step[0]};
    b.psi = {psi.data<double>() + at[1], step[1]};
    b.gc = {gc.data<long long>() + at[2], step[2]};
    b.seed = {nullptr, 0};
    b.out = {nullptr, 0};
    b.unreachable = nan ? armangle::Enforce::nan : armangle::Enforce::raise;
    return b;
}

/// Whether seven joints are numbers that can be used, and which is not.
inline armangle::Problem check_joints(const double* q, double& value) noexcept {
    for (int j = 0; j < armangle::joints; ++j)
        if (!(std::fabs(q[j]) <= armangle::tolerance::largest_angle)) {
            value = q[j];
            return armangle::Problem::joints_not_finite;
        }
    return armangle::Problem::none;
}

/// Applies one(q, out) to each row of joints; `rank` axes of the output belong to one row.
template <class Out, class One>
void for_each_joints(Floats q, nb::handle out, int rank, int threads, const One& one) {
    const Buffer in(q), to(out, true);
    for_each<2>("q", {&in, &to}, {1, rank}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const armangle::Problem problem = check_joints(joint, value);
        if (problem == armangle::Problem::none) one(joint, to.data<Out>() + at[1]);
        return problem;
    });
}

/// A pose, an arm angle and a branch: what an inverse is asked.
struct Asked {
    armangle::Pose<double> pose;
    double psi;
    int gc;
};

/// What is wrong with an element; of an arm with its own chain, whose reach its inverse finds, in its
/// numbers.
inline armangle::Problem check_asked(const armangle::Arm& arm, const armangle::InverseBatch& b,
                                     double& value) noexcept {
    return armangle::detail::check_element(arm, b, 0, value);
}
inline armangle::Problem check_asked(const armangle::NearArm& arm, const armangle::InverseBatch& b,
                                     double& value) noexcept {
    return armangle::detail::check_numbers(arm, b, 0, value);
}

/// Applies one(asked, out, value), which gives its own problem, to each posture that is asked of an arm.
template <class AnyArm, class One>
void for_each_asked(const AnyArm& arm, Floats pose, Floats psi, Ints gc, Floats out, int rank, int threads,
                    const One& one) {
    using namespace armangle;
    const Buffer p(pose), a(psi), g(gc), to(out, true);
    for_each<4>("pose", {&p, &a, &g, &to}, {2, 0, 0, rank}, threads,
                [&](const Py_ssize_t* at, double& value) {
                    InverseBatch b;
                    b.pose = {p.data<double>() + at[0], 0};
                    b.psi = {a.data<double>() + at[1], 0};
                    b.seed = {nullptr, 0};
                    b.gc = {g.data<long long>() + at[2], 0};
                    const Problem problem = check_asked(arm, b, value);
                    if (problem != Problem::none) return problem;
                    const Asked asked{load_pose(b.pose.data), *b.psi.data, static_cast<int>(*b.gc.data)};
                    return one(asked, to.data<double>() + at[3], value);
                });
}

}  // namespace binding
