// Lookahead along known poses: the part of each feasible set from which the following poses can be reached.
//
// It is used only if steps without lookahead would miss a pose of the window; otherwise there is no dead end
// to avoid.
// Nodes are the exact arcs of the poses, not a grid of psi, so narrow arcs are never missed. Two solutions of
// neighbouring poses are linked if every joint moves at most as far as a step may. For one solution the
// linked psi of the next pose have a closed form (bounds.hpp). So a set on one pose gives the set on the
// next; its ends are found by bisection.
#pragma once

#include <cstddef>

#include "../numbers/arrays.hpp"
#include "../scene/clear_cells.hpp"
#include "bounds.hpp"
#include "stepping_family.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// One of the coming poses: its self-motion, its arcs, and the part of them from which the remaining poses
/// can be reached.
struct AheadSection {
    SelfMotion<double> motion;
    JointFunctions<double> functions;
    ArcSet arcs, tube;
};

/// How an S-R-S arm computes the sections of coming poses, and the part of a section that a box of joints
/// permits.
struct ExactSections {
    using Section = AheadSection;
    const Arm& arm;
    const LimitTable& limits;

    /// The arm with the signs, offsets and limits of the robot's joints.
    const Arm& rows() const noexcept { return arm; }
    /// Computes the self-motion of a pose in branch gc and its arcs of psi within the limits (perhaps none)
    /// in `to`.
    void fill(const Pose<double>& pose, int gc, Section& to) const noexcept {
        to.motion = self_motion(arm, pose, configuration(gc));
        to.functions = joint_functions(to.motion);
        feasible(to.motion, to.functions, limits, to.arcs);
    }
    /// Reduces the arcs of a section to their proven collision-free parts.
    void clear(const Scene& scene, Section& to) const noexcept {
        const ArcSet own = to.arcs;
        keep_clear(arm, scene, to.motion, own, to.arcs);
    }
    /// Writes the joints at psi of a section to q; always true, since psi is on an arc.
    bool joints_at(const Section& at, double psi, Joints& q) const noexcept {
        q = joints_within_limits(arm, directions(at.motion, sin_cos(psi)), nullptr);
        return true;
    }
    /// Writes the arcs of a section whose joints stay in a box of moves around q.
    void window(const Section& to, const double* q, const MoveBox& box, ArcSet& out) const noexcept {
        detail::window(arm, to.motion, to.functions, q, box, out);
    }
};

/// How any other kind of arm computes the sections of coming poses, and the part of a section that a box of
/// joints permits.
template <stepping_family F>
struct FamilySections {
    struct Section {
        Pose<double> pose;
        int gc;
        ArcSet arcs, tube;
    };
    F family;

    /// The arm with the signs, offsets and limits of the robot's joints.
    const Arm& rows() const noexcept { return family.rows(); }
    /// Computes the arcs of a pose in branch gc within the limits (perhaps none) in `to`.
    void fill(const Pose<double>& pose, int gc, Section& to) const noexcept {
        to.pose = {orthonormal(pose.rotation), pose.position};
        to.gc = gc;
        arcs_within(to, rows().limits, to.arcs);
    }
    /// Reduces the arcs of a section to their proven collision-free parts.
    void clear(const Scene& scene, Section& to) const noexcept {
        ProvenArcs own;
        own.arcs = to.arcs;
        own.status = Status::OK;
        own.unproven = 0;
        Tag blocking;
        keep_clear(family.arm(), scene, to.pose, to.gc, own, blocking);
        to.arcs = own.arcs;
    }
    /// Writes the joints at lambda in a section to q; false if there are none.
    bool joints_at(const Section& at, double lambda, Joints& q) const noexcept {
        Directions<double> d;
        if (family.at(at.pose, at.gc, lambda, nullptr, d) != Status::OK) return false;
        q = joints_within_limits(rows(), d, nullptr);
        return true;
    }
    /// Writes the arcs of a section whose joints stay in a box of moves around q.
    void window(const Section& to, const double* q, const MoveBox& box, ArcSet& out) const noexcept {
        Limits narrow;
        make_empty(out);
        for (int j = 0; j < joints; ++j) {
            if (!(box.lower[j] <= box.upper[j])) return;
            narrow.lower[j] = q[j] + box.lower[j];
            narrow.upper[j] = q[j] + box.upper[j];
        }
        if (rows().roll_free) {  // joint 7 is independent of the pose
            narrow.lower[joints - 1] = -infinity;
            narrow.upper[joints - 1] = infinity;
        }
        arcs_within(to, narrow, out);
    }

private:
    /// Writes the arcs of a section within these limits to `out`; empty if there are none.
    void arcs_within(const Section& to, const Limits& limits, ArcSet& out) const noexcept {
        ProvenArcs found;
        family.arcs(to.pose, to.gc, limits, found);
        out = found.arcs;
    }
};
/// For compilers that cannot deduce the family of an aggregate.
template <stepping_family F>
FamilySections(F) -> FamilySections<F>;

/// Parameters of lookahead.
struct LookaheadTuning {
    static constexpr double spacing = 0.35;  // rad: between two linked psi closer than this, all are linked
    static constexpr int least = 3;          // least number of psi sampled inside an arc, however narrow
    static constexpr int halvings = 12;      // bisections of the gap between a linked psi and one that is not
    static constexpr double reserve =
        0.01;  // share of a step kept in reserve, so that more than a point remains at the end of a tube
    static constexpr double run_up =
        0.5;  // the same with bounds on acceleration: the reserve to catch up after a late start
};

namespace detail {

/// Computes which psi of two neighbouring sections one step can connect.
template <class View>
struct Links {
    using Section = typename View::Section;
    View view;
    double most[joints];  // rad: largest move in one step
    double share;         // share of it that links use

    /// Writes the part of `within` on section `to` whose joints are at most `part` of a step from q. Joints
    /// with a range below 2 pi, and all of them if `turns_known`, also stay within the limits from q on.
    void reach(const double* q, bool turns_known, double part, const Section& to, const ArcSet& within,
               ArcSet& out) const noexcept {
        const Arm& arm = view.rows();
        MoveBox box;
        for (int i = 0; i < joints; ++i) {
            const bool clip = turns_known || arm.limits.upper[i] - arm.limits.lower[i] < two_pi;
            box.lower[i] = max(-part * most[i], clip ? arm.limits.lower[i] - q[i] : -infinity);
            box.upper[i] = min(part * most[i], clip ? arm.limits.upper[i] - q[i] : infinity);
        }
        ArcSet all;
        view.window(to, q, box, all);
        intersect(all, within, out);
    }

    /// Computes the arcs of section `to`, within `within`, that one step can reach from psi on section
    /// `from`.
    void reach(const Section& from, double psi, const Section& to, const ArcSet& within,
               ArcSet& out) const noexcept {
        Joints q;
        if (!view.joints_at(from, psi, q)) return make_empty(out);
        reach(q.q, false, share, to, within, out);
    }

    /// Whether a step from psi on section `from` reaches `within` on section `to`.
    bool linked(const Section& from, double psi, const Section& to, const ArcSet& within) const noexcept {
        ArcSet reached;
        reach(from, psi, to, within, reached);
        return !reached.empty();
    }
};

/// The psi of one arc at which reachability is tested, in rising order, with the results known so far.
struct Probes {
    static constexpr int capacity = 96;
    int count = 0;
    double psi[capacity];
    bool linked[capacity];

    /// Inserts a psi to probe in order, unless the list is full; `known`: whether it is known to be
    /// reachable.
    void add(double at, bool known) noexcept {
        if (count == capacity) return;
        int i = count++;
        for (; i > 0 && psi[i - 1] > at; --i) {
            psi[i] = psi[i - 1];
            linked[i] = linked[i - 1];
        }
        psi[i] = at;
        linked[i] = known;
    }
};

/// Computes the part of section `to` that steps from a set on section `from` reach.
template <class View>
class Image {
    using Section = typename View::Section;

public:
    /// Keeps references: the psi of section `to` that one step reaches from the arcs `set` of section `from`
    /// are to be found.
    Image(const Links<View>& links, const Section& from, const ArcSet& set, const Section& to)
        : links_(links), from_(from), set_(set), to_(to) {}

    /// Writes the part of the target section's arcs that a step from the set reaches to `out`; perhaps none.
    void operator()(ArcSet& out) const noexcept {
        make_empty(out);
        ArcSet known, gaps;
        Probes doubtful;
        make_empty(known);
        complement(set_, gaps);
        if (!set_.full)
            for (int i = 0; i < set_.count; ++i) seed(set_.arc[i], known);
        if (!set_.empty())
            for (int i = 0; i < gaps.count; ++i) doubt(gaps.arc[i], doubtful);
        for (int i = 0; i < to_.arcs.count; ++i) {
            const Arc& arc = to_.arcs.arc[i];
            Probes probes;
            spread(arc, known, doubtful, probes);
            for (int k = 0; k < probes.count; ++k)
                probes.linked[k] = probes.linked[k] || linked(probes.psi[k]);
            collect(probes, out);
        }
        merge(out);
    }

private:
    /// Whether psi on section `to` is reachable from the set.
    bool linked(double psi) const noexcept { return links_.linked(to_, psi, from_, set_); }

    /// Adds to `known` the psi reached from the ends and the middle of an arc. Samples of a wide target could
    /// miss them.
    void seed(const Arc& arc, ArcSet& known) const noexcept {
        for (double psi : {arc.lower, 0.5 * (arc.lower + arc.upper), arc.upper}) {
            ArcSet reached;
            links_.reach(from_, psi, to_, to_.arcs, reached);
            for (int i = 0; i < reached.count; ++i) put(known, reached.arc[i]);
        }
    }

    /// Adds some psi of a gap of the set, and psi on the target section that a step from them reaches;
    /// otherwise samples could miss the gap in the result.
    void doubt(const Arc& gap, Probes& out) const noexcept {
        for (double share : {0.25, 0.5, 0.75}) {
            const double psi = gap.lower + share * (gap.upper - gap.lower);
            ArcSet reached;
            links_.reach(from_, psi, to_, to_.arcs, reached);
            out.add(wrap(psi), false);
            for (int i = 0; i < reached.count; ++i)
                out.add(wrap(0.5 * (reached.arc[i].lower + reached.arc[i].upper)), false);
        }
    }

    /// Adds psi and psi + 2 pi, as far as they are in the arc.
    static void probe(const Arc& arc, double psi, bool linked, Probes& out) noexcept {
        for (double turn : {0.0, two_pi})
            if (psi + turn >= arc.lower && psi + turn <= arc.upper) out.add(psi + turn, linked);
    }

    /// Adds values spread evenly over an arc, and the ends of `known` arcs and `doubtful` values in it.
    static void spread(const Arc& arc, const ArcSet& known, const Probes& doubtful, Probes& out) noexcept {
        const double width = arc.upper - arc.lower;
        const int parts =
            1 + static_cast<int>(max(double(LookaheadTuning::least), ceil(width / LookaheadTuning::spacing)));
        for (int k = 0; k <= parts; ++k)
            out.add(k == parts ? arc.upper : arc.lower + width * k / parts, false);
        for (int i = 0; i < known.count; ++i)
            for (double end : {known.arc[i].lower, known.arc[i].upper}) probe(arc, end, true, out);
        for (int i = 0; i < doubtful.count; ++i) probe(arc, doubtful.psi[i], false, out);
    }

    /// The last reachable psi between `inside`, which is reachable, and `outside`, which is not, by
    /// bisection.
    double last_linked(double inside, double outside) const noexcept {
        const double first = inside + (outside - inside) * 0x1p-12;
        if (!linked(first)) return inside;
        for (int k = 0; k < LookaheadTuning::halvings; ++k) {
            const double middle = 0.5 * (inside + outside);
            (linked(middle) ? inside : outside) = middle;
        }
        return inside;
    }

    /// Joins neighbouring reachable samples to arcs and refines their ends.
    void collect(const Probes& p, ArcSet& out) const noexcept {
        for (int k = 0; k < p.count; ++k) {
            if (!p.linked[k]) continue;
            const double lower = k > 0 ? last_linked(p.psi[k], p.psi[k - 1]) : p.psi[k];
            while (k + 1 < p.count && p.linked[k + 1]) ++k;
            const double upper = k + 1 < p.count ? last_linked(p.psi[k], p.psi[k + 1]) : p.psi[k];
            put(out, {lower, upper, 0, 0});
        }
    }

    const Links<View>& links_;
    const Section& from_;
    const ArcSet& set_;
    const Section& to_;
};

}  // namespace detail

/// The window of coming poses, which moves along with the motion. It is computed for twice as many poses as
/// requested and again when half of them are passed. So every step sees at least `ahead` poses beyond its own
/// at the cost of two.
template <class View>
class Lookahead {
public:
    using Section = typename View::Section;

    /// The number of sections that the caller's workspace must hold.
    static constexpr std::size_t sections_for(std::size_t ahead) noexcept { return 2 * ahead + 1; }

    /// `scenes` (none, one, or one a pose) and `bounds` may be null. `workspace` holds sections_for(ahead)
    /// sections. Connections do not consider accelerations. If these are bounded, connections use half of the
    /// velocity, and a motion that comes late is led back to the reachable part.
    Lookahead(const View& view, const double* poses, std::size_t n, Strided<const ArcSet> allowed,
              Strided<const Scene* const> scenes, const Bounds* bounds, double largest_step,
              Section* workspace, std::size_t ahead) noexcept
        : poses_(poses),
          n_(n),
          allowed_(allowed),
          scenes_(scenes),
          links_{view, {}, 1.0 - LookaheadTuning::reserve},
          section_(workspace),
          ahead_(ahead) {
        for (int i = 0; i < joints; ++i)
            links_.most[i] =
                min(bounds ? bounds->velocity[i] * bounds->dt : infinity, largest_step) - tolerance::bound;
        for (int i = 0; bounds && i < joints; ++i)
            if (bounds->acceleration[i] < infinity) links_.share = 1.0 - LookaheadTuning::run_up;
    }

    /// The psi of pose i from which as many of the coming poses as possible can be reached, starting from q.
    /// Null if q cannot step to pose i at all, or if lookahead gains nothing. plain(m) returns how many of
    /// the m poses from i on are reached by steps without lookahead.
    template <class Plain>
    const ArcSet* at(std::size_t i, const double* q, int gc, const Plain& plain) noexcept {
        const bool inside =
            count_ && i >= first_ && i < first_ + reached_ && (i <= first_ + ahead_ || first_ + count_ == n_);
        if (inside && plain_) return nullptr;
        std::size_t held = 0;
        const auto begin = [&] {
            const std::size_t most = sections_for(ahead_);
            first_ = i;
            count_ = reached_ = n_ - i < most ? n_ - i : most;
            held = plain(count_);
            plain_ = held == count_;
            if (!plain_) draw(gc);
        };
        const bool drawn = inside && gc == gc_;
        if (!drawn) begin();
        if (plain_) return nullptr;
        Section& here = section_[i - first_];
        ArcSet start;
        links_.reach(q, true, 1.0, here, here.tube, start);
        const bool led_back = links_.share == 1.0 - LookaheadTuning::run_up && !here.tube.empty();
        if (!start.empty() || led_back) return &here.tube;
        if (drawn) begin();
        if (plain_) return nullptr;
        links_.reach(q, true, 1.0, section_[0], section_[0].arcs, start);
        if (start.empty()) {
            count_ = 0;
            return nullptr;
        }
        turn_to(start);
        if (reached_ > held) return &section_[0].tube;
        reached_ = held;
        plain_ = true;
        return nullptr;
    }

    /// Discards the window after the motion left the tube or stopped.
    void forget() noexcept { count_ = 0; }

private:
    /// Computes the sections of the window in branch gc, and the reachable parts from its end.
    void draw(int gc) noexcept {
        gc_ = gc;
        for (std::size_t k = 0; k < count_; ++k) fill(section_[k], first_ + k);
        section_[count_ - 1].tube = section_[count_ - 1].arcs;
        back(count_ - 1);
    }

    /// Computes the arcs of section i within the limits, the user's arcs and the scene in `to`; perhaps none.
    void fill(Section& to, std::size_t i) const noexcept {
        links_.view.fill(load_pose(poses_ + 16 * i), gc_, to);
        const ArcSet own = to.arcs;
        if (allowed_.data) intersect(own, *allowed_.at(i), to.arcs);
        if (scenes_.data) links_.view.clear(**scenes_.at(i), to);
    }

    /// Computes the reachable parts of all sections before section `last`, whose part is known.
    void back(std::size_t last) noexcept {
        for (std::size_t k = last; k-- > 0;)
            detail::Image(links_, section_[k + 1], section_[k + 1].tube, section_[k])(section_[k].tube);
    }

    /// If the end of the window cannot be reached from `start` in the first section, aims at the farthest
    /// section that can.
    void turn_to(const ArcSet& start) noexcept {
        section_[0].tube = start;
        std::size_t last = 0;
        for (; last + 1 < count_; ++last) {
            detail::Image(links_, section_[last], section_[last].tube,
                          section_[last + 1])(section_[last + 1].tube);
            if (section_[last + 1].tube.empty()) break;
        }
        reached_ = last + 1;
        back(last);
    }

    const double* poses_;
    std::size_t n_;
    Strided<const ArcSet> allowed_;
    Strided<const Scene* const> scenes_;
    detail::Links<View> links_;
    Section* section_;
    std::size_t ahead_, first_ = 0, count_ = 0, reached_ = 0;
    int gc_ = -1;
    bool plain_ = false;  // steps without lookahead reach the poses up to `reached_`
};

}  // namespace armangle

#include "../names/end.hpp"
