// How a call fails: one exception, made into the Python error by the one function that has the words.
#pragma once

#include <vector>

#include "buffers.hpp"

namespace binding {

/// What is wrong, with which argument, where in its batch, and the value that shows it.
struct Refusal {
    armangle::Problem problem;
    const char* argument;
    std::vector<Py_ssize_t> at;
    double value;
};

/// Throws where a problem was found in a batch. The batch axes are those of `lead` before its `inner` last
/// ones. `argument` is what the problem is about; `joint_argument` where joint values are another one.
inline void refuse(const armangle::Outcome& found, const Buffer& lead, int inner, const char* argument,
                   const char* joint_argument = nullptr) {
    if (found.problem == armangle::Problem::none) return;
    const bool joints = joint_argument && found.problem == armangle::Problem::joints_not_finite;
    Refusal refusal{found.problem, joints ? joint_argument : argument, {}, found.value};
    const int axes = lead.ndim() - inner;
    refusal.at.resize(static_cast<std::size_t>(axes));
    auto rest = static_cast<Py_ssize_t>(found.index);
    for (int d = axes - 1; d >= 0; --d) {
        refusal.at[static_cast<std::size_t>(d)] = rest % lead.shape(d);
        rest /= lead.shape(d);
    }
    throw refusal;
}

/// Throws where a problem was found in a value that is no batch.
inline void refuse_one(armangle::Problem problem, const char* argument, double value) {
    if (problem != armangle::Problem::none) throw Refusal{problem, argument, {}, value};
}

}  // namespace binding
