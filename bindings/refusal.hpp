// How a call fails: one C++ exception, which one function converts to the Python error with its message.
#pragma once

#include <vector>

#include "buffers.hpp"

namespace binding {

/// The error of a call: the problem, the argument, the index in its batch, and the offending value.
struct Refusal {
    armangle::Problem problem;
    const char* argument;
    std::vector<Py_ssize_t> at;
    double value;
};

/// Whether a problem concerns a pose or quaternion alone, independent of other arguments.
inline bool is_in_one_value(armangle::Problem problem) noexcept {
    using armangle::Problem;
    for (const Problem one : {Problem::pose_not_finite, Problem::pose_last_row, Problem::pose_not_rotation,
                              Problem::pose_reflection, Problem::pose_too_far, Problem::pose_in_millimetres,
                              Problem::not_unit, Problem::unreachable, Problem::folded})
        if (problem == one) return true;
    return false;
}

/// Throws a Refusal if a problem was found in a batch. The batch axes are those of the argument `lead` before
/// its `inner` last ones. An axis along which it is repeated is left out of the index. `argument` names the
/// problem's argument; `joint_argument` is used if joint values are another one.
inline void refuse(const armangle::Outcome& found, const Buffer& lead, int inner, const char* argument,
                   const char* joint_argument = nullptr) {
    if (found.problem == armangle::Problem::none) return;
    const bool joints = joint_argument && (found.problem == armangle::Problem::joints_not_finite ||
                                           found.problem == armangle::Problem::joints_in_degrees);
    Refusal refusal{found.problem, joints ? joint_argument : argument, {}, found.value};
    auto rest = static_cast<Py_ssize_t>(found.index);
    for (int d = lead.ndim() - inner - 1; d >= 0; --d) {
        const bool repeated = lead.stride(d) == 0 && is_in_one_value(found.problem);
        if (!repeated) refusal.at.insert(refusal.at.begin(), rest % lead.shape(d));
        rest /= lead.shape(d);
    }
    throw refusal;
}

/// Throws a Refusal if a problem was found in a value without batch axes.
inline void refuse_one(armangle::Problem problem, const char* argument, double value) {
    if (problem != armangle::Problem::none) throw Refusal{problem, argument, {}, value};
}

}  // namespace binding
