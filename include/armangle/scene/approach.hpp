// What is nearest between two shapes.
#pragma once

#include "../numbers/linalg.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The nearest points of the cores of two shapes, and their distance (m); it is negative behind the plane of
/// a half-space. For a convex hull or a distance field it is a lower bound, as proofs need.
struct Approach {
    Vec3<double> on_rod, on_solid;
    double distance;
};

namespace detail {

/// The approach of two points.
inline Approach between(const Vec3<double>& p, const Vec3<double>& q) noexcept { return {p, q, norm(p - q)}; }

/// Returns the approach with the smaller distance.
inline Approach nearer(const Approach& a, const Approach& b) noexcept {
    return b.distance < a.distance ? b : a;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
