// The path of least cost through the sections of one branch, for any arm whose self-motion is a closed form.
//
//     lambda |   |  |o--|   | an arc of the free number at a section of the path
//            |o--|o-|   |   o a posture; a link is how far, and how fast, the joints move
//            +-------------- s
//
// The search is dynamic programming over a grid of each arc (R. Bellman, 1957). The descent is Newton's
// method on the numbers at all sections at once: travel and duration make a tridiagonal system
// (Gauss-Newton), margins and wishes its diagonal.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "../self_motion/explicit_family.hpp"
#include "curve.hpp"
#include "tube.hpp"
#include "family_tuning.hpp"
#include "plan_options.hpp"
#include "work.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// A section of a branch: the arcs of its free number that are permitted at s, or the reason for none.
struct BranchSection {
    double s;
    Pose<double> pose;
    ArcSet arcs;                             // all that may be used ...
    std::shared_ptr<const ArcSet> unproven;  // ... and what of it is not proven; null: nothing
    Status status;
    Tag pair;       // that touches, where obstacles leave nothing
    double wished;  // the target of the redundant parameter; NaN if none is best
};

/// A configuration with two derivatives with respect to the redundant parameter.
struct BranchState {
    double free, q[joints], slope[joints], theta[joints];
    double cost, cost_1, cost_2;  // of margins and the wish
    double margin, elbow_margin;
};

/// A start or a goal as a place in a branch; q is null if it is free.
struct BranchEnd {
    const double* q = nullptr;
    double lambda = 0, gap = 0;
    int gc = -1;
};

/// A branch with its sections, and the path through them.
struct SearchedBranch {
    BranchReport report;
    std::vector<BranchSection> sections;
    std::vector<BranchState> way;                  // at the first sections, all of them where there is a way
    std::vector<std::vector<BranchState>> others;  // that end elsewhere in the same section
    double cost = infinity;
    BranchEnd ends[2];
    unsigned counted = 0;  // bit j: the search tells the revolutions of joint j apart
    bool stalled = false;  // the search found no continuation: it tries more values of the free number
    bool spent = false;    // it stopped with as many sections as a branch may have
    bool turned = false;   // a path within the limits leads to the goal's pose, but not to its revolutions
};

/// Parameters of a path at equal distances along the tool's way.
struct SpreadOver {
    std::vector<double> s;
    double length = 0;  // how far the path turns the arm (rad)

    /// reach: of the arm (m), which counts as a radian.
    SpreadOver(std::span<const Segment> path, double reach, const FamilyTuning& tuning) {
        constexpr int parts = 8;
        std::vector<double> at{0.0}, gone{0.0};
        Pose<double> last = pose_at(path.front(), 0.0);
        for (const Segment& g : path)
            for (int k = 1; k <= parts; ++k) {
                const double here_s = k < parts ? g.start + (g.end - g.start) * k / parts : g.end;
                const Pose<double> here = pose_at(g, here_s);
                const Twist moved = difference(last, here);
                length += norm(moved.linear) / reach + norm(moved.angular);
                at.push_back(here_s);
                gone.push_back(length + tuning.spacing * here_s);
                last = here;
            }
        length = max(length, TubeParameterTuning::least_length);
        const double whole = gone.back();
        const int count =
            std::max(tuning.least_sections - 1, static_cast<int>(std::ceil(whole / tuning.spacing)));
        s.assign(1, 0.0);
        std::size_t i = 1;
        for (int k = 1; k < count; ++k) {
            const double wanted = whole * k / count;
            while (i + 1 < gone.size() && gone[i] < wanted) ++i;
            const double share = (wanted - gone[i - 1]) / (gone[i] - gone[i - 1]);
            s.push_back(at[i - 1] + share * (at[i] - at[i - 1]));
        }
        s.push_back(1.0);
    }
};

/// An objective with the time that a radian of each joint takes on a path that turns the arm by `length`
/// (rad).
inline Objective with_slowness(Objective out, const JointBounds& bounds, double length) noexcept {
    for (int j = 0; j < joints && out.duration > 0; ++j)
        out.slowness[j] = 1 / joint_speed(bounds.velocity[j], bounds.acceleration[j], length);
    return out;
}

/// Searches paths through the sections of branches, and improves them. Of a family (explicit_family.hpp) it
/// takes rows(), placer(), at_rest() and singular_distances().
template <class F>
class BranchSearch {
    using Section = BranchSection;
    using State = BranchState;
    using Branch = SearchedBranch;
    using End = BranchEnd;
    struct Node;
    using Layers = std::vector<std::vector<Node>>;

public:
    /// Computes the section of branch gc at s.
    using Look = std::function<Section(double s, int gc)>;
    /// Whether joints q at s touch an obstacle; empty: they never do.
    using Touches = std::function<bool(double s, const double* q)>;

    /// Keeps references to work and tuning. length: how far the path turns the arm (rad). threaded: whether
    /// branches are searched at the same time, so that no search may depend on the work of others.
    BranchSearch(const F& family, const Limits& limits, const Objective& objective, double length, Work& work,
                 bool threaded, Look look, Touches touches, const FamilyTuning& tuning)
        : family_(family),
          limits_(limits),
          objective_(objective),
          length_(length),
          work_(work),
          threaded_(threaded),
          look_(std::move(look)),
          touches_(std::move(touches)),
          tuning_(tuning) {
        for (int j = 0; j < joints; ++j) {
            has_a_turn_[j] = has_a_turn(limits_, j);
            rest_[j] = at_rest(family_, j);
        }
    }

    /// Whether the arcs of a section contain a given end, up to rounding, which does not touch an obstacle.
    bool is_held(const Section& at, const End& end) const {
        return abs(wrap(nearest(at.arcs, wrap(end.lambda)) - end.lambda)) <= tuning_.beside &&
               !touches(at, end.lambda, end.q);
    }

    /// Finds the path of least cost from section to section, stores it in the branch as far as it leads, and
    /// returns the number of sections reached.
    std::size_t search(Branch& branch) const {
        Layers layer;
        extend(branch, layer);
        take_ways(branch, layer);
        return layer.size();
    }

    /// Lowers the objective of the branch's paths by a descent each, and keeps the best.
    void settle(Branch& branch) const {
        lift_way(branch);
        descend(branch);
        for (std::vector<State>& other : std::exchange(branch.others, {})) {
            Branch now = branch;
            now.way = std::move(other);
            lift_way(now);
            if (off_limits(now) | turned_at_goal(now)) continue;
            descend(now);
            if (now.cost < branch.cost) branch = std::move(now);
        }
    }

    /// Finds a path through the sections of a branch, with more of them where it ends, and returns the number
    /// of sections reached. Ends if is_shut(branch). From the first section without a continuation on it is
    /// `stalled`; with as many sections as a branch may have it is `spent`. The report says whether it gave
    /// up for that, or after so many rounds without getting farther, first there, then all along the way.
    template <class IsShut>
    std::size_t find(Branch& branch, const IsShut& is_shut) const {
        branch.way.clear();
        const std::size_t most = branch.sections.size() * static_cast<std::size_t>(tuning_.rounds);
        for (unsigned more = 0;; branch.counted |= more) {
            Layers layer;
            double ahead = 0;  // the farthest s at which no continuation was found
            int mended = 0;    // how often sections were added all along the way to there
            for (int round = 0; !is_shut(branch); ++round) {
                extend(branch, layer);
                const std::size_t reached = layer.size();
                branch.report.given_up = false;
                if (reached == branch.sections.size() || reached == 0) break;
                if (const double s = branch.sections[reached].s; s > ahead) {
                    ahead = s;
                    round = 0;
                }
                branch.stalled = true;
                branch.spent = branch.sections.size() > most || (!threaded_ && work_.spent());
                branch.report.given_up = round == tuning_.rounds || branch.spent;
                if (branch.report.given_up || !halve(branch, reached - 1)) {
                    if (branch.spent || mended++ == tuning_.rounds || !mend(branch, layer)) break;
                    round = tuning_.rounds - 1;
                    continue;
                }
                if (reached >= 2 && halve(branch, reached - 2)) layer.pop_back();
            }
            if (layer.empty()) return 0;
            take_ways(branch, layer);
            lift_way(branch);
            const unsigned turned = turned_at_goal(branch), off = off_limits(branch);
            branch.turned = branch.turned || (turned && !off);
            more = (turned | off) & ~branch.counted;
            if (!more) return layer.size();
        }
    }

    /// Adds turns of 2 pi to the joints of the branch's path, so that they are continuous and, if possible,
    /// within the limits. It begins at the given start, else ends at the given goal, else begins in the
    /// revolution with the fewest turns.
    void lift_way(Branch& branch) const noexcept {
        std::vector<State>& way = branch.way;
        if (way.empty()) return;
        for (std::size_t k = 1; k < way.size(); ++k) way[k].free = lift(way[k].free, way[k - 1].free);
        for (int j = 0; j < joints; ++j) {
            if (branch.ends[0].q) way[0].q[j] = lift(way[0].q[j], branch.ends[0].q[j]);
            double low = way[0].q[j], high = low;
            for (std::size_t k = 1; k < way.size(); ++k) {
                way[k].q[j] = lift(way[k].q[j], way[k - 1].q[j]);
                low = min(low, way[k].q[j]);
                high = max(high, way[k].q[j]);
            }
            if (branch.ends[0].q) continue;
            double turn = 0;  // as few as keep the limits; of a goal its own
            const double under = limits_.lower[j] - low - tolerance::angle,
                         over = high - limits_.upper[j] - tolerance::angle;
            if (under > 0) turn = std::ceil(under / two_pi);
            if (over > 0) turn = -std::ceil(over / two_pi);
            if (branch.ends[1].q) turn = round((branch.ends[1].q[j] - way.back().q[j]) / two_pi);
            for (State& at : way) at.q[j] += two_pi * turn;
        }
    }

    /// Whether the path of a branch ends with the turns of its goal; if not, reports that.
    static bool arrives(Branch& branch) noexcept {
        for (int j = 0; j < joints && branch.ends[1].q; ++j) {
            if (abs(branch.way.back().q[j] - branch.ends[1].q[j]) <= pi) continue;
            refuse_turn(branch.report);
            return false;
        }
        return true;
    }

    /// Whether a path within the limits leads to the goal's pose, but the search, unless it was stopped,
    /// found none to its revolutions; if so, reports that.
    static bool misses_turn(Branch& branch) noexcept {
        const bool out = branch.turned && branch.way.size() < branch.sections.size() && !branch.spent;
        if (out) refuse_turn(branch.report);
        return out;
    }

    /// Lowers the objective of the branch's path by Newton steps of the redundant parameter at all sections
    /// that are not fixed.
    void descend(Branch& branch) const {
        std::vector<State>& way = branch.way;
        const std::vector<Section>& at = branch.sections;
        const std::size_t n = way.size();
        const double w = 2 * objective_.travel;
        std::vector<double> diagonal(n), beside(n), move(n);
        branch.cost = cost_of(branch, way);
        for (int step = 0; step < tuning_.steps; ++step) {
            work_.take(posture_work * static_cast<long long>(n));
            for (std::size_t k = 0; k < n; ++k) {
                const double share = share_of(at, k, n);
                diagonal[k] = share * max(way[k].cost_2, 0.0);
                move[k] = -share * way[k].cost_1;
                beside[k] = 0;
            }
            for (std::size_t k = 0; k + 1 < n; ++k) {
                const double per = w / (at[k + 1].s - at[k].s);
                for (int j = 0; j < joints; ++j) {
                    const double d = way[k + 1].q[j] - way[k].q[j], a = way[k].slope[j],
                                 b = way[k + 1].slope[j];
                    diagonal[k] += per * a * a;
                    diagonal[k + 1] += per * b * b;
                    beside[k] -= per * a * b;
                    move[k] += per * d * a;
                    move[k + 1] -= per * d * b;
                }
                if (objective_.duration > 0) {
                    const Haste haste = haste_of(way[k], way[k + 1], at[k + 1].s - at[k].s);
                    diagonal[k] += haste.from_from;
                    diagonal[k + 1] += haste.to_to;
                    beside[k] += haste.from_to;
                    move[k] -= haste.from;
                    move[k + 1] -= haste.to;
                }
            }
            for (std::size_t k = 0; k < n; ++k) {
                const bool held = anchor(branch, k) != nullptr;
                if (held) {
                    diagonal[k] = 1;
                    move[k] = beside[k] = 0;
                    if (k > 0) beside[k - 1] = 0;
                }
                diagonal[k] = diagonal[k] * (1 + 1e-9) + 1e-12;
            }
            for (std::size_t k = 1; k < n; ++k) {
                const double factor = beside[k - 1] / diagonal[k - 1];
                diagonal[k] -= factor * beside[k - 1];
                move[k] -= factor * move[k - 1];
            }
            double most = 0;
            for (std::size_t k = n; k-- > 0;) {
                move[k] = (move[k] - (k + 1 < n ? beside[k] * move[k + 1] : 0.0)) / diagonal[k];
                most = max(most, abs(move[k]));
            }
            const double before = branch.cost;
            double share = most > tuning_.farthest ? tuning_.farthest / most : 1.0;
            for (; share * most > tolerance::angle; share *= 0.5) {
                std::vector<State> next(n);
                bool there = true;
                for (std::size_t k = 0; k < n && there; ++k) {
                    const double wanted = way[k].free + share * move[k];
                    const double free =
                        anchor(branch, k) ? way[k].free : within_arc(at[k], way[k].free, wanted);
                    next[k] = way[k];
                    there = anchor(branch, k) || state(at[k], branch.report.gc, free, way[k].q, next[k]);
                }
                const double cost = there ? cost_of(branch, next) : infinity;
                if (!(cost < branch.cost)) continue;
                way = std::move(next);
                branch.cost = cost;
                break;
            }
            if (!(before - branch.cost > tuning_.settled * before)) return;
        }
    }

    /// The spline of the free number along the branch's path, on given breaks of s, or its sections (empty).
    static Spline drawn(const Branch& branch, const std::vector<double>& breaks = {}) {
        std::vector<double> s, free;
        for (std::size_t k = 0; k < branch.way.size(); ++k) {
            s.push_back(branch.sections[k].s);
            free.push_back(branch.way[k].free);
        }
        return spline(breaks.empty() ? s : breaks, s, free);
    }

    /// Inserts sections and configurations into the branch's path where the proof is open, and minimizes
    /// again; false if nothing was inserted.
    bool refine(Branch& branch, const Proof& proof) const {
        std::vector<Section> sections{branch.sections[0]};
        std::vector<State> way{branch.way[0]};
        bool finer = false;
        for (std::size_t k = 1; k < branch.sections.size(); ++k) {
            const double a = branch.sections[k - 1].s, b = branch.sections[k].s;
            bool open = false;
            for (std::size_t i = 0; i < proof.open.size(); i += 2)
                open = open || (proof.open[i] < b && proof.open[i + 1] > a);
            if (open && b - a > TubeParameterTuning::same) {
                const Section half = look_(0.5 * (a + b), branch.report.gc);
                if (half.arcs.empty()) return false;
                const State &from = way.back(), &to = branch.way[k];
                const double between = 0.5 * (from.free + to.free);
                const double moved = between + wrap(nearest(half.arcs, wrap(between)) - between);
                State here;
                if (!state(half, branch.report.gc, within_arc(half, moved, moved), from.q, here))
                    return false;
                sections.push_back(half);
                way.push_back(here);
                finer = true;
            }
            sections.push_back(branch.sections[k]);
            way.push_back(branch.way[k]);
        }
        branch.sections = std::move(sections);
        branch.way = std::move(way);
        branch.report.sections = static_cast<unsigned>(branch.sections.size());
        if (finer) descend(branch);
        return finer;
    }

private:
    /// The work of a configuration with its cost.
    static constexpr long long posture_work =
        WorkTuning::posture * (planned_family<F> && !explicit_family<F> ? WorkTuning::chain : 1);

    /// Reports a goal to whose revolutions no path leads.
    static void refuse_turn(BranchReport& report) noexcept {
        report.verdict = Verdict::goal;
        report.status = Status::JOINT_JUMP;
        report.from = report.to = report.reached = 1.0;
        report.given_up = false;
    }

    struct Node {
        double free, q[joints];
        double worth;  // the cost of the configuration
        double cost;   // of the cheapest path to it
        int from, arc;
    };

    /// Continues the cheapest paths to the configurations of each section, layer by layer, from those there
    /// are, as far as they lead. A link keeps the revolution of every joint, so only revolutions that a path
    /// leads to are configurations.
    void extend(const Branch& branch, Layers& layer) const {
        for (std::size_t k = layer.size(); k < branch.sections.size(); ++k) {
            std::vector<Node> here = nodes(branch, k);
            const long long links = posture_work + static_cast<long long>(k ? layer.back().size() : 0);
            work_.take(static_cast<long long>(here.size()) * links);
            if (k == 0) {
                for (Node& first : here) first.cost = 0;
            } else {
                std::vector<Node> reached;
                for (const Node& to : here) link(branch, k, layer.back(), to, reached);
                here = std::move(reached);
            }
            if (here.empty()) break;
            layer.push_back(std::move(here));
        }
    }

    /// Appends `to`, a configuration of section k, to `out` in each revolution to which links from those of
    /// the section before lead, with the cheapest link to it.
    void link(const Branch& branch, std::size_t k, const std::vector<Node>& last, const Node& to,
              std::vector<Node>& out) const {
        const Objective& w = objective_;
        const Section& section = branch.sections[k];
        const double ds = section.s - branch.sections[k - 1].s;
        const unsigned turning = anchor(branch, k) ? 0u : branch.counted;
        const std::size_t first = out.size();
        Node turned = to;
        double known_cost = infinity;  // of `to` if it does not turn
        for (std::size_t i = 0; i < last.size(); ++i) {
            const Node& from = last[i];
            if (!turning && !(from.cost < known_cost)) continue;
            if (abs(wrap(to.free - from.free)) > tuning_.link) continue;
            std::size_t at = first;
            if (turning) {
                if (!turn_to(turning, to, from, turned)) continue;
                while (at < out.size() && !(largest_move(out[at].q, turned.q) < pi)) ++at;
            }
            const bool known = at < out.size();
            if (known && !(from.cost < out[at].cost)) continue;
            const Node& there = known ? out[at] : turned;
            double sum = 0, most = 0, rate[joints];
            for (int j = joints - 1; j >= 0 && most <= tuning_.link; --j) {
                const double move = way(branch, j, from.q[j], there.q[j]);
                most = max(most, abs(move));
                sum += move * move;
                rate[j] = move / ds;
            }
            if (most > tuning_.link) continue;
            if (!known && turning && !rate_again(section, branch.report.gc, turned)) continue;
            double cost = from.cost + w.travel * sum / ds + 0.5 * ds * (from.worth + there.worth);
            if (!(cost < there.cost) || !joined(branch, k, from, there)) continue;
            cost += ds * hurry(w, length_, rate);
            if (!(cost < there.cost)) continue;
            if (!known) out.push_back(turned);
            out[at].cost = known_cost = cost;
            out[at].from = static_cast<int>(i);
        }
    }

    /// Turns the joints of `to` in `turning` (bits) to the revolutions nearest to those of `from`, in `out`;
    /// false if that is beyond limits.
    bool turn_to(unsigned turning, const Node& to, const Node& from, Node& out) const noexcept {
        for (int j = 0; j < joints; ++j)
            if (turning >> j & 1u) out.q[j] = lift(to.q[j], from.q[j]);
        return within_limits(limits_, out.q, tolerance::angle);
    }

    /// Computes the worth of a configuration in its revolution; false if there is none.
    bool rate_again(const Section& section, int gc, Node& node) const {
        State x;
        if (!state<double>(placer(family_, section.pose, gc), section.wished, node.free, node.q, x))
            return false;
        node.worth = x.cost;
        std::copy(x.q, x.q + joints, node.q);
        return true;
    }

    /// Stores the paths to the cheapest ends of the last layer in the branch.
    void take_ways(Branch& branch, const Layers& layer) const {
        branch.way.clear();
        branch.others.clear();
        if (layer.empty()) return;
        for (const std::size_t end : least_ends(layer.back())) {
            std::vector<State> way(layer.size());
            std::size_t at = end;
            for (std::size_t k = layer.size(); k-- > 0;) {
                const Node& node = layer[k][at];
                way[k] = fixed(branch.sections[k], branch.report.gc, node.free, node.q);
                at = static_cast<std::size_t>(std::max(node.from, 0));
            }
            if (branch.way.empty())
                branch.way = std::move(way);
            else
                branch.others.push_back(std::move(way));
        }
    }

    /// The configurations of the last section that cost less than those beside them, the cheapest first: each
    /// is the end of a path that a descent may lead to another optimum.
    std::vector<std::size_t> least_ends(const std::vector<Node>& last) const {
        std::vector<std::size_t> out;
        for (std::size_t i = 0; i < last.size(); ++i) {
            const auto less = [&](std::size_t k) {
                return last[k].arc == last[i].arc && last[k].cost < last[i].cost;
            };
            if (!(i > 0 && less(i - 1)) && !(i + 1 < last.size() && less(i + 1))) out.push_back(i);
        }
        std::stable_sort(out.begin(), out.end(),
                         [&](std::size_t a, std::size_t b) { return last[a].cost < last[b].cost; });
        if (out.size() > tuning_.ways) out.resize(tuning_.ways);
        return out;
    }

    /// Computes the configuration of a value of the redundant parameter, in the revolution nearest to `near`,
    /// or to the middles of the limits if it is null. False if there is no solution, or it touches an
    /// obstacle.
    [[nodiscard]] bool state(const Section& at, int gc, double free, const double* near, State& out) const {
        return state<Jet<double, 2>>(placer(family_, at.pose, gc), at.wished, free, near, out) &&
               !touches(at, free, out.q);
    }
    /// Whether joints of a section touch an obstacle; false where that is proven of their redundant
    /// parameter.
    bool touches(const Section& at, double free, const double* q) const {
        return at.unproven && touches_ && armangle::find(*at.unproven, wrap(free)).index >= 0 &&
               touches_(at.s, q);
    }

    /// The same at the pose of a placer (explicit_family.hpp), with the target of the redundant parameter. J:
    /// double, if derivatives are not needed.
    template <class J, class Place>
    [[nodiscard]] bool state(const Place& place, double wished, double free, const double* near,
                             State& out) const noexcept {
        constexpr bool derived = !std::is_same_v<J, double>;
        const auto value = [](const J& x) -> double {
            if constexpr (derived)
                return x.value();
            else
                return x;
        };
        J varied(free);
        if constexpr (derived) varied = J::variable(free);
        const Arm& rows = family_.rows();
        Directions<J> d;
        if (!(place(varied, near, d) > 0)) return false;
        J theta[joints], cost(0.0);
        out.free = free;
        out.margin = out.elbow_margin = infinity;
        const Objective& w = objective_;
        const auto weigh = [&](const J& distance, Kind kind, double& margin) {
            if (!(weight(w, kind) > 0)) return;
            margin = min(margin, value(distance));
            cost = cost + J(weight(w, kind)) * armangle::cost(distance, kind, w.enough);
        };
        for (int j = 0; j < joints; ++j) {
            theta[j] = atan2(d.y[j], d.x[j]);
            out.theta[j] = value(theta[j]);
            out.q[j] = lift(to_q(rows, j, out.theta[j]), near ? near[j] : rest_[j]);
            J q(out.q[j]);
            if constexpr (derived) {
                q = theta[j] * J(rows.sign[j]);
                q.coefficient[0] = out.q[j];
                out.slope[j] = q.coefficient[1];
            }
            double& margin = j == 3 ? out.elbow_margin : out.margin;
            if (limits_.lower[j] > -infinity) weigh(q - J(limits_.lower[j]), Kind::limit, margin);
            if (limits_.upper[j] < infinity) weigh(J(limits_.upper[j]) - q, Kind::limit, margin);
        }
        family_.singular_distances(theta, [&](const J& x) { weigh(x, Kind::singularity, out.margin); });
        cost = cost * J(margin_scale(length_));
        if (!is_nan(wished)) {
            const J off = varied - J(wished);
            cost = cost + J(w.psi * wish_scale(length_)) * (J(2.0) - J(2.0) * sin_cos(off).cos);
        }
        out.cost = value(cost);
        if constexpr (derived) {
            out.cost_1 = cost.coefficient[1];
            out.cost_2 = 2 * cost.coefficient[2];
        }
        return out.cost == out.cost;
    }

    /// The difference of two values of joint j (rad): the shorter way round if its range is at least 2 pi and
    /// its revolutions are not told apart.
    double way(const Branch& branch, int j, double from, double to) const noexcept {
        return has_a_turn_[j] && !(branch.counted >> j & 1u) ? wrap(to - from) : to - from;
    }

    /// Joints (bits) that can be told apart by their revolutions and leave their limits on the branch's path.
    unsigned off_limits(const Branch& branch) const noexcept {
        unsigned out = 0;
        for (int j = 0; j < joints; ++j)
            for (const State& at : branch.way)
                if (has_revolutions(j) && (at.q[j] < limits_.lower[j] - tolerance::angle ||
                                           at.q[j] > limits_.upper[j] + tolerance::angle))
                    out |= 1u << j;
        return out;
    }
    /// Joints (bits) that can be told apart by their revolutions and end the branch's path in another one
    /// than that of the goal.
    unsigned turned_at_goal(const Branch& branch) const noexcept {
        unsigned out = 0;
        if (branch.way.size() < branch.sections.size() || !branch.ends[1].q) return out;
        for (int j = 0; j < joints; ++j)
            if (has_revolutions(j) && abs(branch.way.back().q[j] - branch.ends[1].q[j]) > pi) out |= 1u << j;
        return out;
    }
    /// Whether the limits of a joint leave it several revolutions.
    bool has_revolutions(int j) const noexcept { return has_a_turn_[j] && !is_unlimited(limits_, j); }

    /// Inserts a section of the branch half way between its sections k and k + 1; false, without a change, if
    /// they are too close.
    bool halve(Branch& branch, std::size_t k) const {
        const double a = branch.sections[k].s, b = branch.sections[k + 1].s, s = 0.5 * (a + b);
        if (!(b - a > TubeParameterTuning::same)) return false;
        branch.sections.insert(branch.sections.begin() + static_cast<std::ptrdiff_t>(k) + 1,
                               look_(s, branch.report.gc));
        return true;
    }

    /// Inserts a section before each that has an arc which no path reaches, though the arc meets one that
    /// paths reach in the section before: the joints may turn too far for one link. Removes the layers from
    /// the first such section on; false if there is none.
    bool mend(Branch& branch, Layers& layer) const {
        const auto meet = [](const Arc& a, const Arc& b) {
            const double middle = 0.5 * (a.lower + a.upper), at = 0.5 * (b.lower + b.upper);
            return 2 * abs(lift(at, middle) - middle) <= a.upper - a.lower + b.upper - b.lower;
        };
        std::size_t first = layer.size();
        for (std::size_t k = layer.size() - 1; k > 0; --k) {
            const ArcSet &before = branch.sections[k - 1].arcs, &here = branch.sections[k].arcs;
            const auto torn = [&](int arc) {
                return std::none_of(layer[k].begin(), layer[k].end(),
                                    [&](const Node& x) { return x.arc == arc; }) &&
                       std::any_of(layer[k - 1].begin(), layer[k - 1].end(),
                                   [&](const Node& x) { return meet(before.arc[x.arc], here.arc[arc]); });
            };
            bool any = false;
            for (int arc = 0; arc < here.count && !any; ++arc) any = torn(arc);
            if (any && halve(branch, k - 1)) first = k;
        }
        const bool found = first < layer.size();
        layer.resize(first);
        return found;
    }

    /// The start or goal that section k must use; null: none.
    const End* anchor(const Branch& branch, std::size_t k) const noexcept {
        if (k == 0 && branch.ends[0].q) return &branch.ends[0];
        return k + 1 == branch.sections.size() && branch.ends[1].q ? &branch.ends[1] : nullptr;
    }

    /// The configuration of a value of the redundant parameter whose joints q are known and taken as they
    /// are. Costs and derivatives are 0 if there are none, where joints share their turn: no descent moves
    /// it.
    State fixed(const Section& at, int gc, double free, const double* q) const {
        State out{};
        if (!state(at, gc, free, q, out) || !(out.cost < infinity)) out = {};
        out.free = free;
        std::copy(q, q + joints, out.q);
        return out;
    }

    /// The configurations of section k that the search tries: that of a given end, or some on each arc, at
    /// the first section in all revolutions that are told apart; empty if the section has no arc, or not that
    /// of the end, or the end is beyond limits.
    std::vector<Node> nodes(const Branch& branch, std::size_t k) const {
        std::vector<Node> out;
        const Section& section = branch.sections[k];
        const auto place = placer(family_, section.pose, branch.report.gc);
        const auto put = [&](const State& x, int arc) {
            Node& node = out.emplace_back();
            node = {x.free, {}, x.cost, infinity, -1, arc};
            std::copy(x.q, x.q + joints, node.q);
        };
        const auto look = [&](double free) {
            State x{};
            if (!state<double>(place, section.wished, free, nullptr, x)) x.cost = not_a_number;
            x.free = free;
            return x;
        };
        const auto add = [&](const State& x, int arc) {
            if (is_nan(x.cost) || !within_limits(limits_, x.q, tolerance::angle) ||
                touches(section, x.free, x.q))
                return;
            const std::size_t first = out.size();
            put(x, arc);
            for (int j = 0; j < joints; ++j) {
                if (k > 0 || !(branch.counted >> j & 1u)) continue;
                const double q = x.q[j];
                const double low = std::ceil((limits_.lower[j] - tolerance::angle - q) / two_pi);
                const double high = std::floor((limits_.upper[j] + tolerance::angle - q) / two_pi);
                for (std::size_t i = first, n = out.size(); i < n; ++i)
                    for (double turn = low; turn <= high; ++turn) {
                        Node other = out[i];
                        other.q[j] += two_pi * turn;
                        if (turn != 0 && rate_again(section, branch.report.gc, other)) out.push_back(other);
                    }
            }
        };
        if (const End* end = anchor(branch, k)) {
            if (is_held(section, *end) && within_limits(limits_, end->q, tuning_.beside))
                put(fixed(section, branch.report.gc, end->lambda, end->q), arc_at(section, end->lambda));
            return out;
        }
        for (int i = 0; i < section.arcs.count; ++i) {
            const Arc& arc = section.arcs.arc[i];
            const double width = arc.upper - arc.lower;
            const double inset = min(tuning_.inset, tuning_.inset_share * width);
            const double low = arc.lower + inset, high = arc.upper - inset;
            const double first = std::ceil(low / tuning_.step) * tuning_.step;
            std::vector<double> free{low};
            for (double x = first; x < high; x += tuning_.step)
                if (x > low) free.push_back(x);
            if (high > low) free.push_back(high);
            if (branch.stalled) {
                free.insert(free.end(), {arc.lower, arc.upper});
                for (const End& end : branch.ends) {  // where branches meet only theirs may have a solution
                    const double near = nearest(section.arcs, wrap(end.lambda));
                    if (end.q && arc_at(section, near) == i)
                        free.push_back(lift(near, 0.5 * (arc.lower + arc.upper)));
                }
                std::sort(free.begin(), free.end());
            }
            std::vector<State> tried;
            for (const double x : free) tried.push_back(look(x));
            if (branch.stalled) divide(branch, look, tried);
            for (const State& x : tried) add(x, i);
        }
        return out;
    }

    /// Adds configurations between those of an arc, which ascend in their redundant parameter and have a NaN
    /// cost if there is no solution, where a joint turns by more than half of what it may from section to
    /// section: next to singularities joints turn faster than the grid is fine, and a joint whose revolutions
    /// are told apart changes its revolution at a limit. look(free) computes one.
    template <class LookAt>
    void divide(const Branch& branch, const LookAt& look, std::vector<State>& tried) const {
        const auto turn = [&](const State& x, const State& y) {
            double most = 0;
            for (int j = 0; j < joints && !is_nan(x.cost) && !is_nan(y.cost); ++j) {
                const double move = y.q[j] - x.q[j];
                most = max(most, abs(branch.counted >> j & 1u ? move : wrap(move)));
            }
            return most;
        };
        std::vector<State> ahead(tried.rbegin(), tried.rend());
        for (tried.clear(); !ahead.empty();) {
            const State to = ahead.back();
            if (!tried.empty() && to.free - tried.back().free > tolerance::angle &&
                turn(tried.back(), to) > 0.5 * tuning_.link) {
                ahead.push_back(look(0.5 * (tried.back().free + to.free)));
                continue;
            }
            tried.push_back(to);
            ahead.pop_back();
        }
    }

    /// The cost of the motion from one configuration to another over ds.
    double moving(const State& a, const State& b, double ds) const noexcept {
        double sum = 0, rate[joints];
        for (int j = 0; j < joints; ++j) {
            sum += (b.q[j] - a.q[j]) * (b.q[j] - a.q[j]);
            rate[j] = (b.q[j] - a.q[j]) / ds;
        }
        return objective_.travel * sum / ds + ds * hurry(objective_, length_, rate);
    }

    /// The part of s that section k represents.
    double share_of(const std::vector<Section>& x, std::size_t k, std::size_t n) const noexcept {
        return 0.5 * ((k + 1 < n ? x[k + 1].s : x[k].s) - (k > 0 ? x[k - 1].s : x[k].s));
    }

    /// The objective of a path: distances from limits and target, travel and duration, summed over sections.
    double cost_of(const Branch& branch, const std::vector<State>& way) const noexcept {
        double sum = 0;
        for (std::size_t k = 0; k < way.size(); ++k) {
            sum += share_of(branch.sections, k, way.size()) * way[k].cost;
            if (k + 1 < way.size())
                sum += moving(way[k], way[k + 1], branch.sections[k + 1].s - branch.sections[k].s);
        }
        return sum;
    }

    /// The arc of a section that contains a value of the free number, or is nearest to it.
    static int arc_at(const Section& section, double free) noexcept {
        double least = infinity;
        int out = 0;
        for (int i = 0; i < section.arcs.count; ++i) {
            const Arc& arc = section.arcs.arc[i];
            const double middle = 0.5 * (arc.lower + arc.upper);
            const double off = abs(lift(free, middle) - middle) - 0.5 * (arc.upper - arc.lower);
            if (off < least) out = i;
            least = min(least, off);
        }
        return out;
    }

    /// Whether some value between those of two configurations, on the shorter way round, lies in the arcs of
    /// both. At a given end limits of two joints may meet, and the arc grows out of a moving point.
    bool joined(const Branch& branch, std::size_t k, const Node& from, const Node& to) const noexcept {
        const double slack =
            anchor(branch, k) || anchor(branch, k - 1) ? TubeTuning::still : tolerance::angle;
        const double a = from.free, b = lift(to.free, a);
        double lower = min(a, b), upper = max(a, b);
        const auto keep = [&](const Section& section, const Node& x, double free) {
            const Arc& arc = section.arcs.arc[x.arc];
            if (arc.upper - arc.lower >= two_pi - tolerance::angle) return;
            const double turn = free - lift(free, 0.5 * (arc.lower + arc.upper));
            lower = max(lower, arc.lower + turn);
            upper = min(upper, arc.upper + turn);
        };
        keep(branch.sections[k - 1], from, a);
        keep(branch.sections[k], to, b);
        return lower <= upper + slack;
    }

    /// The value near `wanted` within the arc of a section that contains `free`, slightly inside its ends.
    double within_arc(const Section& section, double free, double wanted) const noexcept {
        const double at = nearest(section.arcs, wrap(free));
        for (int i = 0; i < section.arcs.count; ++i) {
            const Arc& arc = section.arcs.arc[i];
            const double middle = 0.5 * (arc.lower + arc.upper), half = 0.5 * (arc.upper - arc.lower);
            if (abs(lift(at, middle) - middle) > half + tolerance::angle) continue;
            if (half >= pi - tolerance::angle) return wanted;
            const double room =
                half - min(tuning_.inset, 2 * tuning_.inset_share * half) * tuning_.inset_share;
            const double moved = wanted - free + lift(free, middle);
            return wanted + (min(max(moved, middle - room), middle + room) - moved);
        }
        return free;
    }

    /// The derivatives of the cost of duration between two sections by their redundant parameters, the
    /// second ones without the bend of the joints.
    struct Haste {
        double from = 0, to = 0, from_from = 0, from_to = 0, to_to = 0;
    };
    /// The derivatives of the cost of duration for two configurations ds apart, by their redundant
    /// parameters.
    Haste haste_of(const State& a, const State& b, double ds) const noexcept {
        double rate[joints];
        for (int j = 0; j < joints; ++j) rate[j] = (b.q[j] - a.q[j]) / ds;
        const double weight = objective_.duration * length_, n = pace(objective_.slowness, rate);
        Haste out;
        for (int j = 0; j < joints; ++j) {
            const auto [slope, curved] = pace_slope(objective_.slowness[j], rate[j], n);
            out.from -= slope * a.slope[j];
            out.to += slope * b.slope[j];
            out.from_from += curved * a.slope[j] * a.slope[j];
            out.from_to -= curved * a.slope[j] * b.slope[j];
            out.to_to += curved * b.slope[j] * b.slope[j];
        }
        out.from_from = weight / ds * (out.from_from - 7 / n * out.from * out.from);
        out.from_to = weight / ds * (out.from_to - 7 / n * out.from * out.to);
        out.to_to = weight / ds * (out.to_to - 7 / n * out.to * out.to);
        out.from *= weight;
        out.to *= weight;
        return out;
    }

    const F family_;
    const Limits limits_;
    const Objective objective_;  // with the slowness of the joints
    const double length_;        // how far the path turns the arm (rad)
    Work& work_;
    const bool threaded_;
    const Look look_;
    const Touches touches_;
    const FamilyTuning& tuning_;
    bool has_a_turn_[joints];
    double rest_[joints];  // the value of each joint nearest to which it is counted without a reference (rad)
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
