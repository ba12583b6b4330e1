// Finds where an obstacle blocks some arm angle between sections, so that no tube misses it.
//
//     phi |     section      section          In the plane of s and phi an obstacle is an island. Its shadow
//         |        |    ()      |             on s is where the least distance over *all* phi is below R. An
//         |        |            |             island between two sections casts its shadow between them:
//         +--------|----==------|---- s       sections are added at both its ends and in it.
//
// The least over phi is the least over the same pairs of points as at one phi. So the bound of
// clear_proof.hpp between two samples holds for it too, with speeds of a point at any constant phi. Limbs
// that swing about a joint, and own links against each other, are left to the proof.
#pragma once

#include "clear_proof.hpp"
#include "tube.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace blocked_ranges_tuning {
inline constexpr double narrowest = 1e-6;       // of s: islands with a narrower shadow are left to the proof
inline constexpr int halvings = 20;             // of the interval that holds an end of a shadow
inline constexpr int evaluations = 32;          // over stretches, of all between two sections
inline constexpr int starts = 4, queries = 96;  // of the least distance over phi without a closed form
inline constexpr double settled = 1e-7;         // m^2: accuracy of that distance
}  // namespace blocked_ranges_tuning

namespace detail {

/// A lower bound of F = distance^2 - R^2 (m^2; distance - R (m) for a half-space) over all rotations of a rod
/// around the x axis. If it is negative, some rotation attains it. Bound: see witnesses.hpp.
inline double least_over_turns(const Rod& rod, const Solid& solid, double R) noexcept {
    if (solid.kind == SolidKind::half_space) {
        const double n = off_axis(solid.a);
        const auto depth = [&](const Vec3<double>& p) {
            return solid.a.x * p.x - n * off_axis(p) - solid.b.x - R;
        };
        return min(depth(rod.begin), depth(rod.end));
    }
    const auto of = [R](double distance) { return (distance - R) * (distance + R); };
    if (solid.kind == SolidKind::ball) {
        const double rho = off_axis(solid.a);
        if (rod.is_sphere()) return of(hypot(rod.begin.x - solid.a.x, off_axis(rod.begin) - rho));
        if (rod.begin.y == 0 && rod.end.y == 0 && rod.begin.z * rod.end.z >= 0) {
            const Vec3<double> a{rod.begin.x, abs(rod.begin.z), 0}, b{rod.end.x, abs(rod.end.z), 0},
                q{solid.a.x, rho, 0};
            return of(norm(q - a - (b - a) * foot(a, b - a, q)));
        }
    }
    const double amplitude = 2.0 * extent(as_solid(rod)).off_axis * extent(solid).off_axis;
    struct Slice {
        double a, F_a, b, F_b;
        /// A lower bound of F over the slice; A bounds its second derivative.
        double lowest(double A) const noexcept { return least_between(F_a, F_b, A, b - a); }
    };
    const auto at = [&](double psi) {
        const SinCos<double> turn = sin_cos(psi);
        return of(nearest(turned_by(rod.begin, turn), turned_by(rod.end, turn), solid).distance);
    };
    Slice piece[blocked_ranges_tuning::queries + blocked_ranges_tuning::starts];
    int count = 0;
    const double width = two_pi / blocked_ranges_tuning::starts, first = at(0.0);
    double best = first, before = first;
    for (int i = 1; i <= blocked_ranges_tuning::starts; ++i) {
        const double here = i == blocked_ranges_tuning::starts ? first : at(i * width);
        piece[count++] = {(i - 1) * width, before, i * width, here};
        best = min(best, here);
        before = here;
    }
    for (int query = 0; best >= 0; ++query) {
        int low = 0;
        for (int i = 1; i < count; ++i)
            if (piece[i].lowest(amplitude) < piece[low].lowest(amplitude)) low = i;
        const double least = piece[low].lowest(amplitude);
        if (query == blocked_ranges_tuning::queries || best - least < blocked_ranges_tuning::settled)
            return max(least, 0.0);
        const Slice old = piece[low];
        const double middle = 0.5 * (old.a + old.b), here = at(middle);
        best = min(best, here);
        piece[low] = {old.a, old.F_a, middle, here};
        piece[count++] = {middle, here, old.b, old.F_b};
    }
    return best;
}

/// Finds the ranges of s in which a scene blocks some phi, for one sign of the elbow.
class BlockedRanges {
public:
    /// Keeps references to a task and one of its scenes; elbow: 0 (+) or 2 (-), the bit of its sign in gc.
    BlockedRanges(const Task& task, const Scene& scene, int elbow)
        : task_(task), scene_(scene), gc_(configuration(elbow)), moving_(scene_) {}

    /// Returns parameters s between those of `base` at which a tube needs more sections; empty if obstacles
    /// block no phi that the sections of `base` miss. Call it once.
    std::vector<double> find(const std::vector<double>& base) {
        for (std::size_t i = 0; i + 1 < base.size(); ++i) between(base[i], base[i + 1]);
        return std::move(found_);
    }

private:
    /// All shapes at one s, in the frame of the axis shoulder-wrist.
    struct Place {
        Pose<double> to_axis;
        AxisFrames<double> frames;
    };

    /// The frames of the arm's parts at s.
    Place place(double s) const noexcept {
        const SelfMotion<double> m = motion(s);
        return {inverted(axis_frame(task_.arm, m.circle)), axis_frames(task_.arm, m)};
    }
    /// The self-motion at s.
    SelfMotion<double> motion(double s) const noexcept {
        return self_motion(task_.arm, task_.circle_at(s), gc_);
    }

    /// The least F of a pair over all phi, at one place; a lower bound if it is positive.
    double F(const Place& at, const WatchedPair& pair) const noexcept {
        using Kind = WatchedPair::Kind;
        if (pair.kind == Kind::held_ground) {
            const Solid held = placed(at.frames.flange, scene_.held[pair.mover]);
            return pair.F(nearest(held, placed(at.to_axis, pair.solid)).distance);
        }
        const Part& part = scene_.parts[pair.mover];
        const Rod rod = placed(part.lower ? at.frames.lower : at.frames.upper, part.rod);
        if (pair.kind == Kind::arm_rod_ground)
            return least_over_turns(rod, placed(at.to_axis, pair.solid), pair.R);
        return least_over_turns(rod, placed(at.frames.flange, scene_.held[pair.other]), pair.R);
    }

    /// Bounds speed and second derivative of all shapes over a stretch, at any constant phi; takes one from
    /// the budget.
    void enclose(double from, double to) {
        --budget_;
        const Segment& g =
            task_.segments[segment_index(task_.segments, task_.segment_count, 0.5 * (from + to))];
        const Enclosed s = Enclosed::variable(Interval(from, to)), any(Interval(-1.0, 1.0));
        SceneFrames<Enclosed> frames;
        frames.flange = flange_pose(task_.arm, pose_at(g, s));
        const Triad<Enclosed> on = triad(task_.arm, frames.flange, task_.plane);
        const Elbow<Enclosed> bent = elbow(task_.arm, triangle(task_.arm, on.distance), Enclosed(gc_.elbow));
        frames.plane = plane_frames(task_.arm, on, bent, {any, any});
        moving_.enclose(frames, scene_.part_count);
    }

    /// Adds the parameters between two sections at which obstacles block some phi; none if the pose is out of
    /// reach, or the arm folded, at an end or in the middle.
    void between(double from, double to) {
        const double h = to - from, middle = 0.5 * (from + to);
        for (const double s : {from, middle, to}) {
            const SelfMotion<double> m = motion(s);
            if (is_unreachable(m.circle) || is_folded(m.circle)) return;
        }
        budget_ = blocked_ranges_tuning::evaluations;
        enclose(from, to);
        near_.clear();
        gather(place(middle), h);
        if (near_.empty()) return;
        const Place a = place(from), b = place(to);
        std::vector<WatchedPair> open;
        for (WatchedPair& pair : near_) {
            pair.F_a = F(a, pair);
            pair.F_b = F(b, pair);
            if (pair.F_a > 0 && pair.F_b > 0) open.push_back(pair);  // otherwise a section sees it
        }
        search(from, to, open);
    }

    /// Collects the pairs that may come near on a stretch of width h with middle `at`, by bounding balls.
    void gather(const Place& at, double h) {
        using Kind = WatchedPair::Kind;
        const Solid none{SolidKind::ball, 0.0, {0, 0, 0}, {0, 0, 0}, {}};
        const auto reach = [&](const WatchedPair& pair) { return 0.5 * moving_.of(pair).speed * h; };
        const auto arm_rod = [&](int k, const Solid& solid, const WatchedPair& pair) {
            const double more = reach(pair);
            if (!(more < infinity)) return;
            const Part& part = scene_.parts[k];
            if (solid.kind != SolidKind::half_space) {
                const Ball there = around(solid),
                           own = around(
                               as_solid(placed(part.lower ? at.frames.lower : at.frames.upper, part.rod)));
                const double apart = off_axis(own.centre) - off_axis(there.centre),
                             R = moving_.sum_of_radii(own.radius, there.radius) + more;
                if (hypot(own.centre.x - there.centre.x, apart) >= R) return;
            }
            near_.push_back(pair);
        };
        for_ground(scene_, [&](const Solid& solid, int id) {
            const Solid here = placed(at.to_axis, solid);
            for (int k = 0; k < scene_.part_count; ++k)
                if (!scene_.unasked(id, k))
                    arm_rod(
                        k, here,
                        {Kind::arm_rod_ground, k, 0, solid,
                         moving_.sum_of_radii(scene_.parts[k].rod.radius, solid.radius), pair_tag(id, k)});
            for (int held = 0; held < scene_.held_count; ++held) {
                const int link = scene_.part_count + scene_.base_count + held;
                const WatchedPair pair{Kind::held_ground,
                                       held,
                                       0,
                                       solid,
                                       moving_.sum_of_radii(scene_.held[held].radius, solid.radius),
                                       pair_tag(id, link)};
                if (scene_.may_touch(id, link) || !(reach(pair) < infinity)) continue;
                const double distance = nearest(placed(at.frames.flange, scene_.held[held]), here).distance;
                if (distance < pair.R + reach(pair)) near_.push_back(pair);
            }
        });
        for (int held = 0; held < scene_.held_count; ++held)
            for (int k = 0; k < scene_.part_count; ++k)
                if (!scene_.unasked(scene_.first_held + held, k))
                    arm_rod(k, placed(at.frames.flange, scene_.held[held]),
                            {Kind::arm_rod_held, k, held, none,
                             moving_.sum_of_radii(scene_.parts[k].rod.radius, scene_.held[held].radius),
                             pair_tag(scene_.first_held + held, k)});
    }

    /// Adds the parameters at which pairs collide between two where they do not, by bisection; also the
    /// middle where width or budget end the search.
    void search(double from, double to, const std::vector<WatchedPair>& pairs) {
        const double h = to - from, middle = 0.5 * (from + to);
        std::vector<WatchedPair> left;
        for (const WatchedPair& pair : pairs)
            if (!stays_positive(pair.F_a, pair.F_b, pair.bend(moving_.of(pair), h), h)) left.push_back(pair);
        if (left.empty()) return;
        if (h < blocked_ranges_tuning::narrowest || budget_ <= 0) {
            found_.push_back(middle);
            return;
        }
        const Place here = place(middle);
        std::vector<WatchedPair> low, high;
        for (WatchedPair& pair : left) {
            const double F_m = F(here, pair);
            if (!(F_m > 0)) {
                needle(from, middle, to, pair);
                continue;
            }
            low.push_back(pair);
            low.back().F_b = F_m;
            high.push_back(pair);
            high.back().F_a = F_m;
        }
        if (low.empty()) return;
        enclose(from, middle);
        search(from, middle, low);
        enclose(middle, to);
        search(middle, to, high);
    }

    /// Adds the place `in` of a collision and, by bisection, both ends of the range of s around it.
    void needle(double from, double in, double to, const WatchedPair& pair) {
        found_.push_back(in);
        for (const double clear : {from, to}) {
            double outside = clear, inside = in;
            for (int k = 0; k < blocked_ranges_tuning::halvings; ++k) {
                const double middle = 0.5 * (outside + inside);
                (F(place(middle), pair) > 0 ? outside : inside) = middle;
            }
            found_.push_back(inside);
        }
    }

    const Task& task_;
    const Scene& scene_;
    Configuration<double> gc_;
    SceneMotion moving_;
    std::vector<WatchedPair> near_;
    std::vector<double> found_;
    int budget_ = 0;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
