// The yardstick. 1 yd = the time of seven atan2 and one sincos of the C library, scalar, one after another
// with nothing else between: the floor of one scalar inverse. Inputs differ from call to call; results are
// only summed.
#pragma once

#include <math.h>

#include <cstddef>

/// Works through n yards: y, x hold 7 n directions, psi n angles. Returns a sum, so that nothing is left out.
inline double walk_yards(const double* y, const double* x, const double* psi, std::size_t n) noexcept {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 7 * i; j < 7 * i + 7; ++j) sum += ::atan2(y[j], x[j]);
        double s, c;
        ::sincos(psi[i], &s, &c);
        sum += s + c;
    }
    return sum;
}
