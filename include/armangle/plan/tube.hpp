// The tube of one branch: exact feasible arcs at parameters of a path, chosen so that neighbours are similar.
//
//     phi | |   | | |   |          | an arc of a section. If an arc moves, appears, vanishes or splits,
//         | |   |   |   |            sections are inserted until neighbours are similar.
//         |     | |     |
//         +--------------- s
//
// Nodes are arcs, not a grid of psi, so narrow arcs are never missed. All angles are phi (smooth_plane.hpp).
#pragma once

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "../limits/feasible.hpp"
#include "../scene/clear.hpp"
#include "scenes_along.hpp"
#include "path.hpp"
#include "wish_along.hpp"
#include "work.hpp"
#include "../circle/smooth_plane.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Of 96 planes, the one whose singular direction is farthest from the given directions of the wrist (unit
/// vectors).
inline SmoothPlane smooth_plane(const std::vector<Vec3<double>>& wrists) {
    constexpr int candidates = 96;
    const double golden = pi * (3.0 - std::sqrt(5.0));
    SmoothPlane best;
    double most = -1;
    for (int i = 0; i < candidates; ++i) {
        const double z = 1.0 - 2.0 * i / (candidates - 1), r = std::sqrt((1.0 - z) * (1.0 + z));
        const SinCos<double> turn = sin_cos(golden * i);
        const Vec3<double> pole{r * turn.cos, r * turn.sin, z};
        double least = 2;
        for (const Vec3<double>& w : wrists) {
            least = min(least, 1.0 + dot(w, pole));
            if (least <= most) break;
        }
        if (least > most) {
            most = least;
            best.pole = pole;
        }
    }
    const Vec3<double> off = abs(best.pole.z) < 0.9 ? Vec3<double>{0, 0, 1} : Vec3<double>{1, 0, 0};
    const Vec3<double> across = cross(best.pole, off);
    best.side = across * (1.0 / norm(across));
    return best;
}

/// Parameters of the cost of margins of a short path.
struct TubeMarginTuning {
    static constexpr double short_path = 0.5;  // rad: margins count less on a path that turns the arm by less
};

/// The factor of the cost of margins on a path that turns the arm by `length` (rad). It grows like joint
/// travel, so that margins do not dominate a short path.
inline double margin_scale(double length) noexcept {
    const double share = length / TubeMarginTuning::short_path;
    return max(length * length, min(1.0, share * share));
}
/// The factor by which the cost of a target of psi is multiplied for a path that turns the arm by `length`
/// (rad): its square, at least 1, since the user requested the target.
inline double wish_scale(double length) noexcept { return max(1.0, length * length); }

/// The constant data of a plan: the arm, the limits (narrowed by the requested margin), the path and the
/// plane of phi.
struct Task {
    const Arm& arm;
    Limits limits;
    LimitTable table;
    const Segment* segments;
    std::size_t segment_count;
    SmoothPlane plane;
    double length = 1;                                        // how far the path turns the arm (rad)
    const WishAlong* wish = nullptr;                          // target for the arm angle, if there is one
    ScenesAlong scenes = {};                                  // obstacles that the links must avoid
    std::function<void(double s, ArcSet& psi)> allowed = {};  // arcs given by the user; empty: all psi
    const ArcSet* allowed_everywhere = nullptr;               // if they are the same for every s
    double held_theta_7 = 0;                                  // fixed joint 7 of an arm with free roll
    Work* work = nullptr;                                     // that the plan may do

    /// Counts a piece of work, which lets the caller stop the computation.
    void take(long long piece) const {
        if (work) work->take(piece);
    }
    /// The work of a section at s.
    long long section_work(double s) const noexcept {
        return WorkTuning::section + detail::work_of_pairs(scenes, s);
    }

    /// The factor margin_scale() for the path of this task.
    double margin_scale() const noexcept { return armangle::margin_scale(length); }
    /// The factor wish_scale() for the path of this task.
    double wish_scale() const noexcept { return armangle::wish_scale(length); }

    /// The pose at s.
    Pose<double> pose(double s) const noexcept {
        return pose_at(segments[segment_index(segments, segment_count, s)], s);
    }
    /// The circle of the elbow at s, counted in phi.
    Circle<double> circle_at(double s) const noexcept {
        return circle(arm, flange_pose(arm, pose(s)), plane);
    }
    /// The value of joint j without any reference (rad): the middle of its range (0 unless both limits are
    /// finite), or its fixed value.
    double at_rest(int j) const noexcept {
        const bool held = arm.roll_free && j == joints - 1;
        return held ? to_q(arm, j, held_theta_7) : middle(limits, j);
    }
    /// The joint functions of a self-motion; joint 7 is constant if the roll is free.
    template <class T>
    JointFunctions<T> functions(const SelfMotion<T>& m) const noexcept {
        JointFunctions<T> out = joint_functions(m);
        if (!arm.roll_free) return out;
        const SinCos<double> at = sin_cos(held_theta_7);
        const T none(0.0);
        out.pivot[pivots - 1] = {{none, none, T(at.sin)}, {none, none, T(at.cos)}, T(1.0)};
        return out;
    }
    /// The phi (rad) in branch gc at s that the user's target for the elbow asks for; NaN without a target,
    /// or if all angles are as good. phi is the arm angle measured from the plane of this path.
    double wished_phi(int gc, double s) const noexcept {
        if (!wish) return not_a_number;
        const SelfMotion<double> m = self_motion(arm, circle_at(s), configuration(gc));
        return wished_angle(arm, *wish, flange_pose(arm, pose(s)), m, s);
    }

    /// Whether obstacles or the user may forbid some phi.
    bool encumbered() const noexcept { return scenes || allowed; }

    /// Writes to `out` the part of `own` (arcs of phi within the limits, for the self-motion `m` at s) that
    /// the user and the scene permit. OK if some remains, else the reason. `blocking` is the pair of shapes
    /// that alone blocks all phi, or 0.
    Status keep_open(double s, const SelfMotion<double>& m, const ArcSet& own, ArcSet& out,
                     Tag& blocking) const {
        ArcSet asked = own;
        blocking = 0;
        if (allowed) {
            ArcSet psi, phi;
            make_empty(psi);
            allowed(s, psi);
            // psi of the arm exceeds phi by the angle of phi's zero
            const double ahead = arm_angle(triad(arm, flange_pose(arm, pose(s))), m.circle.z);
            turn(psi, -ahead, phi);
            intersect(own, phi, asked);
        }
        out = asked;
        if (asked.empty()) return Status::NOT_ALLOWED;
        if (!scenes) return Status::OK;
        for (int k = scenes.first(s); k <= scenes.last(s); ++k) {
            Cleared cleared;
            clear(arm, scenes[k], m, cleared);
            blocking = cleared.blocking;
            intersect(asked, cleared.arcs, out);
            if (cleared.status != Status::OK) return cleared.status;
            if (out.empty()) return Status::CLEARANCE;
            asked = out;
        }
        return Status::OK;
    }

private:
    /// Writes all arcs shifted by an angle (rad) to `out`.
    static void turn(const ArcSet& arcs, double by, ArcSet& out) noexcept {
        make_empty(out);
        if (arcs.full) return make_full(out);
        for (int i = 0; i < arcs.count; ++i) {
            Arc arc = arcs.arc[i];
            const double lower = wrap(arc.lower + by);
            arc.upper += lower - arc.lower;
            arc.lower = lower;
            detail::put(out, arc);
        }
    }
};

/// The section of a branch's tube at one s.
struct Section {
    double s;
    SelfMotion<double> motion;
    JointFunctions<double> functions;
    Status status;
    Tag blocking;  // the pair of obstacle and link that alone leaves no phi; 0: none
    bool full;
    std::uint32_t first, count;  // its arcs
};

/// All sections of one branch, in rising s.
struct Tube {
    int gc = 0;
    bool coarse = false;  // neighbours differ somewhere although the number of sections is at its maximum
    std::vector<Section> sections;
    std::vector<Arc> arcs;

    /// The first of the `section.count` arcs of a section.
    const Arc* arc(const Section& section) const noexcept { return arcs.data() + section.first; }
};

/// The index, among the arcs of a section, of the one that contains phi or is nearest to it; 0 if there is
/// none.
inline std::uint32_t nearest_arc(const Tube& tube, const Section& x, double phi) noexcept {
    double least = infinity;
    std::uint32_t nearest = 0;
    for (std::uint32_t k = 0; k < x.count; ++k) {
        const Arc& a = tube.arc(x)[k];
        const double middle = 0.5 * (a.lower + a.upper),
                     off = abs(lift(phi, middle) - middle) - 0.5 * (a.upper - a.lower);
        if (off < least) {
            least = off;
            nearest = k;
        }
    }
    return nearest;
}

/// Parameters of the sections of a tube.
struct TubeTuning {
    static constexpr double turn = 0.15;   // wrist, tool and elbow turn at most this between sections (rad)
    static constexpr double shift = 0.3;   // an end moves at most this share of its arc ...
    static constexpr double still = 0.02;  // ... or less than this (rad)
    static constexpr int turn_depth = 16, shift_depth = 5, event_depth = 12;  // halvings spent on each
    static constexpr double no_room = 5e-6;    // range of a joint for which sections are of little use (rad)
    static constexpr std::size_t block = 256;  // steps that are halved together ...
    static constexpr std::size_t most_between = 16384;  // ... with at most so many additional sections
};

namespace detail {

/// A section with its arcs, before it is added to the tube.
struct SolvedSection {
    Section section;
    ArcSet arcs;
};

/// Computes the section of a branch at s: its arcs, or the reason for none.
inline SolvedSection solve_section(const Task& task, int gc, double s) {
    task.take(task.section_work(s));
    SolvedSection out;
    Section& x = out.section;
    x.s = s;
    x.motion = self_motion(task.arm, task.circle_at(s), configuration(gc));
    x.functions = task.functions(x.motion);
    x.status = feasible(x.motion, x.functions, task.table, out.arcs);
    x.blocking = 0;
    if (task.encumbered() && x.status == Status::OK) {
        const ArcSet own = out.arcs;
        x.status = task.keep_open(s, x.motion, own, out.arcs, x.blocking);
        if (x.status != Status::OK) make_empty(out.arcs);
    }
    x.full = out.arcs.full;
    return out;
}

/// The distance of two points (m), or of two unit vectors.
inline double gap(const Vec3<double>& a, const Vec3<double>& b) noexcept { return norm(a - b); }

/// The largest rotation (rad, as a chord) of the wrist's direction, the tool and the elbow between two
/// circles.
inline double turned(const Circle<double>& p, const Circle<double>& q) noexcept {
    const double wrist = gap(p.w, q.w), elbow = hypot(p.triangle.eta.sin - q.triangle.eta.sin,
                                                      p.triangle.eta.cos - q.triangle.eta.cos);
    const auto column = [](const Circle<double>& c, double Vec3<double>::* i) {
        return Vec3<double>{c.tool_w.*i, c.tool_e.*i, c.tool_z.*i};
    };
    const double x = gap(column(p, &Vec3<double>::x), column(q, &Vec3<double>::x)),
                 z = gap(column(p, &Vec3<double>::z), column(q, &Vec3<double>::z));
    return max(max(wrist, elbow), max(x, z));
}

/// The difference of two neighbouring sections, in rising order: small; an arc moved far; an arc appeared,
/// vanished, split or jumped.
enum class Change { small, shifted, event };

/// The change of the arcs of `a` with regard to those of `b`, mod 2 pi: an event if an arc of `a` overlaps
/// not exactly one of `b`. An arc of `b` that overlaps none is not noticed, so the call must be made both
/// ways.
inline Change against(const ArcSet& a, const ArcSet& b) noexcept {
    Change worst = Change::small;
    for (int i = 0; i < a.count; ++i) {
        const Arc& x = a.arc[i];
        const double width = x.upper - x.lower;
        double least = infinity;
        int partners = 0;
        for (int j = 0; j < b.count; ++j) {
            const Arc& y = b.arc[j];
            const double t = two_pi * round((0.5 * (x.lower + x.upper) - 0.5 * (y.lower + y.upper)) / two_pi);
            if (min(x.upper, y.upper + t) <= max(x.lower, y.lower + t)) continue;
            ++partners;
            const double moved = max(abs(x.lower - y.lower - t), abs(x.upper - y.upper - t));
            least = min(least, moved <= TubeTuning::still ? 0.0 : moved / min(width, y.upper - y.lower));
        }
        if (partners != 1) return Change::event;
        if (least > TubeTuning::shift) worst = Change::shifted;
    }
    return worst;
}

/// How much the arcs of two sections differ: the larger change of both directions. It is an event if they
/// differ in number or only one section has arcs, and small if neither has.
inline Change change(const SolvedSection& a, const SolvedSection& b) noexcept {
    if ((a.section.status == Status::OK) != (b.section.status == Status::OK)) return Change::event;
    if (a.section.status != Status::OK || (a.arcs.full && b.arcs.full)) return Change::small;
    if (a.arcs.full != b.arcs.full || a.arcs.count != b.arcs.count) return Change::event;
    const Change one = against(a.arcs, b.arcs), other = against(b.arcs, a.arcs);
    return std::max(one, other);
}

/// Builds the sections of one branch, halving their distance until neighbours are similar.
class TubeBuilder {
public:
    /// Begins an empty tube of branch gc; keeps a reference to the task.
    TubeBuilder(const Task& task, int gc) : task_(task) { tube_.gc = gc; }

    /// Returns the tube with sections at the s in `base` (rising), and more where the arm turns far or arcs
    /// change. Can be called once.
    Tube build(const std::vector<double>& base) {
        tube_.sections.reserve(base.size() + base.size() / 2);
        SolvedSection first = solve_section(task_, tube_.gc, base[0]);
        add(first);
        for (std::size_t from = 0; from + 1 < base.size(); from += TubeTuning::block) {
            const std::size_t to = std::min(from + TubeTuning::block, base.size() - 1);
            row_.assign(1, first);
            for (std::size_t i = from + 1; i <= to; ++i)
                row_.push_back(solve_section(task_, tube_.gc, base[i]));
            first = row_.back();
            halve();
            for (std::size_t i = 1; i < row_.size(); ++i) add(row_[i]);
        }
        return std::move(tube_);
    }

private:
    /// Appends section x and its arcs to the tube.
    void add(SolvedSection& x) {
        x.section.first = static_cast<std::uint32_t>(tube_.arcs.size());
        x.section.count = static_cast<std::uint32_t>(x.arcs.count);
        tube_.arcs.insert(tube_.arcs.end(), x.arcs.arc, x.arcs.arc + x.arcs.count);
        tube_.sections.push_back(x.section);
    }

    /// Whether two neighbours are similar enough, or need no further halving after `depth` halvings.
    bool alike(const SolvedSection& left, const SolvedSection& right, int depth) const noexcept {
        if (depth < TubeTuning::turn_depth &&
            turned(left.section.motion.circle, right.section.motion.circle) > TubeTuning::turn)
            return false;
        const Change now = depth < TubeTuning::event_depth ? change(left, right) : Change::small;
        return now == Change::small || (now == Change::shifted && depth >= TubeTuning::shift_depth);
    }

    /// The largest number of additional sections. It is small if a joint has almost no range: then its arcs
    /// never overlap, and that joint leads instead (crossing.hpp).
    std::size_t most_between() const noexcept {
        const auto narrow = [this](int j) {
            return task_.limits.upper[j] - task_.limits.lower[j] < TubeTuning::no_room;
        };
        for (int j = 0; j < joints; ++j)
            if (j != 3 && narrow(j)) return TubeTuning::block;
        return TubeTuning::most_between;
    }

    /// Inserts sections by halving until neighbours are similar. All intervals are halved together, so that a
    /// limited number of sections is spread evenly.
    void halve() {
        const std::size_t most = row_.size() + most_between();
        unlike_.assign(row_.size() - 1, true);
        for (int depth = 0; depth <= TubeTuning::turn_depth; ++depth) {
            finer_.assign(1, row_[0]);
            still_unlike_.clear();
            for (std::size_t i = 0; i + 1 < row_.size(); ++i) {
                const SolvedSection &left = row_[i], &right = row_[i + 1];
                const double s = 0.5 * (left.section.s + right.section.s);
                const bool halved =
                    unlike_[i] && s > left.section.s && s < right.section.s && !alike(left, right, depth);
                const bool room = finer_.size() + (row_.size() - i) < most;
                tube_.coarse = tube_.coarse || (halved && !room);
                if (halved && room) finer_.push_back(solve_section(task_, tube_.gc, s));
                still_unlike_.insert(still_unlike_.end(), halved && room ? 2 : 1, halved && room);
                finer_.push_back(right);
            }
            const bool done = finer_.size() == row_.size();
            row_.swap(finer_);
            unlike_.swap(still_unlike_);
            if (done) return;
        }
    }

    const Task& task_;
    Tube tube_;
    std::vector<SolvedSection> row_, finer_;
    std::vector<bool> unlike_, still_unlike_;  // of the steps of a row: whether its ends may differ
};

}  // namespace detail

/// Computes the tube of a branch with sections at all of `base` (rising, from 0 to 1) and as many between as
/// needed.
inline Tube tube(const Task& task, int gc, const std::vector<double>& base) {
    return detail::TubeBuilder(task, gc).build(base);
}

/// Parameters of the parameters at which a tube has sections.
struct TubeParameterTuning {
    static constexpr int least_steps = 32;  // of s, between sections that always exist
    static constexpr double turn = 0.5;     // of a segment between two of them (rad)
    static constexpr double same = 1e-12;   // parameters closer than this are equal
    static constexpr double least_length =
        1e-4;  // least length of a path, so that a resting tool has weight (rad)
};

/// Rising parameters from the start of a path to 1: the requested rows (values of s), the ends of segments,
/// and equal steps between them, enough in number and for the rotation of each segment.
inline std::vector<double> base_parameters(const Segment* segments, std::size_t n, const double* rows,
                                           std::size_t row_count) {
    std::vector<double> all(rows, rows + row_count), given, out;
    for (std::size_t i = 0; i < n; ++i) {
        all.push_back(segments[i].start);
        all.push_back(segments[i].end);
    }
    std::sort(all.begin(), all.end());
    for (const double s : all)
        if (given.empty() || s - given.back() > TubeParameterTuning::same) given.push_back(s);
    given.back() = 1.0;
    for (std::size_t i = 0; i + 1 < given.size(); ++i) {
        const double gap = given[i + 1] - given[i];
        const Segment& g = segments[segment_index(segments, n, given[i] + 0.5 * gap)];
        const double turn = largest_angle(g) * gap / (g.end - g.start);
        const int steps = std::max(1, static_cast<int>(std::ceil(max(gap * TubeParameterTuning::least_steps,
                                                                     turn / TubeParameterTuning::turn) -
                                                                 TubeParameterTuning::same)));
        for (int k = 0; k < steps; ++k) out.push_back(given[i] + gap * k / steps);
    }
    out.push_back(1.0);
    return out;
}

/// How far a path turns the arm (rad), at least `least_length`: at each step the largest rotation of the
/// wrist's direction, the tool or the elbow. Unreachable places do not count.
inline double turned_length(const Task& task, const std::vector<double>& base) noexcept {
    struct Facing {
        Vec3<double> wrist, x, z, elbow;
    };
    const auto at = [&task](double s) {
        const Circle<double> c = task.circle_at(s);
        const Mat3<double> tool = task.pose(s).rotation;
        return Facing{c.w, tool.x, tool.z, {c.triangle.eta.cos, c.triangle.eta.sin, 0}};
    };
    double sum = 0;
    Facing before = at(base.front());
    for (const double s : base) {
        const Facing here = at(s);
        const double turn = max(max(detail::gap(before.wrist, here.wrist), detail::gap(before.x, here.x)),
                                max(detail::gap(before.z, here.z), detail::gap(before.elbow, here.elbow)));
        if (turn < infinity) sum += turn;
        before = here;
    }
    return max(TubeParameterTuning::least_length, sum);
}

}  // namespace armangle

#include "../names/end.hpp"
