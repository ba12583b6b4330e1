// The one lower bound of all proofs: what a function that bends little can fall to between two samples.
//
//     F |o             .o      F is the least of functions g with g'' <= A, and at least F_a, F_b at the
//     ends.
//       | `-._     _.-'        Then g less the line through its ends, plus A t (h - t) / 2, is concave and
//       not |     `---'            negative at both ends, so that
//     0 +------------- t           F(t) >= F_a + (F_b - F_a) t / h - A t (h - t) / 2.
//        0             h
#pragma once

#include "../numbers/scalar.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The least value that F can have between two samples F_a and F_b at distance h, if its second derivative is
/// at most A. Lower bounds of the samples suffice. If A is infinite, the result is -infinity.
inline double least_between(double F_a, double F_b, double A, double h) noexcept {
    const double rise = F_b - F_a, t = A * h > 0 ? 0.5 * h - rise / (A * h) : -1.0;
    if (!(t > 0 && t < h)) return min(F_a, F_b);
    return F_a + rise * t / h - 0.5 * A * t * (h - t);
}

}  // namespace armangle

#include "../names/end.hpp"
