// The result of a plan: phi as a cubic spline over s. The closed-form inverse gives every configuration of
// the path from it.
//
//     phi |      o..o          o  the polyline of the search: control values at the Greville abscissae
//         |    .'    `o        .  the spline: within the hull of its neighbours, so it does not overshoot
//         | o.'        `..o       out of a narrow tube; it reproduces lines
//         +------------------ s
//
// The curve is a cubic B-spline, twice continuously differentiable. Sources: I. J. Schoenberg, On spline
// functions (1967): the variation diminishing spline; L. Ramshaw, Blossoming (1987): control values as values
// of the polar form, which gives knot insertion.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "../circle/psi_from_joint.hpp"
#include "../limits/limit_table.hpp"
#include "../numbers/jet.hpp"
#include "path.hpp"
#include "../circle/smooth_plane.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// One stretch [start, end] of a curve: phi = c0 + c1 t + c2 t^2 + c3 t^3, t in [0, 1]. A stretch lies within
/// one segment. If a joint leads (psi_from_joint.hpp), the polynomial is its theta instead, and phi follows.
/// Holds doubles alone, so that a curve fits into an array.
struct Stretch {
    double start, end, coefficient[4];
    double q[joints], psi;          // at its start, continuous: reference for the turns of inner values
    double q_end[joints], psi_end;  // at its end
    double lead = 0, side = 0;      // the leading joint, 1..7, and the root that gives phi; 0: phi leads
    double branch = -1;             // its branch, if different from the curve's
};

inline constexpr std::size_t stretch_width = sizeof(Stretch) / sizeof(double);

/// The value of a stretch's polynomial at s: phi, or theta of the leading joint.
template <class T>
T phi_at(const Stretch& x, const T& s) noexcept {
    const T t = (s - T(x.start)) / (T(x.end) - T(x.start));
    const auto& c = x.coefficient;
    return T(c[0]) + t * (T(c[1]) + t * (T(c[2]) + t * T(c[3])));
}

/// The segment of the path in which a stretch lies.
inline const Segment& segment_of(std::span<const Segment> segments, const Stretch& x) noexcept {
    return segments[segment_index(segments.data(), segments.size(), 0.5 * (x.start + x.end))];
}

/// The stretch that contains s; between two, the later one.
inline const Stretch& stretch_at(std::span<const Stretch> stretches, double s) noexcept {
    std::size_t low = 0, high = stretches.size();
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        (s >= stretches[middle].start ? low : high) = middle;
    }
    return stretches[low];
}

/// One configuration of a curve.
struct PlacedPosture {
    double q[joint_slots], psi;
    int gc;
    Pose<double> pose;
};

/// A configuration for any scalar: the self-motion, phi and the directions of the joints. If a joint leads,
/// also its theta and the squared slope of its equation (psi_from_joint.hpp: slope_square).
template <class T>
struct PlacedDirections {
    SelfMotion<T> motion;
    JointFunctions<T> functions;
    SinCos<T> phi, theta;
    T room;
    Directions<T> angles;
};

/// Parameters of the curve of a plan.
struct CurveTuning {
    static constexpr double inside =
        1e-9;  // of a stretch: distance from its end to evaluate the joints' limit
    static constexpr double there = 1e-5;  // rad: joints this near to the limit have reached it
    /// Sine of a hinge that is 0 at an end of its stretch, below which the joints next to it are read between
    /// the ends: the directions are no longer than this, and round to 2e-15.
    static constexpr double shut = 3e-6;
};

/// Whether the range of joint j is at least 2 pi, so that one angle may fit in two revolutions.
inline bool has_a_turn(const Limits& limits, int j) noexcept {
    return limits.upper[j] - limits.lower[j] >= two_pi - 2 * tolerance::angle;
}

/// A curve over the path; arm, path and stretches belong to the caller.
struct Curve {
    const Arm& arm;
    SmoothPlane plane;
    int gc;
    std::span<const Segment> segments;
    std::span<const Stretch> stretches;

    /// The path segment of a stretch.
    const Segment& segment(const Stretch& x) const noexcept { return segment_of(segments, x); }
    /// The stretch at s; between two, the later one.
    const Stretch& stretch(double s) const noexcept { return stretch_at(stretches, s); }

    /// The branch (0..7) of a stretch: its own, or that of the whole curve. If joint 1 or 3 (5 or 7) leads,
    /// the sign of theta_2 (theta_6) may change along it.
    int branch(const Stretch& x) const noexcept { return x.branch < 0 ? gc : static_cast<int>(x.branch); }

    /// The joint (0: joint 2, 1: joint 6) that is 0 or pi at joints q while a neighbour of the other one
    /// leads the stretch; -1: none.
    int singular_hinge(const Stretch& x, const double* q) const noexcept {
        const int through = hinge_crossed_by(static_cast<int>(x.lead));
        if (through < 0) return -1;
        const int other = 1 - through;
        const double theta = to_theta(arm, hinge_joint[other], q[hinge_joint[other]]);
        return abs(std::sin(theta)) <= tolerance::one_axis ? other : -1;
    }

    /// The self-motion at s of stretch x, counted in phi, for any scalar.
    template <class T>
    SelfMotion<T> motion_at(const Stretch& x, const T& s) const noexcept {
        const Circle<T> c = circle(arm, flange_pose(arm, pose_at(segment(x), s)), plane);
        return self_motion(arm, c, spread<T>(configuration(branch(x))));
    }

    /// Computes the configuration at s of stretch x with phi, or leading theta, equal to `value`, for any
    /// scalar. Its functions, theta and room are set only if a joint leads.
    template <class T>
    PlacedDirections<T> place(const Stretch& x, const T& s, const T& value) const noexcept {
        PlacedDirections<T> out;
        out.motion = motion_at(x, s);
        if (x.lead == 0) {
            out.phi = sin_cos(value);
            out.angles = directions(out.motion, out.phi);
            return out;
        }
        const int joint = static_cast<int>(x.lead);
        out.functions = joint_functions(out.motion);
        out.theta = sin_cos(value);
        const PsiFromJoint<T> led =
            psi_from_joint(joint_condition(out.functions, joint, out.theta), T(x.side));
        out.phi = led.psi;
        out.room = led.slope_square;
        out.angles = directions_with_joint(out.motion, out.phi, joint, out.theta);
        return out;
    }

    /// The configuration at s of stretch x, with psi in the revolution nearest to near_psi and joints in
    /// those nearest to the seven in `near`, within the limits if their range is below 2 pi. value: phi, or
    /// theta of the leading joint.
    PlacedPosture solve(const Stretch& x, double s, double value, const double* near,
                        double near_psi) const noexcept {
        PlacedPosture out;
        out.pose = pose_at(segment(x), s);
        PlacedDirections<double> here = place(x, s, value);
        const bool shut = singular_hinge(x, x.q) >= 0 || singular_hinge(x, x.q_end) >= 0;
        keep_shares(arm, here.motion, here.phi, static_cast<int>(x.lead), near, here.angles,
                    shut ? CurveTuning::shut : tolerance::one_axis);
        const Joints q = joints_within_limits(arm, here.angles, near);
        for (int j = 0; j < joint_slots; ++j) out.q[j] = q.q[j];
        for (int j = 0; j < joints; ++j)  // another turn may hold too, but the curve would jump
            if (has_a_turn(arm.limits, j)) out.q[j] = lift(out.q[j], near[j]);
        if (x.lead != 0) {  // to its last digit, because a locked joint has no room
            const int j = static_cast<int>(x.lead) - 1;
            const double low = arm.limits.lower[j], high = arm.limits.upper[j];
            const double led = lift(to_q(arm, j, value), out.q[j]), held = min(max(led, low), high);
            out.q[j] = abs(held - led) <= tolerance::angle ? held : led;
        }
        const Circle<double>& c = here.motion.circle;
        out.psi =
            lift(arm_angle(circle(arm, flange_pose(arm, out.pose)), c.z * here.phi.cos + c.e * here.phi.sin),
                 near_psi);
        Configuration<double> sign = here.motion.gc;
        const int through = hinge_crossed_by(static_cast<int>(x.lead));
        if (through == 0) sign.shoulder = here.angles.y[1];
        if (through == 1) sign.wrist = here.angles.y[5];
        out.gc = index(sign);
        return out;
    }

    /// The configuration at s; if there is none (out of reach, or the leading joint cannot have its value),
    /// one that misses the pose.
    PlacedPosture at(double s) const noexcept { return at(stretch(s), s); }

    /// The configuration at s, which is on stretch x, as at(s).
    PlacedPosture at(const Stretch& x, double s) const noexcept {
        const double t = (s - x.start) / (x.end - x.start);
        double near[joints];
        for (int j = 0; j < joints; ++j) near[j] = x.q[j] + t * (x.q_end[j] - x.q[j]);
        return solve(x, s, phi_at(x, s), near, t < 0.5 ? x.psi : x.psi_end);
    }

    /// The derivatives q', q'', q''' with respect to s: three rows of seven. Between two segments, those of
    /// the later one.
    void derivatives(double s, double* out) const noexcept {
        using J = Jet<double, 3>;
        const Stretch& x = stretch(s);
        const int from = singular_hinge(x, x.q), to = singular_hinge(x, x.q_end);
        double about = s;  // of the series: an end with a shut hinge, if that is near
        if (from >= 0 && barely_open(x, s, from)) about = x.start;
        if (to >= 0 && barely_open(x, s, to)) about = x.end;
        const J at = J::variable(about);
        Directions<J> d = place(x, at, phi_at(x, at)).angles;
        if (about == x.start) set_singular_limit(x, about, from, 1.0, d);
        if (about == x.end) set_singular_limit(x, about, to, -1.0, d);
        const double off = s - about;
        for (int j = 0; j < joints; ++j) {
            const J theta = atan2(d.y[j], d.x[j]);
            const auto& c = theta.coefficient;
            out[j] = arm.sign[j] * (c[1] + off * (2 * c[2] + off * 3 * c[3]));
            out[joints + j] = arm.sign[j] * (2 * c[2] + off * 6 * c[3]);
            out[2 * joints + j] = arm.sign[j] * 6 * c[3];
        }
        for (int k = 0; k < 3 && arm.roll_free; ++k) out[k * joints + joints - 1] = 0;
    }

    /// Whether joint 2 (h = 0) or joint 6 (h = 1) is so near to 0 or pi at s that the angles of the joints
    /// before and after it lose digits.
    bool barely_open(const Stretch& x, double s, int h) const noexcept {
        return makes_one_axis(place(x, s, phi_at(x, s)).angles, hinge_joint[h], CurveTuning::shut);
    }

    /// Replaces in d the directions of the neighbours of joint 2 or 6 (h: 0, 1), at an end s where that joint
    /// is 0 or pi, by their limit from within. They vanish with the distance there, so they are divided by
    /// it. way: 1 if the stretch begins at s, -1 if it ends. Nothing if h < 0.
    template <int K>
    void set_singular_limit(const Stretch& x, double s, int h, double way,
                            Directions<Jet<double, K>>& d) const noexcept {
        if (h < 0) return;
        using Longer = Jet<double, K + 1>;
        const Longer at = Longer::variable(s);
        const PlacedDirections<Longer> here = place(x, at, phi_at(x, at));
        const auto divided = [way](const Longer& f) {
            Jet<double, K> out;
            for (int k = 0; k <= K; ++k) out.coefficient[k] = way * f.coefficient[k + 1];
            return out;
        };
        for (const int p : {2 * h, 2 * h + 1}) {
            const Pivot<Longer>& pivot = here.functions.pivot[p];
            d.y[pivot_joint[p]] = divided(pivot.g * pivot.U.at(here.phi));
            d.x[pivot_joint[p]] = divided(pivot.g * pivot.V.at(here.phi));
        }
        const int before = pivot_joint[2 * h], hinge = hinge_joint[h];
        const Jet<double, K> size = hypot(d.x[before], d.y[before]);
        const double sign = way * here.functions.hinge[h].g.value();
        d.y[hinge].coefficient[0] = 0;
        for (int k = 1; k <= K; ++k) d.y[hinge].coefficient[k] = sign * size.coefficient[k - 1];
    }
};

namespace detail {

/// The polar form (blossom) at three arguments u of a cubic spline on the interval t[2] .. t[3], from its
/// four control values c; t: the six knots around.
inline double blossom(const double* c, const double* t, const double (&u)[3]) noexcept {
    double d[4] = {c[0], c[1], c[2], c[3]};
    for (int r = 1; r <= 3; ++r)
        for (int j = 3; j >= r; --j) {
            const double from = t[j - 1], to = t[j + 3 - r];
            const double share = (u[r - 1] - from) / (to - from);
            d[j] = (1 - share) * d[j - 1] + share * d[j];
        }
    return d[3];
}

/// Writes the six knots around interval i of the breaks (i - 2 .. i + 3) to t, with repeated ends.
inline void knots_about(const std::vector<double>& breaks, std::size_t i, double (&t)[6]) noexcept {
    for (std::size_t k = 0; k < 6; ++k)
        t[k] = breaks[std::clamp<std::size_t>(i + k, 2, breaks.size() + 1) - 2];
}

/// Writes the three knots whose mean is the Greville abscissa of control value j to t.
inline void knots_of_control(const std::vector<double>& breaks, std::size_t j, double (&t)[3]) noexcept {
    for (std::size_t k = 0; k < 3; ++k)
        t[k] = breaks[std::clamp<std::size_t>(j + 1 + k, 3, breaks.size() + 2) - 3];
}

}  // namespace detail

/// phi as a C2 cubic spline: n breaks of s (two or more, rising) and n + 2 control values.
struct Spline {
    std::vector<double> breaks, control;
};

/// Schoenberg's spline, with these breaks, of a polyline (s, phi): the control values are its values at the
/// Greville abscissae. It equals the polyline at both ends.
inline Spline spline(const std::vector<double>& breaks, const std::vector<double>& s,
                     const std::vector<double>& phi) {
    const std::size_t n = s.size();
    Spline out{breaks, std::vector<double>(breaks.size() + 2)};
    std::size_t at = 0;
    for (std::size_t j = 0; j < out.control.size(); ++j) {
        double t[3];
        detail::knots_of_control(breaks, j, t);
        const double x = (t[0] + t[1] + t[2]) / 3;
        while (at + 2 < n && s[at + 1] < x) ++at;
        const double share = min(max((x - s[at]) / (s[at + 1] - s[at]), 0.0), 1.0);
        out.control[j] = (1 - share) * phi[at] + share * phi[at + 1];
    }
    out.control.front() = phi.front();
    out.control.back() = phi.back();
    return out;
}

/// The same spline on more breaks, which include the old ones, by knot insertion.
inline Spline refined(const Spline& old, const std::vector<double>& breaks) {
    Spline out{breaks, std::vector<double>(breaks.size() + 2)};
    std::size_t at = 0;
    for (std::size_t j = 0; j < out.control.size(); ++j) {
        const double from = breaks[std::clamp<std::size_t>(j, 1, breaks.size() - 1) - 1];
        while (at + 2 < old.breaks.size() && old.breaks[at + 1] <= from) ++at;
        double about[6], t[3];
        detail::knots_about(old.breaks, at, about);
        detail::knots_of_control(breaks, j, t);
        out.control[j] = detail::blossom(&old.control[at], about, t);
    }
    return out;
}

/// The stretches of a spline, also cut at the ends of segments, so that each lies within one. Their joints
/// are not set.
inline std::vector<Stretch> stretches_of(const Spline& x, std::span<const Segment> segments) {
    std::vector<Stretch> out;
    std::size_t next = 0;  // the first segment that ends after the present place
    for (std::size_t i = 0; i + 1 < x.breaks.size(); ++i) {
        double t[6];
        detail::knots_about(x.breaks, i, t);
        const double* c = &x.control[i];
        double l = x.breaks[i];
        while (l < x.breaks[i + 1]) {
            while (next + 1 < segments.size() && segments[next].end <= l) ++next;
            const double r =
                next + 1 < segments.size() ? min(segments[next].end, x.breaks[i + 1]) : x.breaks[i + 1];
            const double b0 = detail::blossom(c, t, {l, l, l}), b1 = detail::blossom(c, t, {l, l, r});
            const double b2 = detail::blossom(c, t, {l, r, r}), b3 = detail::blossom(c, t, {r, r, r});
            Stretch& to = out.emplace_back();
            to.start = l;
            to.end = r;
            const double power[4] = {b0, 3 * (b1 - b0), 3 * (b2 - 2 * b1 + b0), b3 - 3 * b2 + 3 * b1 - b0};
            for (int k = 0; k < 4; ++k) to.coefficient[k] = power[k];
            l = r;
        }
    }
    return out;
}

/// The stretches of the polyline phi(s) through the given values, one fewer than these. Their joints are not
/// set.
inline std::vector<Stretch> straight_stretches(const std::vector<double>& s, const std::vector<double>& phi) {
    std::vector<Stretch> out(s.size() - 1);
    for (std::size_t i = 0; i + 1 < s.size(); ++i) {
        out[i].start = s[i];
        out[i].end = s[i + 1];
        out[i].coefficient[0] = phi[i];
        out[i].coefficient[1] = phi[i + 1] - phi[i];
    }
    return out;
}

namespace detail {

/// The configuration at the start or, if `last`, the end of a stretch, near given joints and psi. If theta_2
/// or theta_6 is 0 or pi there, the joints next to it are the limits from within, since they vary like the
/// root of the distance.
inline PlacedPosture end_posture(const Curve& curve, const Stretch& x, bool last, const double* near,
                                 double psi) noexcept {
    const double s = last ? x.end : x.start,
                 way = (last ? -1.0 : 1.0) * CurveTuning::inside * (x.end - x.start);
    const PlacedPosture here = curve.solve(x, s, phi_at(x, s), near, psi);
    if (const int h = curve.singular_hinge(x, here.q); h >= 0) {
        Directions<Jet<double, 0>> d;
        curve.set_singular_limit(x, s, h, last ? -1.0 : 1.0, d);
        double limit[joints];
        std::copy(near, near + joints, limit);
        for (const int j : {pivot_joint[2 * h], pivot_joint[2 * h + 1]}) {
            const double theta = atan2(d.y[j].value(), d.x[j].value());
            const double q = lift(to_q(curve.arm, j, theta), near[j]);
            if (last || abs(q - near[j]) > CurveTuning::there) limit[j] = q;
        }
        return curve.solve(x, s, phi_at(x, s), limit, psi);
    }
    if (!makes_one_axis(curve.place(x, s, phi_at(x, s)).angles, 1) &&
        !makes_one_axis(curve.place(x, s, phi_at(x, s)).angles, 5))
        return here;
    const PlacedPosture beside = curve.solve(x, s + way, phi_at(x, s + way), here.q, psi);
    const PlacedPosture off = curve.solve(x, s + 4 * way, phi_at(x, s + 4 * way), beside.q, psi);
    double limit[joints];
    for (int j = 0; j < joints; ++j) {
        limit[j] = 2 * beside.q[j] - off.q[j];
        if (abs(limit[j] - near[j]) <= CurveTuning::there) limit[j] = near[j];
    }
    return curve.solve(x, s, phi_at(x, s), limit, psi);
}

}  // namespace detail

/// Sets the joints and psi at the ends of every stretch, continuous from q0 and psi0 on. `stretches` are
/// those of the curve.
inline void lift_stretches(const Curve& curve, std::span<Stretch> stretches, const double* q0,
                           double psi0) noexcept {
    double q[joints], psi = psi0;
    for (int j = 0; j < joints; ++j) q[j] = q0[j];
    for (Stretch& x : stretches) {
        const PlacedPosture from = detail::end_posture(curve, x, false, q, psi);
        for (int j = 0; j < joints; ++j) x.q[j] = q[j] = from.q[j];
        const PlacedPosture to = detail::end_posture(curve, x, true, q, from.psi);
        for (int j = 0; j < joints; ++j) x.q_end[j] = q[j] = to.q[j];
        x.psi = from.psi;
        x.psi_end = psi = to.psi;
    }
}

}  // namespace armangle

#include "../names/end.hpp"
