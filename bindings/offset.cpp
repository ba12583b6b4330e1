// Arms with an offset wrist or shoulder: configurations by the free joint, its arcs, the nearest solution.
#include <vector>

#include <nanobind/stl/vector.h>

#include "elements.hpp"
#include "offset_handle.hpp"
#include "scene_handle.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Forward kinematics: writes poses (n, 4, 4), values of the free joint and branches for the rows of q.
template <class Handle>
void offset_forward(const Handle& self, Floats q, Floats pose, Floats free, Ints gc, int threads) {
    const Buffer in(q), p(pose, true), f(free, true), g(gc, true);
    for_each<4>("q", {&in, &p, &f, &g}, {1, 2, 0, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const Problem problem = check_joints(self.arm, joint, value);
        if (problem != Problem::none) return problem;
        const OffsetPosture found = forward(self.arm, joint);
        store_pose(found.pose, p.data<double>() + at[1]);
        f.data<double>()[at[2]] = found.free;
        g.data<long long>()[at[3]] = found.gc;
        return Problem::none;
    });
}

/// Writes the DH frames (n, 8, 4, 4) for the rows of q.
template <class Handle>
void offset_frames(const Handle& self, Floats q, Floats out, int threads) {
    for_each_joints<double>(self.arm, q, out, 3, threads, [&](const double* joint, double* to) {
        Pose<double> frame[joints + 1];
        frames(self.arm, joint, frame);
        for (int i = 0; i <= joints; ++i) store_pose(frame[i], to + 16 * i);
    });
}

/// Unless limits are ignored: makes a configuration that violates one NaN and, if requested, returns the
/// problem, with the joint (1 to 7) in `value`.
template <class Handle>
Problem enforce_limits(const Handle& self, Enforce limits, Inverse& found, double& value) noexcept {
    if (limits == Enforce::ignore || !(found.margin < -tolerance::angle)) return Problem::none;
    const Limits& range = nominal(self.arm).limits;
    int j = 0;
    while (found.q[j] >= range.lower[j] - tolerance::angle && found.q[j] <= range.upper[j] + tolerance::angle)
        ++j;
    value = j + 1;
    for (double& q : found.q) q = not_a_number;
    return limits == Enforce::raise ? Problem::joint_limit : Problem::none;
}

/// Inverse kinematics: writes the joints for each pose, value of the free joint and branch, and the status.
template <class Handle>
void offset_inverse(const Handle& self, Floats pose, Floats free, Ints gc, Floats seed, Floats out,
                    Ints outcome, Enforce limits, int threads) {
    const Buffer p(pose), f(free), g(gc), q(out, true), code(outcome, true);
    Buffer near;
    if (!seed.is_none()) near.get(seed);
    const Buffer* const by = near.held() ? &near : nullptr;
    for_each<6>("pose", {&p, &f, &g, by, &q, &code}, {2, 0, 0, 1, 1, 0}, threads,
                [&](const Py_ssize_t* at, double& value) {
                    const double* m = p.data<double>() + at[0];
                    Problem problem = check_pose(self.arm, m, value);
                    const double* from = by ? by->data<double>() + at[3] : nullptr;
                    if (problem == Problem::none && from) problem = check_joints(self.arm, from, value);
                    if (problem != Problem::none) return problem;
                    Inverse found = inverse(self.arm, load_pose(m), f.data<double>()[at[1]],
                                            static_cast<int>(g.data<long long>()[at[2]]), from);
                    code.data<long long>()[at[5]] = static_cast<long long>(found.status);
                    const Problem outside = enforce_limits(self, limits, found, value);
                    std::memcpy(q.data<double>() + at[4], found.q, joints * sizeof(double));
                    return outside;
                });
}

/// The deviation of each link from the nominal one, from base to end effector: position (m) and rotation
/// (rad).
std::vector<std::vector<double>> deviations(const OffsetChainHandle& self) {
    std::vector<std::vector<double>> out;
    for (const LinkDeviation& d : self.arm.deviation) out.push_back({d.position, d.rotation});
    return out;
}

/// Binds checks, forward and inverse kinematics of arms with an offset, with or without an own chain.
template <class Handle>
void bind_offset_kinematics_of(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    bind_checks(arm);
    arm.def("forward_many", &offset_forward<Handle>, "q"_a, "pose"_a, "free"_a, "gc"_a, "threads"_a)
        .def("frames_many", &offset_frames<Handle>, "q"_a, "out"_a, "threads"_a)
        .def("inverse_many", &offset_inverse<Handle>, "pose"_a, "free"_a, "gc"_a, "seed"_a.none(), "out"_a,
             "outcome"_a, "limits"_a, "threads"_a);
}

}  // namespace

/// Binds all functions of an arm with an offset and its own chain, and its constructor.
void bind_offset_chain(nb::class_<OffsetChainHandle>& arm) {
    using namespace nb::literals;
    bind_offset_chain_stepping(arm);
    bind_offset_chain_arcs(arm);
    bind_offset_chain_kinematics(arm);
    bind_offset_chain_scenes(arm);
    bind_offset_chain_reach(arm);
    bind_offset_chain_solving(arm);
    bind_offset_chain_planning(arm);
    bind_offset_kinematics_of(arm);
    arm.def(nb::init<Floats, Floats, Floats, Floats, double, bool, Floats>(), "lengths"_a, "joint_rows"_a,
            "base"_a, "tool"_a, "offset"_a, "mirrored"_a, "chain"_a)
        .def_prop_ro("deviations", &deviations);
}

/// Binds all functions of an arm with an offset, and its constructor.
void bind_offset(nb::class_<OffsetHandle>& arm) {
    using namespace nb::literals;
    bind_offset_stepping(arm);
    bind_offset_planning(arm);
    bind_offset_reach(arm);
    bind_offset_arcs(arm);
    bind_offset_kinematics(arm);
    bind_offset_scenes(arm);
    bind_offset_solving(arm);
    bind_offset_kinematics_of(arm);
    arm.def(nb::init<Floats, Floats, Floats, Floats, double, bool, double>(), "lengths"_a, "joint_rows"_a,
            "base"_a, "tool"_a, "offset"_a, "mirrored"_a, "margin"_a);
}

}  // namespace binding
