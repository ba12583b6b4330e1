// The core laws, compiled for one instruction set. Prints lines "name count":
//
//     pose_lost      postures whose pose the joint values of the inverse do not hold
//     joints_lost    postures away from singularities that the inverse does not give back
//     bits_differ    elements of a batch that are not, bit for bit, what they are alone
//     wrong          arm angles, clear of limits, of which the feasible arcs say what the joints do not
//     regular, inside, outside   how many of each kind were asked
//     width          numbers in a register
#include <algorithm>
#include <cstdio>
#include <random>
#include <vector>

#include <armangle/armangle.hpp>

using namespace armangle;

namespace {

constexpr double pose_slack = 1e-12, joint_slack = 1e-9;
std::mt19937_64 generator(11);
/// A random number in [a, b).
double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(generator); }

/// Arms with and without elbow offsets, d_wf, base and tool, by turns as `kind` counts up.
Arm random_arm(int kind) {
    ArmParameters p;
    p.d_bs = uniform(0, 0.5);
    p.d_se = uniform(0.2, 0.5);
    p.d_ew = uniform(0.2, 0.5);
    p.d_wf = kind % 3 == 0 ? 0 : uniform(0, 0.3);
    p.a_3 = kind % 2 == 0 ? 0 : uniform(-0.1, 0.1);
    p.a_4 = kind % 4 == 1 ? -p.a_3 : kind % 2 == 0 ? 0 : uniform(-0.1, 0.1);
    for (int j = 0; j < joints; ++j) {
        p.sign[j] = uniform(0, 1) < 0.5 ? -1 : 1;
        p.offset[j] = uniform(-3, 3);
        const double middle = uniform(-1, 1), half = uniform(0.3, 3.5);
        p.limits.lower[j] = middle - half;
        p.limits.upper[j] = middle + half;
    }
    if (kind % 5 == 1) {
        const double tilt[] = {0.3, -0.5, 0.7, 0.2, 0.1, -0.4, 0.6, 0};
        const Pose<double> pose = forward(make_arm(p), tilt).pose;
        p.base = pose;
        p.tool = pose;
    }
    return make_arm(p);
}

/// Joints within the limits, some on them, or one near a singularity, even beyond its limits, by turns as
/// `kind` counts up.
void random_joints(const Arm& arm, int kind, double* q) {
    for (int j = 0; j < joints; ++j) {
        const double lower = arm.limits.lower[j], upper = arm.limits.upper[j];
        q[j] = kind % 4 == 1 && uniform(0, 1) < 0.5 ? (uniform(0, 1) < 0.5 ? lower : upper)
                                                    : uniform(lower, upper);
    }
    if (kind % 4 == 3) {
        const int joint = 1 + 2 * (kind / 4 % 3);
        const double zero = to_q(joint == 3 ? arm.delta_angle : 0.0, arm.sign[joint], arm.offset[joint]);
        q[joint] = zero + std::pow(10.0, uniform(-12, -2));
    }
}

/// Away from every singularity: |sin| of all three bends is at least 1e-3.
bool is_bent(const Arm& arm, const double* q) {
    const Chain now = chain(arm, q);
    const double bends[] = {now.theta[1], now.theta[3] - arm.delta_angle, now.theta[5]};
    return std::all_of(bends, bends + 3, [](double bend) { return std::abs(std::sin(bend)) >= 1e-3; });
}

/// The largest difference of two poses in one entry of their matrices.
double gap(const Pose<double>& a, const Pose<double>& b) {
    double m[16], n[16], most = 0;
    store_pose(a, m);
    store_pose(b, n);
    for (int i = 0; i < 16; ++i) most = std::max(most, std::abs(m[i] - n[i]));
    return most;
}

}  // namespace

/// Checks the laws at postures of 40 random arms and prints the counts of this file's head.
int main() {
    constexpr int arms = 40, postures = 103, angles = 60;
    long pose_lost = 0, joints_lost = 0, bits_differ = 0, wrong = 0, regular = 0, inside = 0, outside = 0;
    for (int a = 0; a < arms; ++a) {
        const Arm arm = random_arm(a);
        const LimitTable table = limit_table(arm);
        std::vector<double> q, pose, psi, out;
        std::vector<long long> gc;
        for (int k = 0; k < postures; ++k) {
            double one[joint_slots] = {};
            random_joints(arm, k, one);
            const Posture now = forward(arm, one);
            if (std::isnan(now.psi)) continue;
            q.insert(q.end(), one, one + joints);
            pose.resize(pose.size() + 16);
            store_pose(now.pose, pose.data() + pose.size() - 16);
            psi.push_back(now.psi);
            gc.push_back(now.gc);
        }
        out.resize(q.size());
        const InverseBatch batch{
            {pose.data(), 16}, {psi.data(), 1}, {q.data(), joints}, {gc.data(), 1}, {out.data(), joints}};
        Outcome outcome;
        inverse_range(arm, batch, 0, psi.size(), outcome);
        if (outcome.problem != Problem::none) ++pose_lost;
        for (std::size_t k = 0; k < psi.size(); ++k) {
            double seed[joint_slots] = {};
            std::copy_n(q.data() + joints * k, joints, seed);
            const Pose<double> asked = load_pose(pose.data() + 16 * k);
            const int branch = static_cast<int>(gc[k]);
            const Inverse back = inverse(arm, asked, psi[k], branch, seed);
            if (back.status != Status::OK || !(gap(forward(arm, back.q).pose, asked) <= pose_slack))
                ++pose_lost;
            double farthest = 0;
            for (int j = 0; j < joints; ++j) {
                farthest = std::max(farthest, std::abs(back.q[j] - seed[j]));
                if (back.q[j] != out[joints * k + static_cast<std::size_t>(j)]) ++bits_differ;
            }
            const SelfMotion<double> motion = self_motion(arm, asked, branch);
            if (is_bent(arm, seed) && limit_margin(arm.limits, seed) >= 0) {
                ++regular;
                if (!(farthest <= joint_slack)) ++joints_lost;
            }
            ArcSet arcs;
            if (feasible(motion, table, arcs) != Status::OK && k % 4 != 3) ++wrong;
            for (int i = 0; i < angles && k % 4 != 3; ++i) {
                const double at = uniform(-pi, pi);
                const Inverse held = inverse(arm, asked, at, branch);
                if (held.status != Status::OK || !(std::abs(held.margin) > 1e-6)) continue;
                bool said = false;
                for (int n = 0; n < arcs.count; ++n)
                    for (int turn = -1; turn <= 1; ++turn)
                        said |= arcs.arc[n].lower <= at + turn * two_pi &&
                                at + turn * two_pi <= arcs.arc[n].upper;
                ++(held.margin > 0 ? inside : outside);
                wrong += said != (held.margin > 0);
            }
        }
    }
    std::printf("pose_lost %ld\njoints_lost %ld\nbits_differ %ld\nwrong %ld\n", pose_lost, joints_lost,
                bits_differ, wrong);
    std::printf("regular %ld\ninside %ld\noutside %ld\nwidth %d\n", regular, inside, outside, register_width);
}
