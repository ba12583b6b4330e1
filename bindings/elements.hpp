// Applies one function to the elements of broadcast arrays, in threads.
#pragma once

#include "refusal.hpp"
#include "watch.hpp"

namespace binding {

/// Calls one(at, value), which returns a Problem and its value, for each element of broadcast arrays: at[k]
/// is the element's offset in buffer k. The last inner[k] axes of a buffer belong to the element. Raises the
/// first problem, named after `argument`.
template <int N, class One>
void for_each(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
              const One& one) {
    const Grid<N> grid(buffers, inner);
    armangle::Outcome outcomes[armangle::most_threads];
    watched(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        grid.for_runs(begin, end,
                      [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                          for (std::size_t i = 0; i < count; ++i) {
                              if (flat + i > begin && watch.ended(thread, flat + i - begin)) return;
                              Py_ssize_t here[N];
                              for (int k = 0; k < N; ++k)
                                  here[k] = at[k] + static_cast<Py_ssize_t>(i) * step[k];
                              double value = 0;
                              const armangle::Problem problem = one(here, value);
                              if (problem != armangle::Problem::none)
                                  outcomes[thread].report(problem, flat + i, value);
                          }
                      });
    });
    refuse(armangle::first_problem(outcomes, armangle::most_threads), *buffers[0], inner[0], argument);
}

/// Calls run(at, step, count, outcome) for runs of elements of broadcast arrays: at[k] and step[k] are the
/// first offset and the stride in buffer k. Raises the first problem, named after `argument`.
template <int N, class Run>
void for_each_run(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
                  const Run& run) {
    const Grid<N> grid(buffers, inner);
    armangle::Outcome outcomes[armangle::most_threads];
    watched(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        grid.for_runs(
            begin, end,
            [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                armangle::Outcome here;
                run(at, step, count, here);
                if (here.problem != armangle::Problem::none)
                    outcomes[thread].report(here.problem, flat + here.index, here.value);
            },
            [&](std::size_t done) { return watch.ended(thread, done); });
    });
    refuse(armangle::first_problem(outcomes, armangle::most_threads), *buffers[0], inner[0], argument);
}

/// Raises an error for poses (..., 4, 4) that are not rigid or not in m.
template <class Handle>
void check_poses(const Handle& self, Floats poses, const char* argument) {
    const Buffer p(poses);
    for_each<1>(argument, {&p}, {2}, 1, [&](const Py_ssize_t* at, double& value) {
        return check_pose(self.arm, p.data<double>() + at[0], value);
    });
}

/// Raises an error for joints (..., 7) that are not finite or not in rad.
template <class Handle>
void check_joint_rows(const Handle& self, Floats q, const char* argument) {
    const Buffer rows(q);
    for_each<1>(argument, {&rows}, {1}, 1, [&](const Py_ssize_t* at, double& value) {
        return check_joints(self.arm, rows.data<double>() + at[0], value);
    });
}

/// Binds check_poses and check_joints.
template <class Handle>
void bind_checks(nb::class_<Handle>& arm) {
    arm.def("check_poses", &check_poses<Handle>, nb::arg("poses"), nb::arg("argument"));
    arm.def("check_joints", &check_joint_rows<Handle>, nb::arg("q"), nb::arg("argument"));
}

/// Makes the InverseBatch of a run, without seed and output: pointers and strides of poses, psi (rad) and gc
/// at the offsets `at`. `nan`: an unreachable pose gives NaN instead of an error.
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

/// Applies one(q, out) to each row of joints of an arm; `rank` axes of the output belong to one row.
template <class Out, class AnyArm, class One>
void for_each_joints(const AnyArm& arm, Floats q, nb::handle out, int rank, int threads, const One& one) {
    const Buffer in(q), to(out, true);
    for_each<2>("q", {&in, &to}, {1, rank}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const armangle::Problem problem = check_joints(arm, joint, value);
        if (problem == armangle::Problem::none) one(joint, to.data<Out>() + at[1]);
        return problem;
    });
}

/// The arguments of an inverse: a pose, an arm angle and a branch.
struct Asked {
    armangle::Pose<double> pose;
    double psi;
    int gc;
};

/// Checks pose, psi, gc and reach of the first element of an inverse.
inline armangle::Problem check_asked(const armangle::Arm& arm, const armangle::InverseBatch& b,
                                     double& value) noexcept {
    return armangle::detail::check_element(arm, b, 0, value);
}
/// Checks the numbers of the first element alone, for arms whose inverse itself determines the reach.
template <class AnyArm>
armangle::Problem check_asked(const AnyArm& arm, const armangle::InverseBatch& b, double& value) noexcept {
    return armangle::detail::check_numbers(arm, b, 0, value);
}

/// Applies one(asked, out, value), which returns its problem, to each pose, psi and branch of broadcast
/// arrays; `rank` axes of the output belong to one of them.
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
