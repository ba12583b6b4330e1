// A second reference plane, for whole paths: singular in one direction only, which is chosen away from the path.
//
// The normal `side` is carried from `pole` to w by the rotation that takes the one to the other the shortest way. The angle
// phi measured from there differs from psi by an offset of the wrist's direction alone, and turns slowly wherever w is not
// near -pole; so a wrist over the base axis is a place like any other. Only + - * /.
#pragma once

#include <vector>

#include "circle.hpp"

namespace armangle {

struct SmoothPlane {
    Vec3<double> pole{0, 0, 1}, side{1, 0, 0};  // orthonormal

    template <class T>
    Vec3<T> operator()(const Vec3<T>&, const Vec3<T>& w) const noexcept {
        const T share = dot(w, spread<T>(side)) / (T(1.0) + dot(w, spread<T>(pole)));
        return spread<T>(side) - (w + spread<T>(pole)) * share;
    }
};

/// Circle of a pose 0T7 in phi.
template <class T>
Circle<T> circle(const Arm& arm, const Pose<T>& flange, const SmoothPlane& plane) noexcept {
    return circle_on(arm, triad(arm, flange, plane), flange);
}

/// The plane whose singular direction stays farthest from the given directions of the wrist.
inline SmoothPlane smooth_plane(const std::vector<Vec3<double>>& wrists) {
    constexpr int candidates = 96;
    const double golden = pi * (3.0 - std::sqrt(5.0));
    SmoothPlane best;
    double most = -1;
    for (int i = 0; i < candidates; ++i) {
        const double z = 1.0 - 2.0 * i / (candidates - 1), r = std::sqrt((1.0 - z) * (1.0 + z));
        const SinCos<double> turn = sin_cos(golden * i);
        const Vec3<double> pole{r * turn.cos, r * turn.sin, z};
        double least = 2;
        for (const Vec3<double>& w : wrists) {
            least = min(least, 1.0 + dot(w, pole));
            if (least <= most) break;
        }
        if (least > most) most = least, best.pole = pole;
    }
    const Vec3<double> off = abs(best.pole.z) < 0.9 ? Vec3<double>{0, 0, 1} : Vec3<double>{1, 0, 0};
    const Vec3<double> across = cross(best.pole, off);
    best.side = across * (1.0 / norm(across));
    return best;
}

}  // namespace armangle
