// The arm angles at which nothing touches, exactly, and who blocks the others.
//
//     obstacles seen from the circle's axis -> each pair's blocked arc -> their union -> what is left, tagged
//     (8 balls at a time)                      blocked_arc, witnesses      covered        here
#pragma once

#include "../limits/feasible.hpp"
#include "covered.hpp"
#include "scene.hpp"
#include "witnesses.hpp"

namespace armangle {

namespace detail {

/// A part as it is met: seen at psi = 0 from the axis.
struct MetPart {
    Rod rod;
    double reach;  // m: radius and clearance
    enum class Kind : std::uint8_t { sphere, planar, other } kind;
    int pieces;
    PlanarRod piece[2];
    double along, off, length;  // a ball about it: place along the axis and off it, half its length
};

inline MetPart met(const Pose<double>& frame, const Part& part, double clearance) noexcept {
    MetPart out{};
    out.rod = placed(frame, part.rod);
    out.reach = part.rod.radius + clearance;
    const Rod& rod = out.rod;
    const Vec3<double> middle = (rod.begin + rod.end) * 0.5;
    out.along = middle.x;
    out.off = off_axis(middle);
    out.length = part.rod.is_sphere() ? 0.0 : 0.5 * norm(rod.end - rod.begin);
    out.kind = MetPart::Kind::other;
    if (part.rod.is_sphere()) {
        out.kind = MetPart::Kind::sphere;
    } else if (rod.begin.y == 0 && rod.end.y == 0) {
        out.kind = MetPart::Kind::planar;
        out.pieces = planar_rods(rod.begin, rod.end, out.piece);
    }
    return out;
}

/// All pairs of one circle and branch.
class Clearing {
public:
    Clearing(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, Covered& out) noexcept
        : scene_(scene),
          out_(out),
          axis_(axis_frame(arm, m.circle)),
          to_axis_(inverted(axis_)),
          frames_(axis_frames(arm, m)) {
        for (int k = 0; k < scene.part_count; ++k) {
            const Part& part = scene.parts[k];
            part_[k] = met(part.lower ? frames_.lower : frames_.upper, part, scene.clearance);
        }
    }

    void parts_against_all() noexcept {
        for (int k = 0; k < scene_.block_count && !out_.all; ++k) against_balls(k);
        for (int k = 0; k < scene_.solid_count && !out_.all; ++k)
            against_solid(scene_.solids[k], to_axis_, scene_.solid_id[k]);
        for (int k = 0; k < scene_.held_count && !out_.all; ++k)
            against_solid(scene_.held[k], frames_.flange, scene_.first_held + k);
    }

    /// The pair of a held shape and of the ground that touch at this pose; 0: none.
    Tag held_against_ground() const noexcept {
        const Pose<double> flange = axis_ * frames_.flange;
        for (int h = 0; h < scene_.held_count; ++h) {
            const Solid held = placed(flange, scene_.held[h]);
            const Tag found = against_ground(held, scene_.part_count + scene_.base_count + h);
            if (found) return found;
        }
        return 0;
    }

private:
    using Eight = Lane<8>;

    void against_balls(int block) noexcept {
        const BallBlock& balls = scene_.blocks[block];
        const Pose<double>& to = to_axis_;
        const Eight x = Eight::load(balls.x), y = Eight::load(balls.y), z = Eight::load(balls.z);
        const Vec3<Eight> from{x, y, z};
        const Mat3<Eight> rotation{spread<Eight>(to.rotation.x), spread<Eight>(to.rotation.y),
                                   spread<Eight>(to.rotation.z)};
        const Vec3<Eight> q = rotation * from + spread<Eight>(to.position);
        const Eight rho = off_axis(q), radius = Eight::load(balls.radius);
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            const Eight R = radius + Eight(part.reach);
            if (part.kind == MetPart::Kind::planar) {
                for (int piece = 0; piece < part.pieces; ++piece) {
                    const PlanarRod& rod = part.piece[piece];
                    for_each_bit(bits(meets_planar(rod, q.x, rho, R)), [&](int i) {
                        const Vec3<double> at{q.x[i], q.y[i], q.z[i]};
                        add(planar_arc(rod, at, rho[i], planar_threshold(rod, at.x, rho[i], R[i])),
                            id(block, i), k);
                    });
                }
                continue;
            }
            const Eight g = q.x - Eight(part.along), apart = rho - Eight(part.off),
                        near = R + Eight(part.length);
            for_each_bit(bits(mul_add(g, g, apart * apart) < near * near), [&](int i) {
                const Vec3<double> at{q.x[i], q.y[i], q.z[i]};
                if (part.kind == MetPart::Kind::sphere)
                    add(point_point(part.rod.begin, at, R[i]), id(block, i), k);
                else
                    certified({SolidKind::ball, 0.0, at, at, {}}, R[i], id(block, i), k);
            });
        }
    }

    /// Whether a part comes near a ball around a solid at any psi.
    static bool meets_bound(const MetPart& part, double along, double off, double radius) noexcept {
        const double R = radius + part.reach;
        if (part.kind != MetPart::Kind::planar)
            return hypot(along - part.along, off - part.off) < R + part.length;
        bool meets = false;
        for (int piece = 0; piece < part.pieces; ++piece)
            meets |= meets_planar(part.piece[piece], along, off, R);
        return meets;
    }

    int id(int block, int i) const noexcept { return scene_.ball_id[8 * block + i]; }

    void against_solid(const Solid& solid, const Pose<double>& frame, int id) noexcept {
        if (solid.kind == SolidKind::half_space) return against_plane(placed(frame, solid), id);
        Ball bound = around(solid);
        bound.centre = frame.rotation * bound.centre + frame.position;
        const double off = off_axis(bound.centre);
        bool turned = false;
        Solid here = solid;
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            if (!meets_bound(part, bound.centre.x, off, bound.radius)) continue;
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

    void against_plane(const Solid& plane, int id) noexcept {
        for (int k = 0; k < scene_.part_count; ++k) {
            const MetPart& part = part_[k];
            const double limit = plane.b.x + plane.radius + part.reach;
            add(point_plane(part.rod.begin, plane.a, limit), id, k);
            if (part.kind != MetPart::Kind::sphere) add(point_plane(part.rod.end, plane.a, limit), id, k);
        }
    }

    void certified(const Solid& solid, double R, int id, int part) noexcept {
        if (scene_.may_touch(id, part)) return;
        Witnesses(part_[part].rod, solid, R).find([&](double lower, double upper) {
            cover(out_, 0.5 * (lower + upper), 0.5 * (upper - lower), pair_tag(id, part));
        });
    }

    void add(const BlockedArc& arc, int id, int part) noexcept {
        if (arc.half > 0 && !scene_.may_touch(id, part))
            cover(out_, arc.centre, arc.half, pair_tag(id, part));
    }

    Tag against_ground(const Solid& held, int link) const noexcept {
        const auto meets = [&](const Solid& solid, int id) {
            if (scene_.may_touch(id, link)) return false;
            return nearest(held, solid).distance < held.radius + solid.radius + scene_.clearance;
        };
        const Ball bound = around(held);
        const auto far = [&](const Solid& solid) {
            if (solid.kind == SolidKind::half_space) return false;
            const Ball other = around(solid);
            return norm(bound.centre - other.centre) >= bound.radius + other.radius + scene_.clearance;
        };
        Tag found = 0;
        for_ground(scene_, [&](const Solid& solid, int id) {
            if (!found && !far(solid) && meets(solid, id)) found = pair_tag(id, link);
        });
        return found;
    }

    const Scene& scene_;
    Covered& out_;
    Pose<double> axis_, to_axis_;
    AxisFrames<double> frames_;
    MetPart part_[most_parts];
};

}  // namespace detail

/// What a scene leaves of a circle: the arcs, their ends tagged with obstacle and link.
struct Cleared {
    ArcSet arcs;
    Status status;  // OK, UNREACHABLE, FOLDED, POSE_BLOCKED or CLEARANCE
    Tag blocking;   // the pair that blocks the whole circle alone; 0: none does
    bool coarse;    // narrow arcs were left out: there were more than a set holds
};

/// The arcs between the covered ones.
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

/// The psi at which no link touches an obstacle, whatever the joint limits. Of any branch: links 3 and 4 do
/// not depend on GC_2 and GC_6.
inline void clear(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, Cleared& out) noexcept {
    make_empty(out.arcs);
    out.blocking = 0;
    out.coarse = false;
    out.status = is_unreachable(m.circle) ? Status::UNREACHABLE : Status::FOLDED;
    if (is_unreachable(m.circle) || is_folded(m.circle)) return;
    Covered covered;
    detail::Clearing clearing(arm, scene, m, covered);
    out.status = Status::POSE_BLOCKED;
    out.blocking = scene.base_tag ? scene.base_tag : clearing.held_against_ground();
    if (out.blocking) return;
    clearing.parts_against_all();
    open_arcs(covered, out.arcs);
    out.blocking = covered.all_tag;
    out.coarse = covered.coarse;
    out.status = out.arcs.empty() ? Status::CLEARANCE : Status::OK;
}

/// The pair of link 0 and an obstacle of the user's that touch, whatever the pose; 0: none.
inline Tag base_contact(const Scene& scene) noexcept {
    const auto pair = [&](const Solid& base, int own, const Solid& solid, int id) -> Tag {
        const int link = scene.part_count + own - scene.first_base;
        if (own < scene.first_base || id >= scene.first_base || scene.may_touch(id, link)) return 0;
        const double reach = base.radius + solid.radius + scene.clearance;
        return nearest(base, solid).distance < reach ? pair_tag(id, link) : 0;
    };
    Tag found = 0;
    for_ground(scene, [&](const Solid& base, int own) {
        for_ground(scene, [&](const Solid& solid, int id) {
            if (!found) found = pair(base, own, solid, id);
        });
    });
    return found;
}

/// What of `own`, the arcs within the limits, a scene leaves.
inline Status keep_clear(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, const ArcSet& own,
                         ArcSet& out) noexcept {
    Cleared cleared;
    clear(arm, scene, m, cleared);
    intersect(own, cleared.arcs, out);
    if (cleared.status != Status::OK) return cleared.status;
    return out.empty() ? Status::CLEARANCE : Status::OK;
}

}  // namespace armangle
