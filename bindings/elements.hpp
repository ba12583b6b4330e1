// One function over the elements of broadcast arrays, in threads.
#pragma once

#include "refusal.hpp"

namespace binding {

/// Applies one(inputs..., outputs...) to each element; the first problem is refused as one of `argument`.
template <int N, class One>
void for_each(const char* argument, const Buffer* const (&buffers)[N], const int (&inner)[N], int threads,
              const One& one) {
    const Grid<N> grid(buffers, inner);
    armangle::Outcome outcomes[armangle::most_threads];
    {
        nb::gil_scoped_release release;
        armangle::parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            grid.for_runs(
                begin, end,
                [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                    for (std::size_t i = 0; i < count; ++i) {
                        Py_ssize_t here[N];
                        for (int k = 0; k < N; ++k) here[k] = at[k] + static_cast<Py_ssize_t>(i) * step[k];
                        double value = 0;
                        const armangle::Problem problem = one(here, value);
                        if (problem != armangle::Problem::none)
                            outcomes[thread].report(problem, flat + i, value);
                    }
                });
        });
    }
    refuse(armangle::first_problem(outcomes, armangle::most_threads), *buffers[0], inner[0], argument);
}

}  // namespace binding
