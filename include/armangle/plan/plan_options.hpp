// What a plan takes besides the path, and what it returns.
#pragma once

#include <functional>
#include <vector>

#include "../circle/smooth_plane.hpp"
#include "certify.hpp"
#include "diagnose.hpp"
#include "duration.hpp"
#include "objective.hpp"
#include "scenes_along.hpp"
#include "wish_along.hpp"
#include "work.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// Arguments of a plan besides the path.
struct PlanOptions {
    const double* start = nullptr;  // joints at the start; fixes branch, arm angle and turns
    const double* goal = nullptr;
    unsigned branches = 0xff;  // bit k: GC k is permitted
    Objective objective;
    const WishAlong* wish = nullptr;                          // target for the arm angle
    double singularity_margin = 0;                            // rad
    double limit_margin = 0;                                  // rad: limits are narrowed by this
    ScenesAlong scenes = {};                                  // obstacles that the links must avoid
    std::function<void(double s, ArcSet& psi)> allowed = {};  // arcs given by the user; empty: all psi
    const ArcSet* allowed_everywhere = nullptr;               // if they are the same for every s
    JointBounds bounds = {};                                  // if the objective weighs duration
    double held_q_7 = 0;                    // fixed joint 7 of an arm with free roll (with_free_roll)
    int threads = 0;                        // threads for branches; 0: one for each core
    long long work = WorkTuning::plan;      // that the plan may take; then the best path so far is returned
    bool rate_only = false;                 // rate the branches by their searches, and prove no curve
    std::function<void()> checkpoint = {};  // every thread calls it between pieces of work; may throw to stop
    std::function<void()> advanced = {};    // any thread calls it: a branch is surveyed, the choice is proven
};

/// A plan with its proof, or the report why none exists.
struct Plan {
    bool ok = false;
    int gc = -1;
    SmoothPlane plane;
    std::vector<Stretch> stretches;  // of the curve, to the last s reached
    Proof proof;
    double start_gap = 0, goal_gap = 0;  // rad: distance of start and goal from the solutions of their poses
    std::vector<BranchReport> branches;  // the permitted branches, best first
    long long work_left = 0;             // of PlanOptions::work; for other plans of the same request
};

}  // namespace armangle

#include "../names/end.hpp"
