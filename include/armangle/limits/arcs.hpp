// ArcSet: closed arcs on the circle, their algebra, and the tags of their ends. Independent of robots.
//
//        -pi                 0                 pi
//         |====]    [=======]        [==========|     two arcs: the last one crosses the seam, lower in
//              ^    ^                                 [-pi, pi), upper up to a turn further
//              tags: the joint and the limit that end an arc
//
// An arc shorter than the tolerance is an isolated psi: a locked joint, or a configuration near a
// singularity, is feasible only there. Intersections and unions keep it; the closure of a complement does
// not.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "../numbers/angles.hpp"
#include "../numbers/tolerances.hpp"
#include "../status.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// An opaque mark of an arc's end that identifies its cause.
using Tag = std::uint32_t;

/// One arc of the circle, with the tags that identify the causes of its ends.
struct Arc {
    double lower, upper;  // lower in [-pi, pi), upper in [lower, lower + 2 pi]
    Tag lower_tag, upper_tag;
};

/// Disjoint arcs in rising order. The full circle is one arc [-pi, pi] without ends.
struct ArcSet {
    static constexpr int capacity = 32;
    int count = 0;
    bool full = false;
    Arc arc[capacity];

    /// Whether the set holds no arc.
    bool empty() const noexcept { return count == 0; }
};

/// The feasible values of a pose and branch: `arcs`, in which every value is proven, and `unproven`, the
/// length (rad) of what remains undecided and is left out.
struct ProvenArcs {
    ArcSet arcs, open;
    Status status;
    double unproven;
};

/// Makes the set empty.
inline void make_empty(ArcSet& set) noexcept {
    set.count = 0;
    set.full = false;
}
/// Makes the set the whole circle.
inline void make_full(ArcSet& set) noexcept {
    set.count = 1;
    set.full = true;
    set.arc[0] = {-pi, pi, 0, 0};
}

namespace detail {

/// Whether an arc is a single angle, up to the tolerance.
inline bool is_isolated(const Arc& arc) noexcept { return arc.upper - arc.lower < tolerance::angle; }

/// Inserts an arc into `set` in order and shifts it by one turn if its lower end is outside [-pi, pi). Does
/// nothing if the capacity is reached.
inline void put(ArcSet& set, Arc arc) noexcept {
    if (set.count == ArcSet::capacity) return;
    double turn = 0;
    if (arc.lower >= pi) turn = -two_pi;
    if (arc.lower < -pi) turn = two_pi;
    arc.lower += turn;
    arc.upper += turn;
    int at = set.count++;
    for (; at > 0 && set.arc[at - 1].lower > arc.lower; --at) set.arc[at] = set.arc[at - 1];
    set.arc[at] = arc;
}

/// Turns all arcs of `set` by an angle (rad).
inline void turn(ArcSet& set, double angle) noexcept {
    if (set.full) return;
    const ArcSet from = set;
    make_empty(set);
    for (int i = 0; i < from.count; ++i) {
        const Arc& a = from.arc[i];
        const double lower = wrap(a.lower + angle);
        put(set, {lower, lower + (a.upper - a.lower), a.lower_tag, a.upper_tag});
    }
}

/// Inserts an arc into `set` as put() does, unless it is narrower than the tolerance of angles.
inline void push(ArcSet& set, const Arc& arc) noexcept {
    if (!is_isolated(arc)) put(set, arc);
}

/// Merges arcs of `set`, sorted by their lower ends, that overlap or whose gap is shorter than the tolerance,
/// also across the seam.
inline void merge(ArcSet& set) noexcept {
    int kept = 0;
    for (int i = 1; i < set.count; ++i) {
        Arc& last = set.arc[kept];
        if (set.arc[i].lower - last.upper < tolerance::angle) {
            if (set.arc[i].upper > last.upper) {
                last.upper = set.arc[i].upper;
                last.upper_tag = set.arc[i].upper_tag;
            }
        } else {
            set.arc[++kept] = set.arc[i];
        }
    }
    set.count = set.count ? kept + 1 : 0;
    if (set.count == 0) return;
    Arc &first = set.arc[0], &last = set.arc[set.count - 1];
    if (first.lower + two_pi - last.upper >= tolerance::angle) return;
    if (set.count == 1) return make_full(set);
    last.upper = first.upper + two_pi;
    last.upper_tag = first.upper_tag;
    for (int i = 1; i < set.count; ++i) set.arc[i - 1] = set.arc[i];
    --set.count;
}

}  // namespace detail

/// Makes the set one arc from `lower` up to `upper` >= `lower` (rad), given on any multiple of 2 pi; the
/// whole circle if it is as long.
inline void make_arc(ArcSet& set, double lower, double upper, Tag lower_tag, Tag upper_tag) noexcept {
    make_empty(set);
    if (upper - lower >= two_pi - tolerance::angle) return make_full(set);
    const double start = wrap(lower) >= pi ? -pi : wrap(lower);
    detail::put(set, {start, start + (upper - lower), lower_tag, upper_tag});
}

/// Makes the set from n arcs (lower, upper, lower, ...) that are already ordered and normalized. Returns
/// false and makes it empty if they are not, touch, or exceed the capacity.
inline bool make_ordered(ArcSet& set, const double* ends, int n) noexcept {
    make_empty(set);
    if (n < 1 || n > ArcSet::capacity) return false;
    double reach = ends[2 * n - 1] - two_pi;
    if (!(ends[0] >= -pi && ends[2 * n - 2] < pi)) return false;
    for (int i = 0; i < n; ++i) {
        const double lower = ends[2 * i], upper = ends[2 * i + 1];
        if (lower - reach < tolerance::angle || upper < lower) return false;
        set.arc[i] = {lower, reach = upper, 0, 0};
    }
    set.count = n;
    return true;
}

namespace detail {

/// Inserts the common part of the intervals p and q into `set`, without regard to other multiples of 2 pi;
/// nothing if they do not overlap. An isolated angle is kept unchanged; points where they only touch are
/// skipped.
inline void put_common(ArcSet& set, const Arc& p, const Arc& q) noexcept {
    const Arc& narrow = is_isolated(p) ? p : q;
    const Arc& other = is_isolated(p) ? q : p;
    if (is_isolated(narrow)) {
        const double middle = 0.5 * (narrow.lower + narrow.upper);
        if (middle >= other.lower - tolerance::angle && middle <= other.upper + tolerance::angle)
            put(set, narrow);
        return;
    }
    if (q.lower >= p.upper || q.upper <= p.lower) return;
    const bool later = q.lower > p.lower, earlier = q.upper < p.upper;
    push(set, {later ? q.lower : p.lower, earlier ? q.upper : p.upper, later ? q.lower_tag : p.lower_tag,
               earlier ? q.upper_tag : p.upper_tag});
}

}  // namespace detail

/// Writes the intersection of a and b to `out`, another set.
inline void intersect(const ArcSet& a, const ArcSet& b, ArcSet& out) noexcept {
    if (a.full) {
        out = b;
        return;
    }
    if (b.full) {
        out = a;
        return;
    }
    make_empty(out);
    for (int i = 0; i < a.count; ++i) {
        for (int j = 0; j < b.count; ++j) {
            const Arc& q = b.arc[j];
            for (const double turn : {-two_pi, 0.0, two_pi})
                detail::put_common(out, a.arc[i], {q.lower + turn, q.upper + turn, q.lower_tag, q.upper_tag});
        }
    }
    detail::merge(out);
}

/// Calls each(lower, upper) for the common part of each arc of `a` with each arc of `b` shifted by -`turn`
/// (rad). The parts are unsorted; those shorter than the tolerance are skipped. A whole circle is one arc
/// with a seam at +-pi. Returns the smallest gap between two arcs, or their smallest overlap (rad).
template <class Each>
ARMANGLE_INLINE double each_overlap(const ArcSet& a, const ArcSet& b, double turn,
                                    const Each& each) noexcept {
    double least = infinity;
    const auto give = [&](double lower, double upper) {
        least = min(least, abs(upper - lower));
        if (upper - lower >= tolerance::angle) each(lower, upper);
    };
    for (int i = 0; i < a.count; ++i) {
        const Arc& p = a.arc[i];
        for (int k = 0; k < b.count; ++k) {
            const Arc& q = b.arc[k];
            double ahead = q.lower - turn - p.lower;  // from p's lower end to q's, in [0, 2 pi)
            if (ahead < 0) ahead += two_pi;
            if (ahead < 0) ahead += two_pi;
            if (ahead >= two_pi) ahead -= two_pi;
            const double from = p.lower + ahead, to = from + (q.upper - q.lower);
            give(from, min(p.upper, to));
            give(p.lower, min(p.upper, to - two_pi));
        }
    }
    return least;
}

/// Calls each(lower, upper) for the common arcs of two sets; whole circles have no seam. Returns the smallest
/// gap between two arcs, or their smallest overlap (rad); infinite if a set is a whole circle.
template <class Each>
ARMANGLE_INLINE double each_common(const ArcSet& a, const ArcSet& b, const Each& each) noexcept {
    if (!a.full && !b.full) return each_overlap(a, b, 0.0, each);
    const ArcSet& less = a.full ? b : a;
    for (int i = 0; i < less.count; ++i) each(less.arc[i].lower, less.arc[i].upper);
    return infinity;
}

/// Writes the complement of a set, with its ends, to `out`, another set.
inline void complement(const ArcSet& a, ArcSet& out) noexcept {
    if (a.empty()) return make_full(out);
    if (a.full) return make_empty(out);
    make_empty(out);
    for (int i = 0; i < a.count; ++i) {
        const Arc& here = a.arc[i];
        const Arc& next = a.arc[i + 1 < a.count ? i + 1 : 0];
        const double end = i + 1 < a.count ? next.lower : next.lower + two_pi;
        detail::push(out, {here.upper, end, here.upper_tag, next.lower_tag});
    }
    detail::merge(out);
}

/// The union of many arcs of any length, given on any multiple of 2 pi, which may overlap: one sweep over
/// their lower ends.
class UnionOfArcs {
public:
    /// Adds an arc of any length, on any multiple of 2 pi; dropped if the capacity is reached and no arcs can
    /// be joined.
    void add(Arc arc) noexcept {
        if (arc.upper - arc.lower >= two_pi - tolerance::angle) return add_full();
        if (count_ == capacity) join();
        if (full_ || count_ == capacity) return;
        const double start = wrap(arc.lower) >= pi ? -pi : wrap(arc.lower);
        arc.upper += start - arc.lower;
        arc.lower = start;
        int at = count_++;
        for (; at > 0 && arc_[at - 1].lower > arc.lower; --at) arc_[at] = arc_[at - 1];
        arc_[at] = arc;
    }

    /// Adds the whole circle.
    void add_full() noexcept { full_ = true; }

    /// Whether the arcs added so far cover the circle.
    bool full() noexcept {
        if (!full_) join();
        return full_;
    }

    /// Writes the union of the added arcs.
    void finish(ArcSet& out) noexcept {
        if (full()) return make_full(out);
        make_empty(out);
        for (int i = 0; i < count_; ++i) detail::put(out, arc_[i]);
    }

private:
    static constexpr int capacity = 64;
    int count_ = 0;
    bool full_ = false;
    Arc arc_[capacity];

    /// Merges arcs that overlap or touch; the last may cross the seam and cover several of the first.
    void join() noexcept {
        int kept = 0;
        for (int i = 1; i < count_; ++i)
            if (!absorb(arc_[kept], arc_[i], 0.0)) arc_[++kept] = arc_[i];
        count_ = count_ ? kept + 1 : 0;
        int first = 0;
        while (first + 1 < count_ && absorb(arc_[count_ - 1], arc_[first], two_pi)) ++first;
        for (int i = first; i < count_; ++i) arc_[i - first] = arc_[i];
        count_ -= first;
        full_ = count_ == 1 && arc_[0].upper - arc_[0].lower >= two_pi - tolerance::angle;
    }

    /// Extends an arc by `next`, shifted by `turn` (rad), which begins after it. Returns false if there is a
    /// gap between them.
    static bool absorb(Arc& arc, const Arc& next, double turn) noexcept {
        if (next.lower + turn - arc.upper >= tolerance::angle) return false;
        if (next.upper + turn > arc.upper) {
            arc.upper = next.upper + turn;
            arc.upper_tag = next.upper_tag;
        }
        return true;
    }
};

/// The total length (rad) of a set.
inline double measure(const ArcSet& set) noexcept {
    double sum = 0;
    for (int i = 0; i < set.count; ++i) sum += set.arc[i].upper - set.arc[i].lower;
    return sum;
}

/// The arc that contains psi up to a tolerance, and psi shifted into its range; index -1 if there is none.
struct Place {
    int index;
    double psi;
};

/// Finds the arc that contains psi or is within `slack` (rad) of it; index -1 if there is none.
inline Place find(const ArcSet& set, double psi, double slack = tolerance::angle) noexcept {
    psi = wrap(psi);
    if (set.full) return {0, psi};
    int index = -1;
    double at = psi;
    for (int i = set.count - 1; i >= 0; --i) {  // the first arc that holds psi, without branching
        const Arc& arc = set.arc[i];
        const double from = arc.lower - slack, to = arc.upper + slack;
        const double raised = psi < from ? psi + two_pi : psi;
        const double x = psi > to ? psi - two_pi : raised;
        const bool inside = (x >= from) & (x <= to);
        index = inside ? i : index;
        at = inside ? min(max(x, arc.lower), arc.upper) : at;
    }
    return {index, at};
}

/// Whether psi is in the set, up to the angular tolerance.
inline bool contains(const ArcSet& set, double psi) noexcept { return find(set, psi).index >= 0; }

/// Writes the union of a and b to `out`, another set.
inline void unite(const ArcSet& a, const ArcSet& b, ArcSet& out) noexcept {
    if (a.empty()) {
        out = b;
        return;
    }
    if (b.empty()) {
        out = a;
        return;
    }
    ArcSet not_a, not_b, neither;
    complement(a, not_a);
    complement(b, not_b);
    intersect(not_a, not_b, neither);
    complement(neither, out);
    for (const ArcSet* set : {&a, &b})
        for (int i = 0; i < set->count; ++i)
            if (detail::is_isolated(set->arc[i]) && !contains(out, set->arc[i].lower))
                detail::put(out, set->arc[i]);
}

/// psi if it is in the set, else the nearest end on the circle (on a tie that of the first arc), in (-pi,
/// pi]; NaN if the set is empty.
inline double nearest(const ArcSet& set, double psi) noexcept {
    if (set.empty()) return not_a_number;
    const Place place = find(set, psi);
    if (place.index >= 0) return wrap(place.psi);
    double best = infinity, at = not_a_number;
    for (int i = 0; i < set.count; ++i) {
        const double to_lower = abs(wrap(set.arc[i].lower - psi)),
                     to_upper = abs(wrap(set.arc[i].upper - psi));
        if (to_lower < best) {
            best = to_lower;
            at = set.arc[i].lower;
        }
        if (to_upper < best) {
            best = to_upper;
            at = set.arc[i].upper;
        }
    }
    return wrap(at);
}

}  // namespace armangle

#include "../names/end.hpp"
