// The union of blocked arcs, however many: disjoint arcs in rising order that grow as arcs are added.
//
// Of more than `capacity` pieces the two with the narrowest gap become one: what is left stays within the
// truth, and `coarse` says so.
#pragma once

#include "../limits/arcs.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// The arcs of psi that something blocks.
struct Covered {
    static constexpr int capacity = 16;
    int count = 0;
    bool all = false, coarse = false;
    Tag all_tag = 0;  // who blocks the whole circle alone; 0: nobody does
    Arc arc[capacity + 1];
};

namespace detail {

/// Removes the arc with index `at` from `set`.
inline void remove_arc(Covered& set, int at) noexcept {
    for (int i = at; i + 1 < set.count; ++i) set.arc[i] = set.arc[i + 1];
    --set.count;
}

/// Joins the two neighbouring arcs with the narrowest gap; marks the set as coarse.
inline void close_narrowest(Covered& set) noexcept {
    int at = 0;
    double least = infinity;
    for (int i = 0; i < set.count; ++i) {
        const bool last = i + 1 == set.count;
        const double next = last ? set.arc[0].lower + two_pi : set.arc[i + 1].lower;
        if (next - set.arc[i].upper >= least) continue;
        least = next - set.arc[i].upper;
        at = i;
    }
    const bool seam = at + 1 == set.count;
    const Arc next = set.arc[seam ? 0 : at + 1];
    set.arc[at].upper = next.upper + (seam ? two_pi : 0.0);
    set.arc[at].upper_tag = next.upper_tag;
    remove_arc(set, seam ? 0 : at + 1);
    set.coarse = true;
}

/// If arc number `at`, shifted by any multiple of 2 pi, overlaps `arc`, extends `arc` over it and removes it
/// from the set.
inline void take_in(Covered& set, int at, Arc& arc) noexcept {
    const Arc here = set.arc[at];
    for (const double turn : {-two_pi, 0.0, two_pi}) {
        const double lower = here.lower + turn, upper = here.upper + turn;
        if (lower > arc.upper + tolerance::angle || upper < arc.lower - tolerance::angle) continue;
        if (lower < arc.lower) {
            arc.lower = lower;
            arc.lower_tag = here.lower_tag;
        }
        if (upper > arc.upper) {
            arc.upper = upper;
            arc.upper_tag = here.upper_tag;
        }
        return remove_arc(set, at);
    }
}

}  // namespace detail

/// Whether one arc of the set contains the arc of `half` rad on both sides of `centre` (any multiple of 2
/// pi).
inline bool covers(const Covered& set, double centre, double half) noexcept {
    if (set.all) return true;
    for (int i = 0; i < set.count; ++i) {
        const Arc& arc = set.arc[i];
        const double middle = 0.5 * (arc.lower + arc.upper);
        if (abs(wrap(centre - middle)) + half <= 0.5 * (arc.upper - arc.lower)) return true;
    }
    return false;
}

/// Adds to `set` the blocked arc of `half` rad on both sides of `centre` (any multiple of 2 pi), caused by
/// pair `tag`. Half width 0 adds nothing, pi the whole circle.
inline void cover(Covered& set, double centre, double half, Tag tag) noexcept {
    if (set.all || 2.0 * half < tolerance::angle) return;
    if (2.0 * half >= two_pi - tolerance::angle) {
        set.all = true;
        set.all_tag = tag;
        return;
    }
    const double start = wrap(centre - half);
    Arc added{start >= pi ? -pi : start, 0, tag, tag};
    added.upper = added.lower + 2.0 * half;
    for (int i = set.count - 1; i >= 0; --i) detail::take_in(set, i, added);
    if (added.upper - added.lower >= two_pi - tolerance::angle) {
        set.all = true;
        return;
    }
    double turn = 0;
    if (added.lower < -pi) turn = two_pi;
    if (added.lower >= pi) turn = -two_pi;
    added.lower += turn;
    added.upper += turn;
    int at = set.count++;
    for (; at > 0 && set.arc[at - 1].lower > added.lower; --at) set.arc[at] = set.arc[at - 1];
    set.arc[at] = added;
    if (set.count > Covered::capacity) detail::close_narrowest(set);
}

}  // namespace armangle

#include "../names/end.hpp"
