// Long calls that stay responsive: Ctrl-C ends them, and a progress function is called.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "armangle/batch/parallel.hpp"
#include "buffers.hpp"

namespace binding {

/// The function (done, total) that reports progress of the Python call in this thread; null: none.
PyObject*& progress_of_this_thread() noexcept;

/// One call of the core. All its threads call `ended()` between pieces of work. The calling thread, which
/// alone may run Python's signal handlers, reads the clock after pieces of some 0.1 ms in total, and calls
/// Python every 0.05 s.
class Watch {
public:
    /// Watches a computation of `total` elements.
    explicit Watch(std::size_t total = 0) noexcept
        : total_(total), progress_(total ? progress_of_this_thread() : nullptr) {}
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    /// Whether the call must end; called by a thread that has finished `done` of its elements.
    bool ended(std::size_t thread, std::size_t done) noexcept {
        done_[thread].count.store(done, std::memory_order_relaxed);
        if (thread == 0 && --left_ == 0) look();  // parallel() gives the calling thread this number
        return ended_.load(std::memory_order_relaxed);
    }
    /// Whether the call must end; called by a thread without a number.
    bool ended() noexcept {
        if (std::this_thread::get_id() == caller_ && --left_ == 0) look();
        return ended_.load(std::memory_order_relaxed);
    }

    /// Counts one more finished element, in any thread.
    void advance() noexcept { done_[0].count.fetch_add(1, std::memory_order_relaxed); }

    /// Runs Python's signal handlers and reports progress now; if one of them raises, the call has ended().
    /// For the calling thread alone.
    void ask() noexcept {
        asked_ = Clock::now();
        const nb::gil_scoped_acquire held;
        if (PyErr_CheckSignals() != 0 || !report_progress()) ended_.store(true, std::memory_order_relaxed);
    }

    /// Throws the exception that ended the call, or that of a last report of progress; the interpreter's lock
    /// must be held.
    void raise() {
        if (ended_.load(std::memory_order_relaxed)) throw nb::python_error();
        if (progress_ && !report_progress(total_)) throw nb::python_error();
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr auto piece = std::chrono::microseconds(100);
    static constexpr auto patience = std::chrono::milliseconds(50);
    static constexpr unsigned longest_stride = 4096;

    /// Sets the number of pieces until the next look at the clock to some 0.1 ms, or to one if they became
    /// slow.
    void look() noexcept {
        const Clock::time_point now = Clock::now();
        stride_ = now - looked_ < piece ? std::min(2 * stride_, longest_stride) : 1u;
        left_ = stride_;
        looked_ = now;
        if (now - asked_ < patience || ended_.load(std::memory_order_relaxed)) return;
        ask();
        looked_ = Clock::now();
    }

    /// Reports progress; false if the caller's function raised.
    bool report_progress() noexcept {
        if (!progress_) return true;
        std::size_t done = 0;
        for (const Count& one : done_) done += one.count.load(std::memory_order_relaxed);
        return report_progress(done < total_ ? done : total_);
    }
    /// Reports that `done` elements are done; false if the caller's function raised.
    bool report_progress(std::size_t done) noexcept {
        progress_of_this_thread() = nullptr;  // functions that it calls have no progress function
        PyObject* result = PyObject_CallFunction(progress_, "nn", static_cast<Py_ssize_t>(done),
                                                 static_cast<Py_ssize_t>(total_));
        progress_of_this_thread() = progress_;
        Py_XDECREF(result);
        return result != nullptr;
    }

    struct alignas(64) Count {  // on its own cache line: threads write without waiting for one another
        std::atomic<std::size_t> count{0};
    };
    const std::thread::id caller_ = std::this_thread::get_id();
    const std::size_t total_;
    PyObject* const progress_;
    std::atomic<bool> ended_{false};
    Count done_[armangle::most_threads];
    Clock::time_point looked_ = Clock::now(), asked_ = looked_;
    unsigned stride_ = 1, left_ = 1;
};

/// Runs parallel(n, threads, work) with the interpreter's lock released. work(begin, end, thread, watch)
/// calls watch.ended between its elements. Throws what a signal handler raised.
template <class Work>
void watched(std::size_t n, int threads, const Work& work) {
    Watch watch(n);
    {
        const nb::gil_scoped_release release;
        armangle::parallel(
            n, threads,
            [&](std::size_t begin, std::size_t end, std::size_t thread) { work(begin, end, thread, watch); },
            [&] { watch.ask(); });
    }
    watch.raise();
}

}  // namespace binding
