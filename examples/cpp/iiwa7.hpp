// The KUKA LBR iiwa 7 R800 of the paper: Table 1 and Table 3. Limits in degrees in the data sheet, radians
// here.
#pragma once

#include <armangle/armangle.hpp>

namespace example {

inline constexpr double degree = armangle::pi / 180.0;

inline armangle::Arm iiwa7() noexcept {
    armangle::ArmParameters p;
    p.d_bs = 0.34;
    p.d_se = 0.4;
    p.d_ew = 0.4;
    p.d_wf = 0.126;
    constexpr double limit[armangle::joints] = {170, 120, 170, 120, 170, 120, 175};
    for (int i = 0; i < armangle::joints; ++i) {
        p.limits.lower[i] = -limit[i] * degree;
        p.limits.upper[i] = limit[i] * degree;
    }
    return armangle::make_arm(p);
}

}  // namespace example
