// The elbow's target: the psi that brings the elbow nearest to a point or farthest along a direction.
//
// With g = GC_4 and the triad (w, e, z) of its circle, the elbow of a self-motion is at
//   E(psi) - S = La (w cos(kappa) + g sin(kappa) (e cos(psi) - z sin(psi))),
// a circle about w. If S-W leans by tau out of the plane across axis 4, w cos(tau) - (z cos + e sin) sin(tau)
// replaces w. Its part along a vector v is const + La ((a v.e - b v.z) cos - (a v.z + b v.e) sin) with a = g
// sin(kappa), b = cos(kappa) sin(tau). The maximum is at psi = atan2(-a v.z - b v.e, a v.e - b v.z). |P -
// E(psi)|^2 = const - 2 (P - S) . E(psi): the elbow nearest to a point P is the farthest along v = P - S.
#pragma once

#include "self_motion.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The kinds of target for the elbow.
enum class Wish : std::uint8_t { psi, point, direction };

/// The elbow's target: a psi, a point to be near (m), or a direction to be far along. Point and direction are
/// in the frame that poses are given in.
struct Towards {
    Wish wish = Wish::psi;
    double psi = not_a_number;  // rad; for Wish::psi
    Vec3<double> target{};
};

/// The reason why no psi is best: all elbows of the circle are equally good.
enum class Indifferent : std::uint8_t {
    no,
    still,    // the arm is stretched or folded (or the pose out of reach): psi does not move the elbow
    on_axis,  // the point lies on the axis shoulder-wrist, or the direction is along it
};

/// The best psi for a target, or why none is best.
struct WishedPsi {
    double psi;  // rad in (-pi, pi]; NaN if none is best
    Indifferent why;
};

/// The psi (rad) at which the elbow of the self-motion is as near to its target as the circle allows; NaN
/// with a reason if all are equally good. A target that is a psi is returned itself, wrapped.
inline WishedPsi psi_towards(const Arm& arm, const SelfMotion<double>& m, const Towards& towards) noexcept {
    if (towards.wish == Wish::psi) return {wrap(towards.psi), Indifferent::no};
    const Circle<double>& c = m.circle;
    const double a = m.gc.elbow * c.triangle.kappa.sin, b = c.triangle.kappa.cos * m.elbow.tilt.sin;
    if (is_folded(c) || (a == 0.0 && b == 0.0)) return {not_a_number, Indifferent::still};
    Vec3<double> v = arm.has_base ? arm.base_inverse.rotation * towards.target : towards.target;
    double size = norm(v);
    if (towards.wish == Wish::point) {
        v = v + arm.base_inverse.position - Vec3<double>{0, 0, arm.d_bs};
        size += arm.size;
    }
    const double along_e = dot(c.e, v), along_z = dot(c.z, v);
    if (!(hypot(along_e, along_z) > tolerance::vanishing * size)) return {not_a_number, Indifferent::on_axis};
    return {wrap(atan2(-a * along_z - b * along_e, a * along_e - b * along_z)), Indifferent::no};
}

}  // namespace armangle

#include "../names/end.hpp"
