// What stands about an arm, and what of the arm may touch it: views of arrays that are made once.
//
//   body of the chain     links        moves with                       here
//   ground                0, world     nothing                          balls, solids
//   tool                  7, hand      the pose, not psi                held
//   arm plane             3, 4         the pose, and turns by psi       parts
//   between them          1, 2, 5, 6   a joint's angle too              swings
//
// With pose and branch fixed, links 3 and 4 are one rigid body: theta_4 does not depend on psi. What is
// centred on a joint's axis is at rest in both links that the joint joins, so that shapes on axis 1 are of
// the ground, those on axes 3 and 5 of the arm plane, those on axis 7 of the tool; off these axes they swing.
#pragma once

#include "../circle/self_motion.hpp"
#include "../limits/limit_table.hpp"
#include "solids.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// A rod of link 3 or 4, in that link's DH frame.
struct Part {
    Rod rod;
    bool lower;  // of link 4
};

/// A rod of link 1, 2, 5 or 6 off the joint axis, at joint angle 0, in the frame of the neighbouring link (0,
/// 3, 4 or 7) around whose joint it swings.
struct SwingingPart {
    Rod rod;
    int link;
};

/// Two shapes of the arm that are tested against each other: a number among the obstacles and one among the
/// links.
struct OwnPair {
    std::uint16_t obstacle, link;
};

/// Eight balls for vector operations; the last block is filled up with balls that nothing touches.
struct BallBlock {
    double x[8], y[8], z[8], radius[8];
};

/// A bounding ball around consecutive blocks of balls, or around consecutive groups, starting at `first`.
struct BallGroup {
    Vec3<double> centre;
    double radius;
    int first, count;
};

/// The number of blocks in a group, and of groups in a cluster.
inline constexpr int group_blocks = 8, group_groups = 16;

/// Up to this number of parts, bounds do not save time.
inline constexpr int few_parts = 2;
inline constexpr int most_parts = 64, most_links = 254, most_obstacles = 65000;
inline constexpr std::uint16_t no_ball = 0xffff;
/// m beyond the clearance that own pairs are proven apart, or below it that they are always near: farther
/// than any rounding.
inline constexpr double spare_apart = 1e-6;

/// Obstacles are counted: those of the user, then own rods of link 0, then what is held, then what swings,
/// then parts. Links are counted: parts, then rods of link 0, then what is held, then what swings. All
/// lengths m; ground in the frame of the DH base, `held` in DH frame 7.
struct Scene {
    const BallBlock* blocks;
    const std::uint16_t* ball_id;  // of each ball, eight a block; no_ball: none
    int block_count;
    const BallGroup* groups;    // of blocks, all of them in order
    const BallGroup* clusters;  // of groups, all of them in order
    int cluster_count;
    const Solid* solids;  // no balls of the user's
    const std::uint16_t* solid_id;
    int solid_count;
    const Solid* held;
    int held_count, first_held;  // of obstacles
    const Part* parts;
    int part_count, base_count, first_base;  // of obstacles: those of link 0
    Part bound[2];                           // rods in the arm plane that hold the parts (bound_parts)
    int bound_count = 0;                     // 0: none were made
    const SwingingPart* swings;
    int swing_count;
    const OwnPair* own;  // parts and what swings, among each other
    int own_count;
    const std::uint8_t* ignored;  // [obstacle][link], 1: may touch
    int link_count;
    const double* apart = nullptr;  // [obstacle - first_base][link]: m, at least, whatever the joints
    double clearance;               // of all pairs
    double soft = 0;                // m beyond it, which policies keep where they can
    Tag base_tag;  // the pair of an obstacle and link 0 that touch, whatever the pose; 0: none

    /// Whether an obstacle and a link are allowed to touch.
    bool may_touch(int obstacle, int link) const noexcept {
        return ignored[obstacle * link_count + link] != 0;
    }
    /// Whether two own shapes are proven never to come as near as the clearance (never_nearer.hpp).
    bool never_meet(int obstacle, int link) const noexcept {
        return apart != nullptr && obstacle >= first_base &&
               apart[(obstacle - first_base) * link_count + link] > clearance + spare_apart;
    }
    /// Whether a pair is skipped by arcs and proofs: it may touch, or it never can.
    bool unasked(int obstacle, int link) const noexcept {
        return may_touch(obstacle, link) || never_meet(obstacle, link);
    }
    /// The number of the first rod of links 1, 2, 5 and 6 in the count of obstacles.
    int first_swing_obstacle() const noexcept { return first_held + held_count; }
    /// The number of the first rod of links 1, 2, 5 and 6 in the count of links.
    int first_swing_link() const noexcept { return part_count + base_count + held_count; }
};

/// Stores two rods in the arm plane in `scene` that enclose all parts of link 3 and of link 4, for a quick
/// test. With few parts none are made.
inline void bound_parts(Scene& scene) noexcept {
    scene.bound_count = 0;
    if (scene.part_count <= few_parts) return;  // these are asked themselves
    for (const bool lower : {false, true}) {
        // along the bone: y of frame 3, z of frame 4, at the mean x of the plane
        const auto along = [lower](const Vec3<double>& p) { return lower ? p.z : p.y; };
        const auto place = [lower](double x, double way) {
            return lower ? Vec3<double>{x, 0.0, way} : Vec3<double>{x, way, 0.0};
        };
        double low = infinity, high = -infinity, sum = 0, radius = 0;
        int ends = 0;
        const auto for_ends = [&](const auto& visit) {
            for (int k = 0; k < scene.part_count; ++k) {
                if (scene.parts[k].lower != lower) continue;
                visit(scene.parts[k].rod.begin, scene.parts[k].rod.radius);
                visit(scene.parts[k].rod.end, scene.parts[k].rod.radius);
            }
        };
        for_ends([&](const Vec3<double>& p, double) {
            low = min(low, along(p));
            high = max(high, along(p));
            sum += p.x;
            ++ends;
        });
        if (ends == 0) continue;
        const double x = sum / ends;
        for_ends([&](const Vec3<double>& p, double own) {
            radius = max(radius, norm(p - place(x, along(p))) + own);
        });
        scene.bound[scene.bound_count++] = {{place(x, low), place(x, high), radius * (1.0 + 1e-12)}, lower};
    }
}

/// The tag of a pair, an obstacle and a link, for the ends of arcs; tag_obstacle() and tag_link() give both
/// back.
constexpr Tag pair_tag(int obstacle, int link) noexcept {
    return static_cast<Tag>(obstacle + 1) << 16 | static_cast<Tag>(link + 1) << 8 |
           make_tag(0, Side::obstacle);
}
/// The number of the obstacle in a tag; -1 if it has none.
constexpr int tag_obstacle(Tag tag) noexcept { return static_cast<int>(tag >> 16) - 1; }
/// The number of the link in a tag; -1 if it has none.
constexpr int tag_link(Tag tag) noexcept { return static_cast<int>(tag >> 8 & 0xff) - 1; }

/// Where a rod given in a DH frame (0..7) rests: link 0, 7, 3 or 4. What lies on a joint's axis rests in both
/// links that the joint joins, so that axis 1 of link 1 is of link 0, axis 3 of link 2 of link 3, axis 5 of
/// link 5 of link 4 and axis 7 of link 6 of link 7. The rod is taken there, as it is where the joint's angle
/// is 0; off the axis it swings. Eq. (1).
struct Resting {
    int link;
    bool swings;
};

/// Moves `rod`, given in DH frame `frame` (0 to 7), into the frame of the link at which it rests, as it is at
/// joint angle 0. Returns that link, and whether the rod is off the axis and swings.
inline Resting resting_link(const Arm& arm, int frame, Rod& rod) noexcept {
    const auto moved = [&rod](int to, bool along_z, const Pose<double>& by) {
        const auto off = [along_z](const Vec3<double>& p) { return p.x != 0 || (along_z ? p.y : p.z) != 0; };
        const bool swings = off(rod.begin) || off(rod.end);
        rod = placed(by, rod);
        return Resting{to, swings};
    };
    const Vec3<double> x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    switch (frame) {
        case 1:  // its y axis points down axis 1, the origin is the shoulder
            return moved(0, false, {{x, -z, y}, {0, 0, arm.d_bs}});
        case 2:  // its z axis is axis 3, and y of frame 3
            return moved(3, true, {{x, -z, y}, {-arm.a_3, -arm.d_se, 0}});
        case 5:  // its y axis points down axis 5, the origin is the wrist
            return moved(4, false, {{x, -z, y}, {0, 0, arm.d_ew}});
        case 6:  // its z axis is axis 7
            return moved(7, true, {{x, y, z}, {0, 0, -arm.d_wf}});
        default: return {frame, false};
    }
}

/// Calls visit(block) for all blocks of balls except those of groups for which meets(group) is false.
template <class Meets, class Visit>
inline void for_blocks(const Scene& scene, const Meets& meets, const Visit& visit) noexcept {
    for (int c = 0; c < scene.cluster_count; ++c) {
        const BallGroup& cluster = scene.clusters[c];
        if (!meets(cluster)) continue;
        for (int g = cluster.first; g < cluster.first + cluster.count; ++g) {
            const BallGroup& group = scene.groups[g];
            if (!meets(group)) continue;
            for (int block = group.first; block < group.first + group.count; ++block) visit(block);
        }
    }
}

/// Calls visit(solid, obstacle) for all shapes fixed to the ground, those of link 0 too. Groups of balls for
/// which meets(group) is false are skipped.
template <class Meets, class Visit>
inline void for_ground(const Scene& scene, const Meets& meets, const Visit& visit) noexcept {
    for_blocks(scene, meets, [&](int at) {
        const BallBlock& block = scene.blocks[at];
        for (int i = 0; i < 8; ++i) {
            const std::uint16_t id = scene.ball_id[8 * at + i];
            const Vec3<double> centre{block.x[i], block.y[i], block.z[i]};
            if (id != no_ball) visit(Solid{SolidKind::ball, block.radius[i], centre, centre, {}}, id);
        }
    });
    for (int k = 0; k < scene.solid_count; ++k) visit(scene.solids[k], scene.solid_id[k]);
}
/// Calls visit(solid, obstacle) for the shapes of link 0.
template <class Visit>
inline void for_base(const Scene& scene, const Visit& visit) noexcept {
    for (int k = 0; k < scene.solid_count; ++k)
        if (scene.solid_id[k] >= scene.first_base) visit(scene.solids[k], scene.solid_id[k]);
}

/// Calls visit(solid, id) for every solid on the ground, balls included.
template <class Visit>
inline void for_ground(const Scene& scene, const Visit& visit) noexcept {
    for_ground(scene, [](const BallGroup&) { return true; }, visit);
}

/// The frame of the elbow circle in the DH base: origin in the shoulder, x along shoulder-wrist, y along the
/// elbow axis z3 at psi = 0, z = x X y.
inline Pose<double> axis_frame(const Arm& arm, const Triad<double>& c) noexcept {
    return {{c.w, c.z, c.e}, {0, 0, arm.d_bs}};
}

/// DH frames 3 and 4 at psi = 0, and 7, in the frame of the axis. Eq. (1), (15), (20).
template <class T>
struct AxisFrames {
    Pose<T> upper, lower, flange;
};

/// Writes DH frames 3 and 4, with the shoulder as origin, to `upper` and `lower`, from the elbow and the
/// directions of the arm plane: w along shoulder-wrist, f away from it in the plane, z normal to the plane.
template <class T>
inline void plane_frames(const Arm& arm, const Elbow<T>& e, Vec3<T> w, Vec3<T> z, const Vec3<T>& f,
                         Pose<T>& upper, Pose<T>& lower) noexcept {
    if (e.tilted) {
        const Vec3<T> along = combine(w, e.tilt.cos, z, -e.tilt.sin);
        z = combine(w, e.tilt.sin, z, e.tilt.cos);
        w = along;
    }
    const Vec3<T> x3 = combine(w, e.beta.sin, f, e.beta.cos), y3 = combine(w, e.beta.cos, f, -e.beta.sin);
    upper = {{x3, y3, z}, y3 * T(arm.d_se) + x3 * T(arm.a_3)};
    const Vec3<T> x4 = combine(w, e.gamma.sin, f, e.gamma.cos), z4 = combine(w, e.gamma.cos, f, -e.gamma.sin);
    lower = {{x4, -z, z4}, upper.position + z * T(arm.d_4) + x4 * T(arm.a_4)};
}

/// Computes DH frames 3 and 4 and the flange at psi = 0, in the frame of the axis shoulder-wrist of a
/// self-motion.
template <class T>
inline AxisFrames<T> axis_frames(const Arm& arm, const SelfMotion<T>& m) noexcept {
    const Circle<T>& c = m.circle;
    const T zero(0.0), one(1.0);
    AxisFrames<T> out;
    plane_frames<T>(arm, m.elbow, {one, zero, zero}, {zero, one, zero}, {zero, zero, one}, out.upper,
                    out.lower);
    const Vec3<T> z7{c.tool_w.z, c.tool_z.z, c.tool_e.z};
    out.flange = {{{c.tool_w.x, c.tool_z.x, c.tool_e.x}, {c.tool_w.y, c.tool_z.y, c.tool_e.y}, z7},
                  Vec3<T>{c.distance, zero, zero} + z7 * T(arm.d_wf)};
    return out;
}

/// DH frames 3 and 4 of a configuration, in the DH base.
template <class T>
struct PlaneFrames {
    Pose<T> upper, lower;
};

/// Computes DH frames 3 and 4, in the DH base, at psi (sine and cosine) for an elbow on the circle `c`.
template <class T>
inline PlaneFrames<T> plane_frames(const Arm& arm, const Triad<T>& c, const Elbow<T>& elbow,
                                   const SinCos<T>& psi) noexcept {
    PlaneFrames<T> out;
    plane_frames(arm, elbow, c.w, combine(c.z, psi.cos, c.e, psi.sin), combine(c.e, psi.cos, c.z, -psi.sin),
                 out.upper, out.lower);
    const Vec3<T> shoulder{T(0.0), T(0.0), T(arm.d_bs)};
    out.upper.position = out.upper.position + shoulder;
    out.lower.position = out.lower.position + shoulder;
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
