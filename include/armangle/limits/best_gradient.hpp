// How the largest least margin of a pose, over all branches and psi, moves with the pose.
//
// At the best posture some distances m_k of joints to limits are equally small, and no psi makes all of them
// larger. So weights >= 0 of sum 1 exist with sum weight_k dm_k/dpsi = 0, and the margin moves as
// sum weight_k dm_k/d(v, omega), with psi held: one m_k at a place where it does not change with psi, or two
// that change opposite ways. Source: J. M. Danskin, The theory of max-min (1967).
#pragma once

#include "../circle/derivatives.hpp"
#include "nearest.hpp"

namespace armangle {

namespace detail {

/// Derivatives where the slope of joint j by psi is 0, beside the best psi, which a search that compares
/// values knows to half of the digits alone: two steps of the secant method. `d` where there is no such place
/// near, as of joint 4.
inline Derivatives at_its_top(const Arm& arm, const Pose<double>& pose, const Nearest& best, int j,
                              Derivatives d) noexcept {
    constexpr double aside = 1e-5, near = 1e-3;
    constexpr int psi = joints - 1;
    double before = best.psi + aside, now = best.psi;
    double slope_before = inverse_derivative(arm, pose, before, best.gc).entry[j][psi];
    for (int round = 0; round < 2; ++round) {
        const double slope = d.entry[j][psi];
        const double next = now - slope * (now - before) / (slope - slope_before);
        if (slope == 0 || !(abs(next - best.psi) < near)) break;
        before = now;
        slope_before = slope;
        now = next;
        d = inverse_derivative(arm, pose, now, best.gc);
    }
    return d;
}

}  // namespace detail

/// The gradient of the margin of the best posture, as nearest_posture() with Metric::margin finds it, by the
/// twist (v, omega) of the pose: rad/m, rad/rad. Where two branches, arm angles or pairs of joints are as
/// good, that of the posture given. NaN where there is no posture or a joint that counts has no derivative;
/// 0 without limits.
inline void best_gradient(const Arm& arm, const Pose<double>& pose, const Nearest& best,
                          double (&out)[6]) noexcept {
    for (double& slope : out) slope = not_a_number;
    if (best.status != Status::OK) return;
    Derivatives d = inverse_derivative(arm, pose, best.psi, best.gc);
    if (d.status != Status::OK) return;
    struct Side {
        int joint;
        double sign, distance;
    };
    Side side[2 * joints];
    int count = 0;
    double least = infinity;
    for (int j = 0; j < joints; ++j) {
        const double lower = arm.limits.lower[j], upper = arm.limits.upper[j];
        if (!(upper - lower < infinity)) continue;
        side[count++] = {j, 1.0, best.q[j] - lower};
        side[count++] = {j, -1.0, upper - best.q[j]};
        least = min(least, min(best.q[j] - lower, upper - best.q[j]));
    }
    const auto slope = [&](const Side& s, int k) { return s.sign * d.entry[s.joint][k]; };
    constexpr int psi = joints - 1;
    // of those that are least, the one that grows most with psi, and the one that shrinks most
    const Side *rising = nullptr, *falling = nullptr, *flattest = nullptr;
    for (int i = 0; i < count; ++i) {
        const Side& s = side[i];
        if (s.distance > least + tolerance::angle) continue;
        const double now = slope(s, psi);
        if (!flattest || abs(now) < abs(slope(*flattest, psi))) flattest = &s;
        if (now > 0 && (!rising || now > slope(*rising, psi))) rising = &s;
        if (now < 0 && (!falling || now < slope(*falling, psi))) falling = &s;
    }
    double share = 1.0;
    if (rising && falling) {
        const double up = slope(*rising, psi), down = slope(*falling, psi);
        share = down / (down - up);
    } else if (flattest) {
        rising = falling = flattest;
        d = detail::at_its_top(arm, pose, best, flattest->joint, d);
    }
    for (int k = 0; k < 6; ++k) {
        double sum = 0;
        if (flattest) sum = share * slope(*rising, k) + (1.0 - share) * slope(*falling, k);
        out[k] = abs(sum) < infinity ? sum : not_a_number;
    }
}

}  // namespace armangle
