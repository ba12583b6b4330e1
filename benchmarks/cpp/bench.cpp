// Times the C++ core: the rows of the paper's Table 2, what a control loop needs, and batches. One line a
// result:
//   throughput <name> <ns per unit, median of rounds> <yd, median of the rounds' ratios>
//   calls <name> <mean> <standard deviation> <maximum of 10 000> <median> <p99> <worst> <slowest pose>   (ns,
//   one by one)
// Throughput is CPU time, in which other programs' turns do not count; the calls one by one are wall time.
// Usage: bench [rounds] [calls, at least 10 000]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include <armangle/armangle.hpp>

#include "../../examples/cpp/iiwa7.hpp"
#include "yard.hpp"

namespace {

using namespace armangle;
using Clock = std::chrono::steady_clock;

constexpr std::size_t poses = 10000;

double since(Clock::time_point start) {
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

/// CPU time of this thread, ns.
double cpu_time() {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// Makes the compiler believe that a result is read.
template <class T>
void keep(const T& value) {
    asm volatile("" : : "r"(&value) : "memory");
}

double quantile(std::vector<double> v, double share) {
    const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), at, v.end());
    return *at;
}

/// Random feasible poses: joints uniform within the limits, and what forward kinematics makes of them. Seeds
/// near a posture are it, disturbed by 0.05 rad a joint; any other posture is a seed anywhere.
struct Data {
    std::vector<double> q, near, matrix, psi, y, x;
    std::vector<long long> gc;
    std::vector<Pose<double>> pose;

    Data(const Arm& arm, std::size_t n)
        : q(7 * n), near(7 * n), matrix(16 * n), psi(n), y(7 * n), x(7 * n), gc(n), pose(n) {
        std::mt19937_64 random(2018), other(2019);
        std::normal_distribution<double> disturbed(0.0, 0.05);
        for (std::size_t i = 0; i < n; ++i) {
            double* joint = &q[7 * i];
            for (int j = 0; j < joints; ++j)
                joint[j] =
                    std::uniform_real_distribution<double>(arm.limits.lower[j], arm.limits.upper[j])(random);
            for (int j = 0; j < joints; ++j) near[7 * i + j] = joint[j] + disturbed(other);
            const Posture at = forward(arm, joint);
            store_pose(at.pose, &matrix[16 * i]);
            pose[i] = load_pose(&matrix[16 * i]);
            psi[i] = at.psi;
            gc[i] = at.gc;
            for (std::size_t j = 7 * i; j < 7 * i + 7; ++j) {
                y[j] = std::sin(q[j]);
                x[j] = std::cos(q[j]);
            }
        }
    }
};

// -- what is timed
// ---------------------------------------------------------------------------------------------------

/// Steps as large as the policy makes them: near a singularity a joint may well move more than a loop would
/// allow.
StepOptions unlimited_step() {
    StepOptions options{};
    options.max_joint_step = infinity;
    return options;
}

struct Bench {
    Arm arm = example::iiwa7();
    LimitTable limits = limit_table(arm);
    StepOptions options = unlimited_step();
    Data data{arm, poses};
    std::vector<double> out = std::vector<double>(7 * poses);

    void inverse_one(std::size_t i) const {
        const SelfMotion<double> m = self_motion(arm, data.pose[i], static_cast<int>(data.gc[i]));
        keep(joints_within_limits(arm, directions(m, sin_cos(data.psi[i])), nullptr));
    }

    void arcs_one(std::size_t i) const {
        ArcSet set;
        keep(feasible(arm, data.pose[i], static_cast<int>(data.gc[i]), limits, set));
        keep(set);
    }

    void arcs_all(std::size_t i) const {
        AllArcs all;
        feasible_all(arm, data.pose[i], limits, all);
        keep(all);
    }

    /// From the posture of the pose: forward kinematics, arcs, eq. (36), inverse, checks of continuity.
    void step_one(std::size_t i) const { keep(step(arm, limits, &data.q[7 * i], data.pose[i], options)); }

    void solve(std::size_t i, const double* near, Metric metric) const {
        NearestOptions wanted;
        wanted.near = near;
        wanted.metric = metric;
        keep(nearest_posture(arm, limits, data.pose[i], wanted));
    }
    const double* other(std::size_t i) const { return &data.q[7 * ((i + 1) % poses)]; }
    void solve_far(std::size_t i) const { solve(i, other(i), Metric::l2); }
    void solve_near(std::size_t i) const { solve(i, &data.near[7 * i], Metric::l2); }
    void solve_max(std::size_t i) const { solve(i, other(i), Metric::max); }
    void solve_best(std::size_t i) const { solve(i, nullptr, Metric::margin); }

    void solutions(std::size_t i) const {
        NearestOptions wanted;
        wanted.near = other(i);
        Nearests found;
        nearest_postures(arm, limits, data.pose[i], wanted, found);
        keep(found);
    }

    void forward_one(std::size_t i) const { keep(forward(arm, &data.q[7 * i])); }

    void inverse_batch() {
        const InverseBatch batch{{data.matrix.data(), 16},
                                 {data.psi.data(), 1},
                                 {nullptr, 0},
                                 {data.gc.data(), 1},
                                 {out.data(), 7}};
        Outcome outcome;
        inverse_range(arm, batch, 0, poses, outcome);
        keep(outcome);
        keep(out[0]);
    }

    double yard() const {
        const double start = cpu_time();
        keep(walk_yards(data.y.data(), data.x.data(), data.psi.data(), poses));
        return (cpu_time() - start) / poses;
    }
};

// -- how it is timed
// -------------------------------------------------------------------------------------------------

/// One kind of work: all poses once.
template <class Work>
double pass(const Work& work) {
    const double start = cpu_time();
    work();
    return (cpu_time() - start) / poses;
}

struct Row {
    std::string name;
    std::vector<double> ns, yd;
};

/// Rows in turn, round by round, each beside a yard of its own: a busy neighbour hits both.
template <class Work>
void measure(Row& row, const Bench& bench, const Work& work) {
    const double before = bench.yard(), ns = pass(work), after = bench.yard();
    row.ns.push_back(ns);
    row.yd.push_back(2 * ns / (before + after));
}

/// Every call by itself, less the median time that reading the clock takes.
template <class Call>
std::vector<double> one_by_one(std::size_t calls, const Call& call) {
    std::vector<double> times(calls), empty(poses);
    for (double& t : empty) {
        const auto start = Clock::now();
        t = since(start);
    }
    const double clock = quantile(empty, 0.5);
    for (std::size_t i = 0; i < calls; ++i) {
        const auto start = Clock::now();
        call(i % poses);
        times[i] = std::max(0.0, since(start) - clock);
    }
    return times;
}

/// The pose that takes longest, each by its fastest call: what the data costs, and not the system's
/// interruptions.
double slowest_pose(const std::vector<double>& all) {
    std::vector<double> least(all.begin(),
                              all.begin() + static_cast<std::ptrdiff_t>(std::min(poses, all.size())));
    for (std::size_t i = 0; i < all.size(); ++i) least[i % poses] = std::min(least[i % poses], all[i]);
    return *std::max_element(least.begin(), least.end());
}

/// Statistics of the calls. Table 2 states mean, deviation and maximum of 10 000: here the medians of these
/// over the passes, since an interruption of a millisecond would be most of one pass; the rest is of all
/// calls.
template <class Call>
void print_calls(const char* name, std::size_t calls, const Call& call) {
    const std::vector<double> all = one_by_one(calls, call);
    std::vector<double> means, deviations, maxima;
    for (std::size_t first = 0; first + poses <= all.size(); first += poses) {
        double sum = 0, square = 0, most = 0;
        for (std::size_t i = first; i < first + poses; ++i) {
            sum += all[i];
            most = std::max(most, all[i]);
        }
        const double mean = sum / poses;
        for (std::size_t i = first; i < first + poses; ++i) square += (all[i] - mean) * (all[i] - mean);
        means.push_back(mean);
        deviations.push_back(std::sqrt(square / poses));
        maxima.push_back(most);
    }
    std::printf("calls %s %.1f %.1f %.0f %.1f %.1f %.0f %.0f\n", name, quantile(means, 0.5),
                quantile(deviations, 0.5), quantile(maxima, 0.5), quantile(all, 0.5), quantile(all, 0.99),
                *std::max_element(all.begin(), all.end()), slowest_pose(all));
}

void print_throughput(Bench& bench, int rounds) {
    Row rows[] = {{"inverse", {}, {}},    {"arcs_one_gc", {}, {}}, {"full_step", {}, {}},
                  {"forward", {}, {}},    {"arcs_all_gc", {}, {}}, {"inverse_batch", {}, {}},
                  {"solve", {}, {}},      {"solve_near", {}, {}},  {"solve_max", {}, {}},
                  {"solve_best", {}, {}}, {"solutions", {}, {}}};
    std::vector<double> yards;
    const auto each = [&](auto member) {
        return [&bench, member] {
            for (std::size_t i = 0; i < poses; ++i) (bench.*member)(i);
        };
    };
    for (int round = -1; round < rounds; ++round) {
        if (round == 0)  // the first round only warmed up
            for (Row& row : rows) {
                row.ns.clear();
                row.yd.clear();
            }
        measure(rows[0], bench, each(&Bench::inverse_one));
        measure(rows[1], bench, each(&Bench::arcs_one));
        measure(rows[2], bench, each(&Bench::step_one));
        measure(rows[3], bench, each(&Bench::forward_one));
        measure(rows[4], bench, each(&Bench::arcs_all));
        measure(rows[5], bench, [&bench] { bench.inverse_batch(); });
        measure(rows[6], bench, each(&Bench::solve_far));
        measure(rows[7], bench, each(&Bench::solve_near));
        measure(rows[8], bench, each(&Bench::solve_max));
        measure(rows[9], bench, each(&Bench::solve_best));
        measure(rows[10], bench, each(&Bench::solutions));
        yards.push_back(bench.yard());
    }
    std::printf("yard %.2f\n", quantile(yards, 0.5));
    for (const Row& row : rows)
        std::printf("throughput %s %.2f %.4f\n", row.name.c_str(), quantile(row.ns, 0.5),
                    quantile(row.yd, 0.5));
}

/// How many of the steps end with OK: a step that stops early would be timed as fast.
double share_ok(const Bench& b) {
    std::size_t ok = 0;
    for (std::size_t i = 0; i < poses; ++i)
        ok += step(b.arm, b.limits, &b.data.q[7 * i], b.data.pose[i], b.options).status == Status::OK;
    return static_cast<double>(ok) / poses;
}

}  // namespace

int main(int count, char** argument) {
    const int rounds = count > 1 ? std::atoi(argument[1]) : 21;
    const auto calls = static_cast<std::size_t>(count > 2 ? std::atoll(argument[2]) : 1000000);
    static Bench bench;
    std::printf("register_width %d\nsteps_ok %.4f\n", register_width, share_ok(bench));
    print_throughput(bench, rounds);
    print_calls("inverse", calls, [](std::size_t i) { bench.inverse_one(i); });
    print_calls("arcs_one_gc", calls, [](std::size_t i) { bench.arcs_one(i); });
    print_calls("full_step", calls, [](std::size_t i) { bench.step_one(i); });
    print_calls("solve", calls, [](std::size_t i) { bench.solve_far(i); });
    return 0;
}
