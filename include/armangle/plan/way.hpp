// Searches a branch's tube: the sections that the start reaches, and the best path through, by dynamic
// programming (R. Bellman, 1957).
//
//     phi | o   o---o   o        o  configurations of a section    - links
//         | o--o \  o---o--o
//         |       o-o            a configuration without a link to the start is dead; a section of dead ones
//         +---------------- s    ends the path
//
// A link joins configurations of neighbouring sections whose arcs have a common part between them and whose
// joints, including their turns, differ little: |dq|, not |dpsi|. There are two labels: the least margin so
// far, then the cost. The final path is of least cost among those with the best margin.
#pragma once

#include <algorithm>
#include <utility>

#include "candidates.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace way_tuning {
inline constexpr double turn = 0.7;   // of phi from section to section (rad)
inline constexpr double move = 1.0;   // of a joint (rad)
inline constexpr double keep = 0.95;  // share of the best margin that the path of least cost keeps
inline constexpr double tie = 1e-6;   // margins closer than this are equal (rad)
}  // namespace way_tuning

/// A configuration with which a plan must begin or end.
struct Anchor {
    bool given = false;
    bool elsewhere = false;  // the requested joints are in another branch
    double phi = 0;
    std::uint32_t arc = 0;
    double q[joints] = {};
    double gap = 0;                   // rad: distance of q from the requested joints
    Status why = Status::OUTSIDE;     // the reason if it is not given
    Tag touching = 0;                 // the nearest pair then, if obstacles are the reason ...
    double shortfall = not_a_number;  // ... and by how much it is too near (m)
};

/// A path through the sections, as far as it leads.
struct Way {
    std::size_t reached = 0;  // sections 0 .. reached - 1 are connected to the start
    bool whole = false;
    bool given_up = false;      // the permitted links were used up
    bool more = false;          // some turns were not tried
    double margin = -infinity;  // least over the path, without joint 4
    double cost = infinity;
    std::vector<Candidate> rows;
};

namespace detail {

/// The revolutions of up to eight phi, for vector operations.
struct EightWindings {
    double phi[8], q[joints][8] = {}, count[joints][8] = {}, first[8] = {};
    int used = 0;

    /// Begins with eight empty places.
    EightWindings() noexcept { std::fill(phi, phi + 8, not_a_number); }

    /// Stores the revolutions of the joints at one phi in the next of the eight places.
    void add(const Windings& group) noexcept {
        const int i = used++;
        phi[i] = group.phi;
        first[i] = group.first;
        for (int j = 0; j < joints; ++j) {
            q[j][i] = group.q[j];
            count[j][i] = group.count[j];
        }
    }
};

/// The joint moves from eight phi to a configuration: from which configuration, and how long (rad).
struct EightMoves {
    unsigned linked;  // bit i: neither phi nor a joint moves too far from phi i
    double from[8], travel[8];

    /// Computes the moves from the nearest revolutions; any other is more than pi away. turn: largest change
    /// of phi; move: largest move of a joint (rad).
    EightMoves(const Task& task, const Candidate& to, const EightWindings& groups, double turn,
               double move) noexcept {
        const Slots most = move, none = 0.0;
        const Slots apart = Slots(to.phi) - Slots::load(groups.phi);
        LaneMask<8> near = abs(apart - two_pi * round(apart * (1.0 / two_pi))) <= Slots(turn);
        linked = bits(near);
        if (!linked) return;
        Slots sum = 0.0, at = 0.0, stride = 1.0;
        for (int j = 0; j < joints; ++j) {
            const Slots moved = Slots(to.q[j]) - Slots::load(groups.q[j]),
                        count = Slots::load(groups.count[j]);
            const Slots turns = select(abs(moved) > most, round(moved * (1.0 / two_pi)), none);
            const Slots d = moved - two_pi * turns;
            near = near & (abs(d) <= most);
            if (!any(near)) break;
            if (!is_unlimited(task.limits, j)) {
                near = near & (turns >= none) & (turns < count);
                at = at + turns * stride;
            }
            stride = stride * count;
            sum = sum + d * d;
        }
        linked = bits(near);
        (Slots::load(groups.first) + at).store(from);
        sqrt(sum).store(travel);
    }
};

/// Searches the best path through one tube, section by section.
class Search {
public:
    /// spread: of revolutions at a free start (candidates.hpp); links: permitted number, counted down.
    Search(const Task& task, const Tube& tube, const Objective& objective, const Anchor& start,
           const Anchor& goal, int spread, long long& links)
        : task_(task),
          tube_(tube),
          objective_(objective),
          start_(start),
          goal_(goal),
          candidates_(task, objective, spread),
          links_(links) {
        if (goal.given) candidates_.set_reference(goal.q);
        for (const Anchor* end : {&start, &goal})
            if (end->given) candidates_.hold(end->phi);
    }

    /// Finds the path of largest margin, ties decided by cost. Configurations with a margin below `floor`
    /// (rad) are left out; if a floor is given, cost alone decides.
    Way run(double floor) {
        floor_ = floor;
        way_ = Way{};
        here_.clear();
        first_.clear();
        back_.clear();
        phi_.clear();
        const std::size_t n = tube_.sections.size();
        for (std::size_t k = 0; k < n; ++k) {
            if (!advance(k)) break;
            way_.reached = k + 1;
        }
        way_.given_up = links_ < 0;
        way_.more = candidates_.left_windings_out();
        way_.whole = way_.reached == n;
        if (way_.reached) finish();
        return std::move(way_);
    }

private:
    struct Label {
        double margin = -infinity, cost = infinity;

        bool alive() const noexcept { return cost < infinity; }
    };

    /// The label of a configuration, and its predecessor in the previous section.
    struct Link {
        Label label;
        std::uint32_t from = 0;
    };

    /// The configurations of one section, and how each is reached.
    struct Layer {
        Postures postures;
        std::vector<Link> links;

        void clear() noexcept {
            postures.clear();
            links.clear();
        }
    };

    /// Whether label a is better than b: by cost if margins have a floor, otherwise by margin, then by cost.
    bool better(const Label& a, const Label& b) const noexcept {
        if (floor_ > -infinity) return a.cost < b.cost;
        if (a.margin > b.margin + way_tuning::tie) return true;
        return a.margin >= b.margin - way_tuning::tie && a.cost < b.cost;
    }

    /// Advances `here_` to section k. False, with `here_` unchanged, if none of its configurations can be
    /// reached, or no links are left.
    bool advance(std::size_t k) {
        next_.clear();
        const Section& l = tube_.sections[k];
        if (k == 0 && start_.given)
            candidates_.put_fixed(start_.phi, start_.arc, start_.q, next_.postures);
        else if (k + 1 == tube_.sections.size() && goal_.given)
            candidates_.put_fixed(goal_.phi, goal_.arc, goal_.q, next_.postures);
        else
            candidates_.fill(tube_, l, window(k), next_.postures);
        bool alive = false;
        for (const Candidate& x : next_.postures.all) {
            if (k) links_ -= static_cast<long long>(here_.postures.groups.size());
            if (links_ < 0) return false;
            task_.pass_checkpoint();
            const Link link = reached_by(k, x);
            alive = alive || link.label.alive();
            next_.links.push_back(link);
        }
        if (!alive) return false;
        first_.push_back(back_.size());
        for (std::size_t i = 0; i < next_.postures.all.size(); ++i) {
            back_.push_back(next_.links[i].from);
            phi_.push_back(next_.postures.all[i].phi);
        }
        std::swap(here_, next_);
        gather();
        return true;
    }

    /// Collects the reached configurations of the last section for vector operations.
    void gather() {
        alive_.clear();
        const std::vector<Windings>& groups = here_.postures.groups;
        for (std::size_t g = 0; g < groups.size(); ++g) {
            const std::size_t end = g + 1 < groups.size() ? groups[g + 1].first : here_.links.size();
            const auto alive = [](const Link& x) { return x.label.alive(); };
            if (!std::any_of(&here_.links[groups[g].first], &here_.links[0] + end, alive)) continue;
            if (alive_.empty() || alive_.back().used == 8) alive_.emplace_back();
            alive_.back().add(groups[g]);
        }
    }

    /// The link of configuration x at section k; not alive if its margin is below the floor or nothing
    /// reaches it.
    Link reached_by(std::size_t k, const Candidate& x) const noexcept {
        if (!(x.worth.margin >= floor_)) return {};
        return k == 0 ? Link{{x.worth.margin, 0}, 0} : join(k, x);
    }

    /// The range of joint values within one move of those reached at the previous section.
    Window window(std::size_t k) const noexcept {
        Window out;
        out.set = k > 0;
        for (int j = 0; j < joints; ++j) {
            out.lower[j] = infinity;
            out.upper[j] = -infinity;
        }
        for (std::size_t i = 0; i < here_.postures.all.size(); ++i) {
            if (!here_.links[i].label.alive()) continue;
            for (int j = 0; j < joints; ++j) {
                out.lower[j] = min(out.lower[j], here_.postures.all[i].q[j] - way_tuning::move);
                out.upper[j] = max(out.upper[j], here_.postures.all[i].q[j] + way_tuning::move);
            }
        }
        return out;
    }

    /// The best link of a configuration x of section k to the previous section.
    Link join(std::size_t k, const Candidate& x) const noexcept {
        const Section &l = tube_.sections[k], &b = tube_.sections[k - 1];
        const double ds = l.s - b.s, rated = ds * task_.margin_scale() * x.worth.cost;
        Link best;
        for (const EightWindings& groups : alive_) {
            const EightMoves moves(task_, x, groups, way_tuning::turn, way_tuning::move);
            for_each_bit(moves.linked, [&](int i) {
                const auto from = static_cast<std::uint32_t>(moves.from[i]);
                const Label& old = here_.links[from].label;
                if (!old.alive()) return;
                const Label label{min(old.margin, x.worth.margin),
                                  old.cost + rated + objective_.travel * moves.travel[i]};
                if (better(label, best.label) && joined(b, here_.postures.all[from], l, x, cornered(k)))
                    best = {label, from};
            });
        }
        return best;
    }

    /// The permitted gap (rad) between the arcs of sections k - 1 and k. If limits of two joints meet in a
    /// fixed end, the arc grows out of a moving point, and no common part remains.
    double cornered(std::size_t k) const noexcept {
        const bool fixed = (k == 1 && start_.given) || (k + 1 == tube_.sections.size() && goal_.given);
        return fixed ? tube_tuning::still : tolerance::angle;
    }

    /// Whether some phi between those of a and b, on the shorter way round, lies in both their arcs; a gap of
    /// at most `slack` (rad) also counts.
    bool joined(const Section& la, const Candidate& a, const Section& lb, const Candidate& b,
                double slack) const noexcept {
        const double turn = two_pi * round((a.phi - b.phi) / two_pi), end = b.phi + turn;
        double lower = min(a.phi, end), upper = max(a.phi, end);
        if (!la.full) {
            lower = max(lower, tube_.arc(la)[a.arc].lower);
            upper = min(upper, tube_.arc(la)[a.arc].upper);
        }
        if (!lb.full) {
            lower = max(lower, tube_.arc(lb)[b.arc].lower + turn);
            upper = min(upper, tube_.arc(lb)[b.arc].upper + turn);
        }
        return lower <= upper + slack;
    }

    /// Chooses the best configuration of the last section and writes the path to it, with its margin and
    /// cost, to the result.
    void finish() {
        std::size_t best = 0;
        for (std::size_t i = 1; i < here_.links.size(); ++i)
            if (better(here_.links[i].label, here_.links[best].label)) best = i;
        way_.margin = here_.links[best].label.margin;
        way_.cost = here_.links[best].label.cost;
        trace(best);
    }

    /// Follows the links backwards and computes the joints again from phi, in the revolutions nearest to the
    /// next row.
    void trace(std::size_t at) {
        way_.rows.resize(way_.reached);
        way_.rows.back() = here_.postures.all[at];
        for (std::size_t k = way_.reached; k-- > 1;) {
            at = back_[first_[k] + at];
            const Candidate& next = way_.rows[k];
            Candidate& x = way_.rows[k - 1];
            x.phi = lift(phi_[first_[k - 1] + at], next.phi);
            const Section& l = tube_.sections[k - 1];
            double phi[8] = {x.phi};
            const EightThetas solved(l, phi);
            for (int j = 0; j < joints; ++j) x.q[j] = lift(to_q(task_.arm, j, solved.theta[j][0]), next.q[j]);
            x.arc = nearest_arc(tube_, l, x.phi);
            x.worth = rating(task_, objective_, x.q);
        }
        if (start_.given) std::copy(start_.q, start_.q + joints, way_.rows[0].q);
        // the turn of an unlimited joint is continued from the start
        for (std::size_t k = 1; k < way_.reached; ++k)
            for (int j = 0; j < joints; ++j)
                way_.rows[k].q[j] = lift(way_.rows[k].q[j], way_.rows[k - 1].q[j]);
    }

    const Task& task_;
    const Tube& tube_;
    const Objective& objective_;
    const Anchor &start_, &goal_;
    Candidates candidates_;
    long long& links_;
    Layer here_, next_;                 // the last section reached, and the one being tried
    std::vector<EightWindings> alive_;  // the reached turns of the last section
    std::vector<std::size_t> first_;    // of each section, its first configuration in back_ and phi_
    std::vector<std::uint32_t> back_;   // the predecessor of each configuration in the previous section
    std::vector<double> phi_;
    double floor_ = -infinity;
    Way way_;
};

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
