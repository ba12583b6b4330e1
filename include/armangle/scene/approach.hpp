// What is nearest between two shapes.
#pragma once

#include "../numbers/linalg.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Two points, one of each core, and their distance (m; of a half-space negative behind its plane). Of a hull
/// or a field the distance is a lower bound, which is what proofs need.
struct Approach {
    Vec3<double> on_rod, on_solid;
    double distance;
};

namespace detail {

inline Approach between(const Vec3<double>& p, const Vec3<double>& q) noexcept { return {p, q, norm(p - q)}; }

/// The nearer of two.
inline Approach nearer(const Approach& a, const Approach& b) noexcept {
    return b.distance < a.distance ? b : a;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
