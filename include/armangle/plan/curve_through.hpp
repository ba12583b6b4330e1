// The curve through rows that were found step by step: phi goes straight from row to row.
//
//     theta_1 |     .                Beside theta_2 = 0 (theta_6 = 0) phi is no guide: rows side by side may
//             |    ' '    - phi      have quite different phi, and theta_1 sweeps round between them. There
//             | o-'---'-o - leads    joint 1 (5) leads straight from row to row, also through 0 where rows
//             +------------ s        have both signs of theta_2 (theta_6).
#pragma once

#include <span>

#include "curve.hpp"
#include "path_rows.hpp"
#include "tube.hpp"

namespace armangle {

namespace through_rule {
inline constexpr double near = 0.35;    // |sin| of theta_2, theta_6 up to which the pivot beside it may lead
inline constexpr double shut = 1e-6;    // |sin| of these beside which phi has no speed to go by
inline constexpr double swing = 0.002;  // share of the move from row to row by which a joint may leave it
inline constexpr double calmer = 0.9;   // share of a swing that leading leaves at most
inline constexpr double there = 1e-5;   // rad: how near a stretch that is led begins and ends to its rows
inline constexpr double looks[] = {1e-6, 1e-4, 0.003, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 0.997};
}  // namespace through_rule

/// Of an arm with its own chain it is the nominal arm's, and what leads is the true joint.
struct CurveThrough {
    SmoothPlane plane;
    std::vector<Stretch> stretches;
    int torn = -1;  // the row behind which nothing leads on to the branch of the next

    /// `corrected(curve, stretch, s, posture)` is the true posture beside that of the curve.
    template <class Corrected>
    CurveThrough(const Arm& arm, std::span<const Segment> path, const PathRows& rows,
                 const Corrected& corrected) {
        std::vector<Pose<double>> flanges;
        std::vector<Vec3<double>> wrists;
        std::vector<double> phi;
        for (const double s : rows.s) {
            flanges.push_back(flange_pose(arm, pose_at(path[segment_index(path.data(), path.size(), s)], s)));
            wrists.push_back(triad(arm, flanges.back()).w);
        }
        plane = smooth_plane(wrists);
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const Chain now = chain(arm, rows.q.data() + joints * i);
            const double angle = arm_angle(triad(arm, flanges[i], plane), now.z3);
            phi.push_back(i ? lift(angle, phi.back()) : angle);
        }
        stretches = straight_stretches(rows.s, phi);
        for (std::size_t i = 0; i + 1 < rows.size(); ++i) stretches[i].branch = rows.gc[i];
        const Curve curve{arm, plane, rows.gc[0], path, stretches};
        lift_stretches(curve, stretches, rows.q.data(), rows.psi[0]);
        for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
            const double* const q = rows.q.data() + joints * i;
            if (const int passed = rows.gc[i] ^ rows.gc[i + 1]) {
                const bool led = (passed == 1 && lead(curve, corrected, 0, q, infinity, stretches[i])) ||
                                 (passed == 4 && lead(curve, corrected, 1, q, infinity, stretches[i]));
                if (!led && torn < 0) torn = static_cast<int>(i);
            } else {
                calm(curve, corrected, q, stretches[i]);
            }
        }
        lift_stretches(curve, stretches, rows.q.data(), rows.psi[0]);
    }

private:
    /// How far a joint leaves the straight move between two rows q, a row after the other.
    template <class Corrected>
    static double swing(const Curve& curve, const Corrected& corrected, const Stretch& x,
                        const double* q) noexcept {
        double most = 0;
        for (const double share : through_rule::looks) {
            double straight[joints];
            for (int j = 0; j < joints; ++j) straight[j] = q[j] + share * (q[joints + j] - q[j]);
            const double off = off_at(curve, corrected, x, straight, share);
            if (!(off < infinity)) return infinity;
            most = max(most, off);
        }
        return most;
    }
    /// How far it is from q a share of a stretch behind its start.
    template <class Corrected>
    static double off_at(const Curve& curve, const Corrected& corrected, const Stretch& x, const double* q,
                         double share) noexcept {
        const double s = x.start + share * (x.end - x.start);
        const PlacedPosture here = corrected(curve, x, s, curve.solve(x, s, phi_at(x, s), q, x.psi));
        double most = 0;
        for (int j = 0; j < joints; ++j) {
            const double off = abs(lift(here.q[j], q[j]) - q[j]);
            if (!(off <= most)) most = off;
        }
        return most;
    }

    /// Lets the pivot beside a hinge lead where the joints swing less so.
    template <class Corrected>
    static void calm(const Curve& curve, const Corrected& corrected, const double* q, Stretch& x) noexcept {
        for (int h = 0; h < hinges; ++h) {
            const auto opened = [&](const double* row) {
                return abs(std::sin(to_theta(curve.arm, hinge_joint[h], row[hinge_joint[h]])));
            };
            const double open = min(opened(q), opened(q + joints));
            if (open > through_rule::near) continue;
            const double before = swing(curve, corrected, x, q),
                         few = through_rule::swing * detail::largest_move(q, q + joints);
            const bool shut = open <= through_rule::shut;
            if (!shut && before <= few) continue;
            if (lead(curve, corrected, h, q, shut ? max(before, few) : through_rule::calmer * before, x))
                return;
        }
    }

    /// Lets the pivot beside hinge h lead from a row q to the next, if so no joint swings more than `most`.
    template <class Corrected>
    static bool lead(const Curve& curve, const Corrected& corrected, int h, const double* q, double most,
                     Stretch& x) noexcept {
        const double* const next = q + joints;
        const int pivot = pivot_joint[2 * h];
        Stretch led = x;
        led.lead = pivot + 1;
        led.coefficient[0] = to_theta(curve.arm, pivot, q[pivot]);
        led.coefficient[1] = to_theta(curve.arm, pivot, next[pivot]) - led.coefficient[0];
        led.coefficient[2] = led.coefficient[3] = 0;
        for (const double side : {-1.0, 1.0}) {
            led.side = side;
            const double begins = off_at(curve, corrected, led, q, 0.0),
                         ends = off_at(curve, corrected, led, next, 1.0);
            if (!(begins <= through_rule::there && ends <= through_rule::there)) continue;
            if (!(swing(curve, corrected, led, q) <= most)) continue;
            x = led;
            return true;
        }
        return false;
    }
};

}  // namespace armangle
