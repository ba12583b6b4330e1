// How near an arm is to what stands about it, at one psi; and the psi at which it keeps farthest away.
#pragma once

#include "clear.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The nearest pair of shapes at one joint configuration.
struct Proximity {
    double distance;  // m between the surfaces; where they meet negative, as deep as the radii reach at most
    Tag pair;         // obstacle and link; 0: there is no pair
    Vec3<double> on_link, on_obstacle;  // points of their surfaces, in the DH base
    double psi_rate;                    // of the distance, m / rad
};

namespace detail {

/// Searches the nearest pair of shapes at one pose, branch and psi.
class Nearby {
public:
    /// Places the moving shapes at psi (rad) of a self-motion; pairs in `left_out` (null: none) are ignored.
    Nearby(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, double psi,
           const LeftOut* left_out = nullptr) noexcept
        : scene_(scene),
          left_out_(left_out),
          axis_(axis_frame(arm, m.circle)),
          frames_(axis_frames(arm, m)),
          turn_(sin_cos(psi)),
          best_{infinity, 0, {}, {}, 0.0} {
        for (int k = 0; k < scene.part_count; ++k)
            rod_[k] = MovingRod(
                placed(scene.parts[k].lower ? frames_.lower : frames_.upper, scene.parts[k].rod), true);
        make_moving(arm, scene, m, inverted(axis_), frames_, rod_ + scene.part_count);
    }

    /// Returns the nearest pair; pair 0 at an infinite distance if there is none. `turning_alone` skips pairs
    /// that psi does not move.
    Proximity find(bool turning_alone) noexcept {
        const Pose<double> to_axis = inverted(axis_);
        for (int k = 0; k < scene_.part_count + scene_.swing_count; ++k) at_[k] = rod_[k].at(turn_);
        const auto nearer = [&](const BallGroup& group) { return comes_nearer(to_axis, group); };
        for_ground(scene_, nearer,
                   [&](const Solid& solid, int id) { against_rods(placed(to_axis, solid), id); });
        for (int h = 0; h < scene_.held_count; ++h)
            against_rods(placed(frames_.flange, scene_.held[h]), scene_.first_held + h);
        for (int k = 0; k < scene_.own_count; ++k) own_pair(scene_.own[k], turning_alone);
        if (!turning_alone) at_rest(to_axis);
        return best_;
    }

private:
    /// The number among the links of rod k; parts come first, then rods of links 1, 2, 5 and 6.
    int link_of(int k) const noexcept {
        return k < scene_.part_count ? k : scene_.first_swing_link() + k - scene_.part_count;
    }

    /// Whether any rod may be nearer to a ball of a group than the nearest pair found so far.
    bool comes_nearer(const Pose<double>& to_axis, const BallGroup& group) const noexcept {
        const Vec3<double> centre = to_axis.rotation * group.centre + to_axis.position;
        const Solid ball{SolidKind::ball, 0.0, centre, centre, {}};
        for (int k = 0; k < scene_.part_count + scene_.swing_count; ++k) {
            const double apart = nearest(at_[k].begin, at_[k].end, ball).distance;
            if (apart - at_[k].radius - group.radius < best_.distance) return true;
        }
        return false;
    }

    /// Compares one solid, in the frame of the axis, with all rods.
    void against_rods(const Solid& solid, int id) noexcept {
        for (int k = 0; k < scene_.part_count + scene_.swing_count; ++k) {
            if (scene_.may_touch(id, link_of(k))) continue;
            const Rod& rod = at_[k];
            keep(nearest(rod.begin, rod.end, solid), rod.radius, solid, id, link_of(k), &rod_[k]);
        }
    }

    /// Keeps the distance of two shapes of the arm if it is the smallest so far; `turning_alone` skips pairs
    /// whose distance psi does not change.
    void own_pair(const OwnPair& pair, bool turning_alone) noexcept {
        const int first = pair.obstacle - scene_.first_swing_obstacle();
        const bool swings = first < scene_.swing_count;
        if (!swings && turning_alone) return;
        const MovingRod& a = rod_[swings ? scene_.part_count + first : first - scene_.swing_count];
        const int link = pair.link;
        const MovingRod& b =
            rod_[link < scene_.part_count ? link : link - scene_.base_count - scene_.held_count];
        const Rod rod = b.at(turn_);
        keep(nearest(rod.begin, rod.end, as_solid(a.at(turn_))), rod.radius, as_solid(a.at(turn_)),
             pair.obstacle, link, &b, &a);
    }

    /// Compares the shapes that psi does not move: the tool with the ground, and link 0 with the obstacles.
    void at_rest(const Pose<double>& to_axis) noexcept {
        for (int h = 0; h < scene_.held_count; ++h)
            rest_against(placed(frames_.flange, scene_.held[h]), scene_.part_count + scene_.base_count + h,
                         to_axis, most_obstacles);
        for_base(scene_, [&](const Solid& base, int own) {
            rest_against(placed(to_axis, base), scene_.part_count + own - scene_.first_base, to_axis,
                         scene_.first_base);
        });
    }

    /// Compares a shape of the arm that psi does not move with the obstacles whose number is below `end`.
    void rest_against(const Solid& mine, int link, const Pose<double>& to_axis, int end) noexcept {
        const Ball bound = around(mine);
        const auto nearer = [&](const BallGroup& group) {
            const Vec3<double> centre = to_axis.rotation * group.centre + to_axis.position;
            return norm(bound.centre - centre) - bound.radius - group.radius < best_.distance;
        };
        for_ground(scene_, nearer, [&](const Solid& solid, int id) {
            if (id < end && !scene_.may_touch(id, link))
                keep(nearest(mine, placed(to_axis, solid)), mine.radius, solid, id, link);
        });
    }

    /// Keeps a pair if it is nearer than the best so far. `rod` and `other` are the moving rods that carry
    /// its points; nullptr for a shape at rest.
    void keep(const Approach& pair, double link_radius, const Solid& solid, int id, int link,
              const MovingRod* rod = nullptr, const MovingRod* other = nullptr) noexcept {
        const double distance = pair.distance - link_radius - solid.radius;
        if (!(distance < best_.distance)) return;
        if (left_out_ != nullptr && left_out_->holds(pair_tag(id, link))) return;
        const Vec3<double> away = pair.on_rod - pair.on_solid;
        const double length = norm(away), sign = pair.distance < 0 ? -1.0 : 1.0;
        const Vec3<double> n = length > 0 ? away * (sign / length) : Vec3<double>{0, 0, 0};
        double rate = rod == nullptr ? 0.0 : dot(n, rod->velocity(pair.on_rod, turn_));
        if (other != nullptr) rate -= dot(n, other->velocity(pair.on_solid, turn_));
        const auto in_base = [&](const Vec3<double>& p) { return axis_.rotation * p + axis_.position; };
        best_ = {distance, pair_tag(id, link), in_base(pair.on_rod - n * link_radius),
                 in_base(pair.on_solid + n * solid.radius), rate};
    }

    const Scene& scene_;
    const LeftOut* left_out_;  // nullptr: none
    Pose<double> axis_;
    AxisFrames<double> frames_;
    SinCos<double> turn_;
    MovingRod rod_[2 * most_parts];
    Rod at_[2 * most_parts];  // at psi
    Proximity best_;
};

}  // namespace detail

/// The nearest pair of shapes at psi, for a reachable pose. `turning_alone` skips pairs that psi does not
/// move.
inline Proximity proximity(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, double psi,
                           bool turning_alone = false) noexcept {
    return detail::Nearby(arm, scene, m, psi).find(turning_alone);
}

/// The psi (rad) within the joint limits at which the moving links keep the largest distance from obstacles,
/// and the nearest pair there that psi can move apart.
struct Widest {
    double psi;
    Proximity nearest;
};

/// Parameters of the psi that keeps farthest from obstacles.
struct ProximityTuning {
    /// Bisections of the clearance; they leave 1e-12 of the range.
    static constexpr int halvings = 40;
    /// A clearance may be negative down to this share of the thinnest part: cores stay apart.
    static constexpr double thinnest = 0.999;
    /// rad: of an arc on which a pair is at rest, at least; where it is nearest by its motion they are
    /// narrower.
    static constexpr double resting = 1e-3;
    /// m/rad: what a pair at rest still moves by rounding.
    static constexpr double rest = 1e-12;
    /// m: so much below its distance a pair at rest blocks nothing by rounding.
    static constexpr double below = 1e-9;
};

/// The step (m) below which clearances are not distinguished: the tolerance of distance fields, 0 without
/// fields.
inline double indifferent_clearance(const Scene& scene) noexcept {
    double out = infinity;
    for (int k = 0; k < scene.solid_count; ++k)
        if (scene.solids[k].kind == SolidKind::field)
            out = min(out, FieldTuning::agreed_free * scene.solids[k].field->spacing);
    return out < infinity ? out : 0.0;
}

/// Finds by bisection the greatest clearance for which leaves(clearance, arcs) gives an arc, and writes these
/// arcs. `found` is empty if the parts lie so deep in obstacles that no clearance gives any, or if there are
/// none. No clearance exceeds twice `size` (m), that of the arm.
template <class Leaves>
void widest_arcs(const Scene& scene, double size, int halvings, const Leaves& leaves,
                 ArcSet& found) noexcept {
    make_empty(found);
    ArcSet left;
    const auto some = [&](double clearance) {
        leaves(clearance, left);
        if (left.empty()) return false;
        found = left;
        return true;
    };
    double low = -infinity, high = 2.0 * size;
    for (int k = 0; k < scene.part_count; ++k)
        low = max(low, -ProximityTuning::thinnest * scene.parts[k].rod.radius);
    for (int k = 0; k < scene.swing_count; ++k)
        low = max(low, -ProximityTuning::thinnest * scene.swings[k].rod.radius);
    if (scene.part_count + scene.swing_count == 0) return;
    // near the core of a part little is proven free: only what touches at no clearance has to begin there
    if (some(0.0))
        low = 0.0;
    else if (!some(low))
        return;
    if (some(high)) low = high;
    const double enough = indifferent_clearance(scene);
    for (int k = 0; k < halvings && high - low > enough; ++k) {
        const double middle = 0.5 * (low + high);
        (some(middle) ? low : high) = middle;
    }
}

/// The widest arc of a set that is not empty.
inline const Arc& widest_arc(const ArcSet& set) noexcept {
    const Arc* best = &set.arc[0];
    for (int i = 1; i < set.count; ++i)
        if (set.arc[i].upper - set.arc[i].lower > best->upper - best->lower) best = &set.arc[i];
    return *best;
}

/// The middle (rad) of an arc, in (-pi, pi].
inline double middle(const Arc& arc) noexcept { return wrap(0.5 * (arc.lower + arc.upper)); }

/// The middle (rad) of the widest arc of widest_arcs(); NaN if there is none.
template <class Leaves>
double widest_psi(const Scene& scene, double size, int halvings, const Leaves& leaves) noexcept {
    ArcSet found;
    widest_arcs(scene, size, halvings, leaves, found);
    if (found.empty()) return not_a_number;
    return middle(widest_arc(found));
}

/// The result if there is no such psi: NaN.
inline constexpr Widest no_widest{not_a_number, {not_a_number, 0, {}, {}, not_a_number}};

namespace detail {

/// Whether a pair is the nearest along a whole arc while psi does not change its distance, for example the
/// wrist and the tool.
inline bool rests(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, const Arc& arc,
                  const LeftOut& left_out, Tag pair) noexcept {
    if (!(arc.upper - arc.lower > ProximityTuning::resting)) return false;
    for (const double share : {0.25, 0.5, 0.75}) {
        const double psi = arc.lower + share * (arc.upper - arc.lower);
        const Proximity here = Nearby(arm, scene, m, psi, &left_out).find(true);
        if (here.pair != pair || !(abs(here.psi_rate) < ProximityTuning::rest)) return false;
    }
    return true;
}

}  // namespace detail

/// The psi within the arcs `own` at which the arm keeps the largest distance; no_widest if there is none. If
/// psi does not change the distance of the nearest pair along an arc, the next pair decides, unless that pair
/// is nearer than the scene's clearance.
inline Widest widest(const Arm& arm, const Scene& scene, const SelfMotion<double>& m, ArcSet own) noexcept {
    Widest out = no_widest;
    detail::LeftOut left_out;
    while (!own.empty()) {
        ArcSet found;
        const auto leaves = [&](double clearance, ArcSet& left) {
            Scene asked = scene;
            asked.clearance = clearance;
            Covered covered;
            ArcSet cleared;
            detail::Clearing(arm, asked, m, covered, &left_out).parts_against_all();
            open_arcs(covered, cleared);
            intersect(own, cleared, left);
        };
        widest_arcs(scene, arm.size, ProximityTuning::halvings, leaves, found);
        if (found.empty()) return out;
        const double psi = middle(widest_arc(found));
        const Proximity nearest = detail::Nearby(arm, scene, m, psi, &left_out).find(true);
        const bool near = nearest.distance < 2.0 * arm.size;
        if (left_out.count > 0 && !near)  // all that is near is at rest
            return {out.psi, detail::Nearby(arm, scene, m, out.psi).find(true)};
        out = {psi, nearest};
        if (!near) return out;
        if (nearest.distance < scene.clearance || left_out.count == detail::LeftOut::most) return out;
        leaves(nearest.distance - ProximityTuning::below, found);
        if (found.empty() || !detail::rests(arm, scene, m, widest_arc(found), left_out, nearest.pair))
            return out;
        left_out.pair[left_out.count++] = nearest.pair;
        own = found;
    }
    return out;
}

}  // namespace armangle

#include "../names/end.hpp"
