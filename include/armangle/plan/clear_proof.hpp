// Proof that nothing touches between all samples of a curve: distances at both ends of a stretch, and how
// hard they can bend between.
//
//     F |o                          F = distance^2 - R^2 of a pair of shapes is the least of g = |p - q|^2 -
//     R^2
//       | `.             .o         over pairs of points. Where g'' <= A for all of them that can come nearer
//       |   `-._______.-'           than R, over [a, b] with h = b - a,
//     0 +------------------- s        F(a + t) >= F_a + (F_b - F_a) t / h - A t (h - t) / 2
//        a               b
//
// since g less the line through its ends, plus A t (h - t) / 2, is concave and not negative at both ends.
// g'' = 2 (|p'|^2 + (p - q) . p'') <= 2 (v^2 + (R + v h) a): v and a bound speed and acceleration of all
// points of a shape over the stretch, by Jet<Interval, 2> of the frame that it is fixed to; a pair of points
// that is nearer than R somewhere on it is within R + v h all along. Distances are those of solids.hpp, so
// that a shape which has one there has its proof here. What is not proven is halved. Of second order: a miss
// by m costs about 1 / sqrt(m) halvings less than a proof by speeds alone would.
#pragma once

#include <vector>

#include "../numbers/interval.hpp"
#include "../scene/scene.hpp"
#include "../scene/witnesses.hpp"
#include "curve.hpp"

namespace armangle {

namespace clear_proof {
/// Distances are proven with this to spare (m): more than the rounding of postures computed from the curve.
inline constexpr double slack = 1e-9;
/// A pair that is nearer than asked by more than this touches (m).
inline constexpr double broken = 4e-9;
inline constexpr int depth = 24;         // halvings of a stretch
inline constexpr int evaluations = 200;  // of frames over a stretch, on average, before the rest is left
}  // namespace clear_proof

namespace detail {

using Enclosed = Jet<Interval, 2>;

/// Bounds over a stretch of s, of all points of a shape: m per unit of s, and of its square.
struct Swing {
    double speed = 0, bend = 0;
};

inline double greatest(const Interval& x) noexcept { return max(-x.lo, x.hi); }
inline double greatest(const Vec3<Interval>& v) noexcept {
    const Interval x = greatest(v.x), y = greatest(v.y), z = greatest(v.z);
    return sqrt(x * x + y * y + z * z).hi;
}

/// Coefficient k of a vector of series.
inline Vec3<Interval> coefficient(const Vec3<Enclosed>& v, int k) noexcept {
    return {v.x.coefficient[k], v.y.coefficient[k], v.z.coefficient[k]};
}

/// Of a point fixed to a frame.
inline Swing swing(const Pose<Enclosed>& frame, const Vec3<double>& p) noexcept {
    const auto at = [&](int k) {
        const Mat3<Interval> turn{coefficient(frame.rotation.x, k), coefficient(frame.rotation.y, k),
                                  coefficient(frame.rotation.z, k)};
        return greatest(turn * spread<Interval>(p) + coefficient(frame.position, k));
    };
    return {at(1), 2.0 * at(2)};
}

/// Of a segment: its points move as its ends do, or less.
inline Swing swing(const Pose<Enclosed>& frame, const Rod& rod) noexcept {
    const Swing a = swing(frame, rod.begin);
    if (rod.is_sphere()) return a;
    const Swing b = swing(frame, rod.end);
    return {max(a.speed, b.speed), max(a.bend, b.bend)};
}

/// Of all points of a ball: its centre, and how far the rest can turn about it.
inline Swing swing(const Pose<Enclosed>& frame, const Ball& ball) noexcept {
    const auto turn = [&](int k) {
        const double x = greatest(coefficient(frame.rotation.x, k)),
                     y = greatest(coefficient(frame.rotation.y, k)),
                     z = greatest(coefficient(frame.rotation.z, k));
        return (x + y + z) * ball.radius;
    };
    const Swing c = swing(frame, ball.centre);
    return {c.speed + turn(1), c.bend + 2.0 * turn(2)};
}

/// A frame seen from another.
template <class T>
inline Pose<T> seen_from(const Pose<T>& frame, const Pose<T>& other) noexcept {
    const Mat3<T>& r = other.rotation;
    return {{transposed_times(r, frame.rotation.x), transposed_times(r, frame.rotation.y),
             transposed_times(r, frame.rotation.z)},
            transposed_times(r, frame.position - other.position)};
}

/// Two shapes that move against each other: what turns with psi or is held, and what stands or is held.
struct MovingPair {
    enum class Kind : std::uint8_t { part_ground, part_held, held_ground } kind;
    int mover;    // the part, or what is held
    Solid solid;  // in the DH base; of part_held in frame 7
    double R;     // m: centres of balls may come so near; radii, clearance and slack
    Tag tag;      // who
    double F_a = 0, F_b = 0;

    /// Of a half-space the depth itself, as it is linear; else the difference of squares.
    double F(double distance) const noexcept {
        return solid.kind == SolidKind::half_space ? distance - R : (distance - R) * (distance + R);
    }
    /// A of this pair over a stretch of width h.
    double bend(const Swing& w, double h) const noexcept {
        if (solid.kind == SolidKind::half_space) return w.bend;
        return 2.0 * (w.speed * w.speed + (R + w.speed * h) * w.bend);
    }
};

/// Whether F > 0 between two ends, where it is at least F_a, F_b > 0 and bends no more than A.
inline bool stays_positive(double F_a, double F_b, double A, double h) noexcept {
    if (!(F_a > 0 && F_b > 0 && A < infinity)) return false;
    const double rise = F_b - F_a, t = A * h > 0 ? 0.5 * h - rise / (A * h) : -1.0;
    if (!(t > 0 && t < h)) return true;
    return F_a + rise * t / h - 0.5 * A * t * (h - t) > 0;
}

/// The shapes of a scene as they move along a path: how hard over a stretch, and which pairs are near.
class MovingScene {
public:
    MovingScene(const Scene& scene) : scene_(scene) {
        part_.resize(static_cast<std::size_t>(scene.part_count));
        against_held_.resize(part_.size());
        held_.resize(static_cast<std::size_t>(scene.held_count));
    }

    /// Takes in how hard everything moves over a stretch.
    void enclose(const LinkFrames<Enclosed>& f) {
        for (std::size_t k = 0; k < part_.size(); ++k) {
            const Part& part = scene_.parts[k];
            part_[k] = swing(part.lower ? f.lower : f.upper, part.rod);
        }
        if (held_.empty()) return;
        const Pose<Enclosed> upper = seen_from(f.upper, f.flange), lower = seen_from(f.lower, f.flange);
        for (std::size_t k = 0; k < part_.size(); ++k)
            against_held_[k] = swing(scene_.parts[k].lower ? lower : upper, scene_.parts[k].rod);
        for (std::size_t h = 0; h < held_.size(); ++h) {
            Ball core = around(scene_.held[h]);
            core.radius -= scene_.held[h].radius;
            held_[h] = swing(f.flange, core);
        }
    }

    const Swing& of(const MovingPair& pair) const noexcept {
        const auto i = static_cast<std::size_t>(pair.mover);
        if (pair.kind == MovingPair::Kind::part_ground) return part_[i];
        return pair.kind == MovingPair::Kind::part_held ? against_held_[i] : held_[i];
    }

    const Scene& scene() const noexcept { return scene_; }
    /// How near a pair may be in the middle of a stretch and touch within it.
    static double reach(const Swing& w, double R, double h) noexcept { return R + 0.5 * w.speed * h; }
    /// How near the cores of two shapes may come.
    double sum_of_radii(double one, double other) const noexcept {
        return one + other + scene_.clearance + clear_proof::slack;
    }
    const Swing& part(int k) const noexcept { return part_[static_cast<std::size_t>(k)]; }
    const Swing& part_against_held(int k) const noexcept {
        return against_held_[static_cast<std::size_t>(k)];
    }
    const Swing& held(int h) const noexcept { return held_[static_cast<std::size_t>(h)]; }

private:
    const Scene& scene_;
    std::vector<Swing> part_, against_held_, held_;
};

/// Frames of a posture with every moving shape in its place.
struct PlacedScene {
    std::vector<Rod> part, against_held;  // in the DH base, and in frame 7
    std::vector<Solid> held;              // in the DH base

    void place(const Scene& scene, const LinkFrames<double>& f) {
        part.clear();
        against_held.clear();
        held.clear();
        const Pose<double> to_flange = inverted(f.flange);
        for (int k = 0; k < scene.part_count; ++k) {
            part.push_back(placed(scene.parts[k].lower ? f.lower : f.upper, scene.parts[k].rod));
            if (scene.held_count) against_held.push_back(placed(to_flange, part.back()));
        }
        for (int h = 0; h < scene.held_count; ++h) held.push_back(placed(f.flange, scene.held[h]));
    }

    double distance(const MovingPair& pair) const noexcept {
        const auto i = static_cast<std::size_t>(pair.mover);
        if (pair.kind == MovingPair::Kind::held_ground) return nearest(held[i], pair.solid).distance;
        const Rod& rod = pair.kind == MovingPair::Kind::part_ground ? part[i] : against_held[i];
        return nearest(rod.begin, rod.end, pair.solid).distance;
    }
};

/// What of a scene comes near to moving shapes that are placed: found(pair) for each pair that is within half
/// a stretch's way of touching.
template <class Found>
void near_pairs(const MovingScene& moving, const PlacedScene& at, double h, const Found& found) {
    using Eight = Lane<8>;
    using Kind = MovingPair::Kind;
    const Scene& scene = moving.scene();
    const auto offer = [&](Kind kind, int mover, const Solid& solid, double radius, int id, int link) {
        if (scene.may_touch(id, link)) return;
        MovingPair pair{kind, mover, solid, moving.sum_of_radii(radius, solid.radius), pair_tag(id, link)};
        if (at.distance(pair) < moving.reach(moving.of(pair), pair.R, h)) found(pair);
    };
    const auto apart = [&](const Ball& a, const Ball& b, double more) {
        const double R = a.radius + b.radius + scene.clearance + clear_proof::slack + more;
        const Vec3<double> d = a.centre - b.centre;
        return dot(d, d) >= R * R;
    };
    for (int block = 0; block < scene.block_count; ++block) {
        const BallBlock& balls = scene.blocks[block];
        const Vec3<Eight> q{Eight::load(balls.x), Eight::load(balls.y), Eight::load(balls.z)};
        const Eight radius = Eight::load(balls.radius);
        for (int k = 0; k < scene.part_count; ++k) {
            const Rod& rod = at.part[static_cast<std::size_t>(k)];
            const Vec3<double> d = rod.end - rod.begin;
            const double square = dot(d, d), per = square > 0 ? 1.0 / square : 0.0;
            const Vec3<Eight> off = q - spread<Eight>(rod.begin);
            const Eight share = min(max(dot(off, spread<Eight>(d)) * Eight(per), Eight(0.0)), Eight(1.0));
            const Vec3<Eight> rest = off - spread<Eight>(d) * share;
            const Eight R =
                radius + Eight(moving.reach(moving.part(k), moving.sum_of_radii(rod.radius, 0.0), h));
            for_each_bit(bits(dot(rest, rest) < R * R), [&](int i) {
                const int id = scene.ball_id[8 * block + i];
                const Vec3<double> centre{balls.x[i], balls.y[i], balls.z[i]};
                if (id != no_ball)
                    offer(Kind::part_ground, k, {SolidKind::ball, balls.radius[i], centre, centre, {}},
                          rod.radius, id, k);
            });
        }
    }
    for (int n = 0; n < scene.solid_count; ++n) {
        const Solid& solid = scene.solids[n];
        const bool bounded = solid.kind != SolidKind::half_space;
        const Ball bound = bounded ? around(solid) : Ball{};
        for (int k = 0; k < scene.part_count; ++k) {
            const Rod& rod = at.part[static_cast<std::size_t>(k)];
            if (bounded && apart(around(as_solid(rod)), bound, 0.5 * h * moving.part(k).speed)) continue;
            offer(Kind::part_ground, k, solid, rod.radius, scene.solid_id[n], k);
        }
    }
    for (int held = 0; held < scene.held_count; ++held) {
        const Solid& solid = scene.held[held];
        const Ball bound = around(solid), placed_bound = around(at.held[static_cast<std::size_t>(held)]);
        for (int k = 0; k < scene.part_count; ++k) {
            const Rod& rod = at.against_held[static_cast<std::size_t>(k)];
            if (apart(around(as_solid(rod)), bound, 0.5 * h * moving.part_against_held(k).speed)) continue;
            offer(Kind::part_held, k, solid, rod.radius, scene.first_held + held, k);
        }
        const int link = scene.part_count + scene.base_count + held;
        for_ground(scene, [&](const Solid& ground, int id) {
            const bool far = ground.kind != SolidKind::half_space &&
                             apart(placed_bound, around(ground), 0.5 * h * moving.held(held).speed);
            if (!far) offer(Kind::held_ground, held, ground, solid.radius, id, link);
        });
    }
}

/// The proof of one curve, stretch by stretch.
class ClearProver {
public:
    ClearProver(const Curve& curve, const Scene& scene)
        : curve_(curve), scene_(scene), moving_(scene), budget_(0) {}

    /// Whether nothing touches on a stretch; where something does, a place is added to `violated`.
    bool prove(const Stretch& x, std::vector<double>& violated) {
        if (scene_.base_tag) {
            violated.push_back(0.5 * (x.start + x.end));
            return false;
        }
        budget_ += clear_proof::evaluations;
        stretch_ = &x;
        violated_ = &violated;
        const double h = x.end - x.start;
        enclose(x.start, x.end);
        place(0.5 * (x.start + x.end));
        std::vector<MovingPair> near;
        near_pairs(moving_, here_, h, [&](const MovingPair& pair) { near.push_back(pair); });
        if (near.empty()) return true;
        measure(x.start, near, [](MovingPair& pair, double F) { pair.F_a = F; });
        measure(x.end, near, [](MovingPair& pair, double F) { pair.F_b = F; });
        return stands(x.start, x.end, near, 0);
    }

private:
    template <class T>
    LinkFrames<T> frames(const T& s) const noexcept {
        const Stretch& x = *stretch_;
        const T value = phi_at(x, s);
        const Pose<T> flange = flange_pose(curve_.arm, pose_at(curve_.segment(x), s));
        if (x.lead == 0) {
            const Circle<T> c = circle(curve_.arm, flange, curve_.plane);
            const Configuration<T> gc = spread<T>(configuration(curve_.branch(x)));
            return link_frames(curve_.arm, flange, self_motion(curve_.arm, c, gc), sin_cos(value));
        }
        const PlacedDirections<T> led = curve_.place(x, s, value);
        return link_frames(curve_.arm, flange, led.motion, led.phi);
    }

    void enclose(double from, double to) {
        --budget_;
        moving_.enclose(frames(Enclosed::variable(Interval(from, to))));
    }
    void place(double s) { here_.place(scene_, frames(s)); }

    template <class Take>
    void measure(double s, std::vector<MovingPair>& pairs, const Take& take) {
        place(s);
        for (MovingPair& pair : pairs) {
            const double distance = here_.distance(pair);
            take(pair, pair.F(distance));
            touches_ = touches_ || distance < pair.R - clear_proof::slack - clear_proof::broken;
        }
        if (touches_) violated_->push_back(s);
    }

    /// Whether no pair of a list touches between two s, at which they are measured; `moving_` encloses the
    /// stretch.
    bool stands(double from, double to, const std::vector<MovingPair>& pairs, int depth) {
        if (touches_) return touches_ = false;
        const double h = to - from, middle = 0.5 * (from + to);
        std::vector<MovingPair> left;
        for (const MovingPair& pair : pairs)
            if (!stays_positive(pair.F_a, pair.F_b, pair.bend(moving_.of(pair), h), h)) left.push_back(pair);
        if (left.empty()) return true;
        if (depth == clear_proof::depth || budget_ <= 0) return false;
        std::vector<double> F;
        measure(middle, left, [&F](MovingPair&, double value) { F.push_back(value); });
        if (touches_) return touches_ = false;
        for (const bool upper : {false, true}) {
            std::vector<MovingPair> half = left;
            for (std::size_t i = 0; i < half.size(); ++i) (upper ? half[i].F_a : half[i].F_b) = F[i];
            enclose(upper ? middle : from, upper ? to : middle);
            if (!stands(upper ? middle : from, upper ? to : middle, half, depth + 1)) return false;
        }
        return true;
    }

    const Curve& curve_;
    const Scene& scene_;
    MovingScene moving_;
    PlacedScene here_;
    const Stretch* stretch_ = nullptr;
    std::vector<double>* violated_ = nullptr;
    long long budget_;
    bool touches_ = false;
};

}  // namespace detail

}  // namespace armangle
