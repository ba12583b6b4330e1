// Bounded jerk: the motions of a joint in one control cycle after which it can still stop before every bound.
//
// Velocity, acceleration and jerk are those of the commanded rows: v' = (q' - q) / dt, a' = (v' - v) / dt, j'
// = (a' - a) / dt. A state (q, v, a) of a joint is safe if its quickest stop, in continuous time, respects
// all bounds:
//
//     K:  |a| <= A,   |v + a |a| / 2J| <= V if a and v have one sign (else |v| <= V),
//         q + way(v, a) <= upper limit,   q - way(-v, -a) >= lower limit,
//
//     acceleration |\                    way(v, a) = W(w) + w a / J - a^3 / 6J^2,  w = v + a^2 / 2J,
//                a |  \                  W(w) = w sqrt(w / J)             if w <= A^2 / J,
//     -------------|----\---------/----         (w / A + A / J) w / 2     else:
//               -A |     \_______/       jerk -J, then none at -A, then +J to rest; w is the speed at a = 0.
//
// A joint that brakes harder than needed for rest at v = 0, v < a^2 / 2J, swings back. It counts as one that
// just comes to rest, way = (2 J v)^1.5 / 6J^2.
//
// Every cycle has a move that stays in K, whatever its length dt and all earlier dt:
// 1. K is convex. It is an intersection of sets "states from which some motion respects a convex constraint
//    indefinitely", and the mean of two such motions respects it too. (The constraint of a limit is v <= the
//    speed from which the last ramp of a stop, or constant braking before it, ends at the limit: a concave
//    function of the room.)
// 2. The quickest stop s -> (q, v, a)(s) stays in K: w and the place of rest are constant along it.
// 3. The mean of its states with the weights exp(-s / dt) / dt is in K by 1 and 2. By parts, the mean state
//    (q', v', a') obeys q' = q + v' dt, v' = v + a' dt, a' = a + j' dt with j' the mean of the jerks. So it
//    is a commanded row that respects the jerk bound.
// All bounds grow with v', so the moves that stay in K are an interval, found from its two ends.
#pragma once

#include <cmath>

#include "../numbers/scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The bounds of a joint: rad/s, rad/s^2 and rad/s^3; infinite: unbounded.
struct JerkBounds {
    double velocity, acceleration, jerk;

    /// Whether the jerk is bounded.
    bool has_jerk() const noexcept { return jerk < infinity; }
};

/// The bounds of a joint, with the acceleration reduced to sqrt(2 J V), which no motion from rest within
/// velocity V exceeds.
inline JerkBounds jerk_bounds(double velocity, double acceleration, double jerk) noexcept {
    return {velocity, jerk < infinity ? min(acceleration, sqrt(2.0 * jerk * velocity)) : acceleration, jerk};
}

namespace detail {

/// The stopping distance (rad) of a joint with velocity v and acceleration a, and its derivatives with
/// respect to both.
struct StoppingWay {
    double way = 0, per_v = 0, per_a = 0;
};

/// How far (rad) a joint with velocity v and acceleration a still moves in the positive direction until it
/// can be at rest within the bounds, with the derivatives; 0 if it does not move that way.
inline StoppingWay stopping(const JerkBounds& b, double v, double a) noexcept {
    StoppingWay out;
    const double J = b.jerk, A = b.acceleration;
    if (v >= 0 && a < 0 && 2.0 * J * v <= a * a) {
        const double u = sqrt(2.0 * v / J);
        out.way = J * u * u * u / 6.0;
        out.per_v = 0.5 * u;
        return out;
    }
    const double s = a / J, w = v + 0.5 * a * s;
    if (!(w > 0) || (v < 0 && a <= 0)) return out;
    double whole, per_w;
    if (w * J <= A * A) {
        const double u = sqrt(w / J);
        whole = w * u;
        per_w = 1.5 * u;
    } else {
        whole = 0.5 * w * (w / A + A / J);
        per_w = w / A + 0.5 * A / J;
    }
    out.way = whole + s * (w - a * s / 6.0);
    out.per_v = per_w + s;
    out.per_a = s * per_w + w / J + 0.5 * s * s;
    return out.way > 0 ? out : StoppingWay{};
}

/// The largest next acceleration (rad/s^2) with which a joint of bounded jerk (rad/s^3) gains the velocity
/// `left` (rad/s) without overshoot; 0 if `left` is not positive.
inline double easing(double left, double jerk, double dt) noexcept {
    return left > 0 ? 2.0 * left / (dt + sqrt(dt * dt + 2.0 * left / jerk)) : 0.0;
}

}  // namespace detail

/// The largest next velocity from which a joint can still reach its velocity bound without overshoot;
/// infinite without such a bound.
inline double fastest_easing(const JerkBounds& b, double v, double dt) noexcept {
    return b.velocity < infinity ? v + detail::easing(b.velocity - v, b.jerk, dt) * dt : infinity;
}

/// The largest next velocity in [least, most] from which a joint can stop within `room` (rad) of its present
/// value; `least` if there is none. The stopping distance is convex in the velocity, so Newton steps stay
/// above the root and chords below it.
inline double fastest_stopping(const JerkBounds& b, double v, double room, double dt, double least,
                               double most) noexcept {
    if (!(room < infinity)) return most;
    const auto over = [&](double x, double& slope) {
        const detail::StoppingWay w = detail::stopping(b, x, (x - v) / dt);
        slope = w.per_v + w.per_a / dt + dt;
        return w.way + x * dt - room;
    };
    double slope, high = most, too_far = over(high, slope);
    if (!(too_far > 0)) return most;
    double none, low = least, short_of = over(low, none);
    if (!(short_of < 0)) return least;
    for (int round = 0; round < 30 && high - low > 1e-15 * max(abs(high), abs(low)); ++round) {
        const double chord = low - short_of * (high - low) / (too_far - short_of);
        const double tries[] = {high - too_far / slope, chord};
        for (const double x : tries) {
            if (!(x > low && x < high)) continue;
            double here;
            const double f = over(x, here);
            if (f > 0) {
                high = x;
                too_far = f;
                slope = here;
            } else {
                low = x;
                short_of = f;
            }
        }
    }
    return low;
}

// Near obstacles all joints must stop along one known path. They follow v'' = -2 r v' - r^2 v with one rate r
// (1/s). The rows of such cycles lie in the triangle q, q + x v, q + x v + y (v + a / r), for every dt. These
// are the means of 3 above, for straight lines.

/// Whether a joint that stops at a rate (1/s) from v and a respects its bounds until it rests. |v|, |a| and
/// |j| have their maxima now, or where (v + b s) exp(-r s), b = a + r v, and its derivatives have theirs.
inline bool stops_at(const JerkBounds& b, double v, double a, double rate) noexcept {
    const double mixed = a + rate * v, share = a / mixed, size = abs(mixed);
    if (!(abs(a) <= b.acceleration && rate * abs(a + mixed) <= b.jerk)) return false;
    if (!(size > 0)) return true;
    const auto peak = [&](double after) { return after > 0 ? size * std::exp(-after) : 0.0; };
    return peak(share) <= rate * b.velocity && peak(1.0 + share) <= b.acceleration &&
           rate * peak(2.0 + share) <= b.jerk;
}

/// The velocity (rad/s) after the next cycle of a joint that stops at a rate (1/s).
inline double stopping_velocity(double v, double a, double rate, double dt) noexcept {
    const double lag = 1.0 + rate * dt;
    return v + (a - rate * rate * dt * v) / (lag * lag) * dt;
}

}  // namespace armangle

#include "../names/end.hpp"
