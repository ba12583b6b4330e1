// The shapes of an arm that move, by the frames that they are fixed to.
//
//   shape   number as arm rod       fixed to
//   part    0 .. part_count - 1      DH frame 3 or 4
//   swing   part_count ..            link 1, 2, 5 or 6, from the frame that it swings about (swing.hpp)
//   held    counted by itself        DH frame 7
#pragma once

#include "../circle/joint_function.hpp"
#include "../numbers/rotations.hpp"
#include "scene.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Rotates a frame by `by` (sine and cosine) around the line through (x, 0, 0) parallel to its own y axis.
template <class T>
inline Pose<T> turned_about_y(const Pose<T>& home, double x, const SinCos<T>& by) noexcept {
    const auto& [r, p] = home;
    const Vec3<T> ahead = combine(r.x, by.cos, r.z, -by.sin);
    return {{ahead, r.y, combine(r.x, by.sin, r.z, by.cos)}, p + (r.x - ahead) * T(x)};
}

/// The frames that a scene's shapes are fixed to, in the DH base. swinging: of links 1, 2, 5, 6 (swing.hpp).
template <class T>
struct SceneFrames {
    PlaneFrames<T> plane;
    Pose<T> flange, swinging[4];
};

/// The index of link 1, 2, 5 or 6 in SceneFrames::swinging.
constexpr int swinging_place(int link) noexcept { return link < 3 ? link - 1 : link - 3; }

/// Computes the frames of links 1, 2, 5 and 6 from the flange and frames 3 and 4, which are set already;
/// angle(j): sine and cosine of theta of joint j (0 to 6).
template <class T, class Angle>
inline void add_swinging(const Arm& arm, const Angle& angle, SceneFrames<T>& out) noexcept {
    const auto back = [&angle](int j) {
        const SinCos<T> ahead = angle(j);
        return SinCos<T>{-ahead.sin, ahead.cos};
    };
    const Vec3<T> zero{T(0.0), T(0.0), T(0.0)}, x{T(1.0), T(0.0), T(0.0)}, y{T(0.0), T(1.0), T(0.0)},
        z{T(0.0), T(0.0), T(1.0)};
    out.swinging[0] = turned_about_z(Pose<T>{{x, y, z}, zero}, angle(0));
    out.swinging[1] = turned_about_y(out.plane.upper, -arm.a_3, back(2));
    out.swinging[2] = turned_about_z(out.plane.lower, angle(4));
    out.swinging[3] = turned_about_z(out.flange, back(6));
}

/// Computes the frames of links 1, 2, 5 and 6 from the flange and frames 3 and 4, which are set already, and
/// the joint angles as direction vectors.
template <class T>
inline void add_swinging(const Arm& arm, const Directions<T>& d, SceneFrames<T>& out) noexcept {
    const auto angle = [&d](int j) {
        const T per = T(1.0) / sqrt(d.x[j] * d.x[j] + d.y[j] * d.y[j]);
        return SinCos<T>{d.y[j] * per, d.x[j] * per};
    };
    add_swinging(arm, angle, out);
}

/// The frame to which an arm rod is fixed. Arm rods are numbered: first the parts of links 3 and 4 (the arm
/// plane), then the shapes of links 1, 2, 5 and 6 (swings).
template <class T>
inline const Pose<T>& arm_rod_frame(const Scene& scene, const SceneFrames<T>& f, int arm_rod) noexcept {
    if (arm_rod < scene.part_count) return scene.parts[arm_rod].lower ? f.plane.lower : f.plane.upper;
    return f.swinging[swinging_place(scene.swings[arm_rod - scene.part_count].link)];
}
/// The arm rod with this number, in its arm_rod_frame().
inline const Rod& arm_rod_at(const Scene& scene, int arm_rod) noexcept {
    return arm_rod < scene.part_count ? scene.parts[arm_rod].rod
                                      : scene.swings[arm_rod - scene.part_count].rod;
}
/// The number of arm rods.
inline int arm_rod_count(const Scene& scene) noexcept { return scene.part_count + scene.swing_count; }
/// The number of an arm rod in the count of links (see Scene).
inline int link_of_arm_rod(const Scene& scene, int arm_rod) noexcept {
    return arm_rod < scene.part_count ? arm_rod : scene.first_swing_link() + arm_rod - scene.part_count;
}
/// The arm rod of a link number (see Scene), which must be that of a part or a swing.
inline int arm_rod_of_link(const Scene& scene, int link) noexcept {
    return link < scene.part_count ? link : link - scene.first_swing_link() + scene.part_count;
}
/// The arm rod of an obstacle number (see Scene), which must be that of a shape of links 1 to 6.
inline int arm_rod_of_obstacle(const Scene& scene, int obstacle) noexcept {
    const int at = obstacle - scene.first_swing_obstacle();
    return at < scene.swing_count ? scene.part_count + at : at - scene.swing_count;
}

/// Calls found(ball, obstacle) for the balls of a block whose surfaces are within `reach` (m) of a rod's
/// segment.
template <class Found>
void balls_near(const Scene& scene, int block, const Rod& rod, double reach, const Found& found) {
    using Eight = Lane<8>;
    const BallBlock& balls = scene.blocks[block];
    const Vec3<Eight> q{Eight::load(balls.x), Eight::load(balls.y), Eight::load(balls.z)};
    const Vec3<double> d = rod.end - rod.begin;
    const double square = dot(d, d), per = square > 0 ? 1.0 / square : 0.0;
    const Vec3<Eight> off = q - spread<Eight>(rod.begin);
    const Eight share = min(max(dot(off, spread<Eight>(d)) * Eight(per), Eight(0.0)), Eight(1.0));
    const Vec3<Eight> rest = off - spread<Eight>(d) * share;
    const Eight R = Eight::load(balls.radius) + Eight(reach);
    for_each_bit(bits(dot(rest, rest) < R * R), [&](int i) {
        const int id = scene.ball_id[8 * block + i];
        const Vec3<double> centre{balls.x[i], balls.y[i], balls.z[i]};
        if (id != no_ball) found(Solid{SolidKind::ball, balls.radius[i], centre, centre, {}}, id);
    });
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
