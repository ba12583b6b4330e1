// The queries of MoveIt's KinematicsBase without ROS types: solution nearest to a seed, consistency limits,
// held joints, a callback, and an approximate solution. contrib/moveit connects them to MoveIt.
//
// Consistency limits and held joints narrow the limits, so feasible arcs answer them in closed form. The
// search calls the callback along the arcs of all branches, outward from the seed. It ends with a proof:
// every remaining solution is within half a resolution of psi of a rejected one.
#pragma once

#include "limits/nearest_outside.hpp"

#include "names/begin.hpp"

namespace armangle {

/// Arguments of a search besides the pose.
struct SearchOptions {
    const double* seed = nullptr;         // 7 joint values (rad)
    const double* consistency = nullptr;  // 7: largest move of each joint from the seed (rad, >= 0); null:
                                          // any
    unsigned held = 0;                    // bit j: joint j + 1 keeps the seed's value
    double singularity_margin = 0.0;      // rad
    double resolution = 0.05;             // rad of psi between solutions passed to the callback
    double length = 0.0;                  // > 0: accept an approximate solution; metres that equal one radian
};

/// The answer of a callback to a solution.
enum class Answer { accepted, refused, stop };

/// Result of a search. If the status is OK, the configuration solves the pose. If options.length is given,
/// other statuses may also have a configuration: within the window, at distance `gap` from the pose, not
/// improved by any small change.
struct Found {
    Nearest posture;  // NaN if none was found; its status is the result
    double gap;       // m, one radian counting as options.length; 0 if the pose is solved
    int shown;        // number of solutions passed to the callback
    bool proven;      // if the callback accepted none: it saw all solutions, to the resolution
};

/// The limits of a search: the arm's limits, narrowed around the seed by consistency limits and held joints;
/// lower > upper if the seed is too far outside.
inline Limits search_window(const Arm& arm, const SearchOptions& options) noexcept {
    Limits out = arm.limits;
    for (int j = 0; j < joints; ++j) {
        const bool held = options.held >> j & 1u;
        if (!held && !options.consistency) continue;
        const double room = held ? 0.0 : options.consistency[j];
        out.lower[j] = max(out.lower[j], options.seed[j] - room);
        out.upper[j] = min(out.upper[j], options.seed[j] + room);
    }
    return out;
}

namespace detail {

/// Steps along the arcs of one branch: rising (way +1) or falling (-1) psi from a start, on a grid of the
/// resolution, and the ends of all arcs on the way.
class ArcWalk {
public:
    ArcWalk() = default;
    /// Begins a walk from `start` over the arcs in steps of `resolution` (rad), in the direction `way` (1 or
    /// -1). It includes the start itself if `with_start`.
    ArcWalk(const ArcSet& arcs, double start, double way, double resolution, bool with_start) noexcept
        : arcs_(&arcs),
          start_(start),
          way_(way),
          resolution_(resolution),
          walked_(with_start ? -1e-12 : 0.0) {}

    /// The next psi within the arcs, at most pi from the start; false if none remains.
    bool next(double& psi) noexcept {
        if (!arcs_) return false;
        while (walked_ < pi) {
            const double grid = min(resolution_ * (std::floor(walked_ / resolution_ + 1e-9) + 1.0), pi);
            double ahead = walked_ < 0 ? 0.0 : grid;
            bool end = false;
            for (int i = 0; i < arcs_->count && !arcs_->full; ++i)
                for (const double at : {arcs_->arc[i].lower, arcs_->arc[i].upper}) {
                    const double off = distance_to(at);
                    if (off <= walked_ || off > ahead) continue;
                    ahead = off;
                    end = true;
                }
            walked_ = ahead;
            psi = wrap(start_ + way_ * ahead);
            if (end || arcs_->full || contains(*arcs_, psi)) return true;
        }
        return false;
    }

private:
    /// The distance (rad, in [0, 2 pi)) of an angle from the start along this direction.
    double distance_to(double at) const noexcept {
        const double off = way_ * (at - start_);
        return off - two_pi * std::floor(off / two_pi);
    }

    const ArcSet* arcs_ = nullptr;
    double start_ = 0, way_ = 1, resolution_ = 1, walked_ = 0;
};

/// Enumerates the solutions of all branches in sixteen directions (both from the start of each branch), each
/// time the one nearest to the seed.
class OutwardWalk {
public:
    /// Computes the feasible arcs of all branches and, in each, the first solution in both directions of psi:
    /// from the solution `first` in its branch, from the seed's psi in others.
    OutwardWalk(const Arm& arm, const LimitTable& limits, const Pose<double>& pose, const Nearest& first,
                const SearchOptions& options) noexcept
        : arm_(arm), seed_(options.seed) {
        const double psi_then = forward(arm, seed_).psi;
        for (int gc = 0; gc < configurations; ++gc) {
            motion_[gc] = self_motion(arm, pose, gc);
            const bool own = gc == first.gc;
            const double start = own || std::isnan(psi_then) ? first.psi : psi_then;
            if (feasible(motion_[gc], limits, arcs_[gc]) != Status::OK) continue;
            for (int side = 0; side < 2; ++side) {
                Way& way = ways_[2 * gc + side];
                way.walk =
                    ArcWalk(arcs_[gc], start, side ? -1.0 : 1.0, options.resolution, !own && side == 0);
                advance(way, gc);
            }
        }
    }

    /// The next solution; false if all have been returned.
    bool next(Nearest& out) noexcept {
        int best = -1;
        for (int k = 0; k < ways; ++k)
            if (ways_[k].open && (best < 0 || ways_[k].at.distance < ways_[best].at.distance)) best = k;
        if (best < 0) return false;
        out = ways_[best].at;
        advance(ways_[best], best / 2);
        return true;
    }

private:
    static constexpr int ways = 2 * configurations;
    struct Way {
        ArcWalk walk;
        Nearest at;
        bool open = false;
    };

    /// Computes the next solution of one direction in `way`, or closes it if the arcs end.
    void advance(Way& way, int gc) noexcept {
        double psi = 0;
        way.open = way.walk.next(psi);
        if (!way.open) return;
        const Joints found = joints_within_limits(arm_, directions(motion_[gc], sin_cos(psi)), seed_);
        double sum = 0;
        for (int j = 0; j < joint_slots; ++j) way.at.q[j] = found.q[j];
        for (int j = 0; j < joints; ++j) sum += (found.q[j] - seed_[j]) * (found.q[j] - seed_[j]);
        way.at.psi = psi;
        way.at.gc = gc;
        way.at.status = Status::OK;
        way.at.distance = sqrt(sum);
    }

    const Arm& arm_;
    const double* seed_;
    SelfMotion<double> motion_[configurations];
    ArcSet arcs_[configurations];
    Way ways_[ways];
};

/// The empty result with its reason.
inline armangle::Found nothing(Status why) noexcept {
    armangle::Found out{};  // armangle::Found, not the Found of chain/inverse.hpp
    for (double& q : out.posture.q) q = not_a_number;
    out.posture.psi = out.posture.distance = out.posture.margin = out.gap = not_a_number;
    out.posture.gc = -1;
    out.posture.status = why;
    return out;
}

/// Improves an approximate solution until no small change brings it nearer to the pose. It starts there and
/// at the seed, and keeps the better result. Returns the distance (m) from the pose. The limits are the
/// arm's.
inline double come_nearer(const Arm& boxed, const Pose<double>& pose, const SearchOptions& options,
                          Nearest& posture) noexcept {
    Joints from_posture{}, from_seed{};
    for (int j = 0; j < joints; ++j) {
        from_posture.q[j] = posture.q[j];
        from_seed.q[j] = options.seed[j];
    }
    Twist rest;
    double gap = distance(boxed, posture.q, pose, options.length, rest);
    for (const Joints& start : {from_posture, from_seed}) {
        Limits about;
        if (!limits_about(boxed, start, options.singularity_margin, about)) continue;
        const Relaxed found = relaxed(boxed, about, start, pose, options.length);
        if (!(found.distance < gap)) continue;
        gap = found.distance;
        for (int j = 0; j < joints; ++j) posture.q[j] = found.at.q[j];
    }
    const Posture at = forward(boxed, posture.q);
    NearestOptions nearest;
    nearest.near = options.seed;
    posture.psi = at.psi;
    posture.gc = at.gc;
    posture.distance = joint_distance(posture.q, nearest);
    return gap;
}

}  // namespace detail

/// Searches the solution that a callback accepts: Answer accept(const double* q). It first sees the solution
/// nearest to the seed within the window, then others outward over arcs and branches, in the revolutions
/// nearest to the seed. The status is OK; NOT_ALLOWED if it rejected all (`proven`) or stopped; BAD_INPUT; or
/// the reason why the window has no solution. In that case it sees an approximate one if options.length is
/// given.
template <class Accept>
Found search(const Arm& arm, const Pose<double>& pose, const SearchOptions& options,
             const Accept& accept) noexcept {
    const bool usable = options.seed && is_finite(options.seed) && is_rigid(pose) && options.resolution > 0;
    if (!usable) return detail::nothing(Status::BAD_INPUT);
    const Limits window = search_window(arm, options);
    for (int j = 0; j < joints; ++j)
        if (!(window.lower[j] <= window.upper[j])) return detail::nothing(Status::LIMITS);
    ArmParameters narrowed = arm;
    narrowed.limits = window;
    const Arm boxed = make_arm(narrowed);
    const LimitTable limits = limit_table(boxed, options.singularity_margin);
    NearestOptions nearest;
    nearest.near = options.seed;
    Found out{};
    out.posture = nearest_posture(boxed, limits, pose, nearest);
    const Status status = out.posture.status;
    if (!is_solved(status)) {
        if (!(options.length > 0)) return detail::nothing(status);
        out.posture = nearest_outside(boxed, limits, pose, nearest, options.length);
        if (std::isnan(out.posture.q[0])) return detail::nothing(status);
        out.gap = detail::come_nearer(boxed, pose, options, out.posture);
    }
    out.posture.margin = limit_margin(arm.limits, out.posture.q);
    out.shown = 1;
    Answer answer = accept(static_cast<const double*>(out.posture.q));
    if (answer == Answer::accepted) return out;
    if (status == Status::OK && answer == Answer::refused) {
        detail::OutwardWalk walk(boxed, limits, pose, out.posture, options);
        while (answer == Answer::refused && walk.next(out.posture)) {
            out.posture.margin = limit_margin(arm.limits, out.posture.q);
            ++out.shown;
            answer = accept(static_cast<const double*>(out.posture.q));
        }
        if (answer == Answer::accepted) return out;
    }
    Found none = detail::nothing(Status::NOT_ALLOWED);
    none.shown = out.shown;
    none.proven = answer == Answer::refused && status == Status::OK;
    return none;
}

/// The solution within the window nearest to the seed. If there is none, an approximate one if options.length
/// is given.
inline Found search(const Arm& arm, const Pose<double>& pose, const SearchOptions& options) noexcept {
    return search(arm, pose, options, [](const double*) noexcept { return Answer::accepted; });
}

}  // namespace armangle

#include "names/end.hpp"
