#include "refusal.hpp"

namespace binding {

namespace {

PyObject* error_maker = nullptr;

/// Sets the Python error of a refusal.
void set_python_error(const Refusal& refusal) {
    if (!error_maker) throw std::runtime_error("no function makes errors of refusals");
    nb::list at;
    for (const Py_ssize_t index : refusal.at) at.append(index);
    const nb::object error =
        nb::handle(error_maker)(refusal.problem, refusal.argument, nb::tuple(at), refusal.value);
    PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(error.ptr())), error.ptr());
}

/// Translates a Refusal to its Python error; other exceptions are thrown again.
void translate(const std::exception_ptr& thrown, void*) {
    try {
        std::rethrow_exception(thrown);
    } catch (const Refusal& refusal) {
        try {
            set_python_error(refusal);
        } catch (nb::python_error& error) { error.restore(); }
    }
}

}  // namespace

/// Registers Problem, the translation of a Refusal, and on_refusal(function), which sets the function that
/// makes errors.
void bind_refusal(nb::module_& m) {
    using armangle::Problem;
    nb::enum_<Problem>(m, "Problem")
        .value("NONE", Problem::none)
        .value("POSE_NOT_FINITE", Problem::pose_not_finite)
        .value("POSE_LAST_ROW", Problem::pose_last_row)
        .value("POSE_NOT_ROTATION", Problem::pose_not_rotation)
        .value("POSE_REFLECTION", Problem::pose_reflection)
        .value("POSE_TOO_FAR", Problem::pose_too_far)
        .value("POSE_IN_MILLIMETRES", Problem::pose_in_millimetres)
        .value("PSI_NOT_FINITE", Problem::psi_not_finite)
        .value("GC_RANGE", Problem::gc_range)
        .value("JOINTS_NOT_FINITE", Problem::joints_not_finite)
        .value("JOINTS_IN_DEGREES", Problem::joints_in_degrees)
        .value("UNREACHABLE", Problem::unreachable)
        .value("FOLDED", Problem::folded)
        .value("JOINT_LIMIT", Problem::joint_limit)
        .value("STILL", Problem::still)
        .value("ON_AXIS", Problem::on_axis)
        .value("NOT_UNIT", Problem::not_unit)
        .value("NEAR_SINGULAR", Problem::near_singular)
        .value("NO_CONVERGENCE", Problem::no_convergence)
        .value("ON_END", Problem::on_end)
        .value("NO_POSTURE", Problem::no_posture)
        .value("NO_DERIVATIVE", Problem::no_derivative);
    nb::register_exception_translator(&translate);
    m.def(
        "on_refusal",
        [](nb::typed<nb::callable,
                     nb::object(Problem, const char*, nb::typed<nb::tuple, int, nb::ellipsis>, double)>
               function) {
            Py_XDECREF(error_maker);
            error_maker = function.release().ptr();
        },
        nb::arg("function"));
}

}  // namespace binding
