// The arm angles at which nothing touches, exactly, and who blocks the others.
//
//     obstacles seen from the circle's axis -> each pair's blocked arc -> their union -> what is left, tagged
//     (8 balls at a time)                      blocked_arc, witnesses      covered        here
#pragma once

#include "../limits/feasible.hpp"
#include "covered.hpp"
#include "moving_pair.hpp"
#include "scene.hpp"
#include "witnesses.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// A rod of link 3 or 4 in the frame of the axis shoulder-wrist at psi = 0, prepared for the tests against
/// obstacles.
struct MetPart {
    Rod rod;
    double reach;  // m: radius and clearance
    enum class Kind : std::uint8_t { sphere, planar, other } kind;
    int pieces;
    PlanarRod piece[2];
    double along, off, length;  // a ball about it: place along the axis and off it, half its length
};

/// Writes a rod, transformed by `frame` into the frame of the axis, to `out` with its reach, radius and
/// clearance, and classifies it as sphere, planar or other.
inline void meet(const Pose<double>& frame, const Part& part, double clearance, MetPart& out) noexcept {
    const bool sphere = part.rod.is_sphere();
    out.rod.begin = frame.rotation * part.rod.begin + frame.position;
    out.rod.end = sphere ? out.rod.begin : frame.rotation * part.rod.end + frame.position;
    out.rod.radius = part.rod.radius;
    out.reach = part.rod.radius + clearance;
    const Rod& rod = out.rod;
    out.kind = MetPart::Kind::sphere;
    out.length = 0;
    Vec3<double> middle = rod.begin;
    if (!sphere) {
        out.kind = MetPart::Kind::other;
        out.length = 0.5 * norm(rod.end - rod.begin);
        middle = (rod.begin + rod.end) * 0.5;
    }
    out.along = middle.x;
    out.off = off_axis(middle);
    if (!sphere && rod.begin.y == 0 && rod.end.y == 0) {
        out.kind = MetPart::Kind::planar;
        out.pieces = planar_rods(rod.begin, rod.end, out.piece);
    }
}

/// Describes how a rod of link 1, 2, 5 or 6 moves with psi, in the frame of the axis shoulder-wrist.
inline MovingRod moving(const Arm& arm, const SwingingPart& part, const Pose<double>& to_axis,
                        const AxisFrames<double>& frames, const JointFunctions<double>& joint) noexcept {
    const auto about = [&](const Pose<double>& home, const Vec3<double>& point, const Vec3<double>& axis,
                           bool turns, const Swing& swing) {
        return MovingRod(placed(home, part.rod), turns, swing, home.rotation * point + home.position,
                         home.rotation * axis);
    };
    const Vec3<double> origin{0, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    switch (part.link) {
        case 1: return about(to_axis, origin, z, false, Swing(joint.pivot[0], 1.0));
        case 2: return about(frames.upper, {-arm.a_3, 0, 0}, y, true, Swing(joint.pivot[1], -1.0));
        case 5: return about(frames.lower, origin, z, true, Swing(joint.pivot[2], 1.0));
        default: return about(frames.flange, origin, z, false, Swing(joint.pivot[3], -1.0));
    }
}

/// Describes the motion of all rods of links 1, 2, 5 and 6 of a scene; writes scene.swing_count entries.
inline void make_moving(const Arm& arm, const Scene& scene, const SelfMotion<double>& m,
                        const Pose<double>& to_axis, const AxisFrames<double>& frames,
                        MovingRod* out) noexcept {
    if (scene.swing_count == 0) return;
    const JointFunctions<double> joint = joint_functions(m);
    for (int k = 0; k < scene.swing_count; ++k) out[k] = moving(arm, scene.swings[k], to_axis, frames, joint);
}

/// Whether two shapes are nearer than the clearance (m). Cores that meet touch even if both radii are 0; the
/// distance from a half-space is signed, so that its sign decides.
inline bool touch(const Solid& one, const Solid& other, double clearance) noexcept {
    const double distance = nearest(one, other).distance, R = one.radius + other.radius + clearance;
    const bool flat = one.kind == SolidKind::half_space || other.kind == SolidKind::half_space;
    return distance < R || (distance <= 0 && !flat);
}

}  // namespace detail

/// The first pair of a tool shape and a ground shape that are nearer than the clearance with the flange at
/// 0T7, without pairs that may touch; 0 if there is none.
inline Tag held_contact(const Scene& scene, const Pose<double>& flange) noexcept {
    Tag found = 0;
    for (int h = 0; h < scene.held_count && !found; ++h) {
        const Solid held = placed(flange, scene.held[h]);
        const int link = scene.part_count + scene.base_count + h;
        const Ball bound = around(held);
        const auto far = [&](const Solid& solid) {
            if (solid.kind == SolidKind::half_space) return false;
            const Ball other = around(solid);
            return norm(bound.centre - other.centre) > bound.radius + other.radius + scene.clearance;
        };
        const auto near = [&](const BallGroup& group) {
            const double reach = bound.radius + group.radius + scene.clearance;
            return !found && norm(bound.centre - group.centre) < reach;
        };
        for_ground(scene, near, [&](const Solid& solid, int id) {
            if (found || far(solid) || scene.may_touch(id, link)) return;
            if (detail::touch(held, solid, scene.clearance)) found = pair_tag(id, link);
        });
    }
    return found;
}

namespace detail {

/// For groups of balls larger than this (m) is_covered is not evaluated: it would never be true.
inline constexpr double covering_radius = 0.3;

/// Pairs that a query ignores.
struct LeftOut {
    static constexpr int most = 8;
    Tag pair[most];
    int count = 0;

    /// Whether the list has this pair.
    bool holds(Tag asked) const noexcept {
        for (int k = 0; k < count; ++k)
            if (pair[k] == asked) return true;
        return false;
    }
};

/// Collects the blocked arcs of all pairs of shapes for one pose and branch.
class Clearing {
public:
    /// Places the shapes of the arm in the frame of the axis shoulder-wrist, where psi rotates them; pairs in
    /// `left_out` (null: none) are ignored, and blocked arcs go to `out`.
    Clearing(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, Covered& out,
             const LeftOut* left_out = nullptr) noexcept
        : scene_(scene),
          out_(out),
          left_out_(left_out),
          axis_(axis_frame(arm, m.circle)),
          to_axis_(inverted(axis_)),
          frames_(axis_frames(arm, m)) {
        for (int k = 0; k < scene.part_count; ++k) {
            const Part& part = scene.parts[k];
            meet(part.lower ? frames_.lower : frames_.upper, part, scene.clearance, part_[k]);
            const bool planar = part_[k].kind == MetPart::Kind::planar;
            planar_ |= planar;
            round_ |= !planar;
            along_[k] = part_[k].along;
            off_[k] = part_[k].off;
            reach_[k] = planar ? -infinity : part_[k].reach + part_[k].length;
        }
        for (int k = scene.part_count; k % 8 != 0; ++k) {
            along_[k] = off_[k] = 0;
            reach_[k] = -infinity;
        }
        for (int k = 0; k < scene.bound_count; ++k) {
            const Part& part = scene.bound[k];
            meet(part.lower ? frames_.lower : frames_.upper, part, scene.clearance, bound_[k]);
        }
        const bool few = scene.part_count <= few_parts;
        bounds_ = few ? scene.part_count : scene.bound_count;
        for (int k = 0; k < bounds_; ++k) {
            if (few) bound_[k] = part_[k];
            if (bound_[k].kind != MetPart::Kind::planar) bounds_ = 0;  // a tilted elbow
        }
        make_moving(arm, scene, m, to_axis_, frames_, swing_);
    }

    /// Adds the arcs that obstacles, the tool and other links block for the rods of links 1 to 6; ends early
    /// if they cover the circle.
    void parts_against_all() noexcept {
        for (int c = 0; c < scene_.cluster_count && scene_.part_count > 0; ++c) {
            const BallGroup& cluster = scene_.clusters[c];
            if (!adds(cluster)) continue;
            const bool one = cluster.count == 1;  // which the cluster is then
            for (int g = cluster.first; g < cluster.first + cluster.count && !out_.all; ++g)
                if (one || adds(scene_.groups[g])) against_balls(scene_.groups[g]);
        }
        for (int k = 0; k < scene_.solid_count && !out_.all; ++k)
            against_solid(scene_.solids[k], to_axis_, scene_.solid_id[k]);
        for (int k = 0; k < scene_.held_count && !out_.all; ++k)
            against_solid(scene_.held[k], frames_.flange, scene_.first_held + k);
        for (int k = 0; k < scene_.swing_count && !out_.all; ++k) swing_against_all(k);
        for (int k = 0; k < scene_.own_count && !out_.all; ++k) own_pair(scene_.own[k]);
    }

    /// The result of held_contact() for this pose.
    Tag held_against_ground() const noexcept { return held_contact(scene_, axis_ * frames_.flange); }

private:
    using Eight = Lane<8>;

    /// Whether a ball of a group can block arm angles that are not blocked already.
    bool adds(const BallGroup& group) const noexcept {
        const Vec3<double> q = to_axis_.rotation * group.centre + to_axis_.position;
        const double rho = off_axis(q);
        bool meets = bounds_ == 0 || scene_.part_count <= few_parts;  // these are asked below
        for (int k = 0; k < bounds_ && !meets; ++k) meets = meets_bound(bound_[k], q.x, rho, group.radius);
        if (!meets) return false;
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            if (meets_bound(part, q.x, rho, group.radius) && !is_covered(part, q, rho, group.radius))
                return true;
        }
        return false;
    }

    /// Whether everything that a ball of this radius around q (and any shape within it) can block for a part
    /// is blocked already.
    bool is_covered(const MetPart& part, const Vec3<double>& q, double rho, double radius) const noexcept {
        if (out_.all) return true;
        if (out_.count == 0 || radius > covering_radius) return false;
        const double R = part.reach + radius;
        const auto covered = [this](const BlockedArc& arc) {
            return arc.half == 0 || (arc.half < pi && covers(out_, arc.centre, arc.half));
        };
        if (part.kind == MetPart::Kind::sphere) return covered(point_point(part.rod.begin, q, R));
        if (part.kind != MetPart::Kind::planar) return false;
        for (int piece = 0; piece < part.pieces; ++piece) {
            const PlanarRod& rod = part.piece[piece];
            if (!covered(planar_arc(rod, q, rho, planar_threshold(rod, q.x, rho, R)))) return false;
        }
        return true;
    }

    /// The balls of a group that come near the parts at some psi, in the frame of the axis.
    struct Near {
        double x[8 * group_blocks], y[8 * group_blocks], z[8 * group_blocks], rho[8 * group_blocks],
            radius[8 * group_blocks];
        std::uint16_t id[8 * group_blocks];
        int count = 0;
    };

    /// Collects the balls of a group that come near the bounds of the parts at some psi. Eight balls are
    /// tested at a time, without branches, so that no block waits for another.
    void find_near(const BallGroup& group, Near& out) const noexcept {
        const Pose<double>& to = to_axis_;
        const Mat3<Eight> rotation{spread<Eight>(to.rotation.x), spread<Eight>(to.rotation.y),
                                   spread<Eight>(to.rotation.z)};
        const Vec3<Eight> position = spread<Eight>(to.position);
        double seen[group_blocks][4][8];
        unsigned near[group_blocks];
        for (int i = 0; i < group.count; ++i) {
            const BallBlock& balls = scene_.blocks[group.first + i];
            const Vec3<Eight> from{Eight::load(balls.x), Eight::load(balls.y), Eight::load(balls.z)};
            const Vec3<Eight> q = rotation * from + position;
            const Eight rho = off_axis(q), radius = Eight::load(balls.radius);
            q.x.store(seen[i][0]);
            q.y.store(seen[i][1]);
            q.z.store(seen[i][2]);
            rho.store(seen[i][3]);
            near[i] = bounds_ == 0 ? 0xffu : 0u;
            for (int k = 0; k < bounds_; ++k)
                for (int piece = 0; piece < bound_[k].pieces; ++piece)
                    near[i] |=
                        bits(meets_planar(bound_[k].piece[piece], q.x, rho, radius + Eight(bound_[k].reach)));
        }
        for (int i = 0; i < group.count; ++i)
            for_each_bit(near[i], [&](int k) {
                const int at = out.count++;
                out.x[at] = seen[i][0][k];
                out.y[at] = seen[i][1][k];
                out.z[at] = seen[i][2][k];
                out.rho[at] = seen[i][3][k];
                out.radius[at] = scene_.blocks[group.first + i].radius[k];
                out.id[at] = scene_.ball_id[8 * (group.first + i) + k];
            });
    }

    /// Adds the arcs that the balls of a group block.
    void against_balls(const BallGroup& group) noexcept {
        Near near;
        find_near(group, near);
        if (near.count == 0) return;
        if (planar_) planar_against(near);
        if (round_) round_against(near);
    }

    /// Adds the arcs that the balls of `near` block for planar parts, eight balls at a time; fills up `near`
    /// with balls that block nothing.
    void planar_against(Near& near) noexcept {
        for (int i = near.count; i % 8 != 0; ++i) {  // filled up with what nothing reaches
            near.x[i] = near.rho[i] = 0;
            near.radius[i] = -infinity;
        }
        for (int first = 0; first < near.count; first += 8) {
            const Eight x = Eight::load(near.x + first), rho = Eight::load(near.rho + first),
                        radius = Eight::load(near.radius + first);
            for (int k = 0; k < scene_.part_count; ++k) {
                const MetPart& part = part_[k];
                if (part.kind != MetPart::Kind::planar) continue;
                for (int piece = 0; piece < part.pieces; ++piece) {
                    const PlanarRod& rod = part.piece[piece];
                    const Eight R = max(radius + Eight(part.reach), Eight(0.0));
                    for_each_bit(bits(meets_planar(rod, x, rho, R)), [&](int i) {
                        const int at = first + i;
                        const Vec3<double> place{near.x[at], near.y[at], near.z[at]};
                        const double reach = near.radius[at] + part.reach;
                        add(planar_arc(rod, place, near.rho[at],
                                       planar_threshold(rod, place.x, near.rho[at], reach)),
                            near.id[at], k);
                    });
                }
            }
        }
    }

    /// Adds the arcs that these balls block for spheres and for rods that are not planar, eight parts at a
    /// time.
    void round_against(const Near& near) noexcept {
        for (int i = 0; i < near.count; ++i) {
            const Vec3<double> at{near.x[i], near.y[i], near.z[i]};
            for (int first = 0; first < scene_.part_count; first += 8) {
                const Eight g = Eight::load(along_ + first) - Eight(at.x),
                            apart = Eight::load(off_ + first) - Eight(near.rho[i]),
                            reach = max(Eight::load(reach_ + first) + Eight(near.radius[i]), Eight(0.0));
                for_each_bit(bits(mul_add(g, g, apart * apart) < reach * reach), [&](int j) {
                    const MetPart& part = part_[first + j];
                    const double R = part.reach + near.radius[i];
                    if (part.kind == MetPart::Kind::sphere)
                        add(point_point(part.rod.begin, at, R), near.id[i], first + j);
                    else
                        certified({SolidKind::ball, 0.0, at, at, {}}, R, near.id[i], first + j);
                });
            }
        }
    }

    /// Whether a part comes within its reach of a ball of this radius (m), at (along, off) from the axis, at
    /// some psi.
    static bool meets_bound(const MetPart& part, double along, double off, double radius) noexcept {
        const double R = radius + part.reach;
        if (part.kind != MetPart::Kind::planar)
            return hypot(along - part.along, off - part.off) < R + part.length;
        bool meets = false;
        for (int piece = 0; piece < part.pieces; ++piece)
            meets |= meets_planar(part.piece[piece], along, off, R);
        return meets;
    }

    /// The number among the obstacles of ball i of a block of eight.
    int id(int block, int i) const noexcept { return scene_.ball_id[8 * block + i]; }

    /// Adds the arcs that one solid blocks for all parts; `frame` transforms the solid into the frame of the
    /// axis.
    void against_solid(const Solid& solid, const Pose<double>& frame, int id) noexcept {
        if (solid.kind == SolidKind::half_space) return against_plane(placed(frame, solid), id);
        Ball bound = around(solid);
        bound.centre = frame.rotation * bound.centre + frame.position;
        const double off = off_axis(bound.centre);
        bool turned = false;
        Solid here = solid;
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            const double more = more_reach(solid, 2.0 * part.length, part.reach);
            if (!meets_bound(part, bound.centre.x, off, bound.radius + more)) continue;
            if (!turned) here = placed(frame, solid);
            turned = true;
            const double R = solid.radius + part.reach;
            if (solid.kind == SolidKind::ball && part.kind == MetPart::Kind::sphere)
                add(point_point(part.rod.begin, here.a, R), id, k);
            else if (solid.kind == SolidKind::ball && part.kind == MetPart::Kind::planar)
                for (int piece = 0; piece < part.pieces; ++piece)
                    add(planar_arc(part.piece[piece], here.a, off,
                                   planar_threshold(part.piece[piece], here.a.x, off, R)),
                        id, k);
            else
                certified(here, R, id, k);
        }
    }

    /// The extra distance (m) that a bounding test needs for a distance field, whose distance from a rod of
    /// this length is a lower bound; 0 for other solids.
    static double more_reach(const Solid& solid, double length, double reach) noexcept {
        return solid.kind == SolidKind::field ? reach_of_places(*solid.field, length, reach) : 0.0;
    }

    /// Adds the arcs at which the parts reach into a half-space.
    void against_plane(const Solid& plane, int id) noexcept {
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            const double limit = plane.b.x + plane.radius + part.reach;
            add(point_plane(part.rod.begin, plane.a, limit), id, k);
            if (part.kind != MetPart::Kind::sphere) add(point_plane(part.rod.end, plane.a, limit), id, k);
        }
    }

    /// Adds the arcs that a solid blocks for a part, from certified distances. R (m): sum of the radii and
    /// the clearance.
    void certified(const Solid& solid, double R, int id, int part) noexcept {
        if (scene_.unasked(id, part)) return;
        if (solid.kind == SolidKind::field)
            return moved({MovingRod(part_[part].rod, true), solid, R}, id, part);
        Witnesses(part_[part].rod, solid, R).find([&](double lower, double upper) {
            block(0.5 * (lower + upper), 0.5 * (upper - lower), id, part);
        });
    }

    /// Adds the arcs that obstacles and the tool block for moving rod k of link 1, 2, 5 or 6.
    void swing_against_all(int k) noexcept {
        const MovingRod& rod = swing_[k];
        const int link = scene_.first_swing_link() + k;
        const double along = rod.centre().x, off = off_axis(rod.centre()),
                     margin = rod.radius() + scene_.clearance;
        const auto near = [&](const BallGroup& group) {
            const Vec3<double> centre = to_axis_.rotation * group.centre + to_axis_.position;
            return !out_.all && comes_near(rod, {centre, group.radius}, margin);
        };
        for_blocks(scene_, near, [&](int block) {
            const BallBlock& balls = scene_.blocks[block];
            const Vec3<Eight> from{Eight::load(balls.x), Eight::load(balls.y), Eight::load(balls.z)};
            const Mat3<Eight> rotation{spread<Eight>(to_axis_.rotation.x), spread<Eight>(to_axis_.rotation.y),
                                       spread<Eight>(to_axis_.rotation.z)};
            const Vec3<Eight> q = rotation * from + spread<Eight>(to_axis_.position);
            const Eight reach = Eight::load(balls.radius) + Eight(margin + rod.bound());
            const Vec3<Eight> apart = q - spread<Eight>(rod.centre());
            const Eight g = q.x - Eight(along), across = off_axis(q) - Eight(off);
            const Eight square = rod.turns() ? mul_add(g, g, across * across) : dot(apart, apart);
            for_each_bit(bits(square < reach * reach), [&](int i) {
                const Vec3<double> at{q.x[i], q.y[i], q.z[i]};
                if (!out_.all && !scene_.may_touch(id(block, i), link))
                    moved({rod, {SolidKind::ball, 0.0, at, at, {}}, balls.radius[i] + margin}, id(block, i),
                          link);
            });
        });
        const auto solid = [&](const Solid& given, const Pose<double>& frame, int id) {
            if (scene_.unasked(id, link)) return;
            const Solid here = placed(frame, given);
            const double reach = given.radius + margin;
            const Rod& own = scene_.swings[k].rod;
            const double more = more_reach(given, norm(own.end - own.begin), reach);
            if (given.kind != SolidKind::half_space && !comes_near(rod, around(here), margin + more)) return;
            moved({rod, here, reach}, id, link);
        };
        for (int s = 0; s < scene_.solid_count && !out_.all; ++s)
            solid(scene_.solids[s], to_axis_, scene_.solid_id[s]);
        for (int s = 0; s < scene_.held_count && !out_.all; ++s)
            solid(scene_.held[s], frames_.flange, scene_.first_held + s);
    }

    /// Whether the bounding ball of a moving rod comes within `margin` (m) of a ball at some psi.
    static bool comes_near(const MovingRod& rod, const Ball& ball, double margin) noexcept {
        const Vec3<double>&a = rod.centre(), &b = ball.centre;
        const double apart = rod.turns() ? hypot(a.x - b.x, off_axis(a) - off_axis(b)) : norm(a - b);
        return apart < rod.bound() + ball.radius + margin;
    }

    /// Adds the arcs at which a moving pair touches; remembers if the budget of distances was spent.
    void moved(MovingPair pair, int id, int link) noexcept {
        const bool all_asked = pair.find([&](double lower, double upper) {
            block(0.5 * (lower + upper), 0.5 * (upper - lower), id, link);
        });
        out_.coarse |= !all_asked;
    }

    /// Adds the arcs at which two shapes of the arm touch. Parts of links 3 and 4 do not move against each
    /// other; if such a pair touches, it blocks the whole circle.
    void own_pair(const OwnPair& pair) noexcept {
        if (scene_.never_meet(pair.obstacle, pair.link)) return;
        const int first = pair.obstacle - scene_.first_swing_obstacle(), second = pair.link;
        const bool swings = first < scene_.swing_count, both = second >= scene_.part_count;
        if (!swings) {
            const Rod &a = part_[first - scene_.swing_count].rod, &b = part_[second].rod;
            if (nearest(a.begin, a.end, as_solid(b)).distance < a.radius + b.radius + scene_.clearance)
                add(blocks_all, pair.obstacle, second);
            return;
        }
        const MovingRod& a = swing_[first];
        const MovingRod b =
            both ? swing_[second - scene_.first_swing_link()] : MovingRod(part_[second].rod, true);
        const double reach = a.radius() + b.radius() + scene_.clearance, near = reach + a.bound() + b.bound();
        if (apart_at_least(a, b) < near) moved({a, b, reach}, pair.obstacle, second);
    }

    /// A lower bound over all psi of the distance (m) of the centres of two rods' bounding balls.
    static double apart_at_least(const MovingRod& a, const MovingRod& b) noexcept {
        if (a.turns() == b.turns()) return norm(a.centre() - b.centre());
        return hypot(a.centre().x - b.centre().x, off_axis(a.centre()) - off_axis(b.centre()));
    }

    /// Adds the arc that an obstacle blocks for a part, unless the pair may touch.
    void add(const BlockedArc& arc, int id, int part) noexcept {
        if (arc.half > 0 && !scene_.may_touch(id, part)) block(arc.centre, arc.half, id, part);
    }

    /// Blocks the arc centre +- half (rad) by a pair.
    void block(double centre, double half, int id, int link) noexcept {
        const Tag pair = pair_tag(id, link);
        if (left_out_ == nullptr || !left_out_->holds(pair)) cover(out_, centre, half, pair);
    }

    const Scene& scene_;
    Covered& out_;
    const LeftOut* left_out_;  // nullptr: none
    Pose<double> axis_, to_axis_;
    AxisFrames<double> frames_;
    MetPart part_[most_parts], bound_[2];
    double along_[most_parts], off_[most_parts], reach_[most_parts];  // of parts that are not planar
    bool planar_ = false, round_ = false;
    int bounds_ = 0;  // of them that are asked first
    MovingRod swing_[most_parts];
};

}  // namespace detail

/// The arm angles at which an arm is collision-free: arcs whose ends are tagged with the pair that blocks
/// there.
struct Cleared {
    ArcSet arcs;
    Status status;  // OK, UNREACHABLE, FOLDED, POSE_BLOCKED or CLEARANCE
    Tag blocking;   // the pair that blocks the whole circle alone; 0: none does
    bool coarse;    // narrow arcs were left out: there were more than a set holds
};

/// Writes the arcs between the blocked ones, the whole circle if there are none; the ends are tagged with the
/// pair that blocks there.
inline void open_arcs(const Covered& covered, ArcSet& out) noexcept {
    make_empty(out);
    if (covered.all) return;
    if (covered.count == 0) return make_full(out);
    for (int i = 0; i < covered.count; ++i) {
        const bool last = i + 1 == covered.count;
        const Arc &here = covered.arc[i], &next = covered.arc[last ? 0 : i + 1];
        detail::push(out, {here.upper, next.lower + (last ? two_pi : 0.0), here.upper_tag, next.lower_tag});
    }
}

/// Computes the arm angles at which no link comes nearer than the clearance to an obstacle or another link,
/// without joint limits. `turning_alone` skips the tool and link 0 against the ground, which psi does not
/// move.
inline void clear(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, Cleared& out,
                  bool turning_alone = false) noexcept {
    make_empty(out.arcs);
    out.blocking = 0;
    out.coarse = false;
    out.status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (is_unreachable(m.circle) || is_folded(m.circle)) return;
    Covered covered;
    detail::Clearing clearing(arm, scene, m, covered);
    out.status = Status::POSE_BLOCKED;
    if (!turning_alone) out.blocking = scene.base_tag ? scene.base_tag : clearing.held_against_ground();
    if (out.blocking) return;
    clearing.parts_against_all();
    open_arcs(covered, out.arcs);
    out.blocking = covered.all_tag;
    out.coarse = covered.coarse;
    out.status = out.arcs.empty() ? Status::CLEARANCE : Status::OK;
}

/// Computes the collision-free psi of a pose in all eight branches. Without rods of links 1, 2, 5 and 6 the
/// result depends on the sign of the elbow alone and is computed once for each.
inline void clear_all(const Arm& arm, const Scene& scene, const Pose<double>& pose,
                      Cleared (&out)[configurations]) noexcept {
    for (int gc = 0; gc < configurations; ++gc) {
        const int like = scene.swing_count > 0 ? gc : gc & index({1.0, -1.0, 1.0});
        if (like < gc)
            out[gc] = out[like];
        else
            clear(arm, scene, self_motion(arm, pose, gc), out[gc]);
    }
}

/// Within the arc of `open` that contains psi, writes the arcs that also keep the soft clearance. False if
/// there are none or if no arc contains psi. Tool and link 0 are skipped: psi does not move them.
inline bool keep_soft(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, const ArcSet& open,
                      double psi, ArcSet& out) noexcept {
    const Place place = find(open, psi);
    if (place.index < 0) return false;
    Scene asked = scene;
    asked.clearance += scene.soft;
    Covered covered;
    detail::Clearing(arm, asked, m, covered).parts_against_all();
    ArcSet here, far;
    make_empty(here);
    here.arc[here.count++] = open.arc[place.index];
    here.full = open.full;
    open_arcs(covered, far);
    intersect(here, far, out);
    return !out.empty();
}

/// The first pair of link 0 and an obstacle of the user that touch, whatever the pose; 0 if there is none.
inline Tag base_contact(const Scene& scene) noexcept {
    const auto pair = [&](const Solid& base, int own, const Solid& solid, int id) -> Tag {
        const int link = scene.part_count + own - scene.first_base;
        if (id >= scene.first_base || scene.may_touch(id, link)) return 0;
        return detail::touch(base, solid, scene.clearance) ? pair_tag(id, link) : 0;
    };
    Tag found = 0;
    for_base(scene, [&](const Solid& base, int own) {
        const Ball bound = around(base);
        const auto near = [&](const BallGroup& group) {
            return norm(bound.centre - group.centre) < bound.radius + group.radius + scene.clearance;
        };
        for_ground(scene, near, [&](const Solid& solid, int id) {
            if (!found) found = pair(base, own, solid, id);
        });
    });
    return found;
}

/// Writes the collision-free part of `own`, arcs within the joint limits, to `out`. If that is empty, returns
/// the reason, CLEARANCE or that of clear().
inline Status keep_clear(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, const ArcSet& own,
                         ArcSet& out) noexcept {
    Cleared cleared;
    clear(arm, scene, m, cleared);
    intersect(own, cleared.arcs, out);
    if (cleared.status != Status::OK) return cleared.status;
    return out.empty() ? Status::CLEARANCE : Status::OK;
}

}  // namespace armangle

#include "../names/end.hpp"
