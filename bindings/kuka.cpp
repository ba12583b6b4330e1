// KUKA's representation of a configuration: E1, Status, Turn.
#include "armangle/kuka.hpp"

#include <vector>

#include "collected.hpp"
#include "elements.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Writes Status and Turn (..., 2) of joints (..., 7).
void kuka_codes(const ArmHandle& self, Floats q, Ints codes, int threads) {
    for_each_joints<long long>(self.arm, q, codes, 1, threads, [&](const double* joint, long long* code) {
        code[0] = kuka::status(self.arm, joint);
        code[1] = kuka::turn(joint);
    });
}

/// Writes the joints for each pose, E1 and Status, and the status of the solution.
void kuka_inverse(const ArmHandle& self, Floats pose, Floats e1, Ints status, Floats seed, Floats out,
                  Ints outcome, int threads) {
    const Buffer p(pose), e(e1), s(status), q(out, true), code(outcome, true);
    Buffer near;
    if (!seed.is_none()) near.get(seed);
    const Buffer* const buffers[] = {&p, &e, &s, near.held() ? &near : nullptr, &q, &code};
    for_each<6>("pose", {buffers[0], buffers[1], buffers[2], buffers[3], buffers[4], buffers[5]},
                {2, 0, 0, 1, 1, 0}, threads, [&](const Py_ssize_t* at, double& value) {
                    const double* m = p.data<double>() + at[0];
                    Problem problem = check_pose(self.arm, m, value);
                    const double* from = near.held() ? near.data<double>() + at[3] : nullptr;
                    if (problem == Problem::none && from) problem = check_joints(self.arm, from, value);
                    if (problem != Problem::none) return problem;
                    const Inverse found = kuka::inverse(self.arm, load_pose(m), e.data<double>()[at[1]],
                                                        static_cast<int>(s.data<long long>()[at[2]]), from);
                    std::memcpy(q.data<double>() + at[4], found.q, joints * sizeof(double));
                    code.data<long long>()[at[5]] = static_cast<long long>(found.status);
                    return Problem::none;
                });
}

/// Redistributes in q (7,) the rotations that a singular configuration leaves undetermined, so that these
/// joints have their signs of Turn; each keeps the value of the seed (null: the middle of its range) if it
/// can. False, with q unchanged, if nothing is undetermined or no distribution exists.
bool kuka_share_turns(const ArmHandle& self, Floats q, Floats seed, int turn) {
    const Buffer at(q, true);
    Buffer near;
    if (!seed.is_none()) near.get(seed);
    return kuka::share_turns(self.arm, near.held() ? near.data<double>() : nullptr, &turn, at.data<double>());
}

/// Computes the values of E1 within the limits for each pose (..., 4, 4) and Status (n,).
ArcColumns kuka_e1_arcs(const ArmHandle& self, Floats pose, Ints status) {
    const Buffer p(pose), s(status);
    const std::size_t n = p.elements(2);
    Collected whole;
    whole.reserve(n);
    Outcome outcome;
    for (std::size_t i = 0; i < n; ++i) {
        double value = 0;
        const double* m = p.data<double>() + 16 * i;
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) {
            outcome.report(problem, i, value);
            break;
        }
        ArcSet set;
        const Status why =
            kuka::e1_arcs(self.arm, load_pose(m), static_cast<int>(s.data<long long>()[i]), self.limits, set);
        whole.add(self.arm, 0.0, configuration(0), set, why);
    }
    refuse(outcome, p, 2, "pose");
    return whole.release();
}

}  // namespace

/// Binds KUKA's E1, Status and Turn to an S-R-S arm.
void bind_kuka(nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    arm.def_prop_ro("is_kuka", [](const ArmHandle& self) { return kuka::is_alike(self.arm); });
    arm.def("kuka_codes", &kuka_codes, "q"_a, "codes"_a, "threads"_a);
    arm.def("kuka_inverse", &kuka_inverse, "pose"_a, "e1"_a, "status"_a, "seed"_a.none(), "out"_a,
            "outcome"_a, "threads"_a);
    arm.def("kuka_share_turns", &kuka_share_turns, "q"_a, "seed"_a.none(), "turn"_a);
    arm.def("kuka_e1_arcs", &kuka_e1_arcs, "pose"_a, "status"_a);
}

}  // namespace binding
