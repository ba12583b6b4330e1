// Whole paths from anywhere to anywhere: an answer, and on ok a curve that holds the poses within the limits,
// winding for winding.
#include <armangle/plan.hpp>

#include "input.hpp"

namespace {

/// Limits of two turns at most: a plan weighs every combination of windings.
armangle::Arm few_turns(const armangle::Arm& arm) {
    armangle::ArmParameters p = arm;
    constexpr double most = 6.0;
    for (int i = 0; i < armangle::joints; ++i) {
        p.limits.lower[i] = armangle::max(p.limits.lower[i], -most);
        p.limits.upper[i] = armangle::min(p.limits.upper[i], most);
        if (!(p.limits.lower[i] < p.limits.upper[i])) {
            p.limits.lower[i] = -most;
            p.limits.upper[i] = most;
        }
    }
    return make_arm(p);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    using namespace fuzz;
    Input in(data, size);
    const Arm arm = few_turns(in.arm());
    double q[joints];
    for (int i = 0; i < joints; ++i) {
        const double share = 0.5 + 0.5 * in.bounded(1.0, 1.0);
        q[i] = arm.limits.lower[i] + share * (arm.limits.upper[i] - arm.limits.lower[i]);
    }
    const unsigned kind = in.byte();
    const std::size_t count = 1 + kind % 3;
    Segment segments[3];
    Pose<double> from = forward(arm, q).pose;
    double moved[joints];
    std::copy(q, q + joints, moved);
    for (std::size_t i = 0; i < count; ++i) {
        const double start = static_cast<double>(i) / static_cast<double>(count),
                     end = static_cast<double>(i + 1) / static_cast<double>(count);
        for (double& x : moved) x += in.bounded(0.2, 1.0);
        const Pose<double> to = kind & 64 ? in.rigid(1.0) : forward(arm, moved).pose;
        if (kind & 8) {
            const Vec3<double> axis{in.bounded(1.0, 1.0), in.bounded(1.0, 1.0), 1.0};
            segments[i] = screw(start, end, from, to.position, axis * (1.0 / norm(axis)),
                                in.bounded(2.0, 7.0), in.bounded(0.2, 1.0), (kind & 16) != 0);
            from = pose_at(segments[i], end);
        } else {
            segments[i] = line(start, end, from, to, (kind & 16) != 0);
            from = to;
        }
    }
    PlanOptions options;
    options.branches = 1u << (in.byte() % 8);
    if (kind & 32) {
        options.start = q;
        options.branches = 0xff;
    }
    options.singularity_margin = kind & 4 ? std::fabs(in.bounded(0.2, 0.5)) : 0.0;
    const double rows[] = {0.0, 1.0};
    const Plan plan = armangle::plan(arm, segments, count, rows, 2, options);
    for (const BranchReport& b : plan.branches)
        demand(b.from >= 0 && b.from <= b.to && b.to <= 1, "a report speaks of a part of the path");
    if (!plan.ok) return 0;
    demand(plan.proof.violated.empty(), "a plan that is ok breaks nothing");
    const Curve curve{arm, plan.plane, plan.gc, {segments, count}, plan.stretches};
    for (int k = 0; k <= 64; ++k) {
        const PlacedPosture here = curve.at(k / 64.0);
        demand(within_limits(arm.limits, here.q, 1e-6), "a plan that is ok is within the limits");
        demand(pose_error(forward(arm, here.q).pose, here.pose) < 1e-6 + 1e3 * rounding(arm, here.pose),
               "a plan that is ok holds the poses");
    }
    return 0;
}
