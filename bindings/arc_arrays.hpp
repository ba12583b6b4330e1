// Arc sets stored in flat arrays: count per set, and the two angles of every arc.
#pragma once

#include <vector>

#include "buffers.hpp"

namespace binding {

class ArcArrays {
public:
    /// Views numbers of arcs (sets,) and their ends (arcs, 2), rad; only the types are checked.
    ArcArrays(nb::handle count, nb::handle psi) : count_(count), psi_(psi) {
        if (!count_.is('l') || !psi_.is('d'))
            throw std::invalid_argument("arc arrays of int64 and float64 were expected");
        first_.reserve(static_cast<std::size_t>(count_.shape(0)));
        for (Py_ssize_t i = 0; i < count_.shape(0); ++i) {
            first_.push_back(arcs_);
            arcs_ += static_cast<std::size_t>(count_.data<long long>()[i]);
        }
    }

    /// The number of sets.
    std::size_t sets() const noexcept { return first_.size(); }
    /// The number of arcs of all sets.
    std::size_t arcs() const noexcept { return arcs_; }
    /// The index of the first arc of a set.
    std::size_t first(long long set) const noexcept { return first_[static_cast<std::size_t>(set)]; }

    /// Reads set number `set`; its ends are tagged tag, tag + 1, ..., those of a full circle are not.
    armangle::ArcSet load(long long set, int tag) const noexcept {
        armangle::ArcSet out;
        const long long n = count_.data<long long>()[set];
        const double* x = psi_.data<double>() + 2 * first(set);
        if (n == 1 && x[1] - x[0] >= armangle::two_pi - armangle::tolerance::angle) {
            armangle::make_full(out);
            return out;
        }
        for (out.count = 0; out.count < n; ++out.count)
            out.arc[out.count] = {x[2 * out.count], x[2 * out.count + 1],
                                  static_cast<armangle::Tag>(tag + 2 * out.count),
                                  static_cast<armangle::Tag>(tag + 2 * out.count + 1)};
        return out;
    }

private:
    Buffer count_, psi_;
    std::vector<std::size_t> first_;
    std::size_t arcs_ = 0;
};

}  // namespace binding
