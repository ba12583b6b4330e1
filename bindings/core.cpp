// The extension module: the arm, and the functions of the other files. No mathematics here.
#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include "buffers.hpp"
#include "offset_handle.hpp"
#include "watch.hpp"

namespace binding {

namespace {

/// Copies an array of exactly these extents; raises an error for any other.
void copy(nb::handle from, double* to, std::initializer_list<Py_ssize_t> extents) {
    const Buffer b(from);
    if (!b.is_array('d', extents))
        throw std::invalid_argument("a float64 array of another shape was expected");
    std::size_t count = 1;
    for (const Py_ssize_t extent : extents) count *= static_cast<std::size_t>(extent);
    std::memcpy(to, b.data<double>(), count * sizeof(double));
}

/// Reads the parameters of an arm. lengths: d_bs d_se d_ew d_wf a_3 a_4 d_4 (m); joint_map: sign, offset,
/// lower, upper, consecutively; base, tool: 16 numbers each; vector: for Reference::vector.
armangle::ArmParameters parameters(Floats lengths, Floats joint_map, Floats base, Floats tool,
                                   armangle::Reference reference, Floats vector) {
    armangle::ArmParameters p;
    double length[7], map[4 * armangle::joints], transform[16], along[3];
    copy(lengths, length, {7});
    p.d_bs = length[0];
    p.d_se = length[1];
    p.d_ew = length[2];
    p.d_wf = length[3];
    p.a_3 = length[4];
    p.a_4 = length[5];
    p.d_4 = length[6];
    copy(joint_map, map, {4 * armangle::joints});
    for (int i = 0; i < armangle::joints; ++i) {
        p.sign[i] = map[i];
        p.offset[i] = map[armangle::joints + i];
        p.limits.lower[i] = map[2 * armangle::joints + i];
        p.limits.upper[i] = map[3 * armangle::joints + i];
    }
    copy(base, transform, {4, 4});
    p.base = armangle::load_pose(transform);
    copy(tool, transform, {4, 4});
    p.tool = armangle::load_pose(transform);
    copy(vector, along, {3});
    p.reference = reference;
    p.reference_vector = {along[0], along[1], along[2]};
    return p;
}

/// Constructs an S-R-S arm from the arrays of parameters().
void construct(ArmHandle* self, Floats lengths, Floats joint_map, Floats base, Floats tool,
               armangle::Reference reference, Floats vector) {
    const armangle::Arm arm =
        armangle::make_arm(parameters(lengths, joint_map, base, tool, reference, vector));
    new (self) ArmHandle{arm, armangle::limit_table(arm)};
}

/// Constructs a nearly S-R-S arm from the arrays of parameters(); chain: eight transforms, 16 numbers each.
void construct_chain(ChainArmHandle* self, Floats lengths, Floats joint_map, Floats base, Floats tool,
                     armangle::Reference reference, Floats vector, Floats chain) {
    constexpr int links = armangle::joints + 1;
    double numbers[16 * links];
    armangle::Pose<double> link[links];
    copy(chain, numbers, {links, 4, 4});
    for (int k = 0; k < links; ++k) link[k] = armangle::load_pose(numbers + 16 * k);
    new (self) ChainArmHandle{
        armangle::make_near_arm(parameters(lengths, joint_map, base, tool, reference, vector), link)};
}

/// The middle of each joint's range (rad).
std::vector<double> joint_middle(const armangle::Arm& arm) {
    return {arm.joint_middle, arm.joint_middle + armangle::joints};
}

/// The deviation of each link from the nominal one, from base to end effector: position (m) and rotation
/// (rad).
std::vector<std::vector<double>> deviations(const ChainArmHandle& self) {
    std::vector<std::vector<double>> out;
    for (const armangle::LinkDeviation& d : self.arm.deviation) out.push_back({d.position, d.rotation});
    return out;
}

/// Binds the statuses as a Python IntEnum. It is pickled under its public name, which is the same for every
/// instruction set.
void bind_status(nb::module_& m) {
    using armangle::Status;
    nb::enum_<Status>(m, "Status", nb::is_arithmetic())
        .value("OK", Status::OK)
        .value("UNREACHABLE", Status::UNREACHABLE)
        .value("FOLDED", Status::FOLDED)
        .value("ELBOW_LIMIT", Status::ELBOW_LIMIT)
        .value("ELBOW_MARGIN", Status::ELBOW_MARGIN)
        .value("LIMITS", Status::LIMITS)
        .value("OUTSIDE", Status::OUTSIDE)
        .value("JOINT_JUMP", Status::JOINT_JUMP)
        .value("WINDING_EXHAUSTED", Status::WINDING_EXHAUSTED)
        .value("VELOCITY_LIMIT", Status::VELOCITY_LIMIT)
        .value("ACCELERATION_LIMIT", Status::ACCELERATION_LIMIT)
        .value("NOT_REACHED", Status::NOT_REACHED)
        .value("BAD_INPUT", Status::BAD_INPUT)
        .value("NOT_ALLOWED", Status::NOT_ALLOWED)
        .value("POSE_BLOCKED", Status::POSE_BLOCKED)
        .value("CLEARANCE", Status::CLEARANCE)
        .value("NEAR_SINGULAR", Status::NEAR_SINGULAR)
        .value("NO_CONVERGENCE", Status::NO_CONVERGENCE)
        .value("PARTIAL", Status::PARTIAL)
        .value("NO_POSTURE", Status::NO_POSTURE)
        .value("UNPROVEN", Status::UNPROVEN)
        .def_prop_ro(
            "solved", [](Status status) { return armangle::is_solved(status); },
            "Whether the pose has a solution within all limits.")
        .def_prop_ro(
            "sentence", [](Status status) { return armangle::sentence(status); },
            "The outcome as one sentence.");
}

/// Sets the progress function (done, total), or None, of this thread, and returns the previous one.
nb::object exchange_progress(nb::object function) {
    PyObject*& held = progress_of_this_thread();
    nb::object before = held ? nb::steal(held) : nb::none();
    held = function.is_none() ? nullptr : function.release().ptr();
    return before;
}

}  // namespace

/// The progress function of this thread; null if there is none.
PyObject*& progress_of_this_thread() noexcept {
    static thread_local PyObject* function = nullptr;
    return function;
}

}  // namespace binding

#define ARMANGLE_NAMED_MODULE(name, m) NB_MODULE(name, m)
/// Makes the Python module of the core.
ARMANGLE_NAMED_MODULE(ARMANGLE_MODULE, m) {
    namespace nb = nanobind;
    using binding::ArmHandle;
    nb::set_leak_warnings(
        false);  // values kept by module globals and tests live until exit, which is no leak
    m.attr("__version__") = ARMANGLE_VERSION;
    m.attr("JOINTS") = armangle::joints;
    m.attr("CONFIGURATIONS") = armangle::configurations;
    m.attr("ANGLE_TOLERANCE") = armangle::tolerance::angle;
    m.attr("ROTATION_TOLERANCE") = armangle::tolerance::rotation;
    m.attr("UNIT_TOLERANCE") = armangle::tolerance::unit;
    m.attr("LARGEST_ANGLE") = armangle::tolerance::largest_angle;
    m.attr("LIKELY_DEGREES") = armangle::likely_degrees;
    m.attr("FARTHEST") = armangle::tolerance::farthest;
    m.attr("LENGTH_LIMIT") = armangle::tolerance::length;
    m.attr("ARC_CAPACITY") = armangle::ArcSet::capacity;
    m.attr("MOST_MARGIN") = armangle::most_margin;
    m.attr("MAX_JOINT_STEP") = armangle::StepOptions{}.max_joint_step;
    m.def("exchange_progress", &binding::exchange_progress, nb::arg("function").none());
    binding::bind_status(m);
    binding::bind_refusal(m);
    nb::enum_<armangle::Reference>(m, "Reference")
        .value("BASE", armangle::Reference::base)
        .value("VECTOR", armangle::Reference::vector)
        .value("STEREOGRAPHIC", armangle::Reference::stereographic);
    binding::bind_poses(m);
    nb::class_<ArmHandle> arm(m, "Arm");
    arm.def("__init__", &binding::construct, nb::arg("lengths"), nb::arg("joint_map"), nb::arg("base"),
            nb::arg("tool"), nb::arg("reference"), nb::arg("vector"));
    arm.def_prop_ro("reach", [](const ArmHandle& a) { return a.arm.reach; });
    arm.def_prop_ro("inner_reach", [](const ArmHandle& a) { return a.arm.inner_reach; });
    arm.def("with_free_roll", [](const ArmHandle& a) {
        const armangle::Arm free = armangle::with_free_roll(a.arm);
        return ArmHandle{free, armangle::limit_table(free)};
    });
    arm.def_prop_ro("delta", [](const ArmHandle& a) { return a.arm.delta_angle; });
    arm.def_prop_ro("joint_middle", [](const ArmHandle& a) { return binding::joint_middle(a.arm); });
    using binding::ChainArmHandle;
    nb::class_<ChainArmHandle> near(m, "ChainArm");
    near.def("__init__", &binding::construct_chain, nb::arg("lengths"), nb::arg("joint_map"), nb::arg("base"),
             nb::arg("tool"), nb::arg("reference"), nb::arg("vector"), nb::arg("chain"));
    near.def_prop_ro("reach", [](const ChainArmHandle& a) { return a.arm.nominal.reach; });
    near.def_prop_ro("inner_reach", [](const ChainArmHandle& a) { return a.arm.nominal.inner_reach; });
    near.def_prop_ro("delta", [](const ChainArmHandle& a) { return a.arm.nominal.delta_angle; });
    near.def_prop_ro("joint_middle",
                     [](const ChainArmHandle& a) { return binding::joint_middle(a.arm.nominal); });
    near.def_prop_ro("deviations", &binding::deviations);
    nb::class_<binding::OffsetHandle> offset(m, "OffsetArm");
    offset.def("with_free_roll", [](const binding::OffsetHandle& a) {
        binding::OffsetHandle free = a;
        free.arm = with_free_roll(a.arm);
        return free;
    });
    nb::class_<binding::OffsetChainHandle> offset_chain(m, "OffsetChain");
    binding::bind_scenes(m, arm);
    binding::bind_kinematics(m, arm);
    binding::bind_arcs(m, arm);
    binding::bind_chain_kinematics(near);
    binding::bind_chain_arcs(near);
    binding::bind_chain_scenes(near);
    binding::bind_chain_reach(near);
    binding::bind_stepping(m, arm);
    binding::bind_chain_stepping(near);
    binding::bind_planning(m, arm);
    binding::bind_chain_planning(near);
    binding::bind_solving(m, arm);
    binding::bind_chain_solving(near);
    binding::bind_tracking(m);
    binding::bind_reach(m, arm);
    binding::bind_kuka(arm);
    binding::bind_offset(offset);
    binding::bind_offset_chain(offset_chain);
    binding::bind_xla(m, arm, near, offset, offset_chain);
}
