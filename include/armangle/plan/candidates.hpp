// Candidates on one section of a tube: joint values on all turns, distances to limits and singularities, and
// cost.
//
//     arc of phi   [--o---o---o---oo-o---]     evenly spaced, closer where joints turn fast, and near the phi
//                                  ^           at which a joint of more than a turn reaches its limit;
//     turns        q_1, q_1 + 2 pi, ...        each turn within the limits is a configuration of its own
#pragma once

#include <algorithm>

#include "objective.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// One configuration: q lies within the limits, in one of the permitted revolutions.
struct Candidate {
    double phi;
    Rating worth;
    double q[joint_slots];
    std::uint32_t arc;
};

/// The configurations of one phi: all revolutions of the joints from the lowest values `q` on, joint 1
/// counted fastest.
struct Windings {
    std::uint32_t first;  // index of the first one among the configurations of the section
    double phi, q[joints];
    int count[joints];
};

/// The configurations of one section.
struct Postures {
    std::vector<Candidate> all;
    std::vector<Windings> groups;

    void clear() noexcept {
        all.clear();
        groups.clear();
    }
};

/// Parameters of the candidates of a section.
struct CandidateTuning {
    static constexpr double spacing = 0.2;  // largest distance of neighbouring configurations in phi (rad)
    static constexpr double beside = 5e-3;  // distance from the phi where a joint's turns end (rad)
    static constexpr int least = 5;         // configurations on an arc, however narrow
    static constexpr double move = 0.5;     // largest move of a joint from one to the next (rad) ...
    static constexpr int passes = 12;       // ... after at most so many insertions
};

namespace detail {

/// The model angles theta of all joints at eight phi at once.
struct EightThetas {
    double theta[joints][8];

    /// Computes theta at eight values of phi (rad) on section l.
    EightThetas(const Section& l, const double* phi) noexcept {
        const SinCos<Slots> sc = sin_cos(Slots::load(phi));
        const auto at = [&](const Harmonic<double>& f) {
            return mul_add(Slots(f.s), sc.sin, mul_add(Slots(f.c), sc.cos, Slots(f.k)));
        };
        for (int p = 0; p < pivots; ++p) {
            const Pivot<double>& f = l.functions.pivot[p];
            const Slots u = at(f.U) * Slots(f.g), v = at(f.V) * Slots(f.g);
            atan2(u, v).store(theta[pivot_joint[p]]);
            if (p % 2) continue;
            const Hinge<double>& h = l.functions.hinge[p / 2];
            const bool lost =  // sin(theta) is 0 on the whole circle
                p == 0 ? shoulder_singular(l.motion) : wrist_singular(l.motion);
            atan2(lost ? Slots(0.0) : hypot(u, v) * Slots(h.g), at(h.H)).store(theta[hinge_joint[p / 2]]);
        }
        for (double& t : theta[3]) t = atan2(l.motion.elbow.theta_4.sin, l.motion.elbow.theta_4.cos);
    }
};

}  // namespace detail

/// The range of joint values from which a section can be reached.
struct Window {
    bool set = false;
    double lower[joint_slots] = {}, upper[joint_slots] = {};
};

/// Computes the configurations of a section among which a plan is searched.
class Candidates {
public:
    /// Keeps references to task and objective.
    Candidates(const Task& task, const Objective& objective) : task_(task), objective_(objective) {
        const double far = tolerance::largest_angle;
        for (int j = 0; j < joints; ++j) {
            lower_[j] = max(task.limits.lower[j], -far) - tolerance::angle;
            upper_[j] = min(task.limits.upper[j], far) + tolerance::angle;
        }
    }

    /// Writes the configurations of section l with joints in `window`: every arc is sampled evenly, and
    /// closer where joints move fast. Every revolution within the limits is a configuration of its own; if
    /// the window is not set (first section), only those near the reference.
    void fill(const Tube& tube, const Section& l, const Window& window, Postures& out) {
        out.clear();
        if (l.status != Status::OK) return;
        for (std::uint32_t k = 0; k < l.count; ++k) {
            spread_over(tube.arc(l)[k], l.full);
            add_ends(l, tube.arc(l)[k]);
            solve(l, points_);
            for (int pass = 0; pass < CandidateTuning::passes && refine(l); ++pass) {}
            for (const Point& p : points_)
                if (!is_end(p, l, tube.arc(l)[k])) put(p, k, window, out);
        }
    }

    /// Sets joints q near which the revolutions at a first section are chosen, instead of the middles of the
    /// ranges. Keeps the pointer.
    void set_reference(const double* q) noexcept { reference_ = q; }

    /// Adds the configuration q with which a plan must begin or end, whatever its margin.
    void put_fixed(double phi, std::uint32_t arc, const double* q, Postures& out) const {
        Candidate x{};
        Windings alone{};
        x.phi = alone.phi = phi;
        x.arc = arc;
        for (int j = 0; j < joints; ++j) {
            x.q[j] = alone.q[j] = q[j];
            alone.count[j] = 1;
        }
        x.worth = {infinity, rating(task_, objective_, q).cost};
        out.all.push_back(x);
        out.groups.push_back(alone);
    }

    /// Adds the configurations of given model angles (with a free roll, theta_7 is the held one), in all
    /// revolutions within the limits and the window.
    void put_posture(double phi, const double* theta, const Window& window, Postures& out) {
        Point p{phi, {}};
        std::copy(theta, theta + joints, p.theta);
        if (task_.arm.roll_free) p.theta[joints - 1] = task_.held_theta_7;
        put(p, 0, window, out);
    }

private:
    struct Point {
        double phi, theta[joint_slots];
    };

    /// The numbers of revolutions to add to q, first to last; none if last < first.
    struct Turns {
        int first, last;
    };

    /// Replaces the points by equally spaced phi on an arc, its ends included unless it is the full circle.
    /// Their theta is not set.
    void spread_over(const Arc& arc, bool full) {
        points_.clear();
        const double width = arc.upper - arc.lower;
        const int n =
            std::max(CandidateTuning::least, static_cast<int>(width / CandidateTuning::spacing) + 1);
        if (!full) points_.push_back({arc.lower, {}});
        for (int i = 0; i < n; ++i) points_.push_back({arc.lower + width * (i + (full ? 0.0 : 0.5)) / n, {}});
        if (!full) points_.push_back({arc.upper, {}});
    }

    /// Whether a point is an end of an arc, which only shows how far joints move up to it; false if the arc
    /// is a single phi.
    static bool is_end(const Point& p, const Section& l, const Arc& arc) noexcept {
        return !l.full && !detail::is_isolated(arc) && (p.phi == arc.lower || p.phi == arc.upper);
    }

    /// Adds points on either side of each phi on an arc where a joint with a range above 2 pi reaches a
    /// limit. At least one point lies between two such phi, or between one and the end of the arc.
    void add_ends(const Section& l, const Arc& arc) {
        ends_.assign({arc.lower, arc.upper});
        for (int p = 0; p < pivots; ++p) {
            if (task_.table.limited >> p & 1) continue;
            const ThetaRange range = theta_range(task_.arm, task_.limits, pivot_joint[p]);
            for (const double limit : {range.lower, range.upper}) {
                if (!(abs(limit) < infinity)) continue;
                const SinCos<double> at = sin_cos(limit);
                const Pivot<double>& f = l.functions.pivot[p];
                const Roots ends = roots({f.U.s * at.cos - f.V.s * at.sin, f.U.c * at.cos - f.V.c * at.sin,
                                          f.U.k * at.cos - f.V.k * at.sin});
                for (int i = 0; i < ends.count; ++i) {
                    const double phi = lift(ends.psi[i], 0.5 * (arc.lower + arc.upper));
                    if (phi > arc.lower && phi < arc.upper) ends_.push_back(phi);
                }
            }
        }
        if (ends_.size() == 2) return;
        std::sort(ends_.begin(), ends_.end());
        for (std::size_t i = 1; i + 1 < ends_.size(); ++i)
            for (const double room : {ends_[i - 1] - ends_[i], ends_[i + 1] - ends_[i]}) {
                const double away = min(CandidateTuning::beside, 0.5 * abs(room));
                points_.push_back({ends_[i] + std::copysign(away, room), {}});
            }
        std::sort(points_.begin(), points_.end(),
                  [](const Point& a, const Point& b) { return a.phi < b.phi; });
    }

    /// Computes theta of the points from their phi, eight at a time.
    static void solve(const Section& l, std::vector<Point>& points) noexcept {
        constexpr std::size_t eight = 8;
        for (std::size_t first = 0; first < points.size(); first += eight) {
            const std::size_t n = std::min(eight, points.size() - first);
            double phi[eight] = {};
            for (std::size_t k = 0; k < n; ++k) phi[k] = points[first + k].phi;
            const detail::EightThetas solved(l, phi);
            for (std::size_t k = 0; k < n; ++k)
                for (int j = 0; j < joints; ++j) points[first + k].theta[j] = solved.theta[j][k];
        }
    }

    /// Whether some joint moves by more than 0.5 rad from one point to the next.
    static bool turns_far(const Point& a, const Point& b) noexcept {
        const JointLanes turn = wrap(JointLanes::load(b.theta) - JointLanes::load(a.theta));
        return any(abs(turn) > JointLanes(CandidateTuning::move));
    }

    /// Inserts a point between neighbours whose joints differ much; returns whether it inserted any.
    bool refine(const Section& l) {
        between_.clear();
        after_.clear();
        for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
            if (!turns_far(points_[i], points_[i + 1])) continue;
            after_.push_back(i);
            between_.push_back({0.5 * (points_[i].phi + points_[i + 1].phi), {}});
        }
        if (between_.empty()) return false;
        solve(l, between_);
        finer_.clear();
        std::size_t next = 0;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            finer_.push_back(points_[i]);
            if (next < after_.size() && after_[next] == i) finer_.push_back(between_[next++]);
        }
        points_.swap(finer_);
        return true;
    }

    /// The revolution to add to value q of joint j at a first section: of those from `fewest` to `most`, the
    /// one nearest to the reference, or to the middle of the range; none if there is none.
    Turns first_turn(int j, double q, double fewest, double most) const noexcept {
        const double near = reference_ ? reference_[j] : task_.at_rest(j);
        const double turn = min(max(round((near - q) / two_pi), fewest), most);
        return {static_cast<int>(max(fewest, turn)), static_cast<int>(turn)};
    }

    /// Adds the configurations of a point on the arc with index `arc`: all revolutions within the limits and
    /// the window.
    void put(const Point& p, std::uint32_t arc, const Window& window, Postures& out) {
        const JointLanes q = to_q(JointLanes::load(p.theta), JointLanes::load(task_.arm.sign),
                                  JointLanes::load(task_.arm.offset));
        const auto fewest_from = [&](const JointLanes& x) { return ceil((x - q) * (1.0 / two_pi)); };
        const auto most_to = [&](const JointLanes& x) { return floor((x - q) * (1.0 / two_pi)); };
        JointLanes fewest = fewest_from(JointLanes::load(lower_)), most = most_to(JointLanes::load(upper_));
        double ends[2][joint_slots], least[2][joint_slots], at_q[joint_slots];
        fewest.store(ends[0]);
        most.store(ends[1]);
        if (window.set) {
            fewest = max(fewest, fewest_from(JointLanes::load(window.lower)));
            most = min(most, most_to(JointLanes::load(window.upper)));
        }
        fewest.store(least[0]);
        most.store(least[1]);
        q.store(at_q);
        Windings group{};
        group.first = static_cast<std::uint32_t>(out.all.size());
        group.phi = p.phi;
        for (int j = 0; j < joints; ++j) {
            const bool led = window.set && !is_unlimited(task_.limits, j);
            const Turns range = led ? Turns{static_cast<int>(least[0][j]), static_cast<int>(least[1][j])}
                                    : first_turn(j, at_q[j], ends[0][j], ends[1][j]);
            if (range.last < range.first) return;
            group.q[j] = at_q[j] + two_pi * range.first;
            group.count[j] = range.last - range.first + 1;
        }
        Candidate x{};
        x.phi = p.phi;
        x.arc = arc;
        int at[joints] = {};
        for (int j = 0; j < joints;) {  // `at` counts through all turns, joint 1 fastest
            for (int i = 0; i < joints; ++i) x.q[i] = group.q[i] + two_pi * at[i];
            x.worth = rating(task_, objective_, x.q);
            out.all.push_back(x);
            for (j = 0; j < joints && ++at[j] == group.count[j]; ++j) at[j] = 0;
        }
        out.groups.push_back(group);
    }

    const Task& task_;
    const Objective& objective_;
    double lower_[joint_slots] = {}, upper_[joint_slots] = {};  // limits, with their tolerance
    const double* reference_ = nullptr;
    std::vector<Point> points_, between_, finer_;
    std::vector<double> ends_;        // of an arc, and of the turns on it
    std::vector<std::size_t> after_;  // points_[after_[i]] is followed by between_[i]
};

}  // namespace armangle

#include "../names/end.hpp"
