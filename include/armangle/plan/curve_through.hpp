// The curve through rows that were found step by step: phi is straight from row to row.
//
//     theta_1 |     .                Near theta_2 = 0 (theta_6 = 0) phi is no guide: neighbouring rows may
//             |    ' '    - phi      have quite different phi, and theta_1 sweeps around between them. There
//             | o-'---'-o - leads    joint 1 (5) leads straight from row to row, also through 0 if rows
//             +------------ s        have both signs of theta_2 (theta_6).
#pragma once

#include <span>

#include "curve.hpp"
#include "path_rows.hpp"
#include "tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the curve through given rows.
struct CurveThroughTuning {
    static constexpr double near =
        0.35;  // |sin| of theta_2, theta_6 up to which the pivot next to it may lead
    static constexpr double shut = 1e-6;    // |sin| of these near which phi has no usable rate
    static constexpr double swing = 0.002;  // share of the move from row to row by which a joint may deviate
    static constexpr double calmer = 0.9;   // largest share of a deviation that leading may leave
    static constexpr double round = 0.5;    // rad: a led stretch lets no joint deviate farther
    static constexpr double there = 1e-5;   // rad: distance of a led stretch's ends from its rows
    static constexpr double looks[] = {1e-6, 1e-4, 0.003, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 0.997};
};

/// If an arm has its own chain, this is the curve of the nominal arm, and the true joint leads.
struct CurveThrough {
    SmoothPlane plane;
    std::vector<Stretch> stretches;
    int torn = -1;  // the first row after which no continuation exists

    /// Computes the curve through `rows` (two or more) of a path. `corrected(curve, stretch, s, posture)`
    /// returns the true configuration next to that of the curve.
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
            const int passed = rows.gc[i] ^ rows.gc[i + 1];
            bool led = true;
            if (passed == 0) calm(curve, corrected, q, stretches[i]);
            if (passed != 0)
                led = (passed == 1 || passed == 4) &&
                      lead(curve, corrected, passed == 1 ? 0 : 1, q, infinity, stretches[i]);
            if (!led && torn < 0) torn = static_cast<int>(i);
        }
        lift_stretches(curve, stretches, rows.q.data(), rows.psi[0]);
        for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
            const double* const q = rows.q.data() + joints * i;
            std::copy(q, q + joints, stretches[i].q);
            std::copy(q + joints, q + 2 * joints, stretches[i].q_end);
            if (torn < 0 && !meets_rows(curve, corrected, q, stretches[i])) torn = static_cast<int>(i);
        }
    }

private:
    /// The largest deviation (rad) of a joint from the straight move between two rows q, stored one after the
    /// other, at some places between them; infinite if the curve has no solution at one.
    template <class Corrected>
    static double swing(const Curve& curve, const Corrected& corrected, const Stretch& x,
                        const double* q) noexcept {
        double most = 0;
        for (const double share : CurveThroughTuning::looks) {
            double straight[joints];
            for (int j = 0; j < joints; ++j) straight[j] = q[j] + share * (q[joints + j] - q[j]);
            const double off = off_at(curve, corrected, x, straight, share);
            if (!(off < infinity)) return infinity;
            most = max(most, off);
        }
        return most;
    }
    /// The largest deviation (rad) of the curve's joints from q, in any revolution, at this share of a
    /// stretch; infinite where the leading joint does not determine psi, NaN without a solution.
    template <class Corrected>
    static double off_at(const Curve& curve, const Corrected& corrected, const Stretch& x, const double* q,
                         double share) noexcept {
        const double s = x.start + share * (x.end - x.start);
        if (x.lead != 0 && !(curve.place(x, s, phi_at(x, s)).room > 0)) return infinity;
        const PlacedPosture here = corrected(curve, x, s, curve.solve(x, s, phi_at(x, s), q, x.psi));
        double most = 0;
        for (int j = 0; j < joints; ++j) {
            const double off = abs(lift(here.q[j], q[j]) - q[j]);
            if (!(off <= most)) most = off;
        }
        return most;
    }

    /// Whether the joints of a stretch at its ends are those of the two rows q, stored one after the other.
    template <class Corrected>
    static bool meets_rows(const Curve& curve, const Corrected& corrected, const double* q,
                           const Stretch& x) noexcept {
        return off_at(curve, corrected, x, q, 0.0) <= CurveThroughTuning::there &&
               off_at(curve, corrected, x, q + joints, 1.0) <= CurveThroughTuning::there;
    }

    /// Makes a neighbour of joint 2 or 6 lead stretch x between two rows q, stored one after the other, if
    /// that joint is near 0 or pi and joints then deviate less, or phi cannot lead; the one nearer to 0 or pi
    /// is tried first. Leaves x unchanged otherwise.
    template <class Corrected>
    static void calm(const Curve& curve, const Corrected& corrected, const double* q, Stretch& x) noexcept {
        double open[hinges];
        for (int h = 0; h < hinges; ++h) {
            const auto opened = [&](const double* row) {
                return abs(std::sin(to_theta(curve.arm, hinge_joint[h], row[hinge_joint[h]])));
            };
            open[h] = min(opened(q), opened(q + joints));
        }
        const int nearer = open[0] <= open[1] ? 0 : 1;
        if (open[nearer] > CurveThroughTuning::near) return;
        const bool shut = open[nearer] <= CurveThroughTuning::shut || !meets_rows(curve, corrected, q, x);
        const double before = swing(curve, corrected, x, q),
                     few = CurveThroughTuning::swing * detail::largest_move(q, q + joints);
        if (!shut && before <= few) return;
        const double most = shut ? infinity : CurveThroughTuning::calmer * before;
        if (lead(curve, corrected, nearer, q, most, x)) return;
        if (open[1 - nearer] <= CurveThroughTuning::near) lead(curve, corrected, 1 - nearer, q, most, x);
    }

    /// Makes the neighbour of joint 2 or 6 (h: 0, 1) lead stretch x between two rows q, stored one after the
    /// other, if no joint then deviates by more than `most` (rad); otherwise leaves x unchanged and returns
    /// false.
    template <class Corrected>
    static bool lead(const Curve& curve, const Corrected& corrected, int h, const double* q, double most,
                     Stretch& x) noexcept {
        const int pivot = pivot_joint[2 * h];
        Stretch led = x;
        led.lead = pivot + 1;
        led.coefficient[0] = to_theta(curve.arm, pivot, q[pivot]);
        led.coefficient[1] = to_theta(curve.arm, pivot, q[joints + pivot]) - led.coefficient[0];
        led.coefficient[2] = led.coefficient[3] = 0;
        for (const double side : {-1.0, 1.0}) {
            led.side = side;
            if (!meets_rows(curve, corrected, q, led)) continue;
            if (!(swing(curve, corrected, led, q) <= min(most, CurveThroughTuning::round))) continue;
            x = led;
            return true;
        }
        return false;
    }
};

}  // namespace armangle

#include "../names/end.hpp"
