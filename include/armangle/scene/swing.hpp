// How a rod of a link moves with psi: at rest, turned about the line shoulder-wrist, swung about a joint's
// axis, or both.
//
//      link   1              2                 3, 4        5                  6             0, 7
//      turns  no             by psi            by psi      by psi             no            no
//      swings by theta_1     by -theta_3       no          by theta_5         by -theta_7   no
//             about axis 1   about axis 3                  about axis 5       about axis 7
//
// Links 1 and 2 follow from both sides of axis 2, links 5 and 6 from both sides of axis 6, so that theta_2
// and theta_6 are not needed. A joint's direction is (V, U), eq. (26), and theta' = N / D, eq. (28), with
// D = U^2 + V^2: over a stretch both are within what their own first two derivatives allow.
#pragma once

#include "../circle/joint_function.hpp"
#include "blocked_arc.hpp"
#include "scene.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Bounds for any point of a rod over a stretch of psi: speed (m / rad), acceleration (m / rad^2), and
/// distance (m) from its place at the nearer end of the stretch.
struct Drift {
    double speed, acceleration, shift;
};

namespace detail {

/// What a bound is enlarged by, for its own rounding.
inline constexpr double above_rounding = 1.0 + 1e-9;

/// The angle of one joint as a function of psi.
class Swing {
public:
    Swing() noexcept = default;

    /// `sense` is -1 if the rod belongs to the link before the joint; then it swings against the joint's
    /// angle.
    Swing(const Pivot<double>& pivot, double sense) noexcept
        : pivot_(pivot), sense_(sense), N_(slope_numerator(pivot)) {
        const auto bend = [](const Harmonic<double>& f) {
            const double swing = hypot(f.s, f.c);
            return 2.0 * swing * (2.0 * swing + abs(f.k));
        };
        bend_ = bend(pivot.U) + bend(pivot.V);
        wave_ = hypot(N_.s, N_.c);
    }

    /// Sine and cosine of the angle at psi.
    SinCos<double> at(const SinCos<double>& psi) const noexcept {
        const double y = pivot_.g * pivot_.U.at(psi), x = pivot_.g * pivot_.V.at(psi), size = hypot(x, y);
        if (size == 0) return {0.0, 1.0};
        return {sense_ * y / size, x / size};
    }

    /// The derivative of the angle with respect to psi.
    double rate(const SinCos<double>& psi) const noexcept { return sense_ * derivative(pivot_, psi); }

    struct Rates {
        double speed, acceleration;  // |theta'|, |theta''| at most
    };

    /// Bounds of both derivatives within `half` rad on both sides of psi; infinite if the joint's direction
    /// vector may vanish there.
    Rates over(const SinCos<double>& psi, double half) const noexcept {
        const double u = pivot_.U.at(psi), v = pivot_.V.at(psi);
        const double slope = 2.0 * abs(u * pivot_.U.slope(psi) + v * pivot_.V.slope(psi));
        const double least = u * u + v * v - (slope + 0.5 * bend_ * half) * half * above_rounding;
        if (!(least > 0)) return {infinity, infinity};
        const double rise = abs(N_.slope(psi)) + wave_ * half;
        const double most = abs(N_.at(psi)) + rise * half;
        const double speed = most / least;
        return {speed, (rise + speed * (slope + bend_ * half)) / least};
    }

private:
    Pivot<double> pivot_;
    double sense_;
    Harmonic<double> N_;
    double bend_, wave_;  // |D''| at most, |N''| at most
};

/// The motion of a rod with psi, in the frame of the axis shoulder-wrist.
class MovingRod {
public:
    MovingRod() noexcept = default;

    /// A rod of links 3 and 4, which rotates by psi (`turns`), or of links 0 and 7, which rests.
    MovingRod(const Rod& rod, bool turns) noexcept
        : foot_{rod.begin, rod.end},
          centre_((rod.begin + rod.end) * 0.5),
          radius_(rod.radius),
          bound_(0.5 * norm(rod.end - rod.begin)),
          off_joint_(0.0),
          off_line_(max(off_axis(rod.begin), off_axis(rod.end))),
          turns_(turns),
          swings_(false),
          sphere_(rod.is_sphere()) {}

    /// A rod of links 1, 2, 5 and 6, given at theta = psi = 0, that swings around the line through `point`
    /// along `axis`.
    MovingRod(const Rod& rod, bool turns, const Swing& swing, const Vec3<double>& point,
              const Vec3<double>& axis) noexcept
        : swing_(swing),
          point_(point),
          axis_(axis),
          radius_(rod.radius),
          off_joint_(0.0),
          off_line_(0.0),
          turns_(turns),
          swings_(true),
          sphere_(rod.is_sphere()) {
        const Vec3<double> ends[2] = {rod.begin, rod.end};
        for (int k = 0; k < 2; ++k) {
            const Vec3<double> from = ends[k] - point;
            foot_[k] = point + axis * dot(axis, from);
            across_[k] = ends[k] - foot_[k];
            ahead_[k] = cross(axis, across_[k]);
            off_joint_ = max(off_joint_, norm(across_[k]));
            off_line_ = max(off_line_, off_axis(foot_[k]));
        }
        off_line_ += off_joint_;
        centre_ = (foot_[0] + foot_[1]) * 0.5;
        bound_ = max(norm(ends[0] - centre_), norm(ends[1] - centre_));
    }

    /// The rod at psi.
    Rod at(const SinCos<double>& psi) const noexcept {
        Vec3<double> begin = foot_[0], end = foot_[1];
        if (swings_) {
            const SinCos<double> theta = swing_.at(psi);
            begin = begin + combine(across_[0], theta.cos, ahead_[0], theta.sin);
            end = end + combine(across_[1], theta.cos, ahead_[1], theta.sin);
        }
        if (turns_) {
            begin = turned_by(begin, psi);
            end = turned_by(end, psi);
        }
        return {begin, sphere_ ? begin : end, radius_};
    }

    /// Bounds of the motion of any of its points within `half` rad on both sides of psi.
    Drift over(const SinCos<double>& psi, double half) const noexcept {
        const double turn = turns_ ? 1.0 : 0.0, off = turn * off_line_;
        if (!swings_) return {off, off, off * half};
        const Swing::Rates rates = swing_.over(psi, half);
        const double swing = off_joint_;
        if (swing == 0) return {off, off, off * half};  // on the axis, at whatever rate
        return {off + rates.speed * swing,
                off + (2.0 * turn * rates.speed + rates.acceleration + rates.speed * rates.speed) * swing,
                off * half + min(rates.speed * half, 2.0) * swing};
    }

    /// The velocity (m / rad) of the rod's point that is at p at psi.
    Vec3<double> velocity(const Vec3<double>& p, const SinCos<double>& psi) const noexcept {
        Vec3<double> out{0, 0, 0};
        if (turns_) out = {0, -p.z, p.y};
        if (!swings_) return out;
        const auto here = [&](const Vec3<double>& v) { return turns_ ? turned_by(v, psi) : v; };
        return out + cross(here(axis_), p - here(point_)) * swing_.rate(psi);
    }

    /// The centre, at psi = 0, of the ball of bound().
    const Vec3<double>& centre() const noexcept { return centre_; }
    /// The radius (m) of a ball around centre() that contains the segment for all joint angles.
    double bound() const noexcept { return bound_; }
    /// The radius (m) of the rod.
    double radius() const noexcept { return radius_; }
    /// Whether psi rotates the rod, as it does on links 3 and 4.
    bool turns() const noexcept { return turns_; }

private:
    Swing swing_;
    Vec3<double> point_, axis_;                    // a point and the direction of the joint's axis
    Vec3<double> foot_[2], across_[2], ahead_[2];  // of both ends: on that axis, off it, a quarter on
    Vec3<double> centre_;
    double radius_, bound_;
    double off_joint_, off_line_;  // of the axis, of the line, at most
    bool turns_, swings_, sphere_;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
