// Proof that a curve is collision-free between all samples, from the distances at both ends of a stretch and
// a bound of their curvature between.
//
//     F |o                          F = distance^2 - R^2 of a pair is the least of g = |p - q|^2 - R^2 over
//       | `.             .o         pairs of points. If g'' <= A for all of them that can come nearer than R
//       |   `-._______.-'           over [a, b] with h = b - a,
//     0 +------------------- s        F(a + t) >= F_a + (F_b - F_a) t / h - A t (h - t) / 2
//        a               b
//
// because g minus the line through its ends, plus A t (h - t) / 2, is concave and not negative at both ends.
// g'' = 2 (|p' - q'|^2 + (p - q) . (p'' - q'')) <= 2 (v^2 + (R + v h) a). v and a bound speed and
// acceleration of all points of the two shapes over the stretch, by Jet<Interval, 2> of their frames. A pair
// of points that is nearer than R anywhere on the stretch is within R + v h everywhere. Distances are those
// of solids.hpp, so every shape with a distance has a proof. An unproven stretch is halved. The bound is of
// second order: a clearance of m costs about 1 / sqrt(m) fewer halvings than a proof by speeds.
#pragma once

#include <vector>

#include "../numbers/interval.hpp"
#include "../scene/clear.hpp"
#include "../scene/least_between.hpp"
#include "../scene/scene_frames.hpp"
#include "curve.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of the proof that a moving arm is free of collisions.
struct ClearProofTuning {
    /// Distances are proven with this reserve (m): more than the rounding of configurations from the curve.
    static constexpr double slack = 1e-9;
    /// A pair that is too near by more than this is in collision (m).
    static constexpr double broken = 4e-9;
    static constexpr int depth = 24;         // halvings of a stretch
    static constexpr int evaluations = 200;  // of frames over a stretch, on average, before the proof stops
};

namespace detail {

using Enclosed = Jet<Interval, 2>;

/// Bounds of the motion of all points of a shape over a stretch of s: speed (m per unit of s) and second
/// derivative (m per its square).
struct MotionBounds {
    double speed = 0, bend = 0;
};

/// The greatest magnitude of a member of an interval.
inline double greatest(const Interval& x) noexcept { return max(-x.lo, x.hi); }
/// An upper bound of the length of a vector whose components are in these intervals.
inline double greatest(const Vec3<Interval>& v) noexcept {
    const Interval x = greatest(v.x), y = greatest(v.y), z = greatest(v.z);
    return sqrt(x * x + y * y + z * z).hi;
}

/// The k-th Taylor coefficient of each component.
inline Vec3<Interval> coefficient(const Vec3<Enclosed>& v, int k) noexcept {
    return {v.x.coefficient[k], v.y.coefficient[k], v.z.coefficient[k]};
}

/// Bounds for the point p fixed to a frame.
inline MotionBounds motion_bounds(const Pose<Enclosed>& frame, const Vec3<double>& p) noexcept {
    const auto at = [&](int k) {
        const Mat3<Interval> turn{coefficient(frame.rotation.x, k), coefficient(frame.rotation.y, k),
                                  coefficient(frame.rotation.z, k)};
        return greatest(turn * spread<Interval>(p) + coefficient(frame.position, k));
    };
    return {at(1), 2.0 * at(2)};
}

/// Bounds for all points of a rod's segment, which move at most as its ends do.
inline MotionBounds motion_bounds(const Pose<Enclosed>& frame, const Rod& rod) noexcept {
    const MotionBounds a = motion_bounds(frame, rod.begin);
    if (rod.is_sphere()) return a;
    const MotionBounds b = motion_bounds(frame, rod.end);
    return {max(a.speed, b.speed), max(a.bend, b.bend)};
}

/// Bounds for all points of a ball: those of its centre, plus the rotation of the ball around it.
inline MotionBounds motion_bounds(const Pose<Enclosed>& frame, const Ball& ball) noexcept {
    const auto turn = [&](int k) {
        const double x = greatest(coefficient(frame.rotation.x, k)),
                     y = greatest(coefficient(frame.rotation.y, k)),
                     z = greatest(coefficient(frame.rotation.z, k));
        return (x + y + z) * ball.radius;
    };
    const MotionBounds c = motion_bounds(frame, ball.centre);
    return {c.speed + turn(1), c.bend + 2.0 * turn(2)};
}

/// Two shapes of which at least one moves: an arm rod (a rod of links 1 to 6) or a tool shape.
struct WatchedPair {
    enum class Kind : std::uint8_t { arm_rod_ground, arm_rod_held, arm_rod_pair, held_ground } kind;
    int mover, other;  // the arm rod or held shape, and the possible obstacle if that moves
    Solid solid;       // the possible obstacle on the ground, in the DH base
    double R;          // m: least distance of the cores; radii, clearance and slack
    Tag tag;           // identifies the pair
    double F_a = 0, F_b = 0;

    /// Whether the obstacle is a half-space.
    bool plane() const noexcept {
        return solid.kind == SolidKind::half_space &&
               (kind == Kind::arm_rod_ground || kind == Kind::held_ground);
    }
    /// F, which is positive if the pair does not collide, at a distance (m) of the cores: distance^2 - R^2;
    /// for a half-space distance - R.
    double F(double distance) const noexcept {
        return plane() ? distance - R : (distance - R) * (distance + R);
    }
    /// The upper bound A of the second derivative of F over a stretch of width h, from bounds w of the pair's
    /// relative motion.
    double bend(const MotionBounds& w, double h) const noexcept {
        return plane() ? w.bend : 2.0 * (w.speed * w.speed + (R + w.speed * h) * w.bend);
    }
};

/// Whether F is certainly positive between two ends at the distance h of s, if F is at least F_a and F_b
/// there and its second derivative is at most A.
inline bool stays_positive(double F_a, double F_b, double A, double h) noexcept {
    return F_a > 0 && F_b > 0 && A < infinity && least_between(F_a, F_b, A, h) > 0;
}

/// Bounds for the motion of all shapes of a scene over a stretch.
class SceneMotion {
public:
    /// Keeps a reference to the scene, and reserves bounds of motion for each shape; distances are proven
    /// with `slack` (m) to spare.
    explicit SceneMotion(const Scene& scene, double slack = ClearProofTuning::slack)
        : scene_(scene), slack_(slack) {
        arm_rod_.resize(static_cast<std::size_t>(arm_rod_count(scene)));
        held_.resize(static_cast<std::size_t>(scene.held_count));
    }

    /// Computes the bounds of the first `arm_rods` arm rods and of all held shapes from enclosures of the
    /// frames over a stretch.
    void enclose(const SceneFrames<Enclosed>& f, int arm_rods) {
        for (int k = 0; k < arm_rods; ++k)
            arm_rod_[static_cast<std::size_t>(k)] =
                motion_bounds(arm_rod_frame(scene_, f, k), arm_rod_at(scene_, k));
        for (std::size_t h = 0; h < held_.size(); ++h) {
            Ball core = around(scene_.held[h]);
            core.radius -= scene_.held[h].radius;
            held_[h] = motion_bounds(f.flange, core);
        }
    }

    /// The bounds for the relative motion of a pair.
    MotionBounds of(const WatchedPair& pair) const noexcept {
        using Kind = WatchedPair::Kind;
        const MotionBounds& a = pair.kind == Kind::held_ground ? held(pair.mover) : arm_rod(pair.mover);
        if (pair.kind == Kind::arm_rod_ground || pair.kind == Kind::held_ground) return a;
        const MotionBounds& b = pair.kind == Kind::arm_rod_held ? held(pair.other) : arm_rod(pair.other);
        return {a.speed + b.speed, a.bend + b.bend};
    }
    /// The bounds for arm rod k: a part of link 3 or 4, or a shape of link 1, 2, 5 or 6.
    const MotionBounds& arm_rod(int k) const noexcept { return arm_rod_[static_cast<std::size_t>(k)]; }
    /// The bounds for shape h of link 7 or the gripper.
    const MotionBounds& held(int h) const noexcept { return held_[static_cast<std::size_t>(h)]; }
    const Scene& scene() const noexcept { return scene_; }

    /// The least permitted distance (m) of the cores of two shapes with these radii.
    double sum_of_radii(double one, double other) const noexcept {
        return one + other + scene_.clearance + slack_;
    }
    /// The slack (m) contained in sum_of_radii().
    double slack() const noexcept { return slack_; }

private:
    const Scene& scene_;
    double slack_;
    std::vector<MotionBounds> arm_rod_, held_;
};

/// Every moving shape at one place of the path, in the DH base.
struct PlacedScene {
    std::vector<Rod> arm_rod;
    std::vector<Solid> held;

    /// Places all moving shapes at the frames of the links.
    void place(const Scene& scene, const SceneFrames<double>& f) {
        arm_rod.clear();
        held.clear();
        for (int k = 0; k < arm_rod_count(scene); ++k)
            arm_rod.push_back(placed(arm_rod_frame(scene, f, k), arm_rod_at(scene, k)));
        for (int h = 0; h < scene.held_count; ++h) held.push_back(placed(f.flange, scene.held[h]));
    }

    /// The distance (m) of the cores of a pair.
    double distance(const WatchedPair& pair) const noexcept {
        using Kind = WatchedPair::Kind;
        const auto i = static_cast<std::size_t>(pair.mover), j = static_cast<std::size_t>(pair.other);
        if (pair.kind == Kind::held_ground) return nearest(held[i], pair.solid).distance;
        const Rod& rod = arm_rod[i];
        if (pair.kind == Kind::arm_rod_ground) return nearest(rod.begin, rod.end, pair.solid).distance;
        const Solid other = pair.kind == Kind::arm_rod_held ? held[j] : as_solid(arm_rod[j]);
        return nearest(rod.begin, rod.end, other).distance;
    }
};

/// Calls found(k, ball, obstacle) for each ball of the scene's clouds, of the obstacle with this number,
/// whose surface is within reach(k) (m) of the segment of arm rod k.
template <class Reach, class Found>
void near_balls(const Scene& scene, const std::vector<Rod>& arm_rod, const Reach& reach, const Found& found) {
    for (int block = 0; block < scene.block_count; ++block)
        for (int k = 0; k < static_cast<int>(arm_rod.size()); ++k)
            balls_near(scene, block, arm_rod[static_cast<std::size_t>(k)], reach(k),
                       [&](const Solid& ball, int id) { found(k, ball, id); });
}

/// Calls found(pair) for each pair of shapes that could collide on a stretch of width h of s with middle
/// `at`, without the pairs that may touch or never meet.
template <class Found>
void near_pairs(const SceneMotion& moving, const PlacedScene& at, double h, const Found& found) {
    using Kind = WatchedPair::Kind;
    const Scene& scene = moving.scene();
    const Solid none{SolidKind::ball, 0.0, {0, 0, 0}, {0, 0, 0}, {}};
    const auto offer = [&](const WatchedPair& pair) {
        if (at.distance(pair) < pair.R + 0.5 * moving.of(pair).speed * h) found(pair);
    };
    const auto apart = [&](const Ball& a, const Ball& b, double speed) {
        const double R = moving.sum_of_radii(a.radius, b.radius) + 0.5 * h * speed;
        const Vec3<double> d = a.centre - b.centre;
        return dot(d, d) >= R * R;
    };
    const auto reach = [&](int k) {
        return moving.sum_of_radii(arm_rod_at(scene, k).radius, 0.0) + 0.5 * moving.arm_rod(k).speed * h;
    };
    near_balls(scene, at.arm_rod, reach, [&](int k, const Solid& ball, int id) {
        const int link = link_of_arm_rod(scene, k);
        if (scene.may_touch(id, link)) return;
        offer({Kind::arm_rod_ground, k, 0, ball,
               moving.sum_of_radii(arm_rod_at(scene, k).radius, ball.radius), pair_tag(id, link)});
    });
    for (int k = 0; k < arm_rod_count(scene); ++k) {
        const Rod& rod = at.arm_rod[static_cast<std::size_t>(k)];
        const Ball own = around(as_solid(rod));
        const int link = link_of_arm_rod(scene, k);
        const auto far = [&](const Solid& solid, double speed) {
            return solid.kind != SolidKind::half_space && apart(own, around(solid), speed);
        };
        for (int n = 0; n < scene.solid_count; ++n) {
            const Solid& solid = scene.solids[n];
            const int id = scene.solid_id[n];
            if (scene.unasked(id, link) || far(solid, moving.arm_rod(k).speed)) continue;
            offer({Kind::arm_rod_ground, k, 0, solid, moving.sum_of_radii(rod.radius, solid.radius),
                   pair_tag(id, link)});
        }
        for (int held = 0; held < scene.held_count; ++held) {
            const Solid& solid = at.held[static_cast<std::size_t>(held)];
            const int id = scene.first_held + held;
            const bool away = far(solid, moving.arm_rod(k).speed + moving.held(held).speed);
            if (away || scene.unasked(id, link)) continue;
            offer({Kind::arm_rod_held, k, held, none, moving.sum_of_radii(rod.radius, solid.radius),
                   pair_tag(id, link)});
        }
    }
    for (int n = 0; n < scene.own_count; ++n) {
        if (scene.never_meet(scene.own[n].obstacle, scene.own[n].link)) continue;
        const int a = arm_rod_of_link(scene, scene.own[n].link),
                  b = arm_rod_of_obstacle(scene, scene.own[n].obstacle);
        offer({Kind::arm_rod_pair, a, b, none,
               moving.sum_of_radii(arm_rod_at(scene, a).radius, arm_rod_at(scene, b).radius),
               pair_tag(scene.own[n].obstacle, scene.own[n].link)});
    }
    for (int held = 0; held < scene.held_count; ++held) {
        const Solid& solid = at.held[static_cast<std::size_t>(held)];
        const Ball own = around(solid);
        const int link = scene.part_count + scene.base_count + held;
        for_ground(scene, [&](const Solid& ground, int id) {
            const bool far =
                ground.kind != SolidKind::half_space && apart(own, around(ground), moving.held(held).speed);
            if (far || scene.may_touch(id, link)) return;
            offer({Kind::held_ground, held, 0, ground, moving.sum_of_radii(solid.radius, ground.radius),
                   pair_tag(id, link)});
        });
    }
}

/// Proves that a curve is collision-free, stretch by stretch.
class ClearProver {
public:
    /// Keeps references to the curve and the scene. `touching`: a requested end may touch an obstacle, so
    /// pairs may be too near by the slack.
    ClearProver(const Curve& curve, const Scene& scene, bool touching)
        : curve_(curve),
          scene_(scene),
          moving_(scene, touching ? -ClearProofTuning::slack : ClearProofTuning::slack),
          budget_(0) {}

    /// Whether the part [from, to] of a stretch is proven collision-free; the place of a collision that is
    /// found on the way is added to `violated`.
    bool prove(const Stretch& x, double from, double to, std::vector<double>& violated) {
        if (scene_.base_tag) {
            violated.push_back(0.5 * (from + to));
            return false;
        }
        budget_ += ClearProofTuning::evaluations;
        begun_ = budget_;
        stretch_ = &x;
        violated_ = &violated;
        const double h = to - from;
        enclose(from, to);
        here_.place(scene_, frames(0.5 * (from + to)));
        std::vector<WatchedPair> near;
        near_pairs(moving_, here_, h, [&](const WatchedPair& pair) { near.push_back(pair); });
        if (near.empty()) return true;
        measure(from, near, [](WatchedPair& pair, double F) { pair.F_a = F; });
        measure(to, near, [](WatchedPair& pair, double F) { pair.F_b = F; });
        return stands(from, to, near, 0);
    }

    /// How often the last proof enclosed the motion of the shapes.
    long long looks() const noexcept { return begun_ - budget_; }

private:
    /// The frames at s of the present stretch that the scene's shapes are fixed to; those of links 1, 2, 5
    /// and 6 only if there are such shapes.
    template <class T>
    SceneFrames<T> frames(const T& s) const noexcept {
        const Stretch& x = *stretch_;
        const T value = phi_at(x, s);
        SceneFrames<T> out;
        out.flange = flange_pose(curve_.arm, pose_at(curve_.segment(x), s));
        if (x.lead == 0 && scene_.swing_count == 0) {
            const Triad<T> on = triad(curve_.arm, out.flange, curve_.plane);
            const T side(configuration(curve_.branch(x)).elbow);
            out.plane = plane_frames(
                curve_.arm, on, elbow(curve_.arm, triangle(curve_.arm, on.distance), side), sin_cos(value));
            return out;
        }
        const PlacedDirections<T> here = curve_.place(x, s, value);
        out.plane = plane_frames<T>(curve_.arm, here.motion.circle, here.motion.elbow, here.phi);
        if (scene_.swing_count) add_swinging(curve_.arm, here.angles, out);
        return out;
    }

    /// Bounds the speed and second derivative of all shapes over a range of s; takes one from the budget.
    void enclose(double from, double to) {
        --budget_;
        moving_.enclose(frames(Enclosed::variable(Interval(from, to))), arm_rod_count(scene_));
    }

    /// Calls take(pair, F) for each listed pair with its F at s. If one collides there, sets `touches_`; if
    /// that is set now, records s.
    template <class Take>
    void measure(double s, std::vector<WatchedPair>& pairs, const Take& take) {
        here_.place(scene_, frames(s));
        for (WatchedPair& pair : pairs) {
            const double distance = here_.distance(pair);
            take(pair, pair.F(distance));
            touches_ = touches_ || distance < pair.R - moving_.slack() - ClearProofTuning::broken;
        }
        if (touches_) violated_->push_back(s);
    }

    /// Whether all listed pairs are proven apart between two s at which they were measured, by bisection.
    /// `moving_` must hold the bounds over this range. depth: halvings so far. Resets `touches_`.
    bool stands(double from, double to, const std::vector<WatchedPair>& pairs, int depth) {
        if (touches_) return touches_ = false;
        const double h = to - from, middle = 0.5 * (from + to);
        std::vector<WatchedPair> left;
        for (const WatchedPair& pair : pairs)
            if (!stays_positive(pair.F_a, pair.F_b, pair.bend(moving_.of(pair), h), h)) left.push_back(pair);
        if (left.empty()) return true;
        if (depth == ClearProofTuning::depth || budget_ <= 0) return false;
        std::vector<double> F;
        measure(middle, left, [&F](WatchedPair&, double value) { F.push_back(value); });
        if (touches_) return touches_ = false;
        for (const bool upper : {false, true}) {
            std::vector<WatchedPair> half = left;
            for (std::size_t i = 0; i < half.size(); ++i) (upper ? half[i].F_a : half[i].F_b) = F[i];
            enclose(upper ? middle : from, upper ? to : middle);
            if (!stands(upper ? middle : from, upper ? to : middle, half, depth + 1)) return false;
        }
        return true;
    }

    const Curve& curve_;
    const Scene& scene_;
    SceneMotion moving_;
    PlacedScene here_;
    const Stretch* stretch_ = nullptr;
    std::vector<double>* violated_ = nullptr;
    long long budget_, begun_ = 0;
    bool touches_ = false;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
