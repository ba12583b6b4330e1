// The nearest posture of any pose to any seed: it holds the pose within the limits, and nothing on the
// feasible arcs costs less.
#include "input.hpp"

namespace {

using namespace fuzz;

constexpr int samples = 64;

struct Question {
    Arm arm;
    LimitTable limits;
    Pose<double> pose;
    double near[joints];
    NearestOptions options;
    ArcSet allowed;
    double slack;  // rad: what the rounding of joints, offsets and seed may do
};

/// What a posture costs in the metric asked; joints without two limits have no margin.
double cost(const Question& ask, const double* q) {
    double sum = 0, most = 0, margin = infinity;
    for (int j = 0; j < joints; ++j) {
        const double off = std::sqrt(ask.options.weight[j]) * std::fabs(q[j] - ask.near[j]);
        sum += off * off;
        most = max(most, off);
        const double to_lower = q[j] - ask.arm.limits.lower[j], to_upper = ask.arm.limits.upper[j] - q[j];
        if (to_lower + to_upper < infinity) margin = min(margin, min(to_lower, to_upper));
    }
    if (ask.options.metric == Metric::margin) return -margin;
    return ask.options.metric == Metric::l2 ? std::sqrt(sum) : most;
}

double cost(const Question& ask, const Nearest& found) {
    return ask.options.metric == Metric::margin ? cost(ask, found.q) : found.distance;
}

void check(const Question& ask, const Nearest& found) {
    if (found.status != Status::OK) {
        demand(found.gc == -1 && std::isnan(found.psi) && std::isnan(found.q[0]), "no posture is NaN, gc -1");
        return;
    }
    demand(found.gc >= 0 && found.gc < configurations && (ask.options.branches >> found.gc & 1),
           "gc is one of those that may be used");
    demand(found.psi > -pi && found.psi <= pi, "psi is in (-pi, pi]");
    for (int j = 0; j < joints; ++j) demand(std::isfinite(found.q[j]), "joints are finite");
    demand(within_limits(ask.arm.limits, found.q, tolerance::angle + ask.slack), "q is within the limits");
    double turned = 1;
    for (int j = 0; j < joints; ++j) turned = max(turned, std::fabs(found.q[j]));
    demand(pose_error(forward(ask.arm, found.q).pose, ask.pose) <= turned * rounding(ask.arm, ask.pose),
           "q holds the pose");
}

/// The posture at psi is no cheaper than what was found.
void compare(const Question& ask, const SelfMotion<double>& m, double psi, const Nearest& found) {
    const bool near = ask.options.metric != Metric::margin;
    const Joints q =
        joints_within_limits(ask.arm, directions(m, sin_cos(psi)), near ? ask.near : ask.arm.joint_middle);
    if (!within_limits(ask.arm.limits, q.q, 0.0)) return;
    demand(found.status == Status::OK, "where a posture is within the limits, one is found");
    demand(cost(ask, found) <= cost(ask, q.q) + ask.slack, "no posture on the arcs costs less");
}

void sample(const Question& ask, Input& in, const Nearest& found) {
    AllArcs all;
    feasible_all(ask.arm, ask.pose, ask.limits, all);
    for (int k = 0; k < samples; ++k) {
        const int gc = k % configurations;
        if (!(ask.options.branches >> gc & 1)) continue;
        ArcSet arcs = all.arcs[gc];
        if (ask.options.allowed) intersect(all.arcs[gc], ask.allowed, arcs);
        if (arcs.empty()) continue;
        const Arc& arc = arcs.arc[in.byte() % static_cast<unsigned>(arcs.count)];
        const double share = in.byte() / 255.0;
        compare(ask, self_motion(ask.arm, ask.pose, gc), arc.lower + share * (arc.upper - arc.lower), found);
    }
}

void compare_all(const Question& ask, const Nearest& found) {
    Nearests each;
    nearest_postures(ask.arm, ask.limits, ask.pose, ask.options, each);
    demand(each.count >= 0 && each.count <= Nearests::capacity, "the count fits");
    for (int i = 0; i < each.count; ++i) {
        check(ask, each.found[i]);
        demand(each.found[i].status == Status::OK, "each of several is a posture");
        demand(i == 0 || cost(ask, each.found[i - 1]) <= cost(ask, each.found[i]), "costs rise");
        demand(cost(ask, found) <= cost(ask, each.found[i]) + ask.slack, "none of several costs less");
    }
    demand(each.count == 0 || found.status == Status::OK, "where there are several there is one");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    Input in(data, size);
    const Arm arm = in.arm();
    const unsigned kind = in.byte();
    const Pose<double> pose = kind & 1 ? in.reachable(arm).pose : in.rigid(1.0);
    const LimitTable limits = limit_table(arm, kind & 2 ? std::fabs(in.bounded(0.3, 1.5)) : 0.0);
    Question ask{arm, limits, pose, {}, {}, {}, 0};
    ask.options.metric = static_cast<Metric>(in.byte() % 3);
    ask.options.near = ask.near;
    double turned = 1;
    for (int j = 0; j < joints; ++j) {
        ask.near[j] = in.bounded(3.0, 1e6);
        if (kind & 4) ask.options.weight[j] = std::fabs(in.bounded(1.0, 100.0));
        turned = max(turned, max(std::fabs(ask.near[j]), std::fabs(ask.arm.offset[j])));
    }
    if (kind & 8) ask.options.branches = in.byte();
    if (kind & 16) {
        const double lower = in.bounded(pi, 100.0);
        ask.allowed = ArcSet{};
        make_arc(ask.allowed, lower, lower + std::fabs(in.bounded(2.0, 6.0)), 0, 0);
        ask.options.allowed = &ask.allowed;
    }
    ask.slack = 1e-9 * turned;
    const Nearest found = nearest_posture(ask.arm, ask.limits, ask.pose, ask.options);
    check(ask, found);
    sample(ask, in, found);
    compare_all(ask, found);
    return 0;
}
