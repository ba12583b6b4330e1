// Feasible arcs of any arm at any pose: a proper set with a status, whose inner points are within the limits.
#include "input.hpp"

namespace {

using namespace fuzz;

void check_set(const ArcSet& set) {
    demand(set.count >= 0 && set.count <= ArcSet::capacity, "the count fits");
    demand(!set.full || set.count == 1, "the full circle is one arc");
    for (int i = 0; i < set.count; ++i) {
        const Arc& arc = set.arc[i];
        demand(arc.lower >= -pi && arc.lower < pi, "a lower end is in [-pi, pi)");
        demand(arc.upper > arc.lower && arc.upper <= arc.lower + two_pi,
               "an upper end is within a turn above");
        if (i) demand(arc.lower > set.arc[i - 1].upper, "arcs rise and are disjoint");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    Input in(data, size);
    const Arm arm = in.arm();
    const unsigned kind = in.byte();
    const Pose<double> pose = kind & 1 ? in.reachable(arm).pose : in.rigid(1.0);
    const double margin = kind & 2 ? std::fabs(in.bounded(0.3, 1.5)) : 0.0;
    const Configuration<double> gc = configuration(static_cast<int>(in.byte() % 8));
    const LimitTable limits = limit_table(arm, margin);
    const SelfMotion<double> m = self_motion(arm, pose, gc);
    const JointFunctions<double> f = joint_functions(m);
    ArcSet set;
    const Status status = feasible(m, f, limits, set);
    check_set(set);
    demand((status == Status::OK) == !set.empty(), "a set is empty if and only if the status says why");
    for (int i = 0; i < set.count; ++i) {
        const double psi = set.arc[i].lower + 0.382 * (set.arc[i].upper - set.arc[i].lower);
        const Joints q = joints_within_limits(arm, directions(m, sin_cos(psi)), nullptr);
        const Joints dq = rate(arm, f, sin_cos(psi));
        double slack =
            1e-7;  // what the rounding of theta and of the offsets may do, and gaps of psi that are closed
        for (int j = 0; j < joints; ++j) {
            const double turned = std::fabs(arm.offset[j]) + std::fabs(arm.joint_middle[j]);
            slack = max(slack, 1e-7 * turned + tolerance::angle * std::fabs(dq.q[j]));
        }
        for (const Pivot<double>& p :
             f.pivot) {  // near a singularity a short direction, and so an angle known less well
            const SinCos<double> at = sin_cos(psi);
            slack = max(slack, 4e-15 / max(hypot(p.U.at(at), p.V.at(at)), 1e-13));
        }
        for (int j = 0; j < joints; ++j) demand(std::isfinite(q.q[j]), "joints are finite");
        demand(within_limits(arm.limits, q.q, slack), "inside an arc every joint is within its limits");
    }
    for (int joint = 0; joint < joints; ++joint) {
        ArcSet one;
        joint_arcs(m, f, limits, joint, one);
        check_set(one);
        ArcSet both, other;
        intersect(set, one, both), complement(one, other), check_set(other);
        demand(measure(set) - measure(both) < 1e-6, "the arcs of all joints lie in those of each");
        demand(std::fabs(measure(one) + measure(other) - two_pi) < 1e-6,
               "a set and its complement are the circle");
    }
    return 0;
}
