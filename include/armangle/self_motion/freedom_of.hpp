// The redundancy left to a pose, counted from the proven intervals of all branches.
#pragma once

#include "../limits/freedom.hpp"

#include "../names/begin.hpp"

namespace armangle {

namespace detail {

/// Counts and measures the proven intervals of all branches. holds(gc) says whether a branch without any, but
/// with an unproven part, solves the pose nevertheless.
template <class Holds>
Freedom freedom_of(const ProvenArcs (&found)[configurations], const Holds& holds) noexcept {
    Freedom out{0, 0, 0, 0, Status::UNREACHABLE};
    for (int gc = 0; gc < configurations; ++gc) {
        const ArcSet& arcs = found[gc].arcs;
        const bool held = !arcs.empty() || (found[gc].unproven > 0 && holds(gc));
        out.gc = static_cast<std::uint8_t>(out.gc | held << gc);
        out.arcs = static_cast<std::uint8_t>(out.arcs + arcs.count);
        out.total += measure(arcs);
        out.unproven += found[gc].unproven;
        for (int i = 0; i < arcs.count; ++i)
            out.widest = max(out.widest, arcs.arc[i].upper - arcs.arc[i].lower);
        out.status = nearer_reason(out.status, held ? Status::OK : found[gc].status);
    }
    return out;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
