// The forms of the limits of offset arms at random postures, and their roots. Prints lines "name value":
//
//     form_j      a form at its joint's own angle, over its error bound (at most 1)
//     vacuous     the largest error bound of a form at an ordinary posture, over its size
//     missed      own angles of theta_7 that are in none of the enclosures of a form's roots
//     ordinary    postures away from every singularity
//     unsettled   those of them of which an enclosure may hold more than one root
#include <cstdio>
#include <random>

#include <armangle/offset.hpp>

using namespace armangle;

namespace {

std::mt19937_64 generator(7);
/// A random number in [a, b).
double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(generator); }

/// Arms of each reduction: with two elbow offsets, with a_3 + a_4 = 0, and without.
OffsetArm random_arm(int kind) {
    ArmParameters p;
    p.d_bs = uniform(0, 0.5);
    p.d_se = uniform(0.2, 0.5);
    p.d_ew = uniform(0.2, 0.5);
    p.d_wf = uniform(0, 0.3);
    p.a_3 = kind % 3 == 0 ? 0.0 : uniform(-0.15, 0.15);
    p.a_4 = kind % 3 == 0 ? 0.0 : kind % 3 == 1 ? -p.a_3 : uniform(-0.15, 0.15);
    for (int j = 0; j < joints; ++j) {
        p.sign[j] = uniform(0, 1) < 0.5 ? -1 : 1;
        p.offset[j] = uniform(-3, 3);
        p.limits.lower[j] = -3;
        p.limits.upper[j] = 3;
    }
    return make_offset_arm(p, uniform(0.02, 0.2) * (uniform(0, 1) < 0.5 ? -1 : 1), kind % 2 == 1);
}

/// The polynomial at an angle x (rad).
double value(const TrigPolynomial& p, double x) {
    double sum = p.c[0];
    for (int k = 1; k <= p.degree; ++k) sum += p.c[k] * std::cos(k * x) + p.s[k] * std::sin(k * x);
    return sum;
}

}  // namespace

/// Tries the limit forms at 6000 random postures and prints the numbers of this file's head; the test that
/// runs it judges them.
int main() {
    constexpr int forms = 6;
    double worst[forms] = {}, vacuous = 0;
    long missed = 0, unsettled = 0, asked = 0;
    for (int k = 0; k < 6000; ++k) {
        const OffsetArm arm = random_arm(k);
        const bool ordinary = k % 4 != 3;  // else beside theta_2 = 0, a straight elbow or a fold
        double q[joint_slots] = {}, theta[joints];
        for (int j = 0; j < joints; ++j) theta[j] = uniform(-3, 3);
        if (!ordinary) {
            const double off = std::pow(10.0, uniform(-12, -2));
            const int joint[] = {1, 3, 4};
            const double zero[] = {0.0, arm.rest.delta_angle, half_pi};
            theta[joint[k / 4 % 3]] = zero[k / 4 % 3] + off;
        }
        for (int j = 0; j < joints; ++j)
            q[robot_joint(arm, j)] = to_q(theta[j], arm.rest.sign[j], arm.rest.offset[j]);
        const OffsetPosture posture = forward(arm, q);
        const Pose<double> exact{orthonormal(posture.pose.rotation), posture.pose.position};
        const OffsetMotion<> motion = offset_motion(arm, exact, posture.gc);
        const LimitForms of(arm, motion);
        const TrigPolynomial kappa = of.kappa();
        const double x = theta[6], elbow = motion.branch.elbow, bend = value(kappa, x);
        const double sigma = std::sqrt(std::max(0.0, 1 - bend * bend));
        const BentForm form[forms] = {
            of.theta_1(theta[0]),           of.theta_2(theta[1]),
            of.theta_3(theta[2]),           of.bend(std::cos(theta[3] - arm.rest.delta_angle)),
            of.theta_5(std::sin(theta[4])), of.theta_6(theta[5])};
        bool settled = true;
        for (int j = 0; j < forms; ++j) {
            const BentForm& f = form[j];
            const double odd = f.bent ? value(f.odd, x) : 0.0;
            const double of_sigma =
                std::abs(odd) * std::min(2 * kappa.error / sigma, std::sqrt(2 * kappa.error));
            const double error = f.even.error + (f.bent ? sigma * f.odd.error + of_sigma : 0.0);
            worst[j] = std::max(worst[j], std::abs(value(f.even, x) + elbow * sigma * odd) / error);
            const double size = f.even.slope_bound(0) + f.odd.slope_bound(0);
            if (ordinary) vacuous = std::max(vacuous, f.even.error / size);
            // the piece on which kappa is a cosine, cut off beside x
            double from = x, to = x;
            while (from > x - 0.5 && std::abs(value(kappa, from - 0.01)) < 1) from -= 0.01;
            while (to < x + 0.5 && std::abs(value(kappa, to + 0.01)) < 1) to += 0.01;
            bool found = false;
            trig_roots(f, kappa, elbow, from, to, TrigRootsTuning{}, [&](const RootEnclosure& root) {
                settled = settled && root.settled;
                found = found || (root.lower <= x + 1e-9 && root.upper >= x - 1e-9);
            });
            if (ordinary && to > from && !found) ++missed;
        }
        asked += ordinary;
        unsettled += ordinary && !settled;
    }
    for (int j = 0; j < forms; ++j) std::printf("form_%d %.17g\n", j + 1, worst[j]);
    std::printf("vacuous %.17g\nmissed %ld\nordinary %ld\nunsettled %ld\n", vacuous, missed, asked,
                unsettled);
}
