// Poses from positions and orientations in common notations.
#include "elements.hpp"

namespace binding {

using namespace armangle;

namespace {

/// The notation of an orientation.
enum class Orientation : int { wxyz, xyzw, rpy, rotvec };

/// Reports the first of `count` numbers that is not finite, in `value`.
Problem check_finite(const double* x, int count, double& value) noexcept {
    for (int i = 0; i < count; ++i) {
        value = x[i];
        if (!std::isfinite(value)) return Problem::pose_not_finite;
    }
    return Problem::none;
}

/// Reports numbers that are not finite or too large, or a quaternion that is not of length 1, in `value`.
Problem check_orientation(Orientation kind, const double* x, double& value) noexcept {
    if (kind == Orientation::wxyz || kind == Orientation::xyzw) {
        const Problem problem = check_finite(x, 4, value);
        if (problem != Problem::none) return problem;
        value = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
        return std::fabs(value - 1.0) <= tolerance::unit ? Problem::none : Problem::not_unit;
    }
    for (int i = 0; i < 3; ++i) {
        value = x[i];
        if (!(std::fabs(value) <= tolerance::largest_angle)) return Problem::joints_not_finite;
    }
    return Problem::none;
}

/// The rotation matrix of an orientation in this convention.
Mat3<double> rotation_of(Orientation kind, const double* x) noexcept {
    switch (kind) {
        case Orientation::wxyz: return from_quaternion(x[0], x[1], x[2], x[3]);
        case Orientation::xyzw: return from_quaternion(x[3], x[0], x[1], x[2]);
        case Orientation::rpy: return from_rpy(x[0], x[1], x[2]);
        case Orientation::rotvec: break;
    }
    return from_rotation_vector({x[0], x[1], x[2]});
}

/// Writes poses at position 0 of orientations in one notation; raises for invalid numbers, with the
/// argument's `name`.
void rotations_many(Orientation kind, Floats numbers, Floats out, const char* name) {
    const Buffer in(numbers), to(out, true);
    for_each<2>(name, {&in, &to}, {1, 2}, 1, [&](const Py_ssize_t* at, double& value) {
        const double* x = in.data<double>() + at[0];
        const Problem problem = check_orientation(kind, x, value);
        if (problem == Problem::none)
            store_pose({rotation_of(kind, x), {0, 0, 0}}, to.data<double>() + at[1]);
        return problem;
    });
}

/// Raises an error for poses (..., 4, 4) that are not rigid.
void check_transforms(Floats poses, const char* argument) {
    const Buffer p(poses);
    for_each<1>(argument, {&p}, {2}, 1, [&](const Py_ssize_t* at, double& value) {
        return check_pose(p.data<double>() + at[0], value);
    });
}

}  // namespace

/// Registers Orientation, check_transforms and rotations_many.
void bind_poses(nb::module_& m) {
    using namespace nb::literals;
    nb::enum_<Orientation>(m, "Orientation")
        .value("WXYZ", Orientation::wxyz)
        .value("XYZW", Orientation::xyzw)
        .value("RPY", Orientation::rpy)
        .value("ROTVEC", Orientation::rotvec);
    m.def("check_transforms", &check_transforms, "poses"_a, "argument"_a);
    m.def("rotations_many", &rotations_many, "kind"_a, "numbers"_a, "out"_a, "name"_a);
}

}  // namespace binding
