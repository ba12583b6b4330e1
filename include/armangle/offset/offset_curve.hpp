// What the joints of an arm with an offset do between the rows of a path: the free joint moves evenly from
// row to row, and the others follow in closed form, with their derivatives by Taylor arithmetic.
//
//     free |    o--.             o  a row: s, joints, the free joint's value
//          |  .'    `o--o        -  straight in between; the tool is on its path at every s
//          | o
//          +------------- s
#pragma once

#include <algorithm>
#include <span>

#include "../plan/curve.hpp"
#include "offset_posture.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A view: the arm, the path and the rows belong to others.
struct OffsetCurve {
    const OffsetArm& arm;
    std::span<const Segment> segments;
    std::span<const double> s, free;  // of the rows, two or more; s rises, free is lifted
    const double* q;                  // (n, 7)
    int gc;                           // of all rows

    /// The posture at s, on the turns next to the rows'; NaN where there is none.
    PlacedPosture at(double x) const noexcept {
        const std::size_t row = row_before(x);
        const double share = (x - s[row]) / (s[row + 1] - s[row]);
        double near[joints];
        const double *before = q + joints * row, *after = before + joints;
        for (int j = 0; j < joints; ++j) near[j] = between(before[j], after[j], share);
        PlacedPosture out;
        out.pose = pose_at(segment(x), x);
        out.psi = between(free[row], free[row + 1], share);
        out.gc = gc;
        const Inverse found = inverse(arm, out.pose, out.psi, gc, near);
        std::copy(found.q, found.q + joint_slots, out.q);
        return out;
    }

    /// q', q'', q''' with respect to s: three rows of seven, at a row those of what follows. NaN where there
    /// is no posture, or joints 1 and 3 turn about one axis, or 5 about the line to the shoulder.
    void derivatives(double x, double* out) const noexcept {
        using J = Jet<double, 3>;
        std::fill(out, out + 3 * joints, not_a_number);
        const PlacedPosture here = at(x);
        if (!is_finite(here.q)) return;
        const std::size_t row = row_before(x);
        const J now = J::variable(x);
        const J share = (now - J(s[row])) / J(s[row + 1] - s[row]);
        const J value = J(free[row]) + share * J(free[row + 1] - free[row]);
        const J theta_7 = to_theta(value, J(arm.rest.sign[6]), J(arm.rest.offset[6]));
        const OffsetMotion<J> m = offset_motion(arm, pose_at(segment(x), now), gc);
        const SinCos<J> free_angle = sin_cos(theta_7);
        const OffsetWrist<J> wrist = offset_wrist(arm, m, free_angle);
        if (!(abs(wrist.g.value()) > tolerance::folded * arm.rest.reach)) return;
        const Directions<J> d = directions(m, wrist, free_angle, sqrt(wrist.inside));
        if (!(abs(d.y[1].value()) > tolerance::one_axis)) return;
        for (int j = 0; j < joints; ++j) {
            const J theta = j == 6 ? theta_7 : atan2(d.y[j], d.x[j]);
            for (int k = 1; k <= 3; ++k)
                out[(k - 1) * joints + robot_joint(arm, j)] =
                    arm.rest.sign[j] * theta.coefficient[k] * (k == 3 ? 6.0 : k);
        }
    }

private:
    const Segment& segment(double x) const noexcept {
        return segments[segment_index(segments.data(), segments.size(), x)];
    }
    std::size_t row_before(double x) const noexcept {
        const auto after = std::upper_bound(s.begin(), s.end(), x) - s.begin();
        return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(s) - 2));
    }
    static double between(double a, double b, double share) noexcept { return a + share * (b - a); }
};

}  // namespace armangle

#include "../names/end.hpp"
