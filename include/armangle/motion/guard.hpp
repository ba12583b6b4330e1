// Moves that stay collision-free in every case: from every state the arm can brake along a straight line in
// joint space that is proven collision-free.
//
//   q ----------o- - - - - - - - x      v dt, and v T / 2 of braking, T = max |v_j| / a_j: one straight move
//      this cycle   braking             d = v (dt + T / 2), proven by straight_move.hpp and within the limits
//
// A velocity is permitted if its move is proven. If none is, the previous velocity is scaled to v (1 - dt /
// T). Its move lies on the line that was proven for that velocity, however long this cycle is. A proof
// therefore remains valid indefinitely, and nothing needs to be predicted.
//
// With bounds on jerk the joints cannot change direction at once. All joints then brake at one rate
// (jerk.hpp), and their paths lie in a triangle. The guard proves the straight move to its end, plus the
// width of the triangle.
//
// Near obstacles the least squares of a cycle respect constraints (NearPair): room' >= -room / tau.
#pragma once

#include "../arm/joint_quadratic.hpp"
#include "../scene/straight_move.hpp"
#include "jerk.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of moves that stay free of collisions.
struct GuardTuning {
    static constexpr double standoff = 1e-4;  // m beyond the clearance at which an approach ends
    static constexpr double look = 0.03;      // m within which pairs are constrained at rest; more with speed
    static constexpr double farthest = 0.3;   // m: upper bound of that distance
    static constexpr double ticks = 3.0;  // an approach ends no faster than geometrically over so many cycles
    static constexpr double retreat = 0.05;  // m/s at which a pair that is too near separates
    static constexpr double weight =
        1e5;                          // cost of a violation of 1 (m/s)^2, as a share of the greatest of H
    static constexpr int rounds = 8;  // rounds of the least squares that add and drop pairs
    static constexpr int tries = 5;   // number of velocities tried between the requested one and braking
    static constexpr double cautious = 0.9;  // share of the proven part that is tried next
    static constexpr double finer = 0.8;     // factor from one stopping rate to the next one tried ...
    static constexpr int rates = 40;         // ... up to so many
};

/// Keeps a control cycle, and braking after it, collision-free in a scene.
class Guard {
public:
    /// Sets the state at the start of a cycle of dt (s), joints q, velocities v and accelerations a, which
    /// must stay valid during it, and the `limits` that braking must respect. If jerk is bounded, `rate`
    /// (1/s) is the rate at which the joints can stop.
    void begin(const double* q, const double* v, const double* a, double dt, const Limits& limits,
               double rate) noexcept {
        q_ = q;
        before_ = v;
        changing_ = a;
        rate_ = next_rate_ = rate;
        dt_ = dt;
        limits_ = limits;
        blocking_ = 0;
        const double stop = bounds_ ? 4.0 / rate : braking(v);
        double sum = 0;
        for (int j = 0; j < joints; ++j) sum += abs(v[j]);
        lasting_ = max(dt + 0.5 * (stop + dt), GuardTuning::ticks * dt);
        const double reach = min(GuardTuning::look + 0.5 * size_ * sum * lasting_, GuardTuning::farthest);
        count_ = near(q, reach, near_);
    }

    /// The rate (1/s) at which the joints can stop after the cycle.
    double rate() const noexcept { return next_rate_; }

    /// Whether the arm may move with velocities v (rad/s) for one cycle, because braking afterwards is proven
    /// collision-free and within the limits.
    bool allows(const double (&v)[joints]) noexcept { return !(share(v) < 1.0); }

    /// Reduces the requested velocities v (rad/s) towards braking until they are proven; plain braking if no
    /// tried part is. Returns whether v is unchanged.
    bool restrain(double (&v)[joints]) noexcept {
        double braked[joints], wished[joints], part = 1.0;
        const double stop = bounds_ ? 0.0 : braking(before_), slower = stop > dt_ ? 1.0 - dt_ / stop : 0.0;
        for (int j = 0; j < joints; ++j) {
            braked[j] =
                bounds_ ? stopping_velocity(before_[j], changing_[j], rate_, dt_) : before_[j] * slower;
            wished[j] = v[j];
        }
        for (int trial = 0; trial < GuardTuning::tries; ++trial) {
            for (int j = 0; j < joints; ++j) v[j] = braked[j] + part * (wished[j] - braked[j]);
            const double free = share(v);
            if (!(free < 1.0)) return trial == 0;
            part *= trial + 2 < GuardTuning::tries ? max(min(GuardTuning::cautious * free, 0.5), 0.1) : 0.02;
        }
        for (int j = 0; j < joints; ++j) v[j] = braked[j];
        next_rate_ = rate_;
        return false;
    }

    /// Minimizes a quadratic cost of the velocities v (rad/s) between `least` and `greatest`, so that near
    /// pairs do not approach too fast and all joints can brake within their limits; starts from v.
    void minimise(const JointQuadratic& p, const double* least, const double* greatest,
                  double (&v)[joints]) noexcept {
        double lower[joints], upper[joints];
        narrow(least, greatest, lower, upper);
        armangle::minimise(p, lower, upper, v);
        double most = 0, pressed = 0;
        for (int j = 0; j < joints; ++j) most = max(most, p.H[j][j]);
        bool is_watched[StraightMoveTuning::most_near]{};
        for (int round = 0; round < GuardTuning::rounds; ++round) {
            JointQuadratic with = p;
            bool changed = false;
            pressed = 0;
            for (int i = 0; i < count_; ++i) {
                const NearPair& pair = near_[i];
                const double slowest =
                    -max((pair.room - GuardTuning::standoff) / lasting_, -GuardTuning::retreat);
                double now = 0;
                for (int j = 0; j < joints; ++j) now += pair.rate[j] * v[j];
                changed |= is_watched[i] != (now < slowest);
                is_watched[i] = now < slowest;
                if (!is_watched[i]) continue;
                if (slowest - now > pressed) blocking_ = pair.pair;
                pressed = max(pressed, slowest - now);
                for (int j = 0; j < joints; ++j) {
                    with.g[j] += GuardTuning::weight * most * slowest * pair.rate[j];
                    for (int k = 0; k < joints; ++k)
                        with.H[j][k] += GuardTuning::weight * most * pair.rate[j] * pair.rate[k];
                }
            }
            if (!changed) return;
            armangle::minimise(with, lower, upper, v);
        }
    }

    /// Whether the straight joint motion between two configurations is proven collision-free; if not, `pair`
    /// is the blocking pair.
    bool clear(const double* from, const double* to, Tag& pair) noexcept {
        double d[joints];
        for (int j = 0; j < joints; ++j) d[j] = to[j] - from[j];
        return !(proven(from, d, pair, StraightMoveTuning::many_looks, nullptr) < 1.0);
    }

    /// The nearest pair at joints q within the look-ahead distance of the clearance; 0 if there is none.
    Tag nearest_at(const double* q) noexcept { return nearest_pair(q, GuardTuning::look).pair; }

    /// The pair that blocked this cycle; 0 if none did.
    Tag blocking() const noexcept { return blocking_; }

protected:
    /// `size` (m) is that of the arm; `acceleration` (rad/s^2) are the largest of the joints; `bounds` are
    /// all their bounds if jerk is bounded, otherwise null. Both must outlive the guard.
    Guard(double size, const double* acceleration, const JerkBounds* bounds) noexcept
        : size_(size), acceleration_(acceleration), bounds_(bounds) {}
    ~Guard() = default;

private:
    /// Finds the pairs at joints q within `reach` (m) of the clearance; returns their number.
    virtual int near(const double* q, double reach,
                     NearPair (&pairs)[StraightMoveTuning::most_near]) noexcept = 0;
    /// The nearest pair at joints q within `reach` (m) of the clearance; its `pair` is 0 if there is none.
    virtual NearestPair nearest_pair(const double* q, double reach) noexcept = 0;
    /// The share of the motion d (rad) from q that is proven collision-free; see StraightMove::proven.
    virtual double proven(const double* q, const double (&d)[joints], Tag& pair, int looks,
                          const double* off) noexcept = 0;

    /// The time (s) in which all joints stop together from velocities v (rad/s).
    double braking(const double* v) const noexcept {
        double out = 0;
        for (int j = 0; j < joints; ++j)
            if (acceleration_[j] < infinity) out = max(out, abs(v[j]) / acceleration_[j]);
        return out;
    }

    /// Writes to `lower` and `upper` the part of the velocity box from `least` to `greatest` (rad/s) in which
    /// every joint stays within its limits, although all joints stop together in the time of the slowest. If
    /// one joint can only just stop before its limit, the others may brake no longer than it does.
    void narrow(const double* least, const double* greatest, double (&lower)[joints],
                double (&upper)[joints]) const noexcept {
        if (bounds_) return narrow_at_rate(least, greatest, lower, upper);
        double longest = braking(before_) + dt_, down[joints], up[joints];  // s of braking; rad to the limits
        for (int j = 0; j < joints; ++j) {
            down[j] = max(q_[j] - limits_.lower[j], 0.0);
            up[j] = max(limits_.upper[j] - q_[j], 0.0);
            if (least[j] > 0) longest = min(longest, 2.0 * (up[j] / least[j] - dt_));
            if (greatest[j] < 0) longest = min(longest, 2.0 * (down[j] / -greatest[j] - dt_));
        }
        longest = max(longest, 0.0);
        const double lasting = dt_ + 0.5 * longest;
        for (int j = 0; j < joints; ++j) {
            const double most = acceleration_[j] < infinity ? acceleration_[j] * longest : infinity;
            upper[j] = max(min(greatest[j], min(most, up[j] / lasting)), least[j]);
            lower[j] = min(max(least[j], -min(most, down[j] / lasting)), upper[j]);
        }
    }

    /// Does what narrow() does, for bounded jerk: the joints move by v dt + 2 v / r + a / r^2 if all stop at
    /// the present rate r (1/s), a = (v - before_) / dt.
    void narrow_at_rate(const double* least, const double* greatest, double (&lower)[joints],
                        double (&upper)[joints]) const noexcept {
        const double along = 1.0 / (rate_ * rate_ * dt_), lasting = dt_ + 2.0 / rate_ + along;
        for (int j = 0; j < joints; ++j) {
            const double down = max(q_[j] - limits_.lower[j], 0.0), up = max(limits_.upper[j] - q_[j], 0.0),
                         before = along * before_[j];
            upper[j] = max(min(greatest[j], (up + before) / lasting), least[j]);
            lower[j] = min(max(least[j], (before - down) / lasting), upper[j]);
        }
    }

    /// The greatest of some rates (1/s) at which all joints can stop from v (rad/s) and a (rad/s^2); 0 if
    /// there is none.
    double stopping_rate(const double (&v)[joints], const double (&a)[joints]) const noexcept {
        double rate = min(1.0 / dt_, 2.0 * rate_);
        for (int trial = 0; trial < GuardTuning::rates; ++trial, rate *= GuardTuning::finer) {
            bool all = true;
            for (int j = 0; j < joints && all; ++j) all = stops_at(bounds_[j], v[j], a[j], rate);
            if (all) return rate;
        }
        return 0;
    }

    /// Whether a move (rad) of joint j (0..6) stays within its limits, or does not leave them farther.
    bool is_within(int j, double move) const noexcept {
        const double least = min(limits_.lower[j], q_[j]), most = max(limits_.upper[j], q_[j]);
        return q_[j] + move >= least - tolerance::bound && q_[j] + move <= most + tolerance::bound;
    }

    /// The proven share of one cycle with velocities v (rad/s) and a stop at one common rate; 0.5 if no rate
    /// or limit permits it. If all is proven, the rate becomes that of the next cycle.
    double share_at_rate(const double (&v)[joints]) noexcept {
        double a[joints], d[joints], corner[joints], off[joints], along = 0, square = 0;
        for (int j = 0; j < joints; ++j) a[j] = (v[j] - before_[j]) / dt_;
        const double rate = stopping_rate(v, a);
        if (!(rate > 0)) return 0.5;
        for (int j = 0; j < joints; ++j) {
            corner[j] = v[j] * (dt_ + 1.0 / rate);
            d[j] = v[j] * (dt_ + 2.0 / rate) + a[j] / (rate * rate);
            if (!is_within(j, corner[j]) || !is_within(j, d[j])) return 0.5;
            along += corner[j] * d[j];
            square += d[j] * d[j];
        }
        const double part = square > 0 ? min(max(along / square, 0.0), 1.0) : 0.0;
        for (int j = 0; j < joints; ++j) off[j] = abs(corner[j] - part * d[j]);
        const double out = proven(q_, d, blocking_, StraightMoveTuning::looks, off);
        if (!(out < 1.0)) next_rate_ = rate;
        return out;
    }

    /// The share of the motion, one cycle with velocities v (rad/s) followed by braking, that is proven
    /// collision-free; 0.5 if a joint would leave its limits.
    double share(const double (&v)[joints]) noexcept {
        if (bounds_) return share_at_rate(v);
        const double lasting = dt_ + 0.5 * braking(v);
        double d[joints];
        for (int j = 0; j < joints; ++j) {
            d[j] = v[j] * lasting;
            if (!is_within(j, d[j])) return 0.5;
        }
        return proven(q_, d, blocking_, StraightMoveTuning::looks, nullptr);
    }

    double size_;
    const double* acceleration_;
    const JerkBounds* bounds_;
    const double *q_ = nullptr, *before_ = nullptr, *changing_ = nullptr;
    double rate_ = 0, next_rate_ = 0;  // 1/s
    double dt_ = 0, lasting_ = 0;      // s
    Limits limits_{};
    NearPair near_[StraightMoveTuning::most_near];
    int count_ = 0;
    Tag blocking_ = 0;
};

/// The guard of an Arm, a ChainArm or another kind of arm.
template <class AnyArm>
class GuardOf final : public Guard {
public:
    /// A guard of an arm in a scene, both of which must outlive it, with the accelerations (rad/s^2) and jerk
    /// bounds (null: none) of its joints.
    GuardOf(const AnyArm& arm, const Scene& scene, const double* acceleration,
            const JerkBounds* bounds) noexcept
        : Guard(nominal(arm).size, acceleration, bounds), move_(arm, scene) {}

private:
    /// See Guard::near.
    int near(const double* q, double reach,
             NearPair (&pairs)[StraightMoveTuning::most_near]) noexcept override {
        return move_.near(q, reach, pairs);
    }
    /// See Guard::nearest_pair.
    NearestPair nearest_pair(const double* q, double reach) noexcept override {
        return move_.nearest_pair(q, reach);
    }
    /// See Guard::proven.
    double proven(const double* q, const double (&d)[joints], Tag& pair, int looks,
                  const double* off) noexcept override {
        return move_.proven(q, d, pair, looks, off);
    }

    StraightMove<AnyArm> move_;
};

}  // namespace armangle

#include "../names/end.hpp"
