// Threads: split a range into one part each, or take single elements as each thread becomes free.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>

#include "../numbers/arrays.hpp"

#include "../names/begin.hpp"

namespace armangle {

inline constexpr std::size_t most_threads = 64;

/// Splits [0, n) into one range a thread (threads <= 0: one a core) and calls work(begin, end, thread) on
/// each. The calling thread takes the first range; while it then waits for others, it calls idle() twenty
/// times a second. Neither may throw.
template <class Work, class Idle>
void parallel(std::size_t n, int threads, const Work& work, const Idle& idle) {
    // asks the system for the number of cores only if needed, because the answer takes longer than many poses
    std::size_t count = threads > 0 ? static_cast<std::size_t>(threads) : std::thread::hardware_concurrency();
    if (count == 0) count = 1;
    if (count > n) count = n ? n : 1;
    if (count > most_threads) count = most_threads;
    if (count == 1) return work(0, n, 0);
    std::mutex guard;
    std::condition_variable finished;
    std::size_t running = count - 1;
    std::thread pool[most_threads];
    for (std::size_t t = 1; t < count; ++t)
        pool[t] = std::thread([&, t] {
            work(n * t / count, n * (t + 1) / count, t);
            const std::lock_guard<std::mutex> held(guard);
            if (--running == 0) finished.notify_one();
        });
    work(0, n / count, 0);
    std::unique_lock<std::mutex> held(guard);
    while (!finished.wait_for(held, std::chrono::milliseconds(50), [&] { return running == 0; })) {
        held.unlock();
        idle();
        held.lock();
    }
    held.unlock();
    for (std::size_t t = 1; t < count; ++t) pool[t].join();
}

/// Splits [0, n) into one range a thread (threads <= 0: one a core) and calls work(begin, end, thread) on
/// each.
template <class Work>
void parallel(std::size_t n, int threads, const Work& work) {
    parallel(n, threads, work, [] {});
}

/// Calls work(k) for every k in [0, n), each on the first free thread; for few elements of unequal cost. If a
/// call of work throws, the exception is rethrown here and the remaining elements are skipped. While the
/// calling thread waits for the others it calls idle(), which may throw to end the work.
template <class Work, class Idle>
void in_turn(std::size_t n, int threads, const Work& work, const Idle& idle) {
    std::atomic<std::size_t> next{0};
    const auto take = [&] {
        for (std::size_t k = next++; k < n; k = next++) work(k);
    };
#ifdef __cpp_exceptions
    std::exception_ptr thrown[most_threads];
    const auto guarded = [&](std::size_t, std::size_t, std::size_t thread) {
        try {
            take();
        } catch (...) {
            thrown[thread] = std::current_exception();
            next = n;
        }
    };
    const auto waiting = [&] {
        try {
            idle();
        } catch (...) {
            thrown[0] = std::current_exception();
            next = n;
        }
    };
    parallel(n, threads, guarded, waiting);
    for (const std::exception_ptr& one : thrown)
        if (one) std::rethrow_exception(one);
#else
    parallel(n, threads, [&](std::size_t, std::size_t, std::size_t) { take(); }, idle);
#endif
}

/// The problem with the lowest index among the outcomes of all threads; none if there is none.
inline Outcome first_problem(const Outcome* outcomes, std::size_t count) noexcept {
    Outcome first;
    for (std::size_t t = 0; t < count; ++t)
        if (outcomes[t].problem != Problem::none)
            first.report(outcomes[t].problem, outcomes[t].index, outcomes[t].value);
    return first;
}

}  // namespace armangle

#include "../names/end.hpp"
