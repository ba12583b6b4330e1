// How far a straight move of the joints is proven to touch nothing, and what a move has to mind.
//
//       p(s) .                  A point fixed to a link goes p(s) = p + s p' + ..., p' = sum_j d_j z_j x (p -
//       o_j)
//     n ^   . `.                as joints go q + s d, and |p''| <= M: with A, B, C the sums of |d_j| of
//     joints
//       |  .    |  s^2 M / 2    1-3, 4 and 5-7 as far as they move the link,
//    p  o - - - '
//    =========== solid              M = A^2 |E - S| + (A + B)^2 |W - E| + (A + B + C)^2 |p - W|,
//
// since each of the three vectors is fixed to a link whose rotation is a product of rotations with constant
// rates: the second derivative of such a product is no greater than the square of the sum of its rates.
//
// A convex solid lies behind the plane across the shortest way n between it and a core. So long as all
// corners of the core stay in front of that plane by R, n . p + s n . p' - s^2 M / 2 >= R, nothing touches: a
// parabola that opens downwards, so that its root is how far the move is proven. There the next look is
// taken. Two shapes that move each have such a plane at their own corners; the sum counts. A field has no
// plane: its distance lasts as far as the points can go.
#pragma once

#include "../arm/frames.hpp"
#include "../limits/posture_costs.hpp"
#include "proximity.hpp"
#include "scene_frames.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the proof of a straight move.
struct StraightMoveTuning {
    static constexpr int looks = 8;          // of one move
    static constexpr int many_looks = 64;    // the same where there is time
    static constexpr double least = 0.1;     // of an even share of the move that each look has to prove
    static constexpr double slack = 1e-9;    // m that distances are proven with to spare
    static constexpr double rounded = 1e-8;  // m that joints where an obstacle ends an arc may be nearer
    static constexpr double rough = 0.005;   // m more that is kept from fields, beside which proofs are short
    static constexpr int most_near = 16;     // pairs that are minded
    static constexpr int chords = 3;         // towards the end of what is proven to touch
};

/// A pair of shapes, or of corners of them, near each other: its distance beyond the clearance and the
/// derivatives with respect to the joints.
struct NearPair {
    double rate[joints];  // m / rad
    double room;          // m between the surfaces, less the clearance
    Tag pair;
};

/// The nearest pair of a configuration; `core` is 0 if the cores meet.
struct NearestPair {
    double room;  // m between the surfaces, less the clearance
    double core;  // m between the cores
    Tag pair;     // 0: there is none within what was asked
};

/// The arm at given joint values, in the DH base: axes of the joints, origins of the frames, and the frames
/// of the scene's shapes.
struct Placement {
    Vec3<double> axis[joints], origin[joints + 1];
    detail::SceneFrames<double> frames;
};

/// Computes the placement of an arm at joint values q (rad).
inline void place_arm(const Arm& arm, const Scene& scene, const double* q, Placement& out) noexcept {
    double theta[joint_slots];
    detail::walk(arm, joint_lanes(q), theta, [&](int i, const Pose<double>& frame) noexcept {
        out.origin[i] = frame.position;
        if (i < joints) out.axis[i] = frame.rotation.z * arm.sign[i];
        if (i == 3) out.frames.plane.upper = frame;
        if (i == 4) out.frames.plane.lower = frame;
        if (i == joints) out.frames.flange = frame;
    });
    if (scene.swing_count > 0)
        detail::add_swinging(arm, [&theta](int j) { return sin_cos(theta[j]); }, out.frames);
}

/// The weighted length of the chain from the shoulder to point p of a link, sum of weight(k) times the length
/// of segment k (m). With the sums of joint rates as weights it bounds the speed of p.
template <class Weight>
double levers(const Arm&, const Placement& at, int link, const Vec3<double>& p,
              const Weight& weight) noexcept {
    const Vec3<double>&shoulder = at.origin[1], &elbow = at.origin[3], &wrist = at.origin[5];
    if (link <= 3) return weight(link) * norm(p - shoulder);
    const double upper = weight(3) * norm(elbow - shoulder);
    if (link == 4) return upper + weight(4) * norm(p - elbow);
    return upper + weight(4) * norm(wrist - elbow) + weight(link) * norm(p - wrist);
}

/// Writes the frames of all links of any other kind of arm at joint values q to `out`; the shapes of a link
/// are fixed to the frame of that number.
template <class AnyArm>
void place_arm(const AnyArm& arm, const Scene&, const double* q, Placement& out) noexcept {
    const Arm& rows = nominal(arm);
    Pose<double> frame[joints + 1];
    frames(arm, q, frame);
    for (int k = 0; k <= joints; ++k) {
        if (rows.has_base) frame[k] = rows.base_inverse * frame[k];
        out.origin[k] = frame[k].position;
        if (k < joints) out.axis[k] = frame[k].rotation.z * rows.sign[k];
    }
    out.frames.plane = {frame[3], frame[4]};
    out.frames.flange = frame[joints];
    for (const int link : {1, 2, 5, 6}) out.frames.swinging[detail::swinging_place(link)] = frame[link];
}

/// The weighted length of the chain from the base to point p of a link, from frame to frame, for any other
/// kind of arm. The part along a joint's axis does not rotate with that joint.
template <class AnyArm, class Weight>
double levers(const AnyArm&, const Placement& at, int link, const Vec3<double>& p,
              const Weight& weight) noexcept {
    double sum = weight(link) * norm(p - at.origin[link]);
    for (int k = 1; k <= link; ++k) {
        const Vec3<double> along = at.origin[k] - at.origin[k - 1];
        const double axial = abs(dot(along, at.axis[k - 1]));
        sum += weight(k - 1) * axial + weight(k) * norm(cross(along, at.axis[k - 1]));
    }
    return sum;
}

/// What is proven around a configuration along a straight line of the joints. Index 0: backwards, 1:
/// forwards. `clear`: share of the line that is collision-free. `touching`: share over which some pair has no
/// more than the slack.
struct Around {
    double clear[2], touching[2];
    Tag pair;  // who touches, or hinders a proof

    /// Whether the motion is proven free of collisions in both directions.
    bool is_clear() const noexcept { return clear[0] >= 1.0 && clear[1] >= 1.0; }
};

/// Proves straight joint motions of any kind of arm collision-free within a scene.
template <class AnyArm>
class StraightMove {
public:
    /// Keeps references to an arm and a scene prepared for it.
    StraightMove(const AnyArm& arm, const Scene& scene) noexcept : arm_(arm), scene_(scene) {}

    /// The share of the motion d (rad) from q that is proven collision-free; 1: all of it. A pair that
    /// touches already must not come nearer. `blocking`: the pair at which the proof ended, unchanged if all
    /// is proven; `looks`: the most places it uses. With `off` joint j may deviate by off[j] (rad).
    double proven(const double* q, const double (&d)[joints], Tag& blocking,
                  int looks = StraightMoveTuning::looks, const double* off = nullptr) noexcept {
        double done = 0, spread[joints + 1] = {};
        for (int j = 0; off && j < joints; ++j) spread[j + 1] = spread[j] + off[j];
        const auto beside = [&](int link, const Vec3<double>& p) {
            return off ? levers(arm_, at_, link, p, [&](int k) { return spread[k]; }) : 0.0;
        };
        Tag last = 0;
        for (int look = 0; look < looks; ++look) {
            double at[joints];
            for (int j = 0; j < joints; ++j) at[j] = q[j] + done * d[j];
            place(at);
            set_rate_sums(d);
            double share = 1.0 - done;
            Tag nearest = 0;
            const auto way = [&](int link, const Vec3<double>& p, double radius) {
                return (1.0 - done) * (shift(link, p) + sum_[link] * radius) + beside(link, p) +
                       spread[link] * radius;
            };
            for_near(way, [&](const Meeting& m) {
                const double free = off ? free_share_nearer(m, d, more_of(m, beside)) : free_share(m, d);
                if (!(free < share)) return;
                share = free;
                nearest = m.pair;
            });
            if (share >= 1.0 - done) return 1.0;
            last = nearest;
            if (!(share * looks > StraightMoveTuning::least)) break;
            done += share;
        }
        blocking = last;
        return done;
    }

    /// Computes which shares of the line are proven for all joints q + s d + e with |s| <= 1 and |e_j| <=
    /// off_j (rad). The flange stays at the pose `still`; nullptr: it moves with the joints.
    Around about(const double* q, const double (&d)[joints], const double (&off)[joints],
                 const Pose<double>* still) noexcept {
        place(q);
        if (still) flange_ = *still;
        held_rests_ = still != nullptr;
        set_rate_sums(d);
        double spread[joints + 1] = {}, back[joints];
        for (int j = 0; j < joints; ++j) {
            spread[j + 1] = spread[j] + off[j];
            back[j] = -d[j];
        }
        const auto room = [&](int link, const Vec3<double>& p) {
            return levers(arm_, at_, link, p, [&](int k) { return spread[k]; });
        };
        const auto way = [&](int link, const Vec3<double>& p, double radius) {
            return shift(link, p) + room(link, p) + (sum_[link] + spread[link]) * radius;
        };
        Around out{{1.0, 1.0}, {0.0, 0.0}, 0};
        double least = infinity;
        for_near(way, [&](Meeting m) {
            const double more = more_of(m, room), deep = m.apart - m.R;
            add_touching(m, d, more, out.touching);
            m.R += more;
            const bool apart = m.apart > m.R;
            const double behind = apart ? free_share(m, back) : 0.0, ahead = apart ? free_share(m, d) : 0.0;
            out.clear[0] = min(out.clear[0], behind);
            out.clear[1] = min(out.clear[1], ahead);
            if (behind >= 1.0 && ahead >= 1.0) return;
            if (deep < least) out.pair = m.pair;
            least = min(least, deep);
        });
        held_rests_ = false;
        return out;
    }

    /// Writes the pairs of corners whose distance at q is within `reach` (m) of the clearance; returns their
    /// number. The nearest ones are kept if there are too many; pairs whose cores meet are left out.
    int near(const double* q, double reach, NearPair (&out)[StraightMoveTuning::most_near]) noexcept {
        place(q);
        int count = 0;
        const auto way = [&](int, const Vec3<double>&, double) { return reach; };
        for_near(way, [&](const Meeting& m) {
            if (!(m.apart > 0) && !m.flat) return;
            const double kept = m.rough ? StraightMoveTuning::rough : 0.0;
            for (int i = 0; i < m.a.count; ++i) {
                if (m.b.count == 0) add(m, i, -1, kept, reach, out, count);
                for (int k = 0; k < m.b.count; ++k) add(m, i, k, kept, reach, out, count);
            }
        });
        return count;
    }

    /// The nearest pair at q within `reach` (m) of the clearance; pair 0 and room `reach` if there is none.
    NearestPair nearest_pair(const double* q, double reach) noexcept {
        place(q);
        NearestPair out{reach, infinity, 0};
        const auto way = [&](int, const Vec3<double>&, double) { return max(out.room, 0.0); };
        for_near(way, [&](const Meeting& m) {
            if (m.apart - m.R < out.room) out = {m.apart - m.R, m.apart, m.pair};
        });
        return out;
    }

    /// Whether nothing touches at q, with half the slack as tolerance for the end of a proven stretch.
    bool is_clear_at(const double* q) noexcept {
        return nearest_pair(q, StraightMoveTuning::slack).room >= -0.5 * StraightMoveTuning::slack;
    }

    /// The nearest pair at q. Its rate is the derivative of the distance along the joint velocity d.
    /// `turning_alone` skips the tool and link 0 against the ground.
    Proximity proximity(const double* q, const double (&d)[joints], bool turning_alone) noexcept {
        place(q);
        held_rests_ = turning_alone;
        far_too_ = true;
        Proximity out{infinity, 0, {}, {}, 0.0};
        const double kept = scene_.clearance + StraightMoveTuning::slack;
        const auto way = [&](int, const Vec3<double>&, double) { return max(out.distance - kept, 0.0); };
        for_near(way, [&](const Meeting& m) {
            const double distance = m.apart - m.radius_a - m.radius_b;
            if (!(distance < out.distance)) return;
            double rate_of = rate(d, m.a.link, m.on_a, m.n);
            if (m.b.count > 0) rate_of -= rate(d, m.b.link, m.on_b, m.n);
            out = {distance, m.pair, m.on_a - m.n * m.radius_a, m.on_b + m.n * m.radius_b, rate_of};
        });
        held_rests_ = far_too_ = false;
        if (turning_alone) return out;
        for_base(scene_, [&](const Solid& base, int own) {
            const int link = scene_.part_count + own - scene_.first_base;
            for_ground(scene_, [&](const Solid& solid, int id) {
                if (id >= scene_.first_base || scene_.may_touch(id, link)) return;
                const Approach at = nearest(base, solid);
                const double distance = at.distance - base.radius - solid.radius;
                const Vec3<double> between = at.on_rod - at.on_solid;
                const double length = norm(between), sign = at.distance < 0 ? -1.0 : 1.0;
                const Vec3<double> n = length > 0 ? between * (sign / length) : Vec3<double>{0, 0, 0};
                if (distance < out.distance)
                    out = {distance, pair_tag(id, link), at.on_rod - n * base.radius,
                           at.on_solid + n * solid.radius, 0.0};
            });
        });
        return out;
    }

private:
    /// The corners of a shape's core, and the link to which they are fixed.
    struct Core {
        Vec3<double> corner[8];
        int count = 0, link = 0;
        bool about = false;  // of a hull with more corners: those of a box about it
    };

    /// Two cores whose distance along n is `apart` (m); nearer than R they collide. If b is at rest it has no
    /// corners, and its plane is n . x = height.
    struct Meeting {
        Core a, b;
        Vec3<double> n;
        double apart, height, R;
        bool flat, rough;  // b is a half-space, a field
        Tag pair;
        Vec3<double> on_a, on_b;    // the nearest points of the cores
        double radius_a, radius_b;  // m, about them
    };

    /// The core of a rod or of a solid that is fixed to a link.
    static Core core_of(const Rod& rod, int link) noexcept {
        Core out;
        out.link = link;
        out.count = rod.is_sphere() ? 1 : 2;
        out.corner[0] = rod.begin;
        out.corner[1] = rod.end;
        return out;
    }

    /// The corners of a solid without its radius.
    static Core core_of(const Solid& solid, int link) noexcept {
        Core out;
        out.link = link;
        out.count = 1;
        out.corner[0] = solid.a;
        if (solid.kind == SolidKind::capsule) {
            out.count = 2;
            out.corner[1] = solid.b;
        } else if (solid.kind == SolidKind::box) {
            out.count = 8;
            for (int i = 0; i < out.count; ++i) out.corner[i] = detail::corner(solid, i);
        } else if (solid.kind == SolidKind::hull) {
            set_hull(solid, out);
        }
        return out;
    }

    /// Sets the corners of a hull's core; more than eight are replaced by those of their bounding box.
    static void set_hull(const Solid& solid, Core& out) noexcept {
        const auto at = [&](const Vec3<double>& p) { return solid.a + solid.axes * p; };
        out.count = solid.corner_count < 8 ? solid.corner_count : 8;
        out.about = solid.corner_count > 8;
        Vec3<double> low = solid.corners[0], high = low;
        for (int k = 0; k < solid.corner_count; ++k) {
            const Vec3<double>& p = solid.corners[k];
            low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
            high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
            if (!out.about) out.corner[k] = at(p);
        }
        for (int i = 0; out.about && i < 8; ++i)
            out.corner[i] = at({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
    }

    /// Places the arm and all shapes at joint values q.
    void place(const double* q) noexcept {
        place_arm(arm_, scene_, q, at_);
        flange_ = at_.frames.flange;
        for (int k = 0; k < detail::arm_rod_count(scene_); ++k) {
            arm_rod_[k] = placed(detail::arm_rod_frame(scene_, at_.frames, k), detail::arm_rod_at(scene_, k));
            link_[k] = link_of(k);
        }
    }

    /// The link (1 to 6) to which an arm rod is fixed.
    int link_of(int arm_rod) const noexcept {
        if (arm_rod >= scene_.part_count) return scene_.swings[arm_rod - scene_.part_count].link;
        return scene_.parts[arm_rod].lower ? 4 : 3;
    }

    /// Sets the sums of |d_j| over the joints below each link.
    void set_rate_sums(const double (&d)[joints]) noexcept {
        sum_[0] = 0;
        for (int j = 0; j < joints; ++j) sum_[j + 1] = sum_[j] + abs(d[j]);
    }

    /// An upper bound of the path length (m) of point p of a link over the motion.
    double shift(int link, const Vec3<double>& p) const noexcept {
        return levers(arm_, at_, link, p, [this](int k) { return sum_[k]; });
    }

    /// An upper bound of the second derivative |p''| (m) of point p of a link along the motion.
    double bend(int link, const Vec3<double>& p) const noexcept {
        return levers(arm_, at_, link, p, [this](int k) { return sum_[k] * sum_[k]; });
    }

    /// The derivative n . dp / dq_j (j: 0..6) of point p of a link (0..7) along direction n.
    double rate(int j, int link, const Vec3<double>& p, const Vec3<double>& n) const noexcept {
        return j < link ? dot(n, cross(at_.axis[j], p - at_.origin[j])) : 0.0;
    }

    /// The speed along n of point p of a link at joint rates d.
    double rate(const double (&d)[joints], int link, const Vec3<double>& p,
                const Vec3<double>& n) const noexcept {
        double out = 0;
        for (int j = 0; j < link; ++j) out += rate(j, link, p, n) * d[j];
        return out;
    }

    /// Raises `most`, the shares backwards and forwards up to which some two cores are proven to be within R
    /// plus the slack, to those of this meeting, whose distance may grow by `more` (m). The bound of the
    /// distance is convex in the share, so that chords between samples are safe.
    void add_touching(const Meeting& m, const double (&d)[joints], double more,
                      double (&most)[2]) const noexcept {
        const double spare = m.R + StraightMoveTuning::slack - more;
        if (!(m.apart < spare)) return;
        const auto velocity = [&](int link, const Vec3<double>& p) {
            Vec3<double> out{0, 0, 0};
            for (int j = 0; j < link; ++j) out = out + cross(at_.axis[j], p - at_.origin[j]) * d[j];
            return out;
        };
        Vec3<double> v = velocity(m.a.link, m.on_a);
        double bends = bend(m.a.link, m.on_a);
        if (m.b.count > 0) {
            v = v - velocity(m.b.link, m.on_b);
            bends += bend(m.b.link, m.on_b);
        }
        const double along = dot(m.n, v), across = m.flat ? 0.0 : norm(v - m.n * along);
        for (const int side : {0, 1}) {
            const double rate = side == 0 ? -along : along;
            const auto beyond = [&](double share) {
                const double away = (m.flat ? m.apart : max(m.apart, 0.0)) + share * rate;
                return (m.flat ? away : hypot(away, share * across)) + 0.5 * share * share * bends - spare;
            };
            const double at_last = beyond(1.0);
            double kept = at_last < 0 ? 1.0 : 0.0;
            for (int pass = 0; pass < StraightMoveTuning::chords && at_last >= 0; ++pass) {
                const double here = beyond(kept);
                if (!(here < 0)) break;
                kept += (1.0 - kept) * here / (here - at_last);
            }
            most[side] = max(most[side], kept);
        }
    }

    /// An upper bound (m) of how much nearer the cores of a meeting come, if each of their corners moves by
    /// up to room(link, corner).
    template <class Room>
    static double more_of(const Meeting& m, const Room& room) noexcept {
        double more = 0;
        for (const Core* core : {&m.a, &m.b}) {
            double own = 0;
            for (int i = 0; i < core->count; ++i) own = max(own, room(core->link, core->corner[i]));
            more += own;
        }
        return more;
    }

    /// The result of free_share() for cores that may be nearer by `more` (m) than they are at q. If they
    /// touch already, only rounding is allowed.
    double free_share_nearer(Meeting m, const double (&d)[joints], double more) const noexcept {
        const bool touches = !(m.apart > m.R);
        if (touches && more > StraightMoveTuning::slack) return 0.0;
        if (!touches) m.R += more;
        return touches || m.apart > m.R ? free_share(m, d) : 0.0;
    }

    /// The share of the motion d over which two cores are proven not to come nearer than R, or than they are
    /// if that is less; 0 if they meet, above 1 or infinite if the proof reaches beyond the motion.
    double free_share(const Meeting& m, const double (&d)[joints]) const noexcept {
        if (!(m.apart > 0) && !m.flat) return 0.0;
        const double R = min(m.R, m.apart), spare = m.apart - R;
        if (m.rough) {
            double far = 0;
            for (int i = 0; i < m.a.count; ++i) far = max(far, shift(m.a.link, m.a.corner[i]));
            return far > 0 ? spare / far : infinity;
        }
        // corners of a box about a hull may be nearer than the hull is: none of them gives up more than it
        const bool about = m.a.about || m.b.about;
        double least = infinity;
        const auto of = [&](double room, double slope, double M) {
            const double c = about ? spare : max(room, 0.0), root = sqrt(slope * slope + 2.0 * M * c);
            if (slope > 0)
                least = min(least, M > 0 ? (slope + root) / M : infinity);
            else if (root > slope)
                least = min(least, 2.0 * c / (root - slope));
        };
        for (int i = 0; i < m.a.count; ++i) {
            const Vec3<double>& p = m.a.corner[i];
            const double g = rate(d, m.a.link, p, m.n), M = bend(m.a.link, p), high = dot(m.n, p);
            if (m.b.count == 0) of(high - m.height - R, g, M);
            for (int k = 0; k < m.b.count; ++k) {
                const Vec3<double>& o = m.b.corner[k];
                of(high - dot(m.n, o) - R, g - rate(d, m.b.link, o, m.n), M + bend(m.b.link, o));
            }
        }
        return least;
    }

    /// Adds the corner pair (i, k) of a meeting to the nearest ones in `out`, counted in `count`, after
    /// subtracting `kept` (m) from its distance. k = -1: the plane of b. Nothing if it is not below `reach`
    /// (m).
    void add(const Meeting& m, int i, int k, double kept, double reach,
             NearPair (&out)[StraightMoveTuning::most_near], int& count) const noexcept {
        const Vec3<double>& p = m.a.corner[i];
        const double room = dot(m.n, p) - (k < 0 ? m.height : dot(m.n, m.b.corner[k])) - m.R - kept;
        if (!(room < reach)) return;
        int place = count;
        if (count == StraightMoveTuning::most_near) {
            place = 0;
            for (int n = 1; n < count; ++n)
                if (out[n].room > out[place].room) place = n;
            if (!(room < out[place].room)) return;
        } else {
            ++count;
        }
        NearPair& here = out[place];
        here.room = room;
        here.pair = m.pair;
        for (int j = 0; j < joints; ++j) {
            here.rate[j] = rate(j, m.a.link, p, m.n);
            if (k >= 0) here.rate[j] -= rate(j, m.b.link, m.b.corner[k], m.n);
        }
    }

    /// Calls found(meeting) for all pairs whose cores are nearer than Meeting::R (radii, clearance and
    /// rounding) plus the way that they can approach, except pairs that may touch or never meet. way(link,
    /// point, radius) bounds (m) how much nearer a ball around a point of a link comes.
    template <class Way, class Found>
    void for_near(const Way& way, const Found& found) const noexcept {
        for (int k = 0; k < detail::arm_rod_count(scene_); ++k) arm_rod_against_all(k, way, found);
        for (int n = 0; n < scene_.own_count; ++n) {
            if (!far_too_ && scene_.never_meet(scene_.own[n].obstacle, scene_.own[n].link)) continue;
            const int a = detail::arm_rod_of_link(scene_, scene_.own[n].link),
                      b = detail::arm_rod_of_obstacle(scene_, scene_.own[n].obstacle);
            meet(arm_rod_[a], link_[a], as_solid(arm_rod_[b]), link_[b],
                 way_of(way, arm_rod_[a], link_[a]) + way_of(way, arm_rod_[b], link_[b]),
                 pair_tag(scene_.own[n].obstacle, scene_.own[n].link), found);
        }
        for (int h = 0; h < scene_.held_count && !held_rests_; ++h) {
            const Solid held = placed(flange_, scene_.held[h]);
            const int link = scene_.part_count + scene_.base_count + h;
            const Ball bound = around(held);
            const double far = way(joints, bound.centre, bound.radius);
            const auto near = [&](const BallGroup& group) {
                return norm(bound.centre - group.centre) <
                       bound.radius + group.radius + scene_.clearance + StraightMoveTuning::slack + far;
            };
            for_ground(scene_, near, [&](const Solid& solid, int id) {
                if (!scene_.may_touch(id, link) && !away(bound, solid, far))
                    meet(held, joints, solid, far, pair_tag(id, link), found);
            });
        }
    }

    /// The largest way() (m) of a rod's two ends.
    template <class Way>
    static double way_of(const Way& way, const Rod& rod, int link) noexcept {
        return max(way(link, rod.begin, 0.0), way(link, rod.end, 0.0));
    }

    /// Whether a solid is surely farther than `far` (m) beyond the clearance from a ball; always false for a
    /// half-space.
    bool away(const Ball& bound, const Solid& solid, double far) const noexcept {
        if (solid.kind == SolidKind::half_space) return false;
        const Ball other = around(solid);
        const double R = bound.radius + other.radius + scene_.clearance + StraightMoveTuning::slack + far;
        const Vec3<double> d = bound.centre - other.centre;
        return dot(d, d) >= R * R;
    }

    /// Calls found(meeting) for the pairs of arm rod k with obstacles and the tool that for_near() looks for.
    template <class Way, class Found>
    void arm_rod_against_all(int k, const Way& way, const Found& found) const noexcept {
        const Rod& rod = arm_rod_[k];
        const int place = detail::link_of_arm_rod(scene_, k), link = link_[k];
        const double far = way_of(way, rod, link);
        const Ball bound = around(as_solid(rod));
        const auto near = [&](const BallGroup& group) {
            return norm(bound.centre - group.centre) <
                   bound.radius + group.radius + scene_.clearance + StraightMoveTuning::slack + far;
        };
        const double reach = rod.radius + scene_.clearance + StraightMoveTuning::slack + far;
        for_blocks(scene_, near, [&](int block) {
            detail::balls_near(scene_, block, rod, reach, [&](const Solid& ball, int id) {
                if (!scene_.may_touch(id, place)) meet(rod, link, ball, far, pair_tag(id, place), found);
            });
        });
        for (int n = 0; n < scene_.solid_count; ++n) {
            const int id = scene_.solid_id[n];
            if (!scene_.unasked(id, place) && !away(bound, scene_.solids[n], far))
                meet(rod, link, scene_.solids[n], far, pair_tag(id, place), found);
        }
        for (int h = 0; h < scene_.held_count; ++h) {
            const int id = scene_.first_held + h;
            if (scene_.unasked(id, place)) continue;
            const Solid held = placed(flange_, scene_.held[h]);
            if (held_rests_) {
                if (!away(bound, held, far)) meet(rod, link, held, far, pair_tag(id, place), found);
                continue;
            }
            const Ball other = around(held);
            const double both = far + way(joints, other.centre, other.radius);
            if (!away(bound, held, both)) meet(rod, link, held, joints, both, pair_tag(id, place), found);
        }
    }

    /// Calls found(meeting) for a moving shape and a solid at rest, if they are less than `far` (m) beyond R.
    template <class Moving, class Found>
    void meet(const Moving& a, int link, const Solid& solid, double far, Tag pair,
              const Found& found) const noexcept {
        const Approach at = approach(a, solid);
        Meeting m{core_of(a, link), {},       {},          at.distance, 0.0,
                  apart(a, solid),  false,    false,       pair,        at.on_rod,
                  at.on_solid,      a.radius, solid.radius};
        if (!(m.apart - m.R < far)) return;
        m.flat = solid.kind == SolidKind::half_space;
        m.rough = solid.kind == SolidKind::field;
        set_plane(m, at, solid);
        found(m);
    }

    /// Calls found(meeting) for a rod and another moving shape b of link `other`, if they are less than `far`
    /// (m) beyond R.
    template <class Found>
    void meet(const Rod& a, int link, const Solid& b, int other, double far, Tag pair,
              const Found& found) const noexcept {
        const Approach at = nearest(a.begin, a.end, b);
        Meeting m{
            core_of(a, link), core_of(b, other), {},       at.distance, 0.0, apart(a, b), false, false, pair,
            at.on_rod,        at.on_solid,       a.radius, b.radius};
        if (!(m.apart - m.R < far)) return;
        set_plane(m, at, b);
        found(m);
    }

    /// The nearest points of a rod and a solid.
    static Approach approach(const Rod& rod, const Solid& solid) noexcept {
        return nearest(rod.begin, rod.end, solid);
    }
    /// The nearest points of two solids.
    static Approach approach(const Solid& held, const Solid& solid) noexcept { return nearest(held, solid); }

    /// The distance (m) of two cores at which the shapes have the clearance plus the slack.
    template <class Moving>
    double apart(const Moving& a, const Solid& b) const noexcept {
        return a.radius + b.radius + scene_.clearance + StraightMoveTuning::slack;
    }

    /// Stores the plane that separates a meeting's cores in m; leaves it unchanged if they meet.
    static void set_plane(Meeting& m, const Approach& at, const Solid& solid) noexcept {
        if (m.flat) {
            m.n = solid.a;
            m.height = solid.b.x;
            return;
        }
        const Vec3<double> between = at.on_rod - at.on_solid;
        const double length = norm(between);
        if (!(m.apart > 0) || !(length > 0)) return;
        m.n = between * (1.0 / length);
        m.height = dot(m.n, at.on_solid);
        if (solid.kind == SolidKind::hull && m.b.count == 0)
            m.height = dot(m.n, hull_of(solid).farthest(m.n));
    }

    /// The convex hull of a solid in its frame.
    static ConvexHull hull_of(const Solid& solid) noexcept {
        return {solid.corners, solid.corner_count, {solid.axes, solid.a}};
    }

    const AnyArm& arm_;
    const Scene& scene_;
    Placement at_;
    Pose<double> flange_;
    bool held_rests_ = false;
    bool far_too_ = false;  // own pairs that are proven never to meet count too
    double sum_[joints + 1] = {};
    Rod arm_rod_[2 * most_parts];
    int link_[2 * most_parts] = {};
};

/// Whether a configuration q (rad) is proven collision-free.
template <class AnyArm>
bool is_clear(const AnyArm& arm, const Scene& scene, const double* q) noexcept {
    const double none[joints] = {};
    return StraightMove<AnyArm>(arm, scene).about(q, none, none, nullptr).is_clear();
}

/// Whether joints q, whose psi is collision-free, are so too. Where joint 2 or 6 is straight, psi does not
/// tell how its two neighbours share their turn, on which the parts of links 1, 2, 5 and 6 off their axes
/// depend: there q itself is asked.
inline bool is_clear_as_shared(const Arm& arm, const Scene& scene, const double* q) noexcept {
    if (scene.swing_count == 0) return true;
    bool straight = false;
    for (const int j : hinge_joint)
        straight |= abs(sin_cos(to_theta(arm, j, q[j])).sin) <= NearestTuning::near_straight;
    return !straight || StraightMove<Arm>(arm, scene).is_clear_at(q);
}

}  // namespace armangle

#include "../names/end.hpp"
