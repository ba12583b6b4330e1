// What is added to theta of the joint that leads a run of a curve's stretches, on an arm whose joints are not
// quite the curve's.
#pragma once

#include <cstddef>
#include <vector>

#include "../names/begin.hpp"

namespace armangle {

/// c0 + ... + c5 t^5, t in [0, 1]. Doubles alone, so that it travels as an array.
struct LeadShift {
    double start, end, coefficient[6];

    template <class T>
    T at(const T& s) const noexcept {
        const T t = (s - T(start)) / (T(end) - T(start));
        T sum(coefficient[5]);
        for (int k = 4; k >= 0; --k) sum = T(coefficient[k]) + t * sum;
        return sum;
    }
};

/// Of a curve's runs that are led, in their order.
using LeadShifts = std::vector<LeadShift>;

inline constexpr std::size_t lead_shift_width = sizeof(LeadShift) / sizeof(double);

}  // namespace armangle

#include "../names/end.hpp"
