// What the joints of a nearly S-R-S arm do along a curve of arm angles.
//
// A curve says the pose and phi for every s. The nominal arm's posture there is a closed form; the true one
// solves the seven equations of inverse.hpp, with phi's plane in place of psi's, and is next to it. Where a
// joint leads, past theta_2 or theta_6 = 0, its theta is the seventh equation instead: phi does not say there
// which posture it is. Derivatives follow from the same equations on Taylor coefficients.
//
// Beside a stretch where phi is given the true theta is not the nominal one. So what leads is shifted:
//
//     theta |  phi  |   leads   |  phi         o  where the true joint is at the ends of a run
//           |       o - .       |              -  the nominal theta and a quintic that joins it to these,
//           |  -----|     ` - . o---              value, slope and curvature
//           +---------------------- s
#pragma once

#include <span>

#include "../plan/curve.hpp"
#include "../plan/lead_shift.hpp"
#include "inverse.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Newton's method: equations() returns the equations at the present joints, move(step) changes the joints.
/// Returns whether it converges.
template <class EquationsNow, class Move>
bool solve_by_newton(const EquationsNow& equations, const Move& move) noexcept {
    double before = infinity;
    for (int pass = 0;; ++pass) {
        const auto now = equations();
        const double left = now.size();
        const bool solved = left <= ChainInverseTuning::residual;
        if (left <= ChainInverseTuning::settled || (solved && !(left < before))) return true;
        InverseSlope<double> back;
        if (pass == ChainInverseTuning::newton_steps || !(left < infinity) || !eliminate(now, back))
            return solved;
        before = left;
        double step[joints], longest = 0;
        for (int j = 0; j < joints; ++j) {
            step[j] = back.times(j, now.left);
            longest = max(longest, abs(step[j]));
        }
        if (longest > ChainInverseTuning::largest_step)
            for (double& part : step) part *= ChainInverseTuning::largest_step / longest;
        move(step);
    }
}

}  // namespace detail

namespace detail {

/// The seven equations in which the angle of a joint (1..7), given as sine and cosine, replaces psi.
template <class T>
SevenEquations<T> lead_equations(const ChainArm& arm, const Pose<T>& pose, int joint, const SinCos<T>& wanted,
                                 const SinCos<T>* angle) noexcept {
    const Vec3<T> none{T(0.0), T(0.0), T(0.0)};
    SevenEquations<T> out = seven_equations(arm, pose, PsiPlane<T>(none, none), angle);
    const SinCos<T>& now = angle[joint - 1];
    out.left.psi = wanted.sin * now.cos - wanted.cos * now.sin;
    out.column[joint - 1].psi = wanted.cos * now.cos + wanted.sin * now.sin;
    return out;
}

/// Writes the inverse of the Jacobian of the seven equations to `out`, by elimination; false if it is
/// singular.
inline bool eliminate(const SevenEquations<double>& f, InverseSlope<double>& out) noexcept {
    double a[joints][2 * joints] = {};
    for (int k = 0; k < joints; ++k) {
        const auto& c = f.column[k];
        const double column[joints] = {c.wrist.x, c.wrist.y, c.wrist.z, c.turn.x, c.turn.y, c.turn.z, c.psi};
        for (int i = 0; i < joints; ++i) a[i][k] = column[i];
        a[k][joints + k] = 1;
    }
    for (int k = 0; k < joints; ++k) {
        int pivot = k;
        for (int i = k + 1; i < joints; ++i)
            if (abs(a[i][k]) > abs(a[pivot][k])) pivot = i;
        if (!(abs(a[pivot][k]) > ChainInverseTuning::vanishing)) return false;
        std::swap(a[k], a[pivot]);
        const double per = 1 / a[k][k];
        for (double& x : a[k]) x *= per;
        for (int i = 0; i < joints; ++i) {
            if (i == k) continue;
            const double share = a[i][k];
            for (int j = k; j < 2 * joints; ++j) a[i][j] -= share * a[k][j];
        }
    }
    for (int i = 0; i < joints; ++i) {
        const double* x = a[i] + joints;
        out.row[i] = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, x[6]};
    }
    return true;
}

}  // namespace detail

/// The joints of an arm on its own chain along a curve of the nominal arm; refers to its arguments. `shifts`
/// are added to leading joints.
struct CorrectedCurve {
    const ChainArm& arm;
    const Curve& curve;
    std::span<const LeadShift> shifts;

    /// The angle theta (rad) of the leading joint of a stretch at s.
    template <class T>
    T lead_angle(const Stretch& x, const T& s) const noexcept {
        const double middle = 0.5 * (x.start + x.end);
        T out = phi_at(x, s);
        for (const LeadShift& y : shifts)
            if (y.start < middle && middle < y.end) out = out + y.at(s);
        return out;
    }

    /// The seven equations at s at a posture with these angles.
    template <class T>
    detail::SevenEquations<T> equations(const Stretch& x, const T& s, const SinCos<T>* angle) const noexcept {
        const Pose<T> pose = pose_at(curve.segment(x), s);
        if (x.lead == 0) return detail::seven_equations(arm, pose, plane_at(x, s), angle);
        return detail::lead_equations(arm, pose, static_cast<int>(x.lead), sin_cos(lead_angle(x, s)), angle);
    }

    /// Writes the inverse of the Jacobian of the seven equations f at a posture to `out`; false if it is
    /// singular.
    bool inverse_slope(const Stretch& x, const detail::SevenEquations<double>& f,
                       detail::InverseSlope<double>& out) const noexcept {
        if (x.lead != 0) return detail::eliminate(f, out);
        const detail::Reduced<double> reduced(f);
        if (reduced.is_regular()) out = detail::inverse_slope(f, reduced);
        return reduced.is_regular();
    }

    /// The plane of the curve's phi at s.
    template <class T>
    detail::PsiPlane<T> plane_at(const Stretch& x, const T& s) const noexcept {
        return {triad(curve.arm, flange_pose(curve.arm, pose_at(curve.segment(x), s)), curve.plane),
                sin_cos(phi_at(x, s))};
    }

    /// The true posture at s, with the joints' multiples of 2 pi as on the nominal curve; NaN if there is
    /// none.
    PlacedPosture at(double s) const noexcept { return at(curve.stretch(s), s); }

    /// The true posture at s, which is on stretch x, with the joints' multiples of 2 pi as on the nominal
    /// curve; NaN if there is none.
    PlacedPosture at(const Stretch& x, double s) const noexcept {
        const double t = (s - x.start) / (x.end - x.start);
        PlacedPosture nominal = curve.at(x, s);
        for (int j = 0; j < joints; ++j)
            nominal.q[j] = lift(nominal.q[j], x.q[j] + t * (x.q_end[j] - x.q[j]));
        return lifted(x, s, nominal);
    }

    /// The true posture at s on stretch x, found from the nominal posture `out` there; NaN if there is none.
    PlacedPosture lifted(const Stretch& x, double s, PlacedPosture out) const noexcept {
        SinCos<double> angle[joints];
        const bool found = x.lead == 0 ? solve_plane(x, s, out.pose, angle) : newton_from(x, s, out.q, angle);
        const JointLanes theta = detail::theta_of(angle);
        for (int j = 0; j < joints; ++j)
            out.q[j] = found ? lift(to_q(curve.arm, j, theta[j]), out.q[j]) : not_a_number;
        if (x.lead == 0 || !found) return out;
        const Posture here = forward(arm, out.q);
        out.psi = lift(here.psi, out.psi);
        out.gc = here.gc;
        return out;
    }

    /// The posture at s on stretch x to which Newton's method leads from joints q; NaN if it does not
    /// converge.
    PlacedPosture near(const Stretch& x, double s, const double* q) const noexcept {
        SinCos<double> angle[joints];
        PlacedPosture out{};
        const bool found = newton_from(x, s, q, angle);
        const JointLanes theta = detail::theta_of(angle);
        for (int j = 0; j < joints; ++j)
            out.q[j] = found ? lift(to_q(curve.arm, j, theta[j]), q[j]) : not_a_number;
        return out;
    }

    /// Computes theta(s) as Taylor coefficients up to order K at a posture `theta` (rad) on the curve, by
    /// steps of Newton's method; NaN if the equations are singular there.
    template <int K>
    void expand(const Stretch& x, double s, const double* theta,
                Jet<double, K> (&out)[joints]) const noexcept {
        using J = Jet<double, K>;
        const J at = J::variable(s);
        SinCos<J> angle[joints];
        SinCos<double> here[joints];
        for (int j = 0; j < joints; ++j) {
            out[j] = J(theta[j]);
            angle[j] = sin_cos(out[j]);
            here[j] = {angle[j].sin.value(), angle[j].cos.value()};
        }
        detail::InverseSlope<double> back{};
        const bool regular = inverse_slope(x, equations(x, s, here), back);
        for (int right = 1; right <= K; ++right) {
            const auto left = equations(x, at, angle).left;
            J step[joints];
            for (int j = 0; j < joints; ++j) {
                for (int k = 0; k <= K; ++k)
                    step[j].coefficient[k] =
                        regular ? back.times(j, order<double, K>(left, k)) : not_a_number;
                out[j] = out[j] + step[j];
            }
            detail::turn_by(step, angle);
        }
    }

    /// Writes the derivatives q', q'', q''' with respect to s, (3, 7), to `out`; NaN without a posture.
    void derivatives(double s, double* out) const noexcept {
        const Stretch& x = curve.stretch(s);
        const PlacedPosture here = at(s);
        double theta[joints];
        Jet<double, 3> series[joints];
        detail::theta_of(curve.arm, here.q, theta);
        expand(x, s, theta, series);
        for (int j = 0; j < joints; ++j)
            for (int k = 1; k <= 3; ++k)
                out[(k - 1) * joints + j] = curve.arm.sign[j] * series[j].coefficient[k] * (k == 3 ? 6.0 : k);
    }

    /// The coefficients of order k of a row of Taylor series.
    template <class T, int K>
    static typename detail::SevenEquations<T>::Row order(
        const typename detail::SevenEquations<Jet<T, K>>::Row& row, int k) noexcept {
        const auto part = [k](const Vec3<Jet<T, K>>& v) {
            return Vec3<T>{v.x.coefficient[k], v.y.coefficient[k], v.z.coefficient[k]};
        };
        return {part(row.wrist), part(row.turn), row.psi.coefficient[k]};
    }

private:
    /// Writes the posture with the curve's phi at s to `angle`; false if none is found.
    bool solve_plane(const Stretch& x, double s, const Pose<double>& pose,
                     SinCos<double> (&angle)[joints]) const noexcept {
        const Configuration<double> gc = configuration(curve.branch(x));
        return detail::solve_angles(arm, pose, plane_at(x, s), gc, angle) == Status::OK;
    }

    /// Writes the posture at s to `angle` to which Newton's method leads from joints q; false if it does not
    /// converge.
    bool newton_from(const Stretch& x, double s, const double* q,
                     SinCos<double> (&angle)[joints]) const noexcept {
        double theta[joints];
        detail::theta_of(curve.arm, q, theta);
        detail::sin_cos_all(theta, angle);
        return detail::solve_by_newton(
            [&]() noexcept { return equations(x, s, angle); },
            [&](const double (&step)[joints]) noexcept { detail::turn_by(step, angle); });
    }
};

namespace detail {

/// Value, slope and curvature of an angle at an end of a run.
struct RunEnd {
    double value = 0, slope = 0, curvature = 0;
};

/// The difference (rad) between the true and the nominal angle of the joint that leads stretch `led`, with
/// derivatives by s, for the true posture on the neighbouring stretch x; 0 if that has none.
inline RunEnd end_from_neighbour(const CorrectedCurve& curve, const Stretch& x, const Stretch& led,
                                 double s) noexcept {
    using J = Jet<double, 2>;
    const PlacedPosture here = curve.at(x, s);
    if (!is_finite(here.q)) return {};
    double theta[joints];
    J series[joints];
    theta_of(curve.curve.arm, here.q, theta);
    curve.expand(x, s, theta, series);
    const J off = series[static_cast<int>(led.lead) - 1] - phi_at(led, J::variable(s));
    const RunEnd out{wrap(off.value()), off.coefficient[1], 2 * off.coefficient[2]};
    return abs(out.slope) + abs(out.curvature) < infinity ? out : RunEnd{};
}

/// The quintic over [start, end] with these values and derivatives at its ends.
inline LeadShift joined(double start, double end, const RunEnd& a, const RunEnd& b) noexcept {
    const double h = end - start, d0 = a.slope * h, d1 = b.slope * h, c0 = a.curvature * h * h,
                 c1 = b.curvature * h * h, rise = b.value - a.value;
    return {start,
            end,
            {a.value, d0, 0.5 * c0, 10 * rise - 6 * d0 - 4 * d1 - 1.5 * c0 + 0.5 * c1,
             -15 * rise + 8 * d0 + 7 * d1 + 1.5 * c0 - c1, 6 * rise - 3 * (d0 + d1) - 0.5 * (c0 - c1)}};
}

}  // namespace detail

/// The shifts of leading joints along a curve with which the true joints are continuous between stretches,
/// and begin and end at the given joints (null: none).
inline LeadShifts lead_shifts(const ChainArm& arm, const Curve& curve, const double* start,
                              const double* goal) {
    LeadShifts out;
    const std::span<const Stretch> all = curve.stretches;
    const auto asked = [&](const Stretch& x, const double* q, double s) {
        const int j = static_cast<int>(x.lead) - 1;
        return detail::RunEnd{q ? wrap(to_theta(curve.arm, j, q[j]) - phi_at(x, s)) : 0.0, 0, 0};
    };
    for (std::size_t from = 0, to = 0; from < all.size(); from = to) {
        for (to = from + 1; to < all.size() && all[to].lead == all[from].lead;) ++to;
        const Stretch &first = all[from], &last = all[to - 1];
        if (first.lead == 0) continue;
        const CorrectedCurve so_far{arm, curve, out};
        const detail::RunEnd left =
            from == 0 ? asked(first, start, first.start)
                      : detail::end_from_neighbour(so_far, all[from - 1], first, first.start);
        detail::RunEnd right;
        if (to == all.size())
            right = asked(last, goal, last.end);
        else if (all[to].lead == 0)
            right = detail::end_from_neighbour(so_far, all[to], last, last.end);
        out.push_back(detail::joined(first.start, last.end, left, right));
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
