// Redundancy resolution, step and follow.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <vector>

#include "arc_arrays.hpp"
#include "offset_handle.hpp"
#include "refusal.hpp"
#include "scene_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

constexpr double longest_step = 1e9;  // s

/// Makes a policy.
void make_policy(Policy* self, Rule rule, double K, double alpha, Outside outside) {
    new (self) Policy{rule, K, alpha, outside};
}

/// The policy for an elbow target: `target` is a point or a direction, psi is for Wish::psi.
Policy towards(Wish wish, double psi, Floats target, double K, Outside outside) {
    const Buffer at(target);
    if (!at.is_array('d', {3})) throw std::invalid_argument("3 numbers were expected");
    const double* v = at.data<double>();
    return {Rule::towards, K, Policy{}.alpha, outside, {wish, psi, {v[0], v[1], v[2]}}};
}

/// Writes whether a word is `yes` to is_yes; false if it is neither `yes` nor `no`.
bool read_word(nb::handle word, const char* no, const char* yes, bool& is_yes) noexcept {
    if (!PyUnicode_CheckExact(word.ptr())) return false;
    is_yes = PyUnicode_CompareWithASCIIString(word.ptr(), yes) == 0;
    return is_yes || PyUnicode_CompareWithASCIIString(word.ptr(), no) == 0;
}

/// Reads the options of a step in their usual form: gc None or 0..7, carry "psi" or "elbow", max_joint_step
/// None or a float > 0, the margin a float, dt None or a float > 0, outside "refuse" or "nearest". False for
/// anything else: the general function then converts it or raises the error.
bool read_options(nb::handle gc, nb::handle carry, nb::handle max_joint_step, nb::handle singularity_margin,
                  nb::handle dt, nb::handle outside, StepOptions& o, double& margin) noexcept {
    if (!gc.is_none()) {
        if (!PyLong_CheckExact(gc.ptr())) return false;
        int overflow = 0;
        const long index = PyLong_AsLongAndOverflow(gc.ptr(), &overflow);
        if (overflow || index < 0 || index >= configurations) return false;
        o.gc = static_cast<int>(index);
    }
    bool elbow = false;
    if (!read_word(carry, "psi", "elbow", elbow) || !read_word(outside, "refuse", "nearest", o.nearest))
        return false;
    o.carry = elbow ? Carry::elbow : Carry::psi;
    if (!dt.is_none()) {
        if (!PyFloat_CheckExact(dt.ptr())) return false;
        o.dt = PyFloat_AS_DOUBLE(dt.ptr());
        if (!(o.dt > 0 && o.dt <= longest_step)) return false;
    }
    o.max_joint_step = default_joint_step(o.dt);
    if (!max_joint_step.is_none()) {
        if (!PyFloat_CheckExact(max_joint_step.ptr())) return false;
        o.max_joint_step = PyFloat_AS_DOUBLE(max_joint_step.ptr());
        if (!(o.max_joint_step > 0)) return false;
    }
    if (!PyFloat_CheckExact(singularity_margin.ptr())) return false;
    margin = PyFloat_AS_DOUBLE(singularity_margin.ptr());
    return margin >= 0 && margin <= most_margin;
}

/// Reads bounds from Python: 22 numbers, dt, velocities, accelerations, present velocities; or None.
struct GivenBounds {
    Bounds value{};

    /// Reads dt, velocities, accelerations and present velocities (22 numbers) into the options.
    GivenBounds(nb::handle given, StepOptions& options) {
        if (given.is_none()) return;
        const Buffer numbers(given);
        if (!numbers.is_array('d', {1 + 3 * joints})) throw std::invalid_argument("22 numbers were expected");
        const double* x = numbers.data<double>();
        value.dt = x[0];
        for (int j = 0; j < joints; ++j) {
            value.velocity[j] = x[1 + j];
            value.acceleration[j] = x[1 + joints + j];
            value.velocity_now[j] = x[1 + 2 * joints + j];
        }
        options.bounds = &value;
    }
};

/// The arm's own limits, or a table with a margin.
struct LimitsWithMargin {
    std::optional<LimitTable> with_margin;
    const LimitTable& table;

    /// The arm's table of limits, or one with a margin (rad).
    LimitsWithMargin(const ArmHandle& arm, double margin)
        : with_margin(margin == 0 ? std::nullopt : std::optional(limit_table(arm.arm, margin))),
          table(with_margin ? *with_margin : arm.limits) {}
};

/// Makes one step of an S-R-S arm within limits with a margin (rad).
Step next_step(const ArmHandle& self, double margin, const double* q, const Pose<double>& pose,
               const StepOptions& options) noexcept {
    const LimitsWithMargin limits(self, margin);
    return step(self.arm, limits.table, q, pose, options);
}

/// The functions for steps of an arm with an offset, whose own margin counts, not the second argument.
template <class Handle>
auto steps_of(const Handle& self, double) noexcept {
    return armangle::steps_of(self.arm);
}
/// The functions for steps of an arm on its own chain, with a singularity margin (rad).
ChainSteps steps_of(const ChainArmHandle& self, double margin) noexcept { return {self.arm, margin}; }

/// Makes one step of any other kind of arm.
template <class Handle>
Step next_step(const Handle& self, double margin, const double* q, const Pose<double>& pose,
               const StepOptions& options) noexcept {
    return step(steps_of(self, margin), q, pose, options);
}

/// Removes the rounding (relative, `precision`) of a pose: makes its rotation exact, and moves a wrist that
/// only rounding puts beyond the reach or the limit of joint 4 back to it, unless the arm has an offset.
/// Precision 0: the pose unchanged.
template <class Handle>
Pose<double> as_meant(const Handle& self, const Pose<double>& pose, double precision) noexcept {
    return precision > 0 ? within_rounding(reaching(self.arm), pose, precision) : pose;
}

/// Seven NaN, for unknown velocities; the array is kept for the lifetime of the process and read-only.
nb::object no_velocity() {
    static PyObject* kept =
        [] {
            const nb::object array = new_array7();
            const Buffer to(array, true);
            for (int j = 0; j < joints; ++j) to.data<double>()[j] = not_a_number;
            array.attr("setflags")(false);
            return array;
        }()
            .release()
            .ptr();
    return nb::borrow(kept);
}

/// Makes one step: a named tuple `kind` of (q, psi, gc, status of `statuses`, margin, velocity, why). None if
/// q or pose is no small matrix, or an option has no usual form: the general function then converts them or
/// raises the error.
template <class Handle>
nb::object step_one(const Handle& self, nb::handle q_now, nb::handle pose, const Policy& policy,
                    nb::handle gc, nb::handle carry, nb::handle max_joint_step, nb::handle singularity_margin,
                    nb::handle dt, nb::handle outside, nb::handle allowed_count, nb::handle allowed_psi,
                    nb::handle bounds, nb::handle kind, nb::handle statuses, const SceneHandle* scene) {
    double q[joints], m[16], value = 0, margin = 0;
    StepOptions options;
    options.policy = policy;
    SmallMatrix matrix;
    if (!SmallMatrix().read(q_now, 1, joints, q) || !matrix.read(pose, 4, 4, m)) return nb::none();
    if (!read_options(gc, carry, max_joint_step, singularity_margin, dt, outside, options, margin))
        return nb::none();
    Problem problem = check_pose(self.arm, m, value);
    refuse_one(problem, "pose", value);
    problem = check_joints(self.arm, q, value);
    refuse_one(problem, "q_now", value);
    ArcSet allowed;
    if (!allowed_count.is_none()) {
        allowed = ArcArrays(allowed_count, allowed_psi).load(0, 0);
        options.allowed = &allowed;
    }
    options.scene = scene ? &scene->view : nullptr;
    const GivenBounds given(bounds, options);
    const Step next = next_step(self, margin, q, as_meant(self, load_pose(m), matrix.precision()), options);
    const auto seven = [](const double* values) {
        nb::object array = new_array7();
        const Buffer to(array, true);
        std::memcpy(to.data<double>(), values, joints * sizeof(double));
        return array;
    };
    const auto named = [&statuses](Status status) {
        PyObject* name = PyTuple_GetItem(statuses.ptr(), static_cast<Py_ssize_t>(status));
        if (!name) throw nb::python_error();
        return nb::handle(name);
    };
    return new_named(kind, seven(next.q), next.psi, next.gc, named(next.status), next.margin,
                     dt.is_none() ? no_velocity() : seven(next.velocity), named(next.why));
}

/// Arguments of `follow` besides the poses.
struct FollowOptions {
    StepOptions step;
    double singularity_margin;
    OnFail on_fail;
    std::size_t lookahead;
};

/// Makes the options of a sequence of steps.
void make_follow_options(FollowOptions* self, const Policy& policy, std::optional<int> gc, Carry carry,
                         std::optional<double> max_joint_step, double singularity_margin,
                         std::optional<double> dt, bool nearest, OnFail on_fail, std::size_t lookahead) {
    new (self) FollowOptions{{}, singularity_margin, on_fail, lookahead};
    StepOptions& step = self->step;
    step.policy = policy;
    step.carry = carry;
    if (gc) step.gc = *gc;
    if (dt) step.dt = *dt;
    step.max_joint_step = max_joint_step ? *max_joint_step : default_joint_step(step.dt);
    step.nearest = nearest;
}

/// Columns that `follow` fills, one row a pose: q, psi, gc, status, margin, residual.
using FollowColumns = nb::typed<nb::tuple, Floats, Floats, Ints, Codes, Floats, Floats>;

/// None, one for all poses, or one a pose.
using Scenes = Strided<const Scene* const>;

/// The poses to follow, and the options for each of them.
struct Asked {
    const double* poses;
    std::size_t n;
    const StepOptions& options;
    Strided<const ArcSet> allowed;
    Scenes scenes;
};

/// Calls run(ahead), without the interpreter's lock: `ahead` sees `window` coming poses, null if that is 0.
template <class View, class Run>
void with_window(const View& view, std::size_t window, const Asked& asked, const Run& run) {
    std::vector<typename View::Section> sections(window ? Lookahead<View>::sections_for(window) : 0);
    Lookahead<View> ahead(view, asked.poses, asked.n, asked.allowed, asked.scenes, asked.options.bounds,
                          asked.options.max_joint_step, sections.data(), window);
    nb::gil_scoped_release release;
    run(window ? &ahead : nullptr);
}

/// Follows the poses with an S-R-S arm and fills the rows.
void run(const ArmHandle& self, const double* start, const FollowOptions& wanted, const Asked& asked,
         const FollowRows& rows) {
    const LimitsWithMargin limits(self, wanted.singularity_margin);
    with_window(ExactSections{self.arm, limits.table}, wanted.lookahead, asked, [&](auto* ahead) {
        follow(self.arm, limits.table, start, asked.poses, asked.n, asked.options, wanted.on_fail,
               asked.allowed, rows, ahead, asked.scenes);
    });
}

/// Follows the poses with any other kind of arm and fills the rows.
template <class Handle>
void run(const Handle& self, const double* start, const FollowOptions& wanted, const Asked& asked,
         const FollowRows& rows) {
    const auto family = steps_of(self, wanted.singularity_margin);
    with_window(FamilySections{family}, wanted.lookahead, asked, [&](auto* ahead) {
        follow(family, start, asked.poses, asked.n, asked.options, wanted.on_fail, asked.allowed, rows, ahead,
               asked.scenes);
    });
}

/// Follows poses (n, 4, 4) from the joints `start` and fills the columns; raises for an invalid pose or
/// start. `scenes`: none, one for all poses, or one a pose.
template <class Handle>
void follow_all(const Handle& self, Floats start, Floats poses, const FollowOptions& wanted,
                Ints allowed_count, Floats allowed_psi, Floats bounds, const FollowColumns& columns,
                const std::vector<const SceneHandle*>& scenes) {
    const Buffer s(start), p(poses), q_out(columns[0], true), psi_out(columns[1], true),
        gc_out(columns[2], true), status_out(columns[3], true), margin_out(columns[4], true),
        residual_out(columns[5], true);
    const auto n = static_cast<std::size_t>(p.shape(0));
    Outcome outcome;
    for (std::size_t i = 0; i < n && outcome.problem == Problem::none; ++i) {
        double value = 0;
        const Problem problem = check_pose(self.arm, p.data<double>() + 16 * i, value);
        if (problem != Problem::none) outcome.report(problem, i, value);
    }
    refuse(outcome, p, 2, "pose");
    double value = 0;
    const Problem begin = check_joints(self.arm, s.data<double>(), value);
    refuse_one(begin, "start", value);
    std::vector<ArcSet> sets;
    if (!allowed_count.is_none()) {
        const ArcArrays arrays(allowed_count, allowed_psi);
        for (std::size_t i = 0; i < arrays.sets(); ++i)
            sets.push_back(arrays.load(static_cast<long long>(i), 0));
    }
    Watch watch(n);
    const FollowRows rows{q_out.data<double>(),
                          psi_out.data<double>(),
                          margin_out.data<double>(),
                          residual_out.data<double>(),
                          gc_out.data<long long>(),
                          status_out.data<std::int8_t>(),
                          [](void* who, std::size_t row) noexcept {
                              return row > 0 && static_cast<Watch*>(who)->ended(0, row);
                          },
                          &watch};
    const Strided<const ArcSet> allowed{sets.empty() ? nullptr : sets.data(), sets.size() > 1 ? 1 : 0};
    StepOptions options = wanted.step;
    const GivenBounds given(bounds, options);
    std::vector<const Scene*> views;
    for (const SceneHandle* scene : scenes) views.push_back(&scene->view);
    const Scenes about{views.empty() ? nullptr : views.data(), views.size() > 1 ? 1 : 0};
    run(self, s.data<double>(), wanted, {p.data<double>(), n, options, allowed, about}, rows);
    watch.raise();
}

/// Binds step_one and follow_all.
template <class Handle>
void bind_stepping_of(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("step_one", &step_one<Handle>, "q_now"_a.none(), "pose"_a.none(), "policy"_a, "gc"_a.none(),
            "carry"_a.none(), "max_joint_step"_a.none(), "singularity_margin"_a.none(), "dt"_a.none(),
            "outside"_a.none(), "allowed_count"_a.none(), "allowed_psi"_a.none(), "bounds"_a.none(), "kind"_a,
            "statuses"_a, "scene"_a.none());
    arm.def("follow_all", &follow_all<Handle>, "start"_a, "poses"_a, "options"_a, "allowed_count"_a.none(),
            "allowed_psi"_a.none(), "bounds"_a.none(), "columns"_a, "scenes"_a);
}

/// Writes the next psi of each (set, psi), by eq. (36) or another rule; for an elbow's target, `wish` is its
/// psi. kept_count, kept_arcs: None, or sets of arcs on which the policy acts if they lie in the same arcs.
void resolve_many(const Policy& policy, Ints count, Floats psi_arcs, Ints kept_count, Floats kept_arcs,
                  Ints index, Floats psi, Floats wish, Floats out, Codes status) {
    const ArcArrays arcs(count, psi_arcs);
    std::optional<ArcArrays> kept;
    if (!kept_count.is_none()) kept.emplace(kept_count, kept_arcs);
    const Buffer i(index), x(psi), to(out, true), code(status, true);
    Buffer wished;
    if (!wish.is_none()) wished.get(wish);
    Policy now = policy;
    for (Py_ssize_t k = 0; k < i.shape(0); ++k) {
        if (wished.held()) now.towards = {Wish::psi, wished.data<double>()[k], {}};
        const long long at = i.data<long long>()[k];
        const double here = x.data<double>()[k];
        const Resolution r = kept ? resolve(now, arcs.load(at, 0), kept->load(at, 0), here)
                                  : resolve(now, arcs.load(at, 0), here);
        to.data<double>()[k] = r.psi;
        code.data<std::int8_t>()[k] = static_cast<std::int8_t>(r.status);
    }
}

}  // namespace

/// Binds the steps of a nearly S-R-S arm.
void bind_chain_stepping(nb::class_<ChainArmHandle>& arm) { bind_stepping_of(arm); }
/// Binds the steps of an arm with an offset.
void bind_offset_stepping(nb::class_<OffsetHandle>& arm) { bind_stepping_of(arm); }
/// Binds the steps of an arm with an offset and its own chain.
void bind_offset_chain_stepping(nb::class_<OffsetChainHandle>& arm) { bind_stepping_of(arm); }

/// Registers Rule, Outside, Carry, OnFail, Policy, FollowOptions, resolve_many and gain, and the steps of an
/// S-R-S arm.
void bind_stepping(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Rule>(m, "Rule")
        .value("REPULSION", Rule::repulsion)
        .value("HOLD", Rule::hold)
        .value("CENTRE", Rule::centre)
        .value("TOWARDS", Rule::towards);
    nb::enum_<Outside>(m, "Outside")
        .value("NEAREST", Outside::nearest)
        .value("STOP", Outside::stop)
        .value("ESCAPE", Outside::escape);
    nb::enum_<Carry>(m, "Carry").value("PSI", Carry::psi).value("ELBOW", Carry::elbow);
    nb::enum_<OnFail>(m, "OnFail")
        .value("STOP", OnFail::stop)
        .value("HOLD", OnFail::hold)
        .value("SKIP", OnFail::skip);
    nb::class_<Policy>(m, "Policy")
        .def("__init__", &make_policy, "rule"_a, "K"_a, "alpha"_a, "outside"_a)
        .def_static("towards", &towards, "wish"_a, "psi"_a, "target"_a, "K"_a, "outside"_a);
    nb::class_<FollowOptions>(m, "FollowOptions")
        .def("__init__", &make_follow_options, "policy"_a, "gc"_a.none(), "carry"_a,
             "max_joint_step"_a.none(), "singularity_margin"_a, "dt"_a.none(), "nearest"_a, "on_fail"_a,
             "lookahead"_a);
    m.attr("LONGEST_STEP") = longest_step;
    bind_stepping_of(arm);
    m.def("resolve_many", &resolve_many, "policy"_a, "count"_a, "psi_arcs"_a, "kept_count"_a.none(),
          "kept_arcs"_a.none(), "index"_a, "psi"_a, "wish"_a.none(), "out"_a, "status"_a);
    m.def("gain", &gain, "rate"_a, "dt"_a);
}

}  // namespace binding
