// Forward, inverse, Jacobian, self-motion.
#include <memory>

#include "refusal.hpp"

namespace binding {

using namespace armangle;

namespace {

/// One plain inverse: a small (4,4) matrix, float psi, integer gc. None where anything is not plain: the
/// general call then says what.
nb::object inverse_one(const ArmHandle& self, nb::handle pose, nb::handle psi_object, nb::handle gc_object) {
    double psi, value;
    long long gc;
    if (!as_double(psi_object, psi) || !as_index(gc_object, gc) ||
        !(std::fabs(psi) <= tolerance::largest_angle))
        return nb::none();
    if (gc < 0 || gc >= configurations) return nb::none();
    double m[16];
    if (!SmallMatrix().read(pose, 4, 4, m) || check_pose(m, value) != Problem::none) return nb::none();
    const Arm& arm = self.arm;
    const SelfMotion<double> motion = self_motion(arm, load_pose(m), static_cast<int>(gc));
    if (is_folded(motion.circle) || is_unreachable(motion.circle)) return nb::none();
    const Joints q = joints_within_limits(arm, directions(motion, sin_cos(psi)), nullptr);
    nb::object out = new_array7();
    const Buffer to(out, true);
    std::memcpy(to.data<double>(), q.q, joints * sizeof(double));
    return out;
}

void inverse_many(const ArmHandle& self, Floats pose, Floats psi, Ints gc, Floats seed, Floats out,
                  Enforce limits, Enforce unreachable, int threads) {
    const Buffer p(pose), a(psi), g(gc), q(out, true);
    Buffer s;
    if (!seed.is_none()) s.get(seed);
    const Grid<5> grid({&p, &a, &g, s.held() ? &s : nullptr, &q}, {2, 0, 0, 1, 1});
    Outcome outcomes[most_threads];
    {
        nb::gil_scoped_release release;
        parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            grid.for_runs(
                begin, end,
                [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                    InverseBatch b;
                    b.pose = {p.data<double>() + at[0], step[0]};
                    b.psi = {a.data<double>() + at[1], step[1]};
                    b.gc = {g.data<long long>() + at[2], step[2]};
                    b.seed = {s.held() ? s.data<double>() + at[3] : nullptr, step[3]};
                    b.out = {q.data<double>() + at[4], step[4]};
                    b.limits = limits;
                    b.unreachable = unreachable;
                    Outcome here;
                    inverse_range(self.arm, b, 0, count, here);
                    if (here.problem != Problem::none)
                        outcomes[thread].report(here.problem, flat + here.index, here.value);
                });
        });
    }
    refuse(first_problem(outcomes, most_threads), q, 1, "pose", "seed");
}

/// Applies one(inputs..., outputs...) to each element; the first problem is refused as one of `argument`.
template <int N, class One>
void for_each(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
              const One& one) {
    const Grid<N> grid(buffers, inner);
    Outcome outcomes[most_threads];
    {
        nb::gil_scoped_release release;
        parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            grid.for_runs(
                begin, end,
                [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                    for (std::size_t i = 0; i < count; ++i) {
                        Py_ssize_t here[N];
                        for (int k = 0; k < N; ++k) here[k] = at[k] + static_cast<Py_ssize_t>(i) * step[k];
                        double value = 0;
                        const Problem problem = one(here, value);
                        if (problem != Problem::none) outcomes[thread].report(problem, flat + i, value);
                    }
                });
        });
    }
    refuse(first_problem(outcomes, most_threads), *buffers[0], inner[0], argument);
}

Problem check_joints(const double* q, double& value) noexcept {
    for (int j = 0; j < joints; ++j)
        if (!(std::fabs(q[j]) <= tolerance::largest_angle)) {
            value = q[j];
            return Problem::joints_not_finite;
        }
    return Problem::none;
}

void forward_many(const ArmHandle& self, Floats q, Floats pose, Floats psi, Ints gc, bool nan, int threads) {
    const Buffer in(q), p(pose, true), a(psi, true), g(gc, true);
    for_each<4>("q", {&in, &p, &a, &g}, {1, 2, 0, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const Problem problem = check_joints(joint, value);
        if (problem != Problem::none) return problem;
        const Posture posture = forward(self.arm, joint);
        store_pose(posture.pose, p.data<double>() + at[1]);
        a.data<double>()[at[2]] = posture.psi;
        g.data<long long>()[at[3]] = posture.gc;
        return std::isnan(posture.psi) && !nan ? Problem::folded : Problem::none;
    });
}

void frames_many(const ArmHandle& self, Floats q, Floats out, int threads) {
    const Buffer in(q), to(out, true);
    for_each<2>("q", {&in, &to}, {1, 3}, threads, [&](const Py_ssize_t* at, double& value) {
        const Problem problem = check_joints(in.data<double>() + at[0], value);
        if (problem != Problem::none) return problem;
        Pose<double> frame[joints + 1];
        frames(self.arm, in.data<double>() + at[0], frame);
        for (int i = 0; i <= joints; ++i) store_pose(frame[i], to.data<double>() + at[1] + 16 * i);
        return Problem::none;
    });
}

void jacobian_many(const ArmHandle& self, Floats q, Floats out, int threads) {
    const Buffer in(q), to(out, true);
    for_each<2>("q", {&in, &to}, {1, 2}, threads, [&](const Py_ssize_t* at, double& value) {
        const Problem problem = check_joints(in.data<double>() + at[0], value);
        if (problem != Problem::none) return problem;
        const Jacobian j = jacobian(self.arm, in.data<double>() + at[0]);
        std::memcpy(to.data<double>() + at[1], j.entry, sizeof(j.entry));
        return Problem::none;
    });
}

void self_motion_many(const ArmHandle& self, Floats pose, Floats psi, Ints gc, Floats out, int threads) {
    const Buffer p(pose), a(psi), g(gc), to(out, true);
    for_each<4>("pose", {&p, &a, &g, &to}, {2, 0, 0, 1}, threads, [&](const Py_ssize_t* at, double& value) {
        InverseBatch b;
        b.pose = {p.data<double>() + at[0], 0};
        b.psi = {a.data<double>() + at[1], 0};
        b.seed = {nullptr, 0};
        b.gc = {g.data<long long>() + at[2], 0};
        const Problem problem = detail::check_element(self.arm, b, 0, value);
        if (problem != Problem::none) return problem;
        const SelfMotion<double> m =
            self_motion(self.arm, load_pose(b.pose.data), static_cast<int>(*b.gc.data));
        const Joints dq = rate(self.arm, joint_functions(m), sin_cos(*b.psi.data));
        std::memcpy(to.data<double>() + at[3], dq.q, joints * sizeof(double));
        return Problem::none;
    });
}

void limit_margin_many(const ArmHandle& self, Floats q, Floats out) {
    const Buffer in(q), to(out, true);
    for_each<2>("q", {&in, &to}, {1, 0}, 1, [&](const Py_ssize_t* at, double& value) {
        const Problem problem = check_joints(in.data<double>() + at[0], value);
        to.data<double>()[at[1]] = limit_margin(self.arm.limits, in.data<double>() + at[0]);
        return problem;
    });
}

}  // namespace

void bind_kinematics(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Enforce>(m, "Enforce")
        .value("IGNORE", Enforce::ignore)
        .value("RAISE", Enforce::raise)
        .value("NAN", Enforce::nan);
    arm.def("inverse_one", &inverse_one, "pose"_a.none(), "psi"_a.none(), "gc"_a.none());
    arm.def("inverse_many", &inverse_many, "pose"_a, "psi"_a, "gc"_a, "seed"_a.none(), "out"_a, "limits"_a,
            "unreachable"_a, "threads"_a);
    arm.def("forward_many", &forward_many, "q"_a, "pose"_a, "psi"_a, "gc"_a, "nan"_a, "threads"_a);
    arm.def("frames_many", &frames_many, "q"_a, "out"_a, "threads"_a);
    arm.def("jacobian_many", &jacobian_many, "q"_a, "out"_a, "threads"_a);
    arm.def("self_motion_many", &self_motion_many, "pose"_a, "psi"_a, "gc"_a, "out"_a, "threads"_a);
    arm.def("limit_margin_many", &limit_margin_many, "q"_a, "out"_a);
}

}  // namespace binding
