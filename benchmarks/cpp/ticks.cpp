// Times every tick of a tracker: smooth random hands inside the reach, fast, beyond it, over the shoulder,
// turned to the limits, and that jump, each seen 90 times a second with noise; the iiwa 7 at 250 Hz within
// its speeds and 10 rad/s^2, the hand filtered. The same ticks are run several times, and each counts as its
// least, so that what other programs did is left out.
//   <hands> <median> <p99> <p99.9> <worst>   (us of CPU time)
// Usage: ticks [seconds of each hand, 20 by default] [runs, 5 by default] [jerk, rad/s^3, none by default]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "../../examples/cpp/iiwa7.hpp"

namespace {

using namespace armangle;

constexpr double dt = 0.004, rate = 90.0, metre_noise = 0.4e-3, turn_noise = 1.4e-3;
constexpr int hands = 8;  // of each kind

/// A kind of hand: how fast (Hz), how far (m, rad), where about (m), and how often it jumps (1/s).
struct Kind {
    const char* name;
    double highest, metres, radians;
    Vec3<double> about;
    double jumps;
};

constexpr Kind kinds[] = {
    {"inside", 0.35, 0.08, 0.3, {0, 0, 0}, 0},     {"fast", 1.6, 0.04, 0.15, {0, 0, 0}, 0},
    {"beyond", 0.35, 0.2, 0.3, {0.12, 0, 0.1}, 0}, {"singular", 0.35, 0.16, 0.5, {-0.3, 0, 0.15}, 0},
    {"limits", 0.35, 0.08, 0.8, {0, 0, 0}, 0},     {"jumping", 0.35, 0.08, 0.3, {0, 0, 0}, 0.5},
};

/// CPU time of this thread, us.
double cpu_time() {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// A smooth random vector of about unit size at t.
class Smooth {
public:
    Smooth(std::mt19937_64& random, double highest) {
        std::uniform_real_distribution<double> even(0.0, 1.0);
        for (double (&row)[waves][3] : wave_)
            for (double (&one)[3] : row) {
                one[0] = two_pi * highest * (0.1 + 0.9 * even(random));
                one[1] = two_pi * even(random);
                one[2] = 0.2 + 0.4 * even(random);
            }
    }

    Vec3<double> at(double t) const {
        double out[3]{};
        for (int axis = 0; axis < 3; ++axis)
            for (const double (&one)[3] : wave_[axis]) out[axis] += one[2] * std::sin(one[0] * t + one[1]);
        return {out[0], out[1], out[2]};
    }

private:
    static constexpr int waves = 5;
    double wave_[3][waves][3];
};

/// What a camera says of a hand at every tick.
std::vector<Pose<double>> stream(const Pose<double>& start, const Kind& kind, unsigned seed, double seconds) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, 1.0);
    std::uniform_real_distribution<double> even(0.0, 1.0);
    const Smooth place(random, kind.highest), turn(random, kind.highest);
    std::vector<Pose<double>> out;
    Vec3<double> jumped{0, 0, 0};
    double seen = -1;
    for (int k = 0; k * dt < seconds; ++k) {
        const double t = k * dt, begun = min(0.5 * t, 1.0);
        if (even(random) < kind.jumps * dt) jumped = {0.06 * noise(random), 0.06 * noise(random), 0};
        if (std::floor(t * rate) > seen) {
            seen = std::floor(t * rate);
            const auto shaken = [&](double size) {
                return Vec3<double>{size * noise(random), size * noise(random), size * noise(random)};
            };
            const Twist by{(kind.about + place.at(t) * kind.metres) * begun + jumped + shaken(metre_noise),
                           turn.at(t) * (kind.radians * begun) + shaken(turn_noise)};
            out.push_back(moved_by(start, by));
        } else {
            out.push_back(out.back());
        }
    }
    return out;
}

void print(const char* name, std::vector<double> us) {
    std::sort(us.begin(), us.end());
    const auto quantile = [&us](double share) {
        return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
    };
    std::printf("%-9s %.2f %.2f %.2f %.2f\n", name, quantile(0.5), quantile(0.99), quantile(0.999),
                us.back());
}

}  // namespace

int main(int argc, char** argv) {
    const double seconds = argc > 1 ? std::atof(argv[1]) : 20.0;
    const int runs = argc > 2 ? std::atoi(argv[2]) : 5;
    const double jerk = argc > 3 ? std::atof(argv[3]) : infinity;
    const Arm arm = example::iiwa7();
    constexpr double speed[joints] = {98, 98, 100, 130, 140, 180, 180};
    TrackerOptions options;
    for (int j = 0; j < joints; ++j) {
        options.velocity[j] = speed[j] * example::degree;
        options.acceleration[j] = 10.0;
        options.jerk[j] = jerk;
    }
    const double q[joint_slots] = {0.0, 0.7, 0.35, -1.4, 0.0, 1.05, 0.0};
    const Pose<double> start = forward(arm, q).pose;
    std::vector<double> all;
    for (const Kind& kind : kinds) {
        std::vector<double> us;
        for (unsigned seed = 0; seed < hands; ++seed) {
            const std::vector<Pose<double>> poses = stream(start, kind, seed, seconds);
            std::vector<double> least(poses.size(), infinity);
            for (int run = 0; run < runs; ++run) {
                Tracker tracker(arm, options);
                tracker.start(q);
                for (std::size_t k = 0; k < poses.size(); ++k) {
                    const double before = cpu_time();
                    const Tracked now = tracker.step({&poses[k]});
                    least[k] = min(least[k], cpu_time() - before);
                    if (!(now.distance < infinity)) return 1;
                }
            }
            us.insert(us.end(), least.begin(), least.end());
        }
        print(kind.name, us);
        all.insert(all.end(), us.begin(), us.end());
    }
    print("all", all);
    return 0;
}
