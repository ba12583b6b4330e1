// Correction of theta of the joint that leads a run of stretches, for an arm whose joints differ slightly
// from the curve's.
#pragma once

#include <cstddef>
#include <vector>

#include "../names/begin.hpp"

namespace armangle {

/// The correction c0 + ... + c5 t^5 (rad) of a leading joint's angle, t in [0, 1]. Holds doubles alone, so
/// that it fits into an array.
struct LeadShift {
    double start, end, coefficient[6];

    /// The correction (rad) at s.
    template <class T>
    T at(const T& s) const noexcept {
        const T t = (s - T(start)) / (T(end) - T(start));
        T sum(coefficient[5]);
        for (int k = 4; k >= 0; --k) sum = T(coefficient[k]) + t * sum;
        return sum;
    }
};

/// One shift for each led run of a curve, in order.
using LeadShifts = std::vector<LeadShift>;

inline constexpr std::size_t lead_shift_width = sizeof(LeadShift) / sizeof(double);

}  // namespace armangle

#include "../names/end.hpp"
