// The nearest solution of a pose, and one for each branch and arc.
#include <vector>

#include "arc_arrays.hpp"
#include "collected.hpp"
#include "elements.hpp"
#include "offset_handle.hpp"
#include "refusal.hpp"
#include "scene_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

/// The options of a search that are common to all poses.
struct SolveOptions {
    Metric metric;
    double weight[joints];
    unsigned branches;
    double margin;
    double length;  // m that count as one radian for an approximate solution; 0: none
};

/// Makes options from seven weights, bits of branches, a margin (rad) and a length (m).
void make_solve_options(SolveOptions* self, Metric metric, Floats weight, unsigned branches, double margin,
                        double length) {
    const Buffer w(weight);
    if (!w.is_array('d', {joints})) throw std::invalid_argument("7 weights were expected");
    new (self) SolveOptions{metric, {}, branches, margin, length};
    std::memcpy(self->weight, w.data<double>(), sizeof(self->weight));
}

/// The core's options: metric, weights and branches of `o`, a seed (null: none) and allowed arcs (null: all).
NearestOptions nearest_options(const SolveOptions& o, const double* near, const ArcSet* allowed) noexcept {
    NearestOptions out;
    out.metric = o.metric;
    out.near = near;
    for (int j = 0; j < joints; ++j) out.weight[j] = o.weight[j];
    out.branches = o.branches;
    out.allowed = allowed;
    return out;
}

/// The constraints of an arm with its own chain or an offset: a singularity margin (rad), and a scene; null:
/// none.
struct KeptOff {
    double margin;
    const Scene* scene;
};

/// The limits of an S-R-S arm with a margin (rad).
LimitTable limits_with(const ArmHandle& arm, double margin, const Scene*) {
    return margin == 0 ? arm.limits : limit_table(arm.arm, arm.arm.limits, margin);
}
/// The constraints of any other arm: margin (rad) and scene.
template <class Handle>
KeptOff limits_with(const Handle&, double margin, const Scene* scene) {
    return {margin, scene};
}
/// The table of the arm's limits, without a margin.
const LimitTable& own_limits(const ArmHandle& arm) { return arm.limits; }
/// What an arm with its own chain uses instead of a table of limits: a margin of 0.
double own_limits(const ChainArmHandle&) { return 0.0; }

/// The nearest solution within the arm's own limits.
template <class Handle>
Nearest nearest_of(const Handle& self, const Pose<double>& pose, const NearestOptions& options) noexcept {
    return nearest_posture(self.arm, own_limits(self), pose, options);
}
template <class Handle>
    requires free_joint_arm<decltype(Handle::arm)>
/// The nearest solution within the arm's own limits.
Nearest nearest_of(const Handle& self, const Pose<double>& pose, const NearestOptions& options) noexcept {
    return nearest_posture(self.arm, pose, options);
}

/// The arguments of a search over a batch: poses, seeds (or none) and allowed arcs (or none, or one set for
/// all). Each is checked when it is used.
template <class Handle>
class Work {
public:
    /// Acquires the arrays and reads the allowed arcs.
    Work(const Handle& arm, Floats pose, Floats near, Ints allowed_count, Floats allowed_psi,
         const SolveOptions& o, const SceneHandle* scene)
        : arm_(arm),
          options_(o),
          scene_(scene ? &scene->view : nullptr),
          limits_(limits_with(arm, o.margin, scene_)) {
        pose_.get(pose);
        if (!near.is_none()) near_.get(near);
        if (allowed_count.is_none()) return;
        const ArcArrays arrays(allowed_count, allowed_psi);
        for (std::size_t i = 0; i < arrays.sets(); ++i)
            allowed_.push_back(arrays.load(static_cast<long long>(i), 0));
    }

    /// Whether joints that solve a pose are free of collisions; of other arms the search asks itself.
    bool is_free(const double* q) const noexcept {
        if constexpr (std::is_same_v<Handle, ArmHandle>)
            return !scene_ || is_clear_as_shared(arm_.arm, *scene_, q);
        else
            return true;
    }
    /// The number of poses.
    std::size_t size() const noexcept { return pose_.elements(2); }
    /// The array of poses.
    const Buffer& pose() const noexcept { return pose_; }

    /// Calls solve(arm, table, pose, options) for element i, or reports an invalid pose or seed.
    template <class Solve>
    void one(std::size_t i, Outcome& outcome, const Solve& solve) const noexcept {
        const double* m = pose_.data<double>() + 16 * i;
        const double* near = near_.held() ? near_.data<double>() + joints * i : nullptr;
        double value = 0;
        const Problem problem = check_pose(arm_.arm, m, value);
        if (problem != Problem::none) return outcome.report(problem, i, value);
        const Problem seed = near ? check_joints(arm_.arm, near, value) : Problem::none;
        if (seed != Problem::none) return outcome.report(seed, i, value);
        const std::size_t own = allowed_.size() > 1 ? i : 0;
        const ArcSet* allowed = allowed_.empty() ? nullptr : &allowed_[own];
        const Pose<double> pose = load_pose(m);
        NearestOptions options = nearest_options(options_, near, allowed);
        Cleared cleared[configurations];
        if constexpr (std::is_same_v<Handle, ArmHandle>) {
            if (scene_) clear_all(arm_.arm, *scene_, pose, cleared);
            for (int gc = 0; scene_ && gc < configurations; ++gc) {
                options.clear[gc] = &cleared[gc].arcs;
                const bool some = cleared[gc].status == Status::OK;
                options.blocked[gc] = some ? Status::CLEARANCE : cleared[gc].status;
            }
        }
        solve(arm_.arm, limits_, pose, options);
    }

private:
    const Handle& arm_;
    const SolveOptions& options_;
    const Scene* scene_;
    decltype(limits_with(std::declval<Handle>(), 0.0, nullptr)) limits_;
    Buffer pose_, near_;
    std::vector<ArcSet> allowed_;
};

/// The nearest solution. If there is none and `length` (m for a radian) is not 0, the configuration of the
/// nearest reachable pose in any branch, whose status is the reason why there is no solution.
Nearest answer(const Arm& arm, const LimitTable& limits, const Pose<double>& pose, const NearestOptions& o,
               double length) noexcept {
    return length > 0 ? nearest_outside(arm, limits, pose, o, length) : nearest_posture(arm, limits, pose, o);
}
/// The nearest solution of a pose within margin and scene.
Nearest solved(const ChainArm& arm, const KeptOff& kept, const Pose<double>& pose,
               const NearestOptions& o) noexcept {
    return nearest_posture(arm, kept.margin, pose, o, kept.scene);
}
/// The nearest solution of a pose within the scene.
template <free_joint_arm A>
Nearest solved(const A& arm, const KeptOff& kept, const Pose<double>& pose,
               const NearestOptions& o) noexcept {
    return nearest_posture(arm, pose, o, kept.scene);
}
/// The nearest solution. If there is none and `length` (m for a radian) is not 0, the configuration of the
/// nearest reachable pose in any branch, whose status is the reason why there is no solution.
template <class A>
Nearest answer(const A& arm, const KeptOff& kept, const Pose<double>& pose, const NearestOptions& o,
               double length) noexcept {
    const Nearest exact = solved(arm, kept, pose, o);
    if (!(length > 0) || is_solved(exact.status)) return exact;
    return nearest_outside(arm, kept.margin, exact, pose, o, length);
}
/// Writes the nearest solution of each branch and arc within the scene to `out`.
template <free_joint_arm A>
void nearest_postures(const A& arm, const KeptOff& kept, const Pose<double>& pose, const NearestOptions& o,
                      Nearests& out) noexcept {
    armangle::nearest_postures(arm, pose, o, out, kept.scene);
}
/// Writes the nearest solution of each branch and arc within margin and scene to `out`.
void nearest_postures(const ChainArm& arm, const KeptOff& kept, const Pose<double>& pose,
                      const NearestOptions& o, Nearests& out) noexcept {
    armangle::nearest_postures(arm, kept.margin, pose, o, out, kept.scene);
}

/// Searches the nearest solution of each pose, with `near` and `allowed` as in Work; raises for the first
/// invalid pose or seed. Writes q (n, 7), psi, distance, margin (to the joint limits), gap (n,) as float64,
/// gc (n,) as int64, status (n,) as int8.
template <class Handle>
void solve_many(const Handle& self, Floats pose, Floats near, const SolveOptions& options, Ints allowed_count,
                Floats allowed_psi, Floats q, Floats psi, Ints gc, Floats distance, Codes status,
                Floats margin, Floats gap, int threads, const SceneHandle* scene) {
    const Work<Handle> work(self, pose, near, allowed_count, allowed_psi, options, scene);
    const Buffer q_out(q, true), psi_out(psi, true), gc_out(gc, true), distance_out(distance, true);
    const Buffer status_out(status, true), margin_out(margin, true), gap_out(gap, true);
    Outcome outcomes[most_threads];
    watched(work.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        for (std::size_t i = begin; i < end && !(i > begin && watch.ended(thread, i - begin)); ++i)
            work.one(i, outcomes[thread],
                     [&](const auto& arm, const auto& limits, const Pose<double>& at,
                         const NearestOptions& o) noexcept {
                         Nearest found = answer(arm, limits, at, o, options.length);
                         if (is_solved(found.status) && !work.is_free(found.q)) {
                             found = {};
                             for (double& x : found.q) x = not_a_number;
                             found.psi = found.distance = found.margin = found.gap = not_a_number;
                             found.gc = -1;
                             found.status = Status::NEAR_SINGULAR;
                         }
                         std::memcpy(q_out.data<double>() + joints * i, found.q, joints * sizeof(double));
                         psi_out.data<double>()[i] = found.psi;
                         gc_out.data<long long>()[i] = found.gc;
                         distance_out.data<double>()[i] = found.distance;
                         status_out.data<std::int8_t>()[i] = static_cast<std::int8_t>(found.status);
                         margin_out.data<double>()[i] = found.margin;
                         gap_out.data<double>()[i] = found.gap;
                     });
    });
    refuse(first_problem(outcomes, most_threads), work.pose(), 2, "pose", "seed");
}

/// Writes the gradients (n, 6) of the margin of the best solutions q (n, 7), psi, gc (n,) of poses (n, 4, 4);
/// NaN if q is NaN. `margin` (rad) is the singularity margin.
template <class Handle>
void best_gradient_many(const Handle& self, Floats pose, double margin, Floats q, Floats psi, Ints gc,
                        Floats out, int threads) {
    const Buffer p(pose), joint(q), a(psi), g(gc), to(out, true);
    for_each<5>("pose", {&p, &joint, &a, &g, &to}, {2, 1, 0, 0, 1}, threads,
                [&](const Py_ssize_t* at, double&) {
                    Nearest best{};
                    std::memcpy(best.q, joint.data<double>() + at[1], joints * sizeof(double));
                    best.psi = a.data<double>()[at[2]];
                    best.gc = static_cast<int>(g.data<long long>()[at[3]]);
                    best.status = std::isnan(best.q[0]) ? Status::UNREACHABLE : Status::OK;
                    double gradient[6];
                    best_gradient(self.arm, margin, load_pose(p.data<double>() + at[0]), best, gradient);
                    std::memcpy(to.data<double>() + at[4], gradient, sizeof(gradient));
                    return Problem::none;
                });
}

/// Writes the derivatives (n, 7, 13) of the solutions q (n, 7), psi, gc (n,) of poses (n, 4, 4) with respect
/// to twist and seed. `near` (n, 7) holds the seeds, and is ignored for the metric margin. NaN if q is NaN.
template <class Handle>
void solution_derivative_many(const Handle& self, Floats pose, Floats near, const SolveOptions& options,
                              Floats q, Floats psi, Ints gc, Floats out, int threads) {
    const Buffer p(pose), seed(near), joint(q), a(psi), g(gc), to(out, true);
    for_each<6>("pose", {&p, &seed, &joint, &a, &g, &to}, {2, 1, 1, 0, 0, 2}, threads,
                [&](const Py_ssize_t* at, double&) {
                    Nearest best{};
                    std::memcpy(best.q, joint.data<double>() + at[2], joints * sizeof(double));
                    best.psi = a.data<double>()[at[3]];
                    best.gc = static_cast<int>(g.data<long long>()[at[4]]);
                    best.status = std::isnan(best.q[0]) ? Status::UNREACHABLE : Status::OK;
                    const NearestOptions asked =
                        nearest_options(options, seed.data<double>() + at[1], nullptr);
                    const SolutionDerivative found = solution_derivative(
                        self.arm, options.margin, load_pose(p.data<double>() + at[0]), best, asked);
                    std::memcpy(to.data<double>() + at[5], found.entry, sizeof(found.entry));
                    return Problem::none;
                });
}

/// A named tuple `kind` of (q, psi, gc, distance, status of `statuses`, margin, gap, pose) of one solution.
/// m: the pose, which becomes NaN if it is not solved.
nb::object solution_of(const Nearest& found, const double* m, nb::handle kind, nb::handle statuses) {
    const nb::object q = filled(new_array7(), found.q, joints);
    PyObject* status = PyTuple_GetItem(statuses.ptr(), static_cast<Py_ssize_t>(found.status));
    if (!status) throw nb::python_error();
    double frame[16];
    for (int i = 0; i < 16; ++i) frame[i] = is_solved(found.status) ? m[i] : not_a_number;
    return new_named(kind, q, found.psi, found.gc, found.distance, nb::handle(status), found.margin,
                     found.gap, filled(new_array44(), frame, 16));
}

/// A named tuple `kind` of n solutions as arrays, the status as int8 codes. m: the poses, NaN where not
/// solved.
nb::object solutions_of(const Nearest* found, const double* m, Py_ssize_t n, nb::handle kind) {
    static PyObject* int64 = nb::object(nb::module_::import_("numpy").attr("int64")).release().ptr();
    static PyObject* int8 = nb::object(nb::module_::import_("numpy").attr("int8")).release().ptr();
    const nb::object q = new_rows(n, joints), pose = new_rows(n, 4, 4);
    const nb::object psi = new_rows(n), distance = new_rows(n), margin = new_rows(n), gap = new_rows(n);
    const nb::object gc = new_rows_of(int64, n), status = new_rows_of(int8, n);
    const Buffer to_q(q, true), to_pose(pose, true), to_psi(psi, true), to_distance(distance, true),
        to_margin(margin, true), to_gap(gap, true), to_gc(gc, true), to_status(status, true);
    for (Py_ssize_t i = 0; i < n; ++i) {
        const Nearest& one = found[i];
        std::memcpy(to_q.data<double>() + joints * i, one.q, joints * sizeof(double));
        for (Py_ssize_t k = 16 * i; k < 16 * (i + 1); ++k)
            to_pose.data<double>()[k] = is_solved(one.status) ? m[k] : not_a_number;
        to_psi.data<double>()[i] = one.psi;
        to_distance.data<double>()[i] = one.distance;
        to_margin.data<double>()[i] = one.margin;
        to_gap.data<double>()[i] = one.gap;
        to_gc.data<long long>()[i] = one.gc;
        to_status.data<std::int8_t>()[i] = static_cast<std::int8_t>(one.status);
    }
    return new_named(kind, q, psi, gc, distance, status, margin, gap, pose);
}

/// The nearest solution of a pose (4,4) to a seed (7,), or of up to `few` rows of both, as a named tuple
/// `kind`. None for any other arguments, or if one of several rows is invalid: the general function then
/// answers, or raises. An invalid single pose or seed raises here.
template <class Handle>
nb::object solve_few(const Handle& self, nb::handle pose, nb::handle near, Metric metric, nb::handle kind,
                     nb::handle statuses) {
    double q[joints], m[16], value = 0;
    const bool one_seed = SmallMatrix().read(near, 1, joints, q);
    NearestOptions options;
    options.metric = metric;
    if (one_seed && SmallMatrix().read_pose(reaching(self.arm), pose, m)) {
        Problem problem = check_pose(self.arm, m, value);
        refuse_one(problem, "pose", value);
        problem = check_joints(self.arm, q, value);
        refuse_one(problem, "seed", value);
        options.near = q;
        return solution_of(nearest_of(self, load_pose(m), options), m, kind, statuses);
    }
    Buffer poses, seeds;
    const Py_ssize_t n = few_rows(pose, poses, {4, 4});
    if (!n || !(one_seed || few_rows(near, seeds, {joints}) == n)) return nb::none();
    Nearest found[few];
    for (Py_ssize_t i = 0; i < n; ++i) {
        const double* at = poses.data<double>() + 16 * i;
        options.near = one_seed ? q : seeds.data<double>() + joints * i;
        if (check_pose(self.arm, at, value) != Problem::none ||
            check_joints(self.arm, options.near, value) != Problem::none)
            return nb::none();
        found[i] = nearest_of(self, load_pose(at), options);
    }
    return solutions_of(found, poses.data<double>(), n, kind);
}

/// Returns the number of solutions of each pose; q, psi, gc, distance and margin of all of them, in the order
/// of the poses; and the status of each pose, the reason if it has none.
template <class Handle>
nb::typed<nb::tuple, Ints, Floats, Floats, Ints, Floats, Floats, Codes> solutions_many(
    const Handle& self, Floats pose, Floats near, const SolveOptions& options, Ints allowed_count,
    Floats allowed_psi, int threads, const SceneHandle* scene) {
    const Work<Handle> work(self, pose, near, allowed_count, allowed_psi, options, scene);
    std::vector<std::vector<Nearest>> parts(most_threads);
    std::vector<std::int64_t> count(work.size()), gc;
    std::vector<std::int8_t> status(work.size());
    std::vector<double> q, psi, distance, margin;
    Outcome outcomes[most_threads];
    watched(work.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        for (std::size_t i = begin; i < end && !(i > begin && watch.ended(thread, i - begin)); ++i)
            work.one(
                i, outcomes[thread],
                [&](const auto& arm, const auto& limits, const Pose<double>& at, const NearestOptions& o) {
                    Nearests found;
                    nearest_postures(arm, limits, at, o, found);
                    Nearest* const end =
                        std::remove_if(found.found, found.found + found.count,
                                       [&work](const Nearest& one) { return !work.is_free(one.q); });
                    const bool none = end == found.found && found.count > 0;
                    found.count = static_cast<int>(end - found.found);
                    count[i] = found.count;
                    status[i] = static_cast<std::int8_t>(none ? Status::NEAR_SINGULAR : found.status);
                    parts[thread].insert(parts[thread].end(), found.found, found.found + found.count);
                });
    });
    refuse(first_problem(outcomes, most_threads), work.pose(), 2, "pose", "seed");
    for (const std::vector<Nearest>& part : parts)
        for (const Nearest& one : part) {
            q.insert(q.end(), one.q, one.q + joints);
            psi.push_back(one.psi);
            gc.push_back(one.gc);
            distance.push_back(one.distance);
            margin.push_back(one.margin);
        }
    return nb::make_tuple(owned(std::move(count), 1), owned(std::move(q), joints), owned(std::move(psi), 1),
                          owned(std::move(gc), 1), owned(std::move(distance), 1), owned(std::move(margin), 1),
                          owned(std::move(status), 1));
}

/// Binds solve_few, solve_many, solutions_many and the derivatives of solutions.
template <class Handle>
void bind_solving_of(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("solve_few", &solve_few<Handle>, "pose"_a.none(), "near"_a.none(), "metric"_a, "kind"_a,
            "statuses"_a);
    arm.def("solve_many", &solve_many<Handle>, "pose"_a, "near"_a.none(), "options"_a,
            "allowed_count"_a.none(), "allowed_psi"_a.none(), "q"_a, "psi"_a, "gc"_a, "distance"_a,
            "status"_a, "margin"_a, "gap"_a, "threads"_a, "scene"_a.none());
    arm.def("solutions_many", &solutions_many<Handle>, "pose"_a, "near"_a.none(), "options"_a,
            "allowed_count"_a.none(), "allowed_psi"_a.none(), "threads"_a, "scene"_a.none());
    arm.def("solution_derivative_many", &solution_derivative_many<Handle>, "pose"_a, "near"_a, "options"_a,
            "q"_a, "psi"_a, "gc"_a, "out"_a, "threads"_a);
    arm.def("best_gradient_many", &best_gradient_many<Handle>, "pose"_a, "margin"_a, "q"_a, "psi"_a, "gc"_a,
            "out"_a, "threads"_a);
}

}  // namespace

/// Binds the search of solutions of a nearly S-R-S arm.
void bind_chain_solving(nb::class_<ChainArmHandle>& arm) { bind_solving_of(arm); }
/// Binds the search of solutions of an arm with an offset.
void bind_offset_solving(nb::class_<OffsetHandle>& arm) { bind_solving_of(arm); }
/// Binds the search of solutions of an arm with an offset and its own chain.
void bind_offset_chain_solving(nb::class_<OffsetChainHandle>& arm) { bind_solving_of(arm); }

/// Registers Metric and SolveOptions, and the search of solutions of an S-R-S arm with its derivatives.
void bind_solving(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Metric>(m, "Metric")
        .value("L2", Metric::l2)
        .value("MAX", Metric::max)
        .value("MARGIN", Metric::margin);
    nb::class_<SolveOptions>(m, "SolveOptions")
        .def("__init__", &make_solve_options, "metric"_a, "weight"_a, "branches"_a, "margin"_a, "length"_a);
    bind_solving_of(arm);
}

}  // namespace binding
