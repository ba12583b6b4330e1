// The proof of a stretch at random arms of two families and random stretches, beside SAMPLES samples of each.
// Prints lines "name value":
//
//     proven_*    stretches that are proven whole
//     wrong_*     of them those with a sample that passes a limit, has no posture, or lies at least half a
//                 turn off the straight way (0)
//     kept_*      stretches of which no sample comes within 0.02 of any of these
//     missed_*    of them those that are not proven
//     broken_*    cells said to be broken
//     untrue_*    of them those with a middle that is not (0)
#include <cmath>
#include <cstdio>
#include <random>

#include <armangle/plan.hpp>

using namespace armangle;

namespace {

std::mt19937_64 generator(5);
/// A random number in [a, b).
double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(generator); }

/// Random lengths, signs, offsets and limits, without elbow offsets.
ArmParameters random_parameters() {
    ArmParameters p;
    p.d_bs = uniform(0, 0.5);
    p.d_se = uniform(0.2, 0.5);
    p.d_ew = uniform(0.2, 0.5);
    p.d_wf = uniform(0, 0.3);
    for (int j = 0; j < joints; ++j) {
        p.sign[j] = uniform(0, 1) < 0.5 ? -1 : 1;
        p.offset[j] = uniform(-3, 3);
        p.limits.lower[j] = -uniform(1.0, 5.0);
        p.limits.upper[j] = uniform(1.0, 5.0);
    }
    return p;
}

/// What is counted of one family.
struct Count {
    long proven = 0, wrong = 0, kept = 0, missed = 0, broken = 0, untrue = 0;
    void print(const char* family) const {
        std::printf("proven_%s %ld\nwrong_%s %ld\nkept_%s %ld\nmissed_%s %ld\nbroken_%s %ld\nuntrue_%s %ld\n",
                    family, proven, family, wrong, family, kept, family, missed, family, broken, family,
                    untrue);
    }
};

/// Prove the stretch [0, 1], compare it with samples, and count. place(s, d) writes the directions of all
/// joints at s, and returns what is positive where there is a posture.
template <class Place>
void look(const Arm& arm, const Place& place, Count& count) {
    double q[joints], q_end[joints];
    Directions<double> d;
    constexpr int samples = SAMPLES;
    std::vector<double> row(joints * (samples + 1)), room(samples + 1, infinity);
    for (int i = 0; i <= samples; ++i) {
        const double there = place(i / double(samples), d);
        for (int j = 0; j < joints; ++j) {
            const double near = i ? row[joints * (i - 1) + j] : 0.0;
            row[joints * i + j] = lift(to_q(arm, j, armangle::atan2(d.y[j], d.x[j])), near);
            room[i] = min(min(room[i], there),
                          std::hypot(d.y[j], d.x[j]) - 1e-3);  // at theta_2 = 0 joint 1 has no direction
        }
    }
    for (int j = 0; j < joints; ++j) {
        q[j] = row[j];
        q_end[j] = row[joints * samples + j];
    }
    const StraightWay way{0.0, 1.0, q, q_end};
    double least = infinity;  // of the rooms to all that is claimed
    for (int i = 0; i <= samples; ++i) {
        least = min(least, room[i]);
        for (int j = 0; j < joints; ++j) {
            const double at = row[joints * i + j];
            least = min(least, min(at - arm.limits.lower[j], arm.limits.upper[j] - at));
            least = min(least, pi - std::abs(at - way.near(j, i / double(samples))));
            if (i) least = min(least, 1.0 - std::abs(at - row[joints * (i - 1) + j]));
        }
    }
    bool whole = true;
    ProofTuning patient;
    patient.looks = 4096;
    prove_stretch(arm, arm.limits, place, way, patient, [&](double from, double to, bool broken) {
        whole = false;
        if (!broken) return;
        ++count.broken;
        const double s = 0.5 * (from + to);
        const double there = place(s, d);
        bool true_of_it = !(there > 0);
        for (int j = 0; j < joints; ++j) {
            const double at = lift(to_q(arm, j, armangle::atan2(d.y[j], d.x[j])), way.near(j, s));
            true_of_it = true_of_it || at < arm.limits.lower[j] || at > arm.limits.upper[j];
        }
        count.untrue += !true_of_it;
    });
    count.proven += whole;
    count.wrong += whole && least < -1e-12;
    count.kept += least > 0.02;
    count.missed += least > 0.02 && !whole;
}

}  // namespace

/// Looks at up to 3000 stretches of each family and prints the counts of this file's head.
int main() {
    Count offset, exact;
    for (int k = 0; k < 3000; ++k) {
        ArmParameters p = random_parameters();
        double q[joint_slots] = {};
        for (int j = 0; j < joints; ++j) q[j] = uniform(p.limits.lower[j], p.limits.upper[j]);
        const double far = uniform(0.01, 0.3), turned = uniform(-0.5, 0.5);
        const auto beside = [&](const Pose<double>& from) {
            Pose<double> to = from;
            to.position =
                to.position + Vec3<double>{uniform(-far, far), uniform(-far, far), uniform(-far, far)};
            return line(0.0, 1.0, from, to, true);
        };
        {
            const OffsetArm arm = make_offset_arm(p, uniform(-0.2, 0.2), k % 2 == 1);
            const OffsetFamily family(arm);
            const Segment g = beside(tool_pose(arm, q));
            const auto [lambda, gc] = family.on(q);
            const auto place = [&, from = lambda, branch = gc]<class T>(const T& s, Directions<T>& d) {
                return family.place(pose_at(g, s), branch, T(from) + T(turned) * s, nullptr, d);
            };
            look(arm.own, place, offset);
        }
        {
            const Arm arm = make_arm(p);
            const Segment g = beside(tool_pose(arm, q));
            const Posture at = forward(arm, q);
            if (is_nan(at.psi)) continue;
            const auto place = [&]<class T>(const T& s, Directions<T>& d) {
                const Circle<T> c = circle(arm, flange_pose(arm, pose_at(g, s)));
                const SelfMotion<T> m = self_motion(arm, c, spread<T>(configuration(at.gc)));
                d = directions(m, sin_cos(T(at.psi) + T(turned) * s));
                return -c.triangle.excess;
            };
            look(arm, place, exact);
        }
    }
    offset.print("offset");
    exact.print("exact");
}
