// Steps from anywhere to anywhere, any bits: a status, and on OK a posture that holds the pose within the
// limits.
#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    using namespace fuzz;
    Input in(data, size);
    const Arm arm = in.arm();
    const unsigned kind = in.byte();
    const LimitTable limits = limit_table(arm, kind & 1 ? std::fabs(in.bounded(0.3, 1.5)) : 0.0);
    double q[joint_slots] = {};
    for (int i = 0; i < joints; ++i) q[i] = in.number(3.0);
    StepOptions options;
    options.carry = kind & 2 ? Carry::elbow : Carry::psi;
    options.max_joint_step = kind & 4 ? infinity : 0.2;
    options.gc = kind & 8 ? static_cast<int>(in.byte() % 8) : -1;
    options.policy.rule = static_cast<Rule>(in.byte() % 3);
    options.policy.K = std::fabs(in.bounded(1.0, 1.0));
    for (int k = 0; k < 3; ++k) {
        Pose<double> pose = kind & 16 ? in.rigid(1.0) : in.reachable(arm).pose;
        if (kind & 32) {
            pose.rotation.y.z = in.number(1.0);
            pose.position.x = in.number(1.0);
        }
        const Step next = step(arm, limits, q, pose, options);
        demand(static_cast<int>(next.status) >= 0 && static_cast<int>(next.status) < status_count,
               "a status is one of the list");
        if (next.status != Status::OK) {
            demand(std::memcmp(next.q, q, joints * sizeof(double)) == 0, "on any other status nothing moves");
            continue;
        }
        for (int i = 0; i < joints; ++i)
            demand(std::isfinite(next.q[i]), "a step that is OK has finite joints");
        demand(next.psi > -pi && next.psi <= pi, "psi is in (-pi, pi]");
        demand(within_limits(arm.limits, next.q, tolerance::angle), "a step that is OK is within the limits");
        double turned = 1;
        for (int i = 0; i < joints; ++i) turned = max(turned, std::fabs(next.q[i]));
        demand(pose_error(forward(arm, next.q).pose, pose) <
                   5e-6 * (1 + norm(pose.position)) + turned * 1e3 * rounding(arm, pose),
               "a step that is OK holds the pose");
        for (int i = 0; i < joints; ++i) q[i] = next.q[i];
    }
    return 0;
}
