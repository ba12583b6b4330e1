// armangle::ChainIkSolverPos against KDL's own forward kinematics, for a plain arm and for one with base,
// tool, flipped joints and offsets. Prints what fails; exit code 1 then.
#include <armangle/kdl.hpp>

#include <cmath>
#include <cstdio>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <random>

namespace {

using armangle::joints;

int failures = 0;

/// Count and print a law that does not hold.
void check(bool holds, const char* law) {
    if (!holds) {
        ++failures;
        std::printf("fails: %s\n", law);
    }
}

/// The DH rows of the arm as a KDL chain, a joint being its axis and a DH frame behind it.
KDL::Chain kdl_chain(const armangle::Arm& arm) {
    const double alpha[joints] = {-1, 1, 1, -1, -1, 1, 0};
    const double d[joints] = {arm.d_bs, 0, arm.d_se, 0, arm.d_ew, 0, arm.d_wf};
    const double a[joints] = {0, 0, arm.a_3, arm.a_4, 0, 0, 0};
    KDL::Chain chain;
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::Fixed), armangle::to_kdl(arm.base)));
    for (int i = 0; i < joints; ++i) {
        const KDL::Joint joint(KDL::Joint::RotZ, arm.sign[i]);
        chain.addSegment(
            KDL::Segment(joint, KDL::Frame::DH(a[i], alpha[i] * armangle::half_pi, d[i], arm.offset[i])));
    }
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::Fixed), armangle::to_kdl(arm.tool)));
    return chain;
}

/// An arm with limits; unless `plain`, with elbow offsets, flipped joints, a zero offset, base and tool.
armangle::Arm arm_of(bool plain) {
    armangle::ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.39;
    p.d_wf = 0.126;
    constexpr double limit[joints] = {2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0};
    for (int i = 0; i < joints; ++i) {
        p.limits.lower[i] = -limit[i];
        p.limits.upper[i] = limit[i];
    }
    if (!plain) {
        p.a_3 = 0.045;
        p.a_4 = -0.045;
        p.sign[3] = p.sign[5] = -1;
        p.offset[2] = armangle::half_pi;
        p.base = armangle::from_kdl({KDL::Rotation::RPY(0.3, -0.2, 1.1), KDL::Vector(0.1, 0.2, 0.3)});
        p.tool = armangle::from_kdl({KDL::Rotation::RPY(-0.4, 0.7, 0.2), KDL::Vector(0.01, 0.02, 0.15)});
    }
    return armangle::make_arm(p);
}

/// `CartToJnt` solves poses of KDL within the limits, and no further from the seed than the joints behind
/// them.
void solves_what_kdl_says(const armangle::Arm& arm) {
    const KDL::Chain chain = kdl_chain(arm);
    KDL::ChainFkSolverPos_recursive forward(chain);
    armangle::ChainIkSolverPos inverse(arm);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    KDL::JntArray q(joints), seed(joints), found(joints);
    double worst = 0, furthest_same = 0;
    bool solved = true, inside = true, nearest = true;
    for (int k = 0; k < 5000; ++k) {
        for (unsigned i = 0; i < joints; ++i) {
            q(i) = arm.limits.upper[i] * unit(random);
            seed(i) = arm.limits.upper[i] * unit(random);
        }
        KDL::Frame pose, again;
        forward.JntToCart(q, pose);
        solved = solved && inverse.CartToJnt(seed, pose, found) == KDL::SolverI::E_NOERROR;
        inside = inside && armangle::within_limits(arm.limits, found.data.data(), 1e-9);
        nearest = nearest && (found.data - seed.data).norm() <= (q.data - seed.data).norm() + 1e-12;
        forward.JntToCart(found, again);
        worst = std::fmax(worst, KDL::diff(pose, again).vel.Norm() + KDL::diff(pose, again).rot.Norm());
        inverse.CartToJnt(q, pose, found);  // from the solution itself
        furthest_same = std::fmax(furthest_same, (found.data - q.data).cwiseAbs().maxCoeff());
    }
    check(solved, "every pose that KDL reaches within the limits is solved");
    check(inside, "the solution is within the limits");
    check(nearest, "the solution is no further from the seed than the posture that made the pose");
    check(worst < 1e-12, "KDL's forward kinematics of the solution is the pose");
    check(furthest_same < 1e-12, "a seed that solves the pose is the solution");
}

/// `CartToJnt` answers bad sizes and poses with KDL's errors or its own, and leaves `q_out` alone.
void refuses(const armangle::Arm& arm) {
    armangle::ChainIkSolverPos solver(arm);
    KDL::JntArray seed(joints), found(joints), six(6);
    for (unsigned i = 0; i < joints; ++i) {
        seed(i) = 0.3;
        found(i) = 42.0;
    }
    check(solver.CartToJnt(six, KDL::Frame::Identity(), found) == KDL::SolverI::E_SIZE_MISMATCH,
          "six joints are a size mismatch");
    const int far = solver.CartToJnt(seed, KDL::Frame(KDL::Vector(9, 0, 0)), found);
    check(far < -100 && far == solver.getError(), "a pose out of reach is an error of our own");
    check(std::string(solver.strError(far)) == armangle::sentence(armangle::Status::UNREACHABLE),
          "the error is a sentence");
    check(found(0) == 42.0, "q_out is left alone on an error");
    KDL::Frame bad(KDL::Vector(armangle::not_a_number, 0, 0));
    check(solver.CartToJnt(seed, bad, found) == KDL::SolverI::E_UNDEFINED,
          "a pose that is not finite is undefined");
    check(std::string(solver.strError(KDL::SolverI::E_UNDEFINED)) == "Undefined value",
          "KDL's own errors keep their text");
}

}  // namespace

/// Checks all laws for both arms; the exit code is 1 if one does not hold.
int main() {
    for (const bool plain : {true, false}) {
        solves_what_kdl_says(arm_of(plain));
        refuses(arm_of(plain));
    }
    return failures != 0;
}
