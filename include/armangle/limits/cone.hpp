// The cone of a joint's limits: the directions within its range of theta.
#pragma once

#include "../arm/joint_map.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The directions from angle `lower` to `upper` (rad), which the limits of a joint permit.
struct Cone {
    bool free, wide;  // a full turn or more; more than half a turn
    bool straight;    // half a turn: both limits have the same boundary function
    SinCos<double> lower, upper, middle;

    /// Whether a unit direction (sine and cosine of an angle) lies in the cone or within `slack` (rad) of it.
    bool contains(const SinCos<double>& at, double slack = tolerance::angle) const noexcept {
        const double above = at.sin * lower.cos - at.cos * lower.sin,
                     below = upper.sin * at.cos - upper.cos * at.sin;
        const bool behind_lower = above >= -slack, before_upper = below >= -slack;
        if (wide) return free | behind_lower | before_upper;
        const double ahead = at.cos * middle.cos + at.sin * middle.sin;
        return free | (behind_lower & before_upper & (ahead >= -slack));
    }
};

/// Computes the cone of a range of theta.
inline Cone cone(const ThetaRange& range) noexcept {
    const double lower = range.lower, upper = range.upper;
    Cone out{};
    out.free = !(upper - lower < two_pi);
    out.wide = !out.free && upper - lower > pi;
    out.straight = !out.free && abs(upper - lower - pi) <= tolerance::angle;
    if (out.free) return out;
    out.lower = sin_cos(lower);
    out.upper = sin_cos(upper);
    out.middle = sin_cos(0.5 * (lower + upper));
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
