// Angles on the circle and their lifts to the line.
#pragma once

#include "scalar.hpp"

namespace armangle {

/// x modulo a turn, in (-pi, pi].
template <class T>
ARMANGLE_INLINE T wrap(T x) noexcept {
    const T y = x - two_pi * round(x * (1.0 / two_pi));
    return select(y <= T(-pi), y + two_pi, y);
}

/// The angle x + 2 pi k nearest to `near`.
template <class T>
ARMANGLE_INLINE T lift(T x, T near) noexcept {
    return x + two_pi * round((near - x) * (1.0 / two_pi));
}

}  // namespace armangle
