// The work of a plan: one budget for its sections, searches, descents and proofs, so that every plan ends.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>

#include "../scene/scene_frames.hpp"
#include "scenes_along.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What the pieces of a plan's work count, in links of a search: some nanoseconds each.
struct WorkTuning {
    static constexpr long long plan = 350'000'000;  // of one plan; what is then open stays open
    static constexpr long long posture = 40;        // a configuration with its cost
    static constexpr long long section = 1000;      // the arcs of a closed form
    static constexpr long long cell = 500;          // a proof over a range of s or of a free number
    static constexpr long long pair = 100;          // two shapes that may touch, in a section or a cell
    static constexpr long long chain = 80;          // times as much: a section or a cell of an own chain
    static constexpr long long share = 8;  // a proof may take this part of the budget, however late it comes
};

/// The work that a plan has done, of its budget. It is counted, not timed, so that the same request always
/// gives the same answer.
class Work {
public:
    /// checkpoint (may be empty): called between pieces of work; may throw to stop the computation.
    Work(const std::function<void()>& checkpoint, long long budget)
        : checkpoint_(checkpoint), budget_(budget) {}

    /// Counts a piece of work, from any thread, and passes the checkpoint.
    void take(long long piece) {
        done_.fetch_add(piece, std::memory_order_relaxed);
        if (checkpoint_) checkpoint_();
    }
    /// The work that may still be done; not positive if all is spent. Threads must have ended, since it
    /// depends on which came first.
    long long left() const noexcept { return budget_ - done_.load(std::memory_order_relaxed); }
    /// Whether none may be done.
    bool spent() const noexcept { return left() <= 0; }
    /// The work that a proof may take.
    long long left_to_prove() const noexcept { return std::max(left(), budget_ / WorkTuning::share); }

private:
    const std::function<void()>& checkpoint_;
    const long long budget_;
    std::atomic<long long> done_{0};
};

namespace detail {

/// The work of looking once at all pairs of shapes of the scenes at s.
inline long long work_of_pairs(const ScenesAlong& scenes, double s) noexcept {
    long long out = 0;
    for (int k = scenes ? scenes.first(s) : 0; scenes && k <= scenes.last(s); ++k) {
        const Scene& scene = scenes[k];
        const long long moving = arm_rod_count(scene) + scene.held_count;
        out += moving * (scene.solid_count + scene.block_count) + scene.own_count;
    }
    return WorkTuning::pair * out;
}

}  // namespace detail

}  // namespace armangle

#include "../names/end.hpp"
