// What stands about an arm, and what of the arm may touch it: views of arrays that are made once.
//
//   body of the chain     links        moves with                       here
//   ground                0, world     nothing                          balls, solids
//   tool                  7, hand      the pose, not psi                held
//   arm plane             3, 4         the pose, and turns by psi       parts
//
// With pose and branch fixed, links 3 and 4 are one rigid body: theta_4 does not depend on psi. What is
// centred on a joint's axis is at rest in both links that the joint joins, so that shapes on axis 1 are of
// the ground, those on axes 3 and 5 of the arm plane, those on axis 7 of the tool.
#pragma once

#include "../circle/self_motion.hpp"
#include "../limits/limit_table.hpp"
#include "solids.hpp"

namespace armangle {

/// A rod of link 3 or 4, in that link's DH frame.
struct Part {
    Rod rod;
    bool lower;  // of link 4
};

/// Balls as lanes take them; the last block is filled up with balls that nothing reaches.
struct BallBlock {
    double x[8], y[8], z[8], radius[8];
};

inline constexpr int most_parts = 64, most_links = 254, most_obstacles = 65000;
inline constexpr std::uint16_t no_ball = 0xffff;

/// Obstacles are counted: those of the user, then own rods of link 0, then what is held. Links are counted:
/// parts, then rods of link 0, then what is held. All lengths m; ground in the frame of the DH base, `held`
/// in DH frame 7.
struct Scene {
    const BallBlock* blocks;
    const std::uint16_t* ball_id;  // of each ball, eight a block; no_ball: none
    int block_count;
    const Solid* solids;  // no balls
    const std::uint16_t* solid_id;
    int solid_count;
    const Solid* held;
    int held_count, first_held;  // of obstacles
    const Part* parts;
    int part_count, base_count, first_base;  // of obstacles: those of link 0
    const std::uint8_t* ignored;             // [obstacle][link], 1: may touch
    int link_count;
    double clearance;  // of all pairs
    Tag base_tag;      // the pair of an obstacle and link 0 that touch, whatever the pose; 0: none

    bool may_touch(int obstacle, int link) const noexcept {
        return ignored[obstacle * link_count + link] != 0;
    }
};

/// A pair as the tag of the ends that it makes.
constexpr Tag pair_tag(int obstacle, int link) noexcept {
    return static_cast<Tag>(obstacle + 1) << 16 | static_cast<Tag>(link + 1) << 8 |
           make_tag(0, Side::obstacle);
}
constexpr int tag_obstacle(Tag tag) noexcept { return static_cast<int>(tag >> 16) - 1; }  // -1: none
constexpr int tag_link(Tag tag) noexcept { return static_cast<int>(tag >> 8 & 0xff) - 1; }

/// Where a rod given in a DH frame (0..7) rests: link 0, 7, 3 or 4, or -1: on none of them. What lies on a
/// joint's axis rests in both links, so that axis 1 of link 1 is of link 0, axis 3 of link 2 of link 3, axis
/// 5 of link 5 of link 4 and axis 7 of link 6 of link 7; the rod is taken there. Eq. (1).
inline int resting_link(const Arm& arm, int frame, Rod& rod) noexcept {
    const auto on = [&rod](bool along_z) {
        const auto is = [along_z](const Vec3<double>& p) { return p.x == 0 && (along_z ? p.y : p.z) == 0; };
        return is(rod.begin) && is(rod.end);
    };
    const auto move = [&rod](const Pose<double>& to) { rod = placed(to, rod); };
    const Vec3<double> x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    switch (frame) {
        case 1:  // its y axis points down axis 1, the origin is the shoulder
            if (!on(false)) return -1;
            move({{x, -z, y}, {0, 0, arm.d_bs}});
            return 0;
        case 2:  // its z axis is axis 3, and y of frame 3
            if (!on(true)) return -1;
            move({{x, -z, y}, {-arm.a_3, -arm.d_se, 0}});
            return 3;
        case 5:  // its y axis points down axis 5, the origin is the wrist
            if (!on(false)) return -1;
            move({{x, -z, y}, {0, 0, arm.d_ew}});
            return 4;
        case 6:  // its z axis is axis 7
            if (!on(true)) return -1;
            move({{x, y, z}, {0, 0, -arm.d_wf}});
            return 7;
        default: return frame;
    }
}

/// visit(solid, obstacle) for all that stands on the ground, link 0 too.
template <class Visit>
inline void for_ground(const Scene& scene, const Visit& visit) noexcept {
    for (int k = 0; k < 8 * scene.block_count; ++k) {
        if (scene.ball_id[k] == no_ball) continue;
        const BallBlock& block = scene.blocks[k / 8];
        const Vec3<double> centre{block.x[k % 8], block.y[k % 8], block.z[k % 8]};
        visit(Solid{SolidKind::ball, block.radius[k % 8], centre, centre, {}}, scene.ball_id[k]);
    }
    for (int k = 0; k < scene.solid_count; ++k) visit(scene.solids[k], scene.solid_id[k]);
}

/// Where a circle is: x along shoulder-wrist, y the zero of psi, z = x X y; origin the shoulder. In the DH
/// base.
inline Pose<double> axis_frame(const Arm& arm, const Triad<double>& c) noexcept {
    return {{c.w, c.z, c.e}, {0, 0, arm.d_bs}};
}

/// DH frames 3 and 4 at psi = 0, and 7, in the frame of the axis. Eq. (1), (15), (20).
template <class T>
struct AxisFrames {
    Pose<T> upper, lower, flange;
};

template <class T>
inline AxisFrames<T> axis_frames(const Arm& arm, const SelfMotion<T>& m) noexcept {
    const Elbow<T>& e = m.elbow;
    const Circle<T>& c = m.circle;
    const T zero(0.0), one(1.0);
    Vec3<T> w{one, zero, zero}, z3{zero, one, zero};
    const Vec3<T> f{zero, zero, one};
    if (e.tilted) {
        w = {e.tilt.cos, -e.tilt.sin, zero};
        z3 = {e.tilt.sin, e.tilt.cos, zero};
    }
    AxisFrames<T> out;
    const Vec3<T> x3 = combine(w, e.beta.sin, f, e.beta.cos), y3 = combine(w, e.beta.cos, f, -e.beta.sin);
    out.upper = {{x3, y3, z3}, y3 * T(arm.d_se) + x3 * T(arm.a_3)};
    const Vec3<T> x4 = combine(w, e.gamma.sin, f, e.gamma.cos), z4 = combine(w, e.gamma.cos, f, -e.gamma.sin);
    out.lower = {{x4, -z3, z4}, out.upper.position + z3 * T(arm.d_4) + x4 * T(arm.a_4)};
    const Vec3<T> z7{c.tool_w.z, c.tool_z.z, c.tool_e.z};
    out.flange = {{{c.tool_w.x, c.tool_z.x, c.tool_e.x}, {c.tool_w.y, c.tool_z.y, c.tool_e.y}, z7},
                  Vec3<T>{c.distance, zero, zero} + z7 * T(arm.d_wf)};
    return out;
}

/// Frames 3, 4 and 7 of a posture, in the DH base.
template <class T>
struct LinkFrames {
    Pose<T> upper, lower, flange;
};

/// Those of a self-motion at psi, with the flange that it is of.
template <class T>
inline LinkFrames<T> link_frames(const Arm& arm, const Pose<T>& flange, const SelfMotion<T>& m,
                                 const SinCos<T>& psi) noexcept {
    const Circle<T>& c = m.circle;
    const AxisFrames<T> at = axis_frames(arm, m);
    const Mat3<T> turned{c.w, combine(c.z, psi.cos, c.e, psi.sin), combine(c.e, psi.cos, c.z, -psi.sin)};
    const Pose<T> axis{turned, {T(0.0), T(0.0), T(arm.d_bs)}};
    return {axis * at.upper, axis * at.lower, flange};
}

}  // namespace armangle
