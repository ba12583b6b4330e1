// Threads: a range of elements split into one part each.
#pragma once

#include <cstddef>
#include <thread>

#include "../numbers/arrays.hpp"

namespace armangle {

inline constexpr std::size_t most_threads = 64;

/// Splits [0, n) into one range a thread; work(begin, end, thread).
template <class Work>
void parallel(std::size_t n, int threads, const Work& work) {
    // the system is asked how many cores it has only where it matters: the answer takes longer than many
    // poses
    std::size_t count = threads > 0 ? static_cast<std::size_t>(threads) : std::thread::hardware_concurrency();
    if (count == 0) count = 1;
    if (count > n) count = n ? n : 1;
    if (count > most_threads) count = most_threads;
    std::thread pool[most_threads];
    for (std::size_t t = 1; t < count; ++t)
        pool[t] = std::thread([&work, n, count, t] { work(n * t / count, n * (t + 1) / count, t); });
    work(0, n / count, 0);
    for (std::size_t t = 1; t < count; ++t) pool[t].join();
}

/// The problem with the lowest index of all threads.
inline Outcome first_problem(const Outcome* outcomes, std::size_t count) noexcept {
    Outcome first;
    for (std::size_t t = 0; t < count; ++t)
        if (outcomes[t].problem != Problem::none)
            first.report(outcomes[t].problem, outcomes[t].index, outcomes[t].value);
    return first;
}

}  // namespace armangle
