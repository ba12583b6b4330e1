// Rows of a path that was found step by step.
#pragma once

#include <cstddef>
#include <vector>

#include "../names/begin.hpp"

namespace armangle {

/// Parameters, continuous arm angle (or free joint of an offset arm), joints, and branches.
struct PathRows {
    std::vector<double> s, psi, q;  // q: (n, 7)
    std::vector<int> gc;

    std::size_t size() const noexcept { return s.size(); }
};

}  // namespace armangle

#include "../names/end.hpp"
