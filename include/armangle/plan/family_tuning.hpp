// What the search for a path, and FamilyPlanner, are tuned by.
#pragma once

#include <cstddef>

#include "../self_motion/prove_stretch.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Parameters of BranchSearch and FamilyPlanner.
struct FamilyTuning {
    ProofTuning proof;
    /// The largest motion of the tool from section to section (rad; the reach counts as a radian), and the
    /// least number of sections.
    double spacing = 0.04;
    int least_sections = 9;
    /// The largest step of the redundant parameter between two configurations of the search (rad), and their
    /// distance from the ends of an arc (rad, or a share of it).
    double step = 0.05;
    double inset = 0.02, inset_share = 0.25;
    /// The largest joint move from section to section of the search (rad).
    double link = 0.6;
    /// The largest number of paths, by where they end, from which a descent begins.
    std::size_t ways = 3;
    /// How often sections are added where the search finds no continuation, or the proof fails.
    int rounds = 8;
    /// The number of steps of the descent, the largest one (rad), and the share of the objective at which it
    /// ends.
    int steps = 60;
    double farthest = 0.3, settled = 1e-7;
    /// How far a start or a goal may lie outside the arcs by rounding (rad).
    double beside = 1e-6;
    /// The number of sections that are examined to explain an empty range, and the bisections of the required
    /// widening of a limit.
    int explained = 3, halvings = 24;
};

}  // namespace armangle

#include "../names/end.hpp"
