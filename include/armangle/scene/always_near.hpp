// How far apart two shapes of one arm ever come, at most, whatever its joints: what always touches is a
// mistake of the shapes, which no pose and no arm angle mends.
//
//     link i  ===( joints i+1 .. j, all through one point P )===  link j
//
// Where all joints between two links turn about axes through one point, shoulder, elbow or wrist, that point
// is at rest in both: so the links are never farther apart than both together are from it.
#pragma once

#include "never_nearer.hpp"
#include "scene.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// m: axes so near to a point pass through it.
inline constexpr double through_a_point = 1e-9;

/// A shape of the arm, given in the DH frame of its link.
struct LinkShape {
    Solid solid;
    int link;
};

/// The shape of the arm that has number `obstacle` among the obstacles (at least first_base), in the DH frame
/// of its link.
inline LinkShape link_shape(const Arm& arm, const Scene& scene, int obstacle) noexcept {
    if (obstacle < scene.first_held) {
        int k = 0;
        while (scene.solid_id[k] != obstacle) ++k;
        return {scene.solids[k], 0};
    }
    if (obstacle < scene.first_swing_obstacle()) return {scene.held[obstacle - scene.first_held], joints};
    const int arm_rod = obstacle - scene.first_swing_obstacle();
    if (arm_rod >= scene.swing_count) {
        const Part& part = scene.parts[arm_rod - scene.swing_count];
        return {as_solid(part.rod), part.lower ? 4 : 3};
    }
    // back from where resting_link took it
    const SwingingPart& part = scene.swings[arm_rod];
    const bool above = part.link == 1 || part.link == 5;
    const Pose<double> step = dh_frame(arm, above ? part.link : part.link + 1, 0.0);
    return {placed(above ? inverted(step) : step, as_solid(part.rod)), part.link};
}

/// The number among the obstacles of the arm's shape that has number `link` among the links.
inline int obstacle_of_link(const Scene& scene, int link) noexcept {
    if (link < scene.part_count) return scene.first_swing_obstacle() + scene.swing_count + link;
    if (link < scene.first_swing_link()) return scene.first_base + link - scene.part_count;
    return scene.first_swing_obstacle() + link - scene.first_swing_link();
}

}  // namespace detail

/// Two shapes of an arm and an upper bound of their distance (m) over all joint angles.
struct OwnDistance {
    Tag pair;  // 0: none
    double most;
};

/// Finds two shapes of the arm that are nearer than the clearance at all joint angles; pair 0 and infinity if
/// there are none. Pairs that are allowed to touch are skipped. Everything is computed at theta = 0: a point
/// fixed to two links has the same distance from their shapes at all joint angles.
inline OwnDistance always_near(const Arm& arm, const Scene& scene) noexcept {
    Pose<double> frame[joints + 1]{identity_pose()};
    for (int k = 1; k <= joints; ++k) frame[k] = frame[k - 1] * detail::dh_frame(arm, k, 0.0);
    unsigned
        on[joints + 1]{};  // bit k: joint k + 1, which turns about z of frame k, has the point on its axis
    for (int p = 0; p <= joints; ++p)
        for (int k = 0; k < joints; ++k) {
            const Vec3<double> off = frame[p].position - frame[k].position;
            if (norm(cross(frame[k].rotation.z, off)) < detail::through_a_point) on[p] |= 1u << k;
        }
    double far[most_links][joints + 1];  // m, of a shape's surface from a point
    int at[most_links];
    for (int link = 0; link < scene.link_count; ++link) {
        const detail::LinkShape shape = detail::link_shape(arm, scene, detail::obstacle_of_link(scene, link));
        const Solid here = placed(frame[shape.link], shape.solid);
        at[link] = shape.link;
        for (int p = 0; p <= joints; ++p)
            far[link][p] = nearest(frame[p].position, frame[p].position, here).distance - here.radius;
    }
    for (int one = 0; one < scene.link_count; ++one)
        for (int link = 0; link < scene.link_count; ++link) {
            const int obstacle = detail::obstacle_of_link(scene, one);
            if (at[link] >= at[one] || scene.may_touch(obstacle, link)) continue;
            const unsigned between = (1u << at[one]) - (1u << at[link]);
            for (int p = 0; p <= joints; ++p) {
                const double most = far[one][p] + far[link][p];
                if ((on[p] & between) == between && most < scene.clearance - spare_apart)
                    return {pair_tag(obstacle, link), most};
            }
        }
    return {0, infinity};
}

}  // namespace armangle

#include "../names/end.hpp"
