// The paper's motion: from eq. (38) by 0.25 m along the tool's own z axis to eq. (39), in 101 poses, a step
// each: lines of pose number, arm angle and least distance to a limit (deg), then the joints reached.
#include <cstdio>

#include "iiwa7.hpp"

int main() {
    const armangle::Arm arm = example::iiwa7();
    const armangle::LimitTable limits = armangle::limit_table(arm);
    const double q_deg[] = {-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812};
    double q[armangle::joints];
    for (int i = 0; i < armangle::joints; ++i) q[i] = q_deg[i] * example::degree;
    const armangle::Pose<double> start = armangle::forward(arm, q).pose;

    armangle::StepOptions options;  // repulsion of eq. (36)
    options.policy = {armangle::Rule::repulsion, 0.1, 20.0, armangle::Outside::nearest};
    for (int k = 0; k <= 100; ++k) {
        armangle::Pose<double> pose = start;
        pose.position = armangle::mul_add(start.rotation.z, 0.25 * k / 100.0, start.position);
        const armangle::Step next = armangle::step(arm, limits, q, pose, options);
        if (next.status != armangle::Status::OK) {
            std::printf("pose %d fails: %s\n", k, armangle::sentence(next.status));
            return 1;
        }
        for (int i = 0; i < armangle::joints; ++i) q[i] = next.q[i];
        std::printf("pose %d %.12f %.12f\n", k, next.psi / example::degree, next.margin / example::degree);
    }
    std::printf("q_deg");
    for (const double value : q) std::printf(" %.12f", value / example::degree);
    std::printf("\n");
}
