// The work of a request: one budget for the sections, searches, descents and proofs of its plans, so that it
// ends.
#pragma once

#include <atomic>
#include <functional>

#include "../scene/scene_frames.hpp"
#include "scenes_along.hpp"

#include "../names/begin.hpp"

namespace armangle {

/// What the pieces of a plan's work count, in links of a search: some nanoseconds each.
struct WorkTuning {
    static constexpr long long plan = 270'000'000;  // of all plans of a request; what is then open stays open
    static constexpr long long proofs = plan / 8;   // of it: what searches leave to proofs
    static constexpr long long posture = 40;        // a configuration with its cost
    static constexpr long long section = 1000;      // the arcs of a closed form
    static constexpr long long cell = 500;          // a proof over a range of s or of a free number
    static constexpr long long pair = 100;          // two shapes that may touch, in a section or a cell
    static constexpr long long chain = 80;          // times as much: each of them of an own chain
};

/// The work that may still be done. It is counted, not timed, so that the same request always
/// gives the same answer.
class Work {
public:
    /// checkpoint (may be empty): called between pieces of work; may throw to stop the computation.
    Work(const std::function<void()>& checkpoint, long long budget)
        : checkpoint_(checkpoint), left_(budget) {}

    /// Counts a piece of work, from any thread, and passes the checkpoint.
    void take(long long piece) {
        left_.fetch_sub(piece, std::memory_order_relaxed);
        if (checkpoint_) checkpoint_();
    }
    /// The work that may still be done; not positive if all is. Threads must have ended, since it depends on
    /// which came first.
    long long left() const noexcept { return left_.load(std::memory_order_relaxed); }
    /// Whether none is left but that of the proofs.
    bool spent() const noexcept { return left() <= WorkTuning::proofs; }

private:
    const std::function<void()>& checkpoint_;
    std::atomic<long long> left_;
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
