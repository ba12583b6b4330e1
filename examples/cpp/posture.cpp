// A posture of the paper's example, eq. (37): its pose (38), arm angle, branch, the way back, and the
// feasible arcs.
#include <cstdio>

#include "iiwa7.hpp"

int main() {
    const armangle::Arm arm = example::iiwa7();
    const double q_deg[] = {-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812};
    double q[armangle::joints];
    for (int i = 0; i < armangle::joints; ++i) q[i] = q_deg[i] * example::degree;

    const armangle::Posture posture = armangle::forward(arm, q);
    const armangle::Vec3<double>& p = posture.pose.position;
    std::printf("position_m %.15g %.15g %.15g\n", p.x, p.y, p.z);
    std::printf("psi_deg %.15g\ngc %d\n", posture.psi / example::degree, posture.gc);

    const armangle::Inverse back = armangle::inverse(arm, posture.pose, posture.psi, posture.gc);
    if (back.status != armangle::Status::OK) {
        std::printf("%s\n", armangle::sentence(back.status));
        return 1;
    }
    std::printf("q_deg");
    for (int i = 0; i < armangle::joints; ++i) std::printf(" %.15g", back.q[i] / example::degree);

    const armangle::SelfMotion<double> motion = armangle::self_motion(arm, posture.pose, posture.gc);
    armangle::ArcSet arcs;
    const armangle::Status status = armangle::feasible(motion, armangle::limit_table(arm), arcs);
    std::printf("\nstatus %s\n", armangle::sentence(status));
    for (int i = 0; i < arcs.count; ++i)
        std::printf("arc_deg %.15g %.15g\n", arcs.arc[i].lower / example::degree,
                    arcs.arc[i].upper / example::degree);
}
