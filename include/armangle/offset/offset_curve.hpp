// What the joints of an arm with an offset do between the rows of a path: one joint leads evenly from row to
// row, and the others follow by Newton's method, with their derivatives on Taylor coefficients.
//
//     q of the   |    o--.             o  a row: s and joints
//     joint that |  .'    `o--o        -  straight in between; the tool is on its path at every s
//     leads      | o
//                +------------- s
//
// The free joint leads. Where the self-motion moves another joint much faster, that one does: at theta_2 = 0
// joint 1 or 3, and at a fold another than the free joint. So branches are no borders.
#pragma once

#include <algorithm>
#include <span>

#include "../chain/corrected_curve.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The pose of the end effector at joint values q, in the frame that poses are given in, for any scalar.
template <class T>
Pose<T> tool_pose(const OffsetArm& arm, const T* q) noexcept {
    SinCos<T> angle[joints];
    for (int j = 0; j < joints; ++j)
        angle[j] = sin_cos(to_theta(q[j], T(arm.own.sign[j]), T(arm.own.offset[j])));
    const int row = arm.mirrored ? 1 : 6;
    Vec3<T> shift{};
    Pose<T> flange{};
    detail::walk(arm.own, angle, [&](int i, const Pose<T>& frame) noexcept {
        if (i == row) shift = frame.rotation.x * T(arm.mirrored ? -arm.a_6 : arm.a_6);
        if (i == joints) flange = frame;
    });
    flange.position = flange.position + shift;
    return user_pose(arm.own, flange);
}

/// The curve of an arm with an offset, or of one on its own chain, through rows; arm, path and rows belong to
/// the caller.
template <free_joint_arm AnyArm>
struct OffsetCurve {
    const AnyArm& arm;
    std::span<const Segment> segments;
    std::span<const double> s, free;  // of the rows, two or more; s rises, free is lifted
    const double* q;                  // (n, 7)

    /// The configuration at s = x: the leading joint is on the straight line between two rows, and Newton's
    /// method finds the others from there. NaN if it does not converge.
    PlacedPosture at(double x) const noexcept {
        const Gap gap = gap_at(x);
        const double share = (x - gap.start) / gap.length;
        PlacedPosture out;
        out.pose = pose_at(segment(x), x);
        for (int j = 0; j < joints; ++j) out.q[j] = gap.from[j] + share * (gap.to[j] - gap.from[j]);
        out.q[joints] = 0.0;
        if (!solve(out.pose, gap.lead, out.q)) std::fill(out.q, out.q + joints, not_a_number);
        const OffsetPosture here = forward(arm, out.q);
        out.gc = here.gc;
        out.psi = lift(here.free, free[gap.row] + share * (free[gap.row + 1] - free[gap.row]));
        return out;
    }

    /// Writes the derivatives q', q'', q''' with respect to s at s = x to `out`: three rows of seven; at a
    /// row those of what follows. NaN if there is no solution or the arm is stretched.
    void derivatives(double x, double* out) const noexcept {
        using J = Jet<double, 3>;
        std::fill(out, out + 3 * joints, not_a_number);
        const Gap gap = gap_at(x);
        const PlacedPosture here = at(x);
        detail::InverseSlope<double> back;
        if (!is_finite(here.q) || !detail::eliminate(equations(here.pose, gap.lead, here.q), back)) return;
        const Pose<J> wanted = pose_at(segment(x), J::variable(x));
        J series[joints];
        for (int j = 0; j < joints; ++j) series[j] = J(here.q[j]);
        const double rate = (gap.to[gap.lead] - gap.from[gap.lead]) / gap.length;
        for (int k = 1; k <= 3; ++k) {  // one coefficient after the other: the equations are linear in it
            const auto left = rest(tool_pose(arm, series), wanted);
            const Row order{coefficient(left.wrist, k), coefficient(left.turn, k), k == 1 ? rate : 0.0};
            for (int j = 0; j < joints; ++j) series[j].coefficient[k] = back.times(j, order);
        }
        for (int j = 0; j < joints; ++j)
            for (int k = 1; k <= 3; ++k)
                out[(k - 1) * joints + j] = series[j].coefficient[k] * (k == 3 ? 6.0 : k);
    }

private:
    /// A joint leads instead of the free joint if the self-motion moves it this many times as fast.
    static constexpr double fast = 10.0;

    template <class T>
    using Equations = detail::SevenEquations<T>;
    using Row = Equations<double>::Row;

    /// Two neighbouring rows, and the joint (0..6) that is linear between them.
    struct Gap {
        std::size_t row;
        const double *from, *to;  // (7,)
        double start, length;     // of s
        int lead;
    };

    /// The two rows between which x lies: the first's number, joints of both, its s, their distance in s, and
    /// the joint that leads between them.
    Gap gap_at(double x) const noexcept {
        const auto after = std::upper_bound(s.begin(), s.end(), x) - s.begin();
        const auto last = std::ssize(s) - 2;
        const auto row = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, last));
        const double *from = q + joints * row, *to = from + joints;
        return {row, from, to, s[row], s[row + 1] - s[row], leader(from, to)};
    }
    /// The path segment that contains x.
    const Segment& segment(double x) const noexcept {
        return segments[segment_index(segments.data(), segments.size(), x)];
    }
    /// The k-th Taylor coefficient of each component.
    static Vec3<double> coefficient(const Vec3<Jet<double, 3>>& v, int k) noexcept {
        return {v.x.coefficient[k], v.y.coefficient[k], v.z.coefficient[k]};
    }

    /// The difference from one pose to another: lengths as shares of the reach, and the rotation.
    template <class T>
    typename Equations<T>::Row rest(const Pose<T>& from, const Pose<T>& to) const noexcept {
        const Vec3<T> twice = cross(from.rotation.x, to.rotation.x) + cross(from.rotation.y, to.rotation.y) +
                              cross(from.rotation.z, to.rotation.z);
        const T per_reach(1.0 / nominal_offset(arm).rest.reach);
        return {(to.position - from.position) * per_reach, twice * T(0.5), T(0.0)};
    }
    /// The error of the pose at joints `at`, and its Jacobian with a row for the joint that leads.
    Equations<double> equations(const Pose<double>& pose, int lead, const double* at) const noexcept {
        const Jacobian J = jacobian(arm, at);
        const double per_reach = 1.0 / nominal_offset(arm).rest.reach;
        Equations<double> out;
        out.left = rest(tool_pose(arm, at), pose);
        for (int j = 0; j < joints; ++j) {
            const auto& e = J.entry;
            out.column[j].wrist = Vec3<double>{e[0][j], e[1][j], e[2][j]} * per_reach;
            out.column[j].turn = {e[3][j], e[4][j], e[5][j]};
            out.column[j].psi = j == lead ? 1.0 : 0.0;
        }
        return out;
    }
    /// The joint that is linear between two rows: the free joint, or the joint that the self-motion moves
    /// fastest half way if it is more than `fast` times as fast; the last joint if the arm is stretched.
    int leader(const double* from, const double* to) const noexcept {
        double middle[joint_slots] = {};
        for (int j = 0; j < joints; ++j) middle[j] = from[j] + 0.5 * (to[j] - from[j]);
        const Pose<double> here = tool_pose(arm, middle);
        const int own = robot_joint(arm, 6);
        for (int first = 0; first < joints; ++first) {
            const int lead = (own + first) % joints;
            detail::InverseSlope<double> back;
            if (!detail::eliminate(equations(here, lead, middle), back)) continue;
            int most = lead;
            for (int j = 0; j < joints; ++j)
                if (abs(back.row[j].psi) > abs(back.row[most].psi)) most = j;
            const bool leads = lead == own && abs(back.row[most].psi) <= fast;
            return leads ? own : most;
        }
        return joints - 1;
    }
    /// Moves the joints `at` onto the pose by Newton's method, but for joint `lead` (0..6), which keeps its
    /// value; false if it does not converge (`at` is then anywhere).
    bool solve(const Pose<double>& pose, int lead, double* at) const noexcept {
        return detail::solve_by_newton([&]() noexcept { return equations(pose, lead, at); },
                                       [&](const double (&step)[joints]) noexcept {
                                           for (int j = 0; j < joints; ++j) at[j] += step[j];
                                       });
    }
};

}  // namespace armangle

#include "../names/end.hpp"
