// A 1 kHz control loop around step(): no allocation, every step timed. Before it, the robot stands parked:
// all joints at 0 up to the noise of their encoders, and every question about its pose is timed. Usage:
// realtime [seconds], 5 by default.
#include <time.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "iiwa7.hpp"

static long allocations = 0;

void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) return memory;
    std::abort();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

constexpr long period_ns = 1'000'000;

double now_us() {
    timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

void wait_until_next(timespec& tick) {
    tick.tv_nsec += period_ns;
    if (tick.tv_nsec >= 1'000'000'000) {
        tick.tv_nsec -= 1'000'000'000;
        ++tick.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &tick, nullptr);
}

/// The longest time (us) of all questions together about one pose of a parked robot, of a hundred poses.
double worst_parked(const armangle::Arm& arm) {
    const armangle::LimitTable limits = armangle::limit_table(arm);
    double worst = 0;
    for (int k = 0; k < 100; ++k) {
        double q[armangle::joints];
        for (int i = 0; i < armangle::joints; ++i) q[i] = 1e-5 * std::sin(2.3 * k + 1.7 * i);
        const armangle::Pose<double> pose = armangle::forward(arm, q).pose;
        armangle::NearestOptions near;
        near.near = q;
        armangle::AllArcs arcs;
        const double begin = now_us();
        armangle::feasible_all(arm, pose, limits, arcs);
        const armangle::Freedom freedom = armangle::freedom(arm, pose, limits);
        const armangle::Nearest found = armangle::nearest_posture(arm, limits, pose, near);
        const armangle::Step next = armangle::step(arm, limits, q, pose, {});
        const double took = now_us() - begin;
        if (freedom.status != armangle::Status::OK || found.status != armangle::Status::OK ||
            next.status != armangle::Status::OK)
            std::exit(1);
        worst = took > worst ? took : worst;
    }
    return worst;
}

}  // namespace

int main(int argc, char** argv) {
    const double seconds = argc > 1 ? std::atof(argv[1]) : 5.0;
    const armangle::Arm arm = example::iiwa7();
    const armangle::LimitTable limits = armangle::limit_table(arm, 0.02);
    double q[armangle::joints] = {0.1, 0.6, 0.2, -1.4, 0.3, 0.9, 0.5};
    const armangle::Pose<double> centre = armangle::forward(arm, q).pose;
    armangle::StepOptions options;
    options.policy.K = armangle::gain(5.0, 1e-3);  // 5/s at 1 kHz

    double worst = 0, sum = 0;
    long failed = 0;
    const long steps = static_cast<long>(1000.0 * seconds), before = allocations;
    std::printf("worst_parked_us %.1f\n", worst_parked(arm));
    timespec tick;
    clock_gettime(CLOCK_MONOTONIC, &tick);
    for (long k = 0; k < steps; ++k) {
        wait_until_next(tick);
        const double t = 1e-3 * static_cast<double>(k);
        armangle::Pose<double> pose = centre;  // a slow loop in space
        pose.position = centre.position + armangle::Vec3<double>{0.05 * std::sin(t), 0.05 * std::sin(0.7 * t),
                                                                 0.05 * std::sin(1.3 * t)};
        const double begin = now_us();
        const armangle::Step next = armangle::step(arm, limits, q, pose, options);
        const double took = now_us() - begin;
        worst = took > worst ? took : worst;
        sum += took;
        if (next.status != armangle::Status::OK) ++failed;
        for (int i = 0; i < armangle::joints; ++i)
            q[i] = next.q[i];  // the present joints where a step failed
    }
    std::printf("steps %ld\nfailed %ld\nallocations %ld\nmean_us %.3f\nworst_us %.3f\n", steps, failed,
                allocations - before, sum / static_cast<double>(steps), worst);
    return failed || allocations != before;
}
