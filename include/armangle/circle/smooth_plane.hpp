// A second reference plane, for whole paths. It is singular in one direction only, chosen away from the path.
//
// The normal `side` is carried from `pole` to w by the shortest rotation. The angle phi measured from there
// differs from psi by an offset that depends on the wrist's direction alone. phi turns slowly unless w is
// near -pole, so a wrist over the base axis is no special case. Uses only + - * /.
#pragma once

#include "circle.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A zero of the arm angle: `side` carried from `pole` to the wrist's direction by the shortest rotation.
struct SmoothPlane {
    Vec3<double> pole{0, 0, 1}, side{1, 0, 0};  // orthonormal

    /// The normal of the plane phi = 0 for the wrist's direction w.
    template <class T>
    Vec3<T> operator()(const Vec3<T>&, const Vec3<T>& w) const noexcept {
        const Vec3<T> image = (w + spread<T>(pole)) * (T(1.0) / (T(1.0) + dot(w, spread<T>(pole))));
        return detail::carried(spread<T>(side), image, dot(w, spread<T>(side)));
    }
};

/// Computes the circle of a flange pose 0T7, with its zero at phi = 0 of this plane.
template <class T>
Circle<T> circle(const Arm& arm, const Pose<T>& flange, const SmoothPlane& plane) noexcept {
    return circle_on(arm, triad(arm, flange, plane), flange);
}

}  // namespace armangle

#include "../names/end.hpp"
