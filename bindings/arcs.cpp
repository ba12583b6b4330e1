// Feasible arcs, joint functions, and the algebra of arcs over batches.
//
// A batch of arc sets travels as flat arrays: `count` per set; for each arc its two ends as angle, joint (0:
// none), side and value in q.
#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <vector>

#include "arc_arrays.hpp"
#include "buffers.hpp"

namespace binding {

using namespace armangle;

namespace {

template <class T>
nb::object owned(std::vector<T>&& values, std::size_t columns) {
    auto* kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    const std::size_t rows = kept->size() / columns;
    if (columns == 1) return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), {rows}, owner));
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), {rows, columns}, owner));
}

/// Memory that grows without being filled first; its own, or a part of another's until that is too small.
template <class T>
struct Grown {
    std::unique_ptr<T[]> own;
    T* data = nullptr;
    std::size_t size = 0, capacity = 0;

    void reserve(std::size_t wanted) {
        if (wanted <= capacity) return;
        std::unique_ptr<T[]> larger(new T[wanted]);
        if (size) std::memcpy(larger.get(), data, size * sizeof(T));
        own = std::move(larger), data = own.get(), capacity = wanted;
    }
    void room_for(std::size_t more) {
        if (size + more > capacity) reserve(size + more + capacity / 2);
    }
    void borrow(const Grown& whole, std::size_t first, std::size_t count) {
        data = whole.data + first, capacity = count;
    }

    nb::object release(std::size_t columns) {
        T* kept = own.release();
        nb::capsule owner(kept, [](void* p) noexcept { delete[] static_cast<T*>(p); });
        const std::size_t rows = size / columns;
        if (columns == 1) return nb::cast(nb::ndarray<nb::numpy, T>(kept, {rows}, owner));
        return nb::cast(nb::ndarray<nb::numpy, T>(kept, {rows, columns}, owner));
    }
};

/// Arc sets under construction.
struct Collected {
    static constexpr std::size_t ends = 5;  // a set, as a rule: two arcs and a half
    Grown<std::int64_t> count;
    Grown<double> psi, value;
    Grown<std::int8_t> joint, side, status;

    /// Room for so many sets.
    void reserve(std::size_t sets) {
        count.reserve(sets), status.reserve(sets);
        psi.reserve(ends * sets), value.reserve(ends * sets), joint.reserve(ends * sets),
            side.reserve(ends * sets);
    }
    /// The room that another has for the sets from `first` on.
    void borrow(const Collected& whole, std::size_t first, std::size_t sets) {
        count.borrow(whole.count, first, sets), status.borrow(whole.status, first, sets);
        psi.borrow(whole.psi, ends * first, ends * sets),
            value.borrow(whole.value, ends * first, ends * sets);
        joint.borrow(whole.joint, ends * first, ends * sets),
            side.borrow(whole.side, ends * first, ends * sets);
    }

    void add(const Arm& arm, double margin, const Configuration<double>& gc, const ArcSet& set,
             Status outcome) {
        count.room_for(1), status.room_for(1);
        count.data[count.size++] = set.count, status.data[status.size++] = static_cast<std::int8_t>(outcome);
        const auto ends = static_cast<std::size_t>(2 * set.count);
        psi.room_for(ends), value.room_for(ends), joint.room_for(ends), side.room_for(ends);
        for (int i = 0; i < set.count; ++i) {
            const Arc& arc = set.arc[i];
            psi.data[psi.size++] = arc.lower, psi.data[psi.size++] = arc.upper;
            for (const Tag tag : {arc.lower_tag, arc.upper_tag}) {
                joint.data[joint.size++] = static_cast<std::int8_t>(tag_joint(tag));
                side.data[side.size++] = static_cast<std::int8_t>(tag_side(tag));
                value.data[value.size++] = end_value(arm, margin, gc, tag);
            }
        }
    }

    nb::tuple release() {
        return nb::make_tuple(count.release(1), psi.release(2), joint.release(2), side.release(2),
                              value.release(2), status.release(1));
    }
};

/// One array of all threads' sets: drawn together where it was written, or copied where a thread outgrew its
/// part.
template <auto member>
void join(std::vector<Collected>& parts, Collected& whole) {
    auto& to = whole.*member;
    std::remove_reference_t<decltype(to)> all;
    std::size_t total = 0;
    bool outgrown = false;
    for (const Collected& part : parts)
        total += (part.*member).size, outgrown |= (part.*member).own != nullptr;
    for (Collected& part : parts) {
        auto& from = part.*member;
        if (!from.own || from.size < total) continue;
        to = std::move(from);  // one holds all there is
        return;
    }
    if (outgrown) {
        all.reserve(total);
    } else {
        all = std::move(to);
    }
    for (const Collected& part : parts) {
        const auto& from = part.*member;
        if (from.size) std::memmove(all.data + all.size, from.data, from.size * sizeof(from.data[0]));
        all.size += from.size;
    }
    to = std::move(all);
}

void join(std::vector<Collected>& parts, Collected& whole) {
    join<&Collected::count>(parts, whole), join<&Collected::psi>(parts, whole),
        join<&Collected::value>(parts, whole);
    join<&Collected::joint>(parts, whole), join<&Collected::side>(parts, whole),
        join<&Collected::status>(parts, whole);
}

/// What is asked of a pose: Psi_all of one branch, Psi_i of its seven joints, or Psi_all of all eight
/// branches.
enum class Wanted : int { branch, joints, branches };

constexpr int sets_of(Wanted wanted) noexcept {
    return wanted == Wanted::branch ? 1 : (wanted == Wanted::joints ? joints : configurations);
}

struct Request {
    const ArmHandle& self;
    const LimitTable& limits;
    Wanted wanted;
};

void collect_branches(const Request& r, const Circle<double>& c, Collected& to) {
    AllArcs all;
    feasible_all(r.self.arm, r.limits, c, all);
    for (int k = 0; k < configurations; ++k)
        to.add(r.self.arm, r.limits.margin, configuration(k), all.arcs[k], all.status[k]);
}

Problem collect_pose(const Request& r, const double* m, long long gc, Collected& to, double& value) {
    const Problem problem = check_pose(m, value);
    if (problem != Problem::none) return problem;
    if (gc < 0 || gc >= configurations) return value = static_cast<double>(gc), Problem::gc_range;
    const Arm& arm = r.self.arm;
    const Circle<double> c = circle(arm, flange_pose(arm, load_pose(m)));
    if (r.wanted == Wanted::branches) return collect_branches(r, c, to), Problem::none;
    const Configuration<double> g = configuration(static_cast<int>(gc));
    const SelfMotion<double> motion = self_motion(arm, c, g);
    const JointFunctions<double> f = joint_functions(motion);
    ArcSet set;
    if (r.wanted == Wanted::branch) {
        const Status status = feasible(motion, f, r.limits, set);
        to.add(arm, r.limits.margin, g, set, status);
        return Problem::none;
    }
    for (int joint = 0; joint < joints; ++joint) {
        const Status status = joint_arcs(motion, f, r.limits, joint, set);
        to.add(arm, r.limits.margin, g, set, status);
    }
    return Problem::none;
}

/// The sets of elements [begin, end), up to the first problem. Its arguments are copies: what one thread
/// writes to must not lie on a cache line that another reads.
[[gnu::noinline]] void collect_range(Request request, Grid<2> grid, const double* poses, const long long* gc,
                                     std::size_t begin, std::size_t end, Collected& to, Outcome& outcome) {
    grid.for_runs(
        begin, end, [&](std::size_t flat, const Py_ssize_t* at, const Py_ssize_t* step, std::size_t count) {
            for (std::size_t i = 0; i < count; ++i) {
                const auto k = static_cast<Py_ssize_t>(i);
                double value = 0;
                const Problem problem =
                    collect_pose(request, poses + at[0] + k * step[0], gc[at[1] + k * step[1]], to, value);
                if (problem != Problem::none) return outcome.report(problem, flat + i, value);
            }
        });
}

/// Arrays of the sets of all elements, or a report of the first problem.
nb::object feasible_many(const ArmHandle& self, nb::handle pose, nb::handle gc, double margin,
                         double psi_margin, double discriminant, int wanted, int threads) {
    const Buffer p(pose), g(gc);
    const Grid<2> grid({&p, &g}, {2, 0});
    const bool plain = margin == 0 && psi_margin == 0;
    const LimitTable own = plain ? LimitTable{} : limit_table(self.arm, margin, psi_margin, discriminant);
    const Request request{self, plain ? self.limits : own, static_cast<Wanted>(wanted)};
    const auto sets = static_cast<std::size_t>(sets_of(request.wanted));
    Collected whole;
    whole.reserve(grid.size() * sets);
    std::vector<Collected> parts(most_threads);
    Outcome outcomes[most_threads];
    {
        nb::gil_scoped_release release;
        parallel(grid.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t thread) {
            Collected mine;
            mine.borrow(whole, begin * sets, (end - begin) * sets);
            collect_range(request, grid, p.data<double>(), g.data<long long>(), begin, end, mine,
                          outcomes[thread]);
            parts[thread] = std::move(mine);
        });
    }
    const Outcome outcome = first_problem(outcomes, most_threads);
    if (outcome.problem != Problem::none) return report(outcome);
    join(parts, whole);
    return whole.release();
}

/// One joint's function of psi on one circle and branch.
struct JointFunctionHandle {
    Arm arm;
    SelfMotion<double> motion;
    JointFunctions<double> f;
    int joint;

    double value(double psi) const noexcept {
        return joints_within_limits(arm, directions(motion, sin_cos(psi)), nullptr).q[joint];
    }
    double slope(double psi) const noexcept { return rate(arm, f, sin_cos(psi)).q[joint]; }
    Profile special() const noexcept {
        for (int h = 0; h < hinges; ++h)
            if (hinge_joint[h] == joint) return profile(f.hinge[h]);
        for (int p = 0; p < pivots; ++p)
            if (pivot_joint[p] == joint) return profile(f.pivot[p]);
        return {Case::constant, {0, {}}, {0, {}}};
    }
};

nb::object joint_function(const ArmHandle& self, nb::handle pose, long long gc, int joint) {
    const Buffer m(pose);
    double value = 0;
    Outcome outcome;
    const Problem problem = check_pose(m.data<double>(), value);
    if (problem != Problem::none) return outcome.report(problem, 0, value), report(outcome);
    const SelfMotion<double> motion =
        self_motion(self.arm, load_pose(m.data<double>()), static_cast<int>(gc));
    const Circle<double>& c = motion.circle;
    if (is_unreachable(c)) return outcome.report(Problem::unreachable, 0, c.triangle.excess), report(outcome);
    if (is_folded(c)) return outcome.report(Problem::folded, 0, 0), report(outcome);
    return nb::cast(JointFunctionHandle{self.arm, motion, joint_functions(motion), joint});
}

template <class Function>
void map_psi(nb::handle psi, nb::handle out, const Function& function) {
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

std::vector<double> listed(const Roots& r) { return {r.psi, r.psi + r.count}; }

/// Sets made from arrays of [lower, upper] of any lift; overlapping arcs are joined.
nb::tuple arcs_from(nb::handle count, nb::handle psi) {
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

/// operation 0: a and b, 1: a or b, 2: not a. `source` says from which end (of a, then of b) each end came,
/// or -1.
nb::tuple combine(int operation, nb::handle count_a, nb::handle psi_a, nb::handle index_a, nb::handle count_b,
                  nb::handle psi_b, nb::handle index_b) {
    const ArcArrays a(count_a, psi_a), b(count_b, psi_b);
    const Buffer ia(index_a), ib(index_b);
    const auto ends_of_a = static_cast<std::int64_t>(2 * a.arcs());
    std::vector<std::int64_t> counts, source;
    std::vector<double> arcs;
    ArcSet out;
    for (Py_ssize_t i = 0; i < ia.shape(0); ++i) {
        const auto at_a = ia.data<long long>()[i], at_b = ib.data<long long>()[i];
        const ArcSet left = a.load(at_a, 1),
                     right = operation == 2 ? ArcSet{} : b.load(at_b, 1 + 2 * ArcSet::capacity);
        if (operation == 0)
            intersect(left, right, out);
        else if (operation == 1)
            unite(left, right, out);
        else
            complement(left, out);
        counts.push_back(out.count);
        for (int k = 0; k < out.count; ++k) {
            arcs.insert(arcs.end(), {out.arc[k].lower, out.arc[k].upper});
            for (const Tag tag : {out.arc[k].lower_tag, out.arc[k].upper_tag}) {
                const bool from_a = tag <= 2 * ArcSet::capacity;
                source.push_back(out.full || tag == 0 ? -1
                                 : from_a ? static_cast<std::int64_t>(2 * a.first(at_a)) + tag - 1
                                          : ends_of_a + static_cast<std::int64_t>(2 * b.first(at_b)) + tag -
                                                1 - 2 * ArcSet::capacity);
            }
        }
    }
    return nb::make_tuple(owned(std::move(counts), 1), owned(std::move(arcs), 2),
                          owned(std::move(source), 2));
}

/// For each (set index, psi): whether the set contains it (as 0 or 1), or the nearest psi in it.
void query(nb::handle count, nb::handle psi_arcs, nb::handle index, nb::handle psi, nb::handle out,
           bool nearest_wanted) {
    const ArcArrays a(count, psi_arcs);
    const Buffer i(index), x(psi), to(out, true);
    for (Py_ssize_t k = 0; k < i.shape(0); ++k) {
        const ArcSet set = a.load(i.data<long long>()[k], 1);
        const double at = x.data<double>()[k];
        to.data<double>()[k] = nearest_wanted ? nearest(set, at) : contains(set, at);
    }
}

}  // namespace

void bind_arcs(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    arm.def("feasible_many", &feasible_many, "pose"_a, "gc"_a, "margin"_a, "psi_margin"_a, "discriminant"_a,
            "wanted"_a, "threads"_a);
    arm.def("joint_function", &joint_function, "pose"_a, "gc"_a, "joint"_a);
    nb::class_<JointFunctionHandle>(m, "JointFunction")
        .def(
            "value",
            [](const JointFunctionHandle& h, nb::handle psi, nb::handle out) {
                map_psi(psi, out, [&](double x) { return h.value(x); });
            },
            "psi"_a, "out"_a)
        .def(
            "derivative",
            [](const JointFunctionHandle& h, nb::handle psi, nb::handle out) {
                map_psi(psi, out, [&](double x) { return h.slope(x); });
            },
            "psi"_a, "out"_a)
        .def_prop_ro("stationary",
                     [](const JointFunctionHandle& h) { return listed(h.special().stationary); })
        .def_prop_ro("singular", [](const JointFunctionHandle& h) { return listed(h.special().singular); })
        .def_prop_ro("kind", [](const JointFunctionHandle& h) { return static_cast<int>(h.special().kind); });
    m.def("arcs_from", &arcs_from, "count"_a, "psi"_a);
    m.def("combine", &combine, "operation"_a, "count_a"_a, "psi_a"_a, "index_a"_a, "count_b"_a, "psi_b"_a,
          "index_b"_a);
    m.def("query", &query, "count"_a, "psi_arcs"_a, "index"_a, "psi"_a, "out"_a, "nearest"_a);
}

}  // namespace binding
