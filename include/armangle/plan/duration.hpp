// The least duration of a curve, from rest to rest, within bounds on joint velocities and accelerations.
//
//     y |   ____cap____             y = (ds/dt)^2, u = d2s/dt2 = y' / 2; at every s of a grid
//       |  /           `.             |q'| sqrt(y) <= v        |q' u + q'' y| <= a
//       | /              `.
//     0 +------------------- s      backward: the greatest y that reaches the end; forward: as fast as that
//                                   permits
//
// Source: H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
// analysis (2018): TOPP-RA. The permitted y at a place are an interval from 0 on; bisection finds its end.
#pragma once

#include <vector>

#include "curve.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the least duration of a curve.
struct DurationTuning {
    static constexpr double places = 400;  // intervals of s ...
    static constexpr double least = 8;   // ... and of a stretch: near an end that is left fast they are short
    static constexpr int halvings = 50;  // bisections of an interval of y
    static constexpr double most = 1e12;  // y if no joint moves (1/s^2)
};

/// Bounds of the joints; both may be infinite.
struct JointBounds {
    double velocity[joints], acceleration[joints];  // rad/s, rad/s^2
};

namespace detail {

/// q' and q'' at one place of the grid.
struct Bend {
    double first[joints], second[joints];
};

/// The range of u = d2s/dt2 that the acceleration bounds permit at y = (ds/dt)^2.
struct Pull {
    double least = -infinity, most = infinity;
};

/// The range of d2s/dt2 that the acceleration bounds permit at a place, at (ds/dt)^2 = y; empty if none is
/// permitted.
inline Pull pull(const Bend& bend, const JointBounds& bounds, double y) noexcept {
    Pull out;
    for (int j = 0; j < joints; ++j) {
        const double a = bounds.acceleration[j];
        if (!(a < infinity)) continue;
        const double slope = abs(bend.first[j]), along = bend.first[j] < 0 ? -bend.second[j] : bend.second[j];
        if (slope * DurationTuning::most > a) {
            out.least = max(out.least, (-a - along * y) / slope);
            out.most = min(out.most, (a - along * y) / slope);
        } else if (abs(along) * y > a) {
            out.most = -infinity;
        }
    }
    return out;
}

/// The greatest y = (ds/dt)^2 that the velocity bounds permit.
inline double velocity_cap(const Bend& bend, const JointBounds& bounds) noexcept {
    double out = DurationTuning::most;
    for (int j = 0; j < joints; ++j) {
        const double speed = bounds.velocity[j] / abs(bend.first[j]);
        if (speed * speed < out) out = speed * speed;
    }
    return out;
}

/// The greatest y = (ds/dt)^2 up to `cap` from which a permitted d2s/dt2 leads to a y in [0, next] over a
/// step of s; 0 if none does.
inline double leading_on(const Bend& bend, const JointBounds& bounds, double cap, double next,
                         double step) noexcept {
    const auto leads = [&](double y) {
        const Pull u = pull(bend, bounds, y);
        return max(u.least, -y / (2 * step)) <= min(u.most, (next - y) / (2 * step));
    };
    if (leads(cap)) return cap;
    double low = 0, high = cap;
    for (int i = 0; i < DurationTuning::halvings; ++i) {
        const double middle = 0.5 * (low + high);
        (leads(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace detail

/// The least duration (s) of a curve from rest to rest; infinite if joints have no finite rate along it.
template <class AnyCurve>
double duration(const AnyCurve& curve, const JointBounds& bounds) {
    std::vector<double> at;
    for (const Stretch& x : curve.stretches) {
        const double parts = max(DurationTuning::least, ceil(DurationTuning::places * (x.end - x.start)));
        for (double k = 0; k < parts; ++k) at.push_back(x.start + (x.end - x.start) * k / parts);
    }
    at.push_back(curve.stretches.back().end);
    const std::size_t n = at.size() - 1;
    std::vector<detail::Bend> bend(n + 1);
    std::vector<double> cap(n + 1), reach(n + 1, 0.0);
    for (std::size_t i = 0; i <= n; ++i) {
        double d[3 * joints];
        curve.derivatives(at[i], d);
        for (int j = 0; j < joints; ++j) {
            bend[i].first[j] = d[j];
            bend[i].second[j] = d[joints + j];
            if (!(abs(d[j]) < infinity && abs(d[joints + j]) < infinity)) return infinity;
        }
        cap[i] = detail::velocity_cap(bend[i], bounds);
    }
    for (std::size_t i = n; i-- > 0;)
        reach[i] =
            detail::leading_on(bend[i], bounds, i == 0 ? 0.0 : cap[i], reach[i + 1], at[i + 1] - at[i]);
    double sum = 0, y = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const double step = at[i + 1] - at[i], most = detail::pull(bend[i], bounds, y).most;
        const double next = max(0.0, min(reach[i + 1], y + 2 * step * most));
        sum += 2 * step / (std::sqrt(y) + std::sqrt(next));
        y = next;
    }
    return sum;
}

}  // namespace armangle

#include "../names/end.hpp"
