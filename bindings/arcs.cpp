// Feasible arcs, joint functions, and the algebra of arcs over batches.
//
// A batch of arc sets is stored in flat arrays: `count` per set; for each arc its two ends as angle, joint
// (0: none), side and value in q.
#include <nanobind/ndarray.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <vector>

#include "arc_arrays.hpp"
#include "collected.hpp"
#include "offset_handle.hpp"
#include "refusal.hpp"
#include "scene_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

/// The requested sets of a pose: Psi_all of one branch; Psi_i of its seven joints; Psi_all of all eight
/// branches; the collision-free arcs of one branch; or those with soft clearance (gripper and link 0
/// excepted).
enum class Wanted : int { branch, joints, branches, clear, soft };

/// The number of sets that a request has for each pose.
constexpr int sets_of(Wanted wanted) noexcept {
    if (wanted == Wanted::joints) return joints;
    return wanted == Wanted::branches ? configurations : 1;
}

/// The arguments for the arcs of an S-R-S arm that all poses share.
struct Request {
    const ArmHandle& self;
    const LimitTable& limits;
    Wanted wanted;
    const Scene* scene;  // or null
};

/// Adds the part of `own`, the arcs within the limits, that is collision-free, with `status`, or the reason
/// if nothing remains.
void add_clear(const Request& r, const Configuration<double>& gc, const Cleared& cleared, const ArcSet& own,
               Status status, Collected& to) {
    ArcSet left;
    intersect(own, cleared.arcs, left);
    if (status == Status::OK && left.empty())
        status = cleared.status == Status::OK ? Status::CLEARANCE : cleared.status;
    to.add(r.self.arm, r.limits.margin, gc, left, status, cleared.blocking, cleared.coarse);
}

/// Adds the arcs of all eight branches of a pose; with a scene, their collision-free parts.
void collect_branches(const Request& r, const Pose<double>& pose, Collected& to) {
    AllArcs all;
    feasible_all(r.self.arm, pose, r.limits, all);
    Cleared cleared[configurations];
    if (r.scene) clear_all(r.self.arm, *r.scene, pose, cleared);
    for (int k = 0; k < configurations; ++k) {
        const Configuration<double> gc = configuration(k);
        if (r.scene)
            add_clear(r, gc, cleared[k], all.arcs[k], all.status[k], to);
        else
            to.add(r.self.arm, r.limits.margin, gc, all.arcs[k], all.status[k]);
    }
}

/// Adds the requested sets of one pose (16 numbers); returns its problem, with the offending number in
/// `value`.
Problem collect_pose(const Request& r, const double* m, long long gc, Collected& to, double& value) {
    const Problem problem = check_pose(r.self.arm, m, value);
    if (problem != Problem::none) return problem;
    if (gc < 0 || gc >= configurations) {
        value = static_cast<double>(gc);
        return Problem::gc_range;
    }
    const Arm& arm = r.self.arm;
    const Pose<double> pose = load_pose(m);
    if (r.wanted == Wanted::branches) {
        collect_branches(r, pose, to);
        return Problem::none;
    }
    const Configuration<double> g = configuration(static_cast<int>(gc));
    ArcSet set;
    if (r.scene || r.wanted == Wanted::clear) {
        const SelfMotion<double> motion = self_motion(arm, pose, g);
        Cleared cleared;
        Scene asked = *r.scene;
        if (r.wanted == Wanted::soft) asked.clearance += asked.soft;
        clear(arm, asked, motion, cleared, r.wanted == Wanted::soft);
        if (r.wanted == Wanted::clear)
            to.add(arm, 0.0, g, cleared.arcs, cleared.status, cleared.blocking, cleared.coarse);
        else
            add_clear(r, g, cleared, set, feasible(motion, r.limits, set), to);
        return Problem::none;
    }
    if (r.wanted == Wanted::branch) {
        const Status status = feasible(arm, pose, static_cast<int>(gc), r.limits, set);
        to.add(arm, r.limits.margin, g, set, status);
        return Problem::none;
    }
    const SelfMotion<double> motion = self_motion(arm, pose, g);
    const JointFunctions<double> f = joint_functions(motion);
    for (int joint = 0; joint < joints; ++joint) {
        const Status status = joint_arcs(motion, f, r.limits, joint, set);
        to.add(arm, r.limits.margin, g, set, status);
    }
    return Problem::none;
}

/// Collects the sets of elements [begin, end), up to the first problem. The arguments are copies, so that no
/// thread writes to a cache line that another reads.
[[gnu::noinline]] void collect_range(Request request, Grid<2> grid, const double* poses, const long long* gc,
                                     std::size_t begin, std::size_t end, std::size_t thread, Watch& watch,
                                     Collected& to, Outcome& outcome) {
    grid.for_runs(
        begin, end, [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
            for (std::size_t i = 0; i < count; ++i) {
                if (flat + i > begin && watch.ended(thread, flat + i - begin)) return;
                const auto k = static_cast<Py_ssize_t>(i);
                double value = 0;
                const Problem problem =
                    collect_pose(request, poses + at[0] + k * step[0], gc[at[1] + k * step[1]], to, value);
                if (problem != Problem::none) return outcome.report(problem, flat + i, value);
            }
        });
}

/// Computes the requested sets of all poses as flat arrays; margin, psi_margin and discriminant are those of
/// limit_table().
ArcColumns feasible_many(const ArmHandle& self, Floats pose, Ints gc, double margin, double psi_margin,
                         double discriminant, Wanted wanted, int threads, const SceneHandle* scene) {
    const Buffer p(pose), g(gc);
    const Grid<2> grid({&p, &g}, {2, 0});
    const bool plain = margin == 0 && psi_margin == 0;
    const LimitTable own = plain ? LimitTable{} : limit_table(self.arm, margin, psi_margin, discriminant);
    const Request request{self, plain ? self.limits : own, wanted, scene ? &scene->view : nullptr};
    const auto sets = static_cast<std::size_t>(sets_of(request.wanted));
    Collected whole;
    whole.with_scene = scene != nullptr;
    whole.reserve(grid.size() * sets);
    std::vector<Collected> parts(most_threads);
    Outcome outcomes[most_threads];
    watched(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        Collected mine;
        mine.borrow(whole, begin * sets, (end - begin) * sets);
        collect_range(request, grid, p.data<double>(), g.data<long long>(), begin, end, thread, watch, mine,
                      outcomes[thread]);
        parts[thread] = std::move(mine);
    });
    refuse(first_problem(outcomes, most_threads), p, 2, "pose");
    join(parts, whole);
    return whole.release();
}

/// Arguments for the proven sets of a pose, within limits of the robot's joints.
struct ProvenRequest {
    Wanted wanted;
    int gc;  // if one branch is requested
    double margin;
    Limits limits;
    const Scene* scene;  // or null
    bool left_out;       // return the unproven sets within the limits instead
};

/// Calls take(k, set, found, blocking, value_of) for each set of a pose. `found` has the status and the
/// unproven length; value_of(tag, psi) is the joint value q (rad) that causes an end. If no arc remains,
/// `blocking` is a pair that was found to touch; 0 if none is known.
template <class Take>
void proven_sets(const ChainArm& arm, const Pose<double>& pose, const ProvenRequest& r, const Take& take) {
    ProvenArcs found;
    for (int k = 0; k < sets_of(r.wanted); ++k) {
        const int joint = r.wanted == Wanted::joints ? k : -1;
        const int gc = r.wanted == Wanted::branches ? k : r.gc;
        feasible(arm, pose, gc, r.limits, r.margin, found, joint);
        Tag blocking = 0;
        if (r.scene) keep_clear(arm, *r.scene, pose, gc, found, blocking, r.wanted == Wanted::soft);
        take(k, r.left_out ? found.open : found.arcs, found, blocking,
             [&](Tag tag, double) { return end_value(arm.nominal, r.margin, configuration(gc), tag); });
    }
}

/// Calls take(k, set, found, blocking, value_of), as for a chain, for each set of a pose of an arm with an
/// offset.
template <class AnyOffset, class Take>
void proven_offset_sets(const AnyOffset& arm, const Pose<double>& pose, const ProvenRequest& r,
                        const Take& take) {
    const auto give = [&](int k, int gc, ProvenArcs& found) {
        Tag blocking = 0;
        if (r.scene) keep_clear(arm, *r.scene, pose, gc, found, blocking, r.wanted == Wanted::soft);
        take(k, in_robot_order(arm, r.left_out ? found.open : found.arcs), found, blocking,
             [&](Tag tag, double free) { return end_value(arm, pose, gc, tag, free); });
    };
    ProvenArcs found[configurations];
    if (r.wanted == Wanted::branches) {
        feasible_all(arm, pose, r.limits, found);
        for (int gc = 0; gc < configurations; ++gc) give(gc, gc, found[gc]);
    } else if (r.wanted == Wanted::joints) {
        for (int j = 0; j < joints; ++j) {
            const Limits own = limits_of_one(r.limits, j);
            if constexpr (std::is_same_v<AnyOffset, OffsetArm>)
                feasible(arm, pose, r.gc, own, found[0], {}, j);
            else
                feasible(arm, pose, r.gc, own, found[0]);
            give(j, r.gc, found[0]);
        }
    } else {
        feasible(arm, pose, r.gc, r.limits, found[0]);
        give(0, r.gc, found[0]);
    }
}
/// Calls take(k, set, found, blocking, value_of) for each set of a pose of an arm with an offset.
template <class Take>
void proven_sets(const OffsetArm& arm, const Pose<double>& pose, const ProvenRequest& r, const Take& take) {
    OffsetArm asked = arm;
    asked.margin = r.margin;
    proven_offset_sets(asked, pose, r, take);
}
/// Calls take(k, set, found, blocking, value_of) for each set of a pose of an arm with an offset on its own
/// chain; a singularity margin is ignored.
template <class Take>
void proven_sets(const OffsetChain& arm, const Pose<double>& pose, const ProvenRequest& r, const Take& take) {
    proven_offset_sets(arm, pose, r, take);
}

/// Computes the proven sets of a nearly S-R-S arm, or of an arm with an offset, as flat arrays. `unproven`
/// receives the unproven length (rad) of each set. With `left_out` (and no scene) the sets are the unproven
/// ones within the limits.
template <class Handle>
ArcColumns proven_feasible_many(const Handle& self, Floats pose, Ints gc, double margin, Wanted wanted,
                                Floats unproven, int threads, const SceneHandle* scene, bool left_out) {
    const Buffer p(pose), g(gc), lost(unproven, true);
    const Grid<2> grid({&p, &g}, {2, 0});
    const auto sets = static_cast<std::size_t>(sets_of(wanted));
    Scene asked = scene ? scene->view : Scene{};
    if (wanted == Wanted::soft) asked.clearance += asked.soft;
    const Limits limits = wanted == Wanted::clear ? Limits{} : nominal(self.arm).limits;
    const ProvenRequest request{wanted, 0, margin, limits, scene ? &asked : nullptr, left_out};
    Collected whole;
    whole.with_scene = scene != nullptr;
    whole.reserve(grid.size() * sets);
    std::vector<Collected> parts(most_threads);
    Outcome outcomes[most_threads];
    const auto solve = [&](const Pose<double>& frame, int branch, std::size_t flat, Collected& to) {
        ProvenRequest one = request;
        one.gc = branch;
        proven_sets(
            self.arm, frame, one,
            [&](int k, const ArcSet& set, const ProvenArcs& found, Tag blocking, const auto& value_of) {
                to.add(set, found.status, value_of, blocking);
                lost.data<double>()[flat * sets + static_cast<std::size_t>(k)] = found.unproven;
            });
    };
    const auto collect = [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch,
                             Collected& to, Outcome& outcome) {
        grid.for_runs(begin, end,
                      [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
                          for (std::size_t i = 0; i < count; ++i) {
                              if (flat + i > begin && watch.ended(thread, flat + i - begin)) return;
                              const auto k = static_cast<Py_ssize_t>(i);
                              double value = 0;
                              const double* m = p.data<double>() + at[0] + k * step[0];
                              const long long branch = g.data<long long>()[at[1] + k * step[1]];
                              Problem problem = check_pose(self.arm, m, value);
                              if (problem == Problem::none && (branch < 0 || branch >= configurations)) {
                                  problem = Problem::gc_range;
                                  value = static_cast<double>(branch);
                              }
                              if (problem != Problem::none) return outcome.report(problem, flat + i, value);
                              solve(load_pose(m), static_cast<int>(branch), flat + i, to);
                          }
                      });
    };
    watched(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        Collected mine;
        mine.borrow(whole, begin * sets, (end - begin) * sets);
        collect(begin, end, thread, watch, mine, outcomes[thread]);
        parts[thread] = std::move(mine);
    });
    refuse(first_problem(outcomes, most_threads), p, 2, "pose");
    join(parts, whole);
    return whole.release();
}

/// The sets of a pose or of a few, converted to arrays when Python reads them.
struct ArcsOfFew {
    Collected sets;
    Py_ssize_t rows;  // -1: one pose without a batch axis
    nb::object made[Collected::columns];

    /// Column `index` of the sets as an array, made on first use.
    nb::object column(std::size_t index) {
        if (index >= Collected::columns) throw nb::index_error();
        if (!made[index].is_valid()) made[index] = sets.column(index);
        return made[index];
    }
};

/// The sets of one pose, a small (4,4) matrix, or of up to `few` rows of them, in one thread. None for any
/// other arguments: the general function then answers, or raises.
std::unique_ptr<ArcsOfFew> feasible_few(const ArmHandle& self, nb::handle pose, nb::handle gc_object,
                                        nb::handle margin_object, nb::handle psi_margin,
                                        nb::handle discriminant, Wanted wanted, nb::handle threads,
                                        const SceneHandle* scene) {
    double margin, psi_wide, threshold, m[16], value;
    long long gc[few], one;
    if (!as_double(margin_object, margin) || !(margin >= 0 && margin <= most_margin)) return nullptr;
    if (!as_double(psi_margin, psi_wide) || !(psi_wide >= 0 && psi_wide <= most_margin)) return nullptr;
    if (!as_double(discriminant, threshold) || !(threshold >= 0)) return nullptr;
    if (!as_index(threads, one) || one != 1) return nullptr;
    Buffer batch;
    const bool single = as_index(gc_object, gc[0]) && SmallMatrix().read_pose(self.arm, pose, m);
    const Py_ssize_t rows = single ? 1 : few_rows(pose, batch, {4, 4});
    if (!rows || !few_branches(gc_object, rows, gc)) return nullptr;
    auto out = std::make_unique<ArcsOfFew>();
    out->rows = single ? -1 : rows;
    out->sets.with_scene = scene != nullptr;
    out->sets.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(sets_of(wanted)));
    const bool plain = margin == 0 && psi_wide == 0;
    const LimitTable own = plain ? LimitTable{} : limit_table(self.arm, margin, psi_wide, threshold);
    const Request request{self, plain ? self.limits : own, wanted, scene ? &scene->view : nullptr};
    for (Py_ssize_t i = 0; i < rows; ++i) {
        const double* at = single ? m : batch.data<double>() + 16 * i;
        if (collect_pose(request, at, gc[i], out->sets, value) != Problem::none) return nullptr;
    }
    return out;
}

/// One joint as a function of psi, for one pose and branch.
struct JointFunctionHandle {
    Arm arm;
    SelfMotion<double> motion;
    JointFunctions<double> f;
    int joint;

    /// The joint's value (rad) at psi.
    double value(double psi) const noexcept {
        return joints_within_limits(arm, directions(motion, sin_cos(psi)), nullptr).q[joint];
    }
    /// The joint's derivative by psi (rad/rad).
    double slope(double psi) const noexcept { return rate(arm, f, sin_cos(psi)).q[joint]; }
    /// The stationary and singular psi of the joint.
    Profile special() const noexcept {
        for (int h = 0; h < hinges; ++h)
            if (hinge_joint[h] == joint) return profile(f.hinge[h]);
        for (int p = 0; p < pivots; ++p)
            if (pivot_joint[p] == joint) return profile(f.pivot[p]);
        return {Case::constant, {0, {}}, {0, {}}};
    }
};

/// Makes the function of joint 0..6 for a pose and branch (0..7, not checked); raises for a pose that is
/// invalid, unreachable or folded.
JointFunctionHandle joint_function(const ArmHandle& self, Floats pose, long long gc, int joint) {
    const Buffer m(pose);
    double value = 0;
    const Problem problem = check_pose(self.arm, m.data<double>(), value);
    refuse_one(problem, "pose", value);
    const SelfMotion<double> motion =
        self_motion(self.arm, load_pose(m.data<double>()), static_cast<int>(gc));
    const Circle<double>& c = motion.circle;
    if (is_unreachable(c)) refuse_one(Problem::unreachable, "pose", c.triangle.excess);
    if (is_folded(c)) refuse_one(Problem::folded, "pose", 0);
    return {self.arm, motion, joint_functions(motion), joint};
}

/// Writes function(psi) to `out` for each psi of an array.
template <class Function>
void map_psi(Floats psi, Floats out, const Function& function) {
    const Buffer in(psi), to(out, true);
    const Grid<2> grid({&in, &to}, {0, 0});
    grid.for_runs(
        0, grid.size(), [&](std::size_t, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
            for (std::size_t i = 0; i < count; ++i) {
                const auto k = static_cast<Py_ssize_t>(i);
                to.data<double>()[at[1] + k * step[1]] = function(in.data<double>()[at[0] + k * step[0]]);
            }
        });
}

/// The roots as a vector.
std::vector<double> listed(const Roots& r) { return {r.psi, r.psi + r.count}; }

/// Makes sets from rows [lower, upper] on any multiple of 2 pi, `count` (n,) rows for each set; overlapping
/// arcs are merged. Returns count and rows of the sets.
nb::typed<nb::tuple, Ints, Floats> arcs_from(Ints count, Floats psi) {
    const Buffer n(count), x(psi);
    std::vector<std::int64_t> counts;
    std::vector<double> arcs;
    std::size_t at = 0;
    for (Py_ssize_t i = 0; i < n.shape(0); ++i) {
        ArcSet sum, one, before;
        const long long wanted = n.data<long long>()[i];
        const double* ends = x.data<double>() + 2 * at;
        if (!make_ordered(sum, ends, static_cast<int>(wanted))) {
            make_empty(sum);
            for (long long k = 0; k < wanted; ++k) {
                make_arc(one, ends[2 * k], ends[2 * k + 1], 0, 0);
                before = sum;
                unite(before, one, sum);
            }
        }
        at += static_cast<std::size_t>(wanted);
        counts.push_back(sum.count);
        for (int k = 0; k < sum.count; ++k) arcs.insert(arcs.end(), {sum.arc[k].lower, sum.arc[k].upper});
    }
    return nb::make_tuple(owned(std::move(counts), 1), owned(std::move(arcs), 2));
}

enum class SetOperation { intersection, union_, complement };

/// Computes the intersection or union of sets a and b, or the complement of a, for each pair of the indices
/// index_a and index_b. Returns count, rows [lower, upper] and `source`, the end (of a, then of b) from which
/// each end came, or -1.
nb::typed<nb::tuple, Ints, Floats, Ints> combine(SetOperation operation, Ints count_a, Floats psi_a,
                                                 Ints index_a, Ints count_b, Floats psi_b, Ints index_b) {
    const ArcArrays a(count_a, psi_a), b(count_b, psi_b);
    const Buffer ia(index_a), ib(index_b);
    const auto ends_of_a = static_cast<std::int64_t>(2 * a.arcs());
    std::vector<std::int64_t> counts, source;
    std::vector<double> arcs;
    constexpr int in_b = 2 * ArcSet::capacity;  // larger tags belong to b
    ArcSet out;
    for (Py_ssize_t i = 0; i < ia.shape(0); ++i) {
        const auto at_a = ia.data<long long>()[i], at_b = ib.data<long long>()[i];
        const ArcSet left = a.load(at_a, 1),
                     right = operation == SetOperation::complement ? ArcSet{} : b.load(at_b, 1 + in_b);
        if (operation == SetOperation::intersection)
            intersect(left, right, out);
        else if (operation == SetOperation::union_)
            unite(left, right, out);
        else
            complement(left, out);
        counts.push_back(out.count);
        for (int k = 0; k < out.count; ++k) {
            arcs.insert(arcs.end(), {out.arc[k].lower, out.arc[k].upper});
            for (const Tag tag : {out.arc[k].lower_tag, out.arc[k].upper_tag}) {
                std::int64_t end = -1;
                if (!out.full && tag > in_b)
                    end = ends_of_a + static_cast<std::int64_t>(2 * b.first(at_b)) + tag - 1 - in_b;
                else if (!out.full && tag > 0)
                    end = static_cast<std::int64_t>(2 * a.first(at_a)) + tag - 1;
                source.push_back(end);
            }
        }
    }
    return nb::make_tuple(owned(std::move(counts), 1), owned(std::move(arcs), 2),
                          owned(std::move(source), 2));
}

/// Writes for each (set index, psi) whether the set contains it (as 0 or 1), or the nearest psi in it.
void query(Ints count, Floats psi_arcs, Ints index, Floats psi, Floats out, bool nearest_wanted) {
    const ArcArrays a(count, psi_arcs);
    const Buffer i(index), x(psi), to(out, true);
    for (Py_ssize_t k = 0; k < i.shape(0); ++k) {
        const ArcSet set = a.load(i.data<long long>()[k], 1);
        const double at = x.data<double>()[k];
        to.data<double>()[k] = nearest_wanted ? nearest(set, at) : contains(set, at);
    }
}

}  // namespace

/// Binds feasible_many of arms with proven arcs.
template <class Handle>
void bind_proven_arcs(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("feasible_many", &proven_feasible_many<Handle>, "pose"_a, "gc"_a, "margin"_a, "wanted"_a,
            "unproven"_a, "threads"_a, "scene"_a.none(), "left_out"_a = false);
}

/// Binds the arcs of an arm with its own chain.
void bind_chain_arcs(nb::class_<ChainArmHandle>& arm) { bind_proven_arcs(arm); }
/// Binds the arcs of an arm with an offset.
void bind_offset_arcs(nb::class_<OffsetHandle>& arm) { bind_proven_arcs(arm); }
/// Binds the arcs of an arm with an offset and its own chain.
void bind_offset_chain_arcs(nb::class_<OffsetChainHandle>& arm) { bind_proven_arcs(arm); }

/// Registers Side, Wanted, SetOperation, Case, the algebra of arcs, and the arcs and joint functions of an
/// S-R-S arm.
void bind_arcs(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Side>(m, "Side")
        .value("NONE", Side::none)
        .value("LOWER", Side::lower)
        .value("UPPER", Side::upper)
        .value("USER", Side::user)
        .value("NEAR_MARGIN", Side::near_margin)
        .value("FAR_MARGIN", Side::far_margin)
        .value("NEAR_SINGULAR", Side::near_singular)
        .value("FAR_SINGULAR", Side::far_singular)
        .value("OBSTACLE", Side::obstacle)
        .value("UNPROVEN", Side::unproven);
    nb::enum_<Wanted>(m, "Wanted")
        .value("BRANCH", Wanted::branch)
        .value("JOINTS", Wanted::joints)
        .value("BRANCHES", Wanted::branches)
        .value("CLEAR", Wanted::clear)
        .value("SOFT", Wanted::soft);
    nb::enum_<SetOperation>(m, "SetOperation")
        .value("INTERSECTION", SetOperation::intersection)
        .value("UNION", SetOperation::union_)
        .value("COMPLEMENT", SetOperation::complement);
    nb::enum_<Case>(m, "Case")
        .value("STATIONARY", Case::stationary)
        .value("MONOTONIC", Case::monotonic)
        .value("SINGULAR", Case::singular)
        .value("CONSTANT", Case::constant);
    arm.def("feasible_many", &feasible_many, "pose"_a, "gc"_a, "margin"_a, "psi_margin"_a, "discriminant"_a,
            "wanted"_a, "threads"_a, "scene"_a.none());
    nb::class_<ArcsOfFew>(m, "ArcsOfFew")
        .def_ro("rows", &ArcsOfFew::rows)
        .def("column", &ArcsOfFew::column, "index"_a);
    arm.def("feasible_few", &feasible_few, "pose"_a.none(), "gc"_a.none(), "margin"_a.none(),
            "psi_margin"_a.none(), "discriminant"_a.none(), "wanted"_a, "threads"_a.none(), "scene"_a.none());
    arm.def("joint_function", &joint_function, "pose"_a, "gc"_a, "joint"_a);
    nb::class_<JointFunctionHandle>(m, "JointFunction")
        .def(
            "value",
            [](const JointFunctionHandle& h, Floats psi, Floats out) {
                map_psi(psi, out, [&](double x) { return h.value(x); });
            },
            "psi"_a, "out"_a)
        .def(
            "derivative",
            [](const JointFunctionHandle& h, Floats psi, Floats out) {
                map_psi(psi, out, [&](double x) { return h.slope(x); });
            },
            "psi"_a, "out"_a)
        .def_prop_ro("stationary",
                     [](const JointFunctionHandle& h) { return listed(h.special().stationary); })
        .def_prop_ro("singular", [](const JointFunctionHandle& h) { return listed(h.special().singular); })
        .def_prop_ro("kind", [](const JointFunctionHandle& h) { return h.special().kind; });
    m.def("arcs_from", &arcs_from, "count"_a, "psi"_a);
    m.def("combine", &combine, "operation"_a, "count_a"_a, "psi_a"_a, "index_a"_a, "count_b"_a, "psi_b"_a,
          "index_b"_a);
    m.def("query", &query, "count"_a, "psi_arcs"_a, "index"_a, "psi"_a, "out"_a, "nearest"_a);
}

}  // namespace binding
