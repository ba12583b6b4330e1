// Bytes of a fuzzer as arms, poses and angles: any bit pattern, numbers where branches change, and plain
// ones.
#pragma once

#include <armangle/armangle.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace fuzz {

using namespace armangle;

inline void demand(bool holds, const char* law) {
    if (holds) return;
    std::fprintf(stderr, "law broken: %s\n", law);
    std::abort();
}

class Input {
public:
    Input(const unsigned char* data, std::size_t size) : data_(data), size_(size) {}

    unsigned byte() noexcept { return at_ < size_ ? data_[at_++] : 0u; }

    double raw() noexcept {
        unsigned char bits[8];
        for (unsigned char& b : bits) b = static_cast<unsigned char>(byte());
        double out;
        std::memcpy(&out, bits, sizeof(out));
        return out;
    }

    /// A number: any bits, one of the special ones, or an even one in [-1, 1] times `scale`.
    double number(double scale) noexcept {
        static constexpr double special[] = {0.0,  -0.0,   pi,     -pi,      half_pi,   -half_pi,    two_pi,
                                             1e-9, -1e-9,  1e-13,  1e-7,     1.0,       -1.0,        1e6,
                                             -1e6, 1e-300, 5e-324, infinity, -infinity, not_a_number};
        const unsigned kind = byte();
        if (kind < 16) return raw();
        if (kind < 64) return special[byte() % (sizeof(special) / sizeof(special[0]))];
        const unsigned high = byte(), low = byte();
        return scale * (static_cast<double>(high * 256u + low) / 32767.5 - 1.0);
    }

    /// A number that is finite and within +-most.
    double bounded(double scale, double most) noexcept {
        const double x = number(scale);
        return std::fabs(x) <= most ? x : scale * 0.3;
    }

    Pose<double> rigid(double scale) noexcept {
        double q[4], sum = 0;
        for (double& x : q) {
            x = bounded(1.0, 1.0);
            sum += x * x;
        }
        if (!(sum > 1e-6)) {
            q[0] = 1;
            q[1] = q[2] = q[3] = 0;
            sum = 1;
        }
        const double k = 1.0 / std::sqrt(sum), w = q[0] * k, x = q[1] * k, y = q[2] * k, z = q[3] * k;
        const Vec3<double> p{bounded(scale, 1e3), bounded(scale, 1e3), bounded(scale, 1e3)};
        return {{{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                 {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                 {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}},
                p};
    }

    /// An arm that the Python side would accept; lengths between 1 mm and 10 m where they must be positive.
    Arm arm() noexcept {
        ArmParameters p;
        const auto link = [&] { return std::fmax(1e-3, std::fabs(bounded(1.0, 10.0))); };
        p.d_bs = bounded(1.0, 10.0);
        p.d_se = link();
        p.d_ew = link();
        p.d_wf = bounded(0.3, 10.0);
        const unsigned options = byte();
        if (options & 1) {
            p.a_3 = bounded(0.1, 1.0);
            p.a_4 = bounded(0.1, 1.0);
        }
        if (options & 2) p.base = rigid(1.0);
        if (options & 4) p.tool = rigid(0.3);
        if (options & 8) p.d_ew = p.d_se;
        for (int i = 0; i < joints; ++i) {
            p.sign[i] = byte() & 1 ? -1.0 : 1.0;
            if (options & 16) p.offset[i] = bounded(pi, 1e6);
            const double a = limit(), b = limit();
            p.limits.lower[i] = a < b ? a : b;
            p.limits.upper[i] = a < b ? b : a;
            if (p.limits.lower[i] == infinity || p.limits.upper[i] == -infinity) {
                p.limits.lower[i] = -infinity;
                p.limits.upper[i] = infinity;
            }
        }
        return make_arm(p);
    }

    Posture reachable(const Arm& arm) noexcept {
        double q[joints];
        for (double& x : q) x = bounded(pi, 100.0);
        return forward(arm, q);
    }

private:
    double limit() noexcept {
        const double x = number(3.5);
        return std::isinf(x) || std::fabs(x) <= 1e5 ? x : 2.0;
    }

    const unsigned char* data_;
    std::size_t size_, at_ = 0;
};

/// What rounding may do to a position (m) or an axis at this size of numbers.
inline double rounding(const Arm& arm, const Pose<double>& pose) noexcept {
    const auto size = [](const Pose<double>& p) { return norm(p.position); };
    double turned = 0;
    for (int i = 0; i < joints; ++i) turned = max(turned, std::fabs(arm.offset[i]));
    return 1e-12 *
           (1.0 + arm.reach + std::fabs(arm.d_bs) + std::fabs(arm.d_wf) + size(arm.base) + size(arm.tool) +
            size(pose)) *
           (1.0 + turned);
}

inline double pose_error(const Pose<double>& a, const Pose<double>& b) noexcept {
    const auto& [ax, ay, az] = a.rotation;
    const auto& [bx, by, bz] = b.rotation;
    return norm(a.position - b.position) + norm(ax - bx) + norm(ay - by) + norm(az - bz);
}

}  // namespace fuzz
