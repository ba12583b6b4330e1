// Bounds on a step: no joint exceeds its velocity or its acceleration.
//
// One step may reach a box around the present joints. The psi whose joints stay in the box are feasible arcs
// again, of an arm with the box as limits. They come from the closed form of feasible.hpp without a search
// along psi. The chosen psi is checked once more by its joints.
#pragma once

#include "../limits/feasible.hpp"
#include "resolution.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Velocities are difference quotients, (q - q_now) / dt. An acceleration is the change of velocity between
/// steps, over dt.
struct Bounds {
    double dt;                    // s, > 0
    double velocity[joints];      // rad/s; infinite: unbounded
    double acceleration[joints];  // rad/s^2; infinite: unbounded
    double velocity_now[joints];  // rad/s, of the previous step
};

/// Bounds without effect: only the largest step limits the joints.
inline constexpr Bounds no_bounds{1.0,
                                  {infinity, infinity, infinity, infinity, infinity, infinity, infinity},
                                  {infinity, infinity, infinity, infinity, infinity, infinity, infinity},
                                  {}};

/// Joint displacements (rad), from lower to upper.
struct MoveBox {
    double lower[joints], upper[joints];
};

namespace detail {

/// The longest move (rad) towards a limit `room` rad away after which a joint can still stop before it, if
/// each later move may be shorter by `change` (rad): the largest m with m + (m - change) + (m - 2 change) +
/// ... <= room.
inline double longest_move(double room, double change) noexcept {
    if (!(room < infinity) || !(change < infinity) || !(room > 0)) return room;
    const double n = std::floor(0.5 * (std::sqrt(1.0 + 8.0 * (room / change)) - 1.0));
    return (room + change * (0.5 * n * (n + 1.0))) / (n + 1.0);
}

/// Which bounds a box respects. limits: those of joints with a range below 2 pi; turns: those of all other
/// joints.
struct Kept {
    bool velocity = true, largest_step = true, acceleration = true, limits = true, turns = true;
};

/// Computes the range of displacements (rad) from q_now that the bounds named by `kept` permit and after
/// which each joint can still brake before its limit; slightly narrowed against rounding. lower > upper for a
/// joint without any.
inline MoveBox move_box(const Arm& arm, const Bounds& b, const double* q_now, double largest_step,
                        Kept kept) noexcept {
    MoveBox box;
    for (int i = 0; i < joints; ++i) {
        const double fastest = kept.velocity ? b.velocity[i] * b.dt : infinity;
        const double most = min(fastest, kept.largest_step ? largest_step : infinity) - tolerance::bound;
        double lower = -most, upper = most;
        const bool ends = arm.limits.upper[i] - arm.limits.lower[i] < two_pi ? kept.limits : kept.turns;
        if (kept.acceleration && b.acceleration[i] < infinity) {
            const double change = b.acceleration[i] * b.dt * b.dt, same = b.velocity_now[i] * b.dt;
            lower = max(lower, same - change + tolerance::bound);
            upper = min(upper, same + change - tolerance::bound);
            if (ends) lower = max(lower, -longest_move(q_now[i] - arm.limits.lower[i], change));
            if (ends) upper = min(upper, longest_move(arm.limits.upper[i] - q_now[i], change));
        }
        box.lower[i] = ends ? max(lower, arm.limits.lower[i] - q_now[i]) : lower;
        box.upper[i] = ends ? min(upper, arm.limits.upper[i] - q_now[i]) : upper;
    }
    return box;
}

/// Writes the arcs of psi on which all joints stay in a box around `from`, regardless of the arm's limits;
/// joint 7 is disregarded if the roll is free. Empty if a range of the box is.
inline void window(const Arm& arm, const SelfMotion<double>& m, const JointFunctions<double>& f,
                   const double* from, const MoveBox& box, ArcSet& out) noexcept {
    Limits narrow;
    for (int i = 0; i < joints; ++i) {
        if (!(box.lower[i] <= box.upper[i])) return make_empty(out);
        narrow.lower[i] = from[i] + box.lower[i];
        narrow.upper[i] = from[i] + box.upper[i];
    }
    if (arm.roll_free) {  // joint 7 is independent of the pose
        narrow.lower[joints - 1] = -infinity;
        narrow.upper[joints - 1] = infinity;
    }
    feasible(m, f, limit_table(arm, narrow), out);
}

/// Whether the step from q_now to q (rad) respects limits, bounds and the largest step (rad), and leaves
/// every joint with bounded acceleration room to brake before its limits.
inline bool keeps(const Arm& arm, const Bounds& b, const double* q_now, const double* q,
                  double largest_step) noexcept {
    for (int i = 0; i < joints; ++i) {
        const double move = q[i] - q_now[i], speed = move / b.dt;
        if (!(q[i] >= arm.limits.lower[i] - tolerance::angle &&
              q[i] <= arm.limits.upper[i] + tolerance::angle))
            return false;
        if (!(abs(move) <= largest_step && abs(speed) <= b.velocity[i])) return false;
        if (!(b.acceleration[i] < infinity)) continue;
        if (!(abs(speed - b.velocity_now[i]) <= b.acceleration[i] * b.dt)) return false;
        const double change = b.acceleration[i] * b.dt * b.dt;
        if (!(move <= longest_move(arm.limits.upper[i] - q_now[i], change) + tolerance::angle)) return false;
        if (!(-move <= longest_move(q_now[i] - arm.limits.lower[i], change) + tolerance::angle)) return false;
    }
    return true;
}

/// The psi of the set nearest to `wish` for which keeps(psi) holds; NaN if there is none. keeps() is expected
/// to fail only by rounding near the ends; a few psi further inside replace an end that fails.
template <class Keeps>
double nearest_kept(const ArcSet& set, double wish, const Keeps& keeps) noexcept {
    static constexpr double inside[] = {0, 1e-6, 1e-3, 0.1, 0.5};  // shares of the distance to the middle
    double best = infinity, found = not_a_number;
    for (int i = 0; i < set.count; ++i) {
        const Arc& arc = set.arc[i];
        const double middle = 0.5 * (arc.lower + arc.upper), lifted = lift(wish, middle);
        const double at = set.full ? lifted : min(max(lifted, arc.lower), arc.upper);
        for (double share : inside) {
            const double psi = wrap(at + share * (middle - at));
            if (abs(wrap(psi - wish)) >= best) break;
            if (keeps(psi)) {
                best = abs(wrap(psi - wish));
                found = psi;
            }
        }
    }
    return found;
}

/// The displacement (rad) of joint i (0..6) if it brakes as hard as the bounds allow, but not beyond its
/// limit.
inline double braked(const Arm& arm, const Bounds& b, const double* q_now, int i) noexcept {
    const double v = b.velocity_now[i], slower = abs(v) - b.acceleration[i] * b.dt;
    const double move = slower > 0 ? copysign(slower * b.dt, v) : 0.0;
    const double room = v > 0 ? arm.limits.upper[i] - q_now[i] : arm.limits.lower[i] - q_now[i];
    return v > 0 ? min(move, max(room, 0.0)) : max(move, min(room, 0.0));
}

/// Splits the total rotation of two joints around one axis equally between them in q, as far as a box of
/// moves from q_now permits. They are the neighbours of joint 2 or 6 (h: index 1 or 5), whose theta is 0 (or
/// pi: flipped). With a free roll, joints 5 and 7 share nothing.
inline void share_turn(const Arm& arm, int h, bool flipped, const double* q_now, const MoveBox& box,
                       Joints& q) noexcept {
    const int a = h - 1, b = h + 1;
    const double eps = arm.sign[a] * arm.sign[b] * (flipped ? -1.0 : 1.0);
    const bool nothing = arm.roll_free && b == joints - 1;
    const double wanted = nothing ? 0.0 : wrap((q.q[b] - q_now[b]) + eps * (q.q[a] - q_now[a]));
    const double from = max(min(eps * box.lower[a], eps * box.upper[a]), wanted - box.upper[b]),
                 to = min(max(eps * box.lower[a], eps * box.upper[a]), wanted - box.lower[b]);
    const double half = min(max(0.5 * wanted, from), to);
    q.q[a] = q_now[a] + eps * half;
    q.q[b] = q_now[b] + (wanted - half);
}

/// Computes the joints q after one cycle with velocities k d (k in 1/s, d in rad), all scaled down to the
/// largest step, then each clamped to its bounds. A joint without a permitted move brakes.
inline void go(const Arm& arm, const Bounds& b, const double* q_now, double max_joint_step,
               const double (&d)[joints], double k, double* q) noexcept {
    double share = k * b.dt;
    for (int j = 0; j < joints; ++j) share = min(share, max_joint_step / abs(d[j]));
    const MoveBox box = move_box(arm, b, q_now, max_joint_step, {});
    for (int j = 0; j < joints; ++j) {
        const bool open = box.lower[j] <= box.upper[j];
        q[j] =
            q_now[j] + (open ? min(max(share * d[j], box.lower[j]), box.upper[j]) : braked(arm, b, q_now, j));
    }
}

}  // namespace detail

/// One step under bounds: its start q_now, and the self-motion of its target.
struct BoundedStep {
    const Arm& arm;
    const SelfMotion<double>& motion;
    const JointFunctions<double>& functions;
    const double* q_now;
    const Bounds& bounds;
    double largest_step;

    /// Writes the part of `arcs` that the step can reach within the bounds named by `kept`.
    void within(const ArcSet& arcs, detail::Kept kept, ArcSet& out) const noexcept {
        ArcSet here;
        detail::window(arm, motion, functions, q_now,
                       detail::move_box(arm, bounds, q_now, largest_step, kept), here);
        intersect(here, arcs, out);
    }

    /// The joints at psi, in the revolutions nearest to q_now. Two joints that rotate around one axis share
    /// their total rotation equally, as far as the bounds allow.
    Joints at(double psi) const noexcept {
        const Directions<double> d = directions(motion, sin_cos(psi));
        Joints q = joints_near(arm, d, q_now);
        for (const int h : hinge_joint)
            if (abs(d.y[h]) <= tolerance::one_axis)
                detail::share_turn(arm, h, d.x[h] < 0, q_now,
                                   detail::move_box(arm, bounds, q_now, largest_step, {}), q);
        return q;
    }

    /// Whether the joints at psi respect the bounds.
    bool keeps(double psi) const noexcept {
        return detail::keeps(arm, bounds, q_now, at(psi).q, largest_step);
    }

    /// The psi of the set nearest to `wish` that respects the bounds; NaN if there is none.
    double nearest(const ArcSet& set, double wish) const noexcept {
        return detail::nearest_kept(set, wish, [this](double psi) { return keeps(psi); });
    }

    /// Whether a step within the bounds reaches any of these arcs.
    bool leads_to(const ArcSet& arcs) const noexcept {
        ArcSet left;
        within(arcs, {}, left);
        return !left.empty();
    }

    /// The reason why no step within the bounds reaches `arcs`, a part of the feasible arcs `own`:
    /// NOT_ALLOWED if one reaches `own`; otherwise the first condition whose removal permits a step, of
    /// accelerations, velocities, revolutions, limits and the largest step.
    Status refusal(const ArcSet& own, const ArcSet& arcs) const noexcept {
        ArcSet whole;
        make_full(whole);
        const auto leads = [&](const ArcSet& to, detail::Kept kept) {
            ArcSet left;
            within(to, kept, left);
            return !left.empty();
        };
        if (leads_to(own)) return Status::NOT_ALLOWED;
        if (leads(arcs, {.acceleration = false})) return Status::ACCELERATION_LIMIT;
        if (leads(arcs, {.velocity = false, .acceleration = false})) return Status::VELOCITY_LIMIT;
        if (leads(whole, {.turns = false})) return Status::WINDING_EXHAUSTED;
        if (leads(whole, {.limits = false, .turns = false})) return Status::LIMITS;
        return leads(arcs, {.largest_step = false, .acceleration = false}) ? Status::JOINT_JUMP
                                                                           : Status::VELOCITY_LIMIT;
    }
};

}  // namespace armangle

#include "../names/end.hpp"
