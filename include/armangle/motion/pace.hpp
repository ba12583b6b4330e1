// One step towards a configuration, such that every joint can come to rest there.
//
//    speed |      ____________
//          |     /            \        no faster than v^2 = 2 a s, a being a share of the acceleration, and
//          |    /              \__     geometrically at the end, so that steps do not overshoot
//          +---------------------------- way
//
// All joints move on one straight line: one of them moves as fast as it may.
#pragma once

#include "../arm/limits.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of one step towards a configuration.
struct PaceTuning {
    static constexpr double braking = 0.6;  // share of the acceleration that an approach assumes
    static constexpr double ticks = 3.0;  // an approach ends no faster than geometrically over so many steps
};

/// The factor k (1/s) of a velocity k d towards a goal d rad away, such that every joint can still stop
/// there. Bounds in rad/s and rad/s^2, infinite if unbounded. Without acceleration bounds k may be 1 / dt.
inline double pace(const double (&d)[joints], double dt, const double* velocity,
                   const double* acceleration) noexcept {
    double k = 1.0 / dt;
    for (int j = 0; j < joints; ++j) {
        const double way = abs(d[j]);
        if (!(way > 0)) continue;
        k = min(k, velocity[j] / way);
        if (!(acceleration[j] < infinity)) continue;
        k = min(k, 1.0 / (PaceTuning::ticks * dt));
        k = min(k, sqrt(2.0 * PaceTuning::braking * acceleration[j] / way));
    }
    return k;
}

}  // namespace armangle

#include "../names/end.hpp"
