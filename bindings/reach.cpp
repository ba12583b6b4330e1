// Reachability: freedom of poses, turns of base and tool, and placement of the base.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "armangle/chain/between_ends.hpp"
#include "armangle/offset/chain/between_ends.hpp"
#include "armangle/offset/proven_cell.hpp"
#include "collected.hpp"
#include "elements.hpp"
#include "limits_of_handle.hpp"
#include "watch.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Writes 1 or 0 for each pose: whether any branch and psi solve it within the limits and a margin (rad) to
/// singularities; raises for an invalid pose. Obstacles are ignored.
template <class Handle>
void reachable_many(const Handle& self, Floats pose, double margin, Ints out, int threads) {
    const Buffer in(pose), to(out, true);
    const auto limits = table(self, margin);
    for_each<2>("pose", {&in, &to}, {2, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* m = in.data<double>() + at[0];
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) return problem;
        to.data<long long>()[at[1]] = reachable_within(self.arm, limits, load_pose(m));
        return Problem::none;
    });
}

/// Writes the Freedom of each pose. widths: total, widest and unproven (rad); codes: gc (a bit a branch),
/// arcs, status.
template <class Handle>
void freedom_many(const Handle& self, Floats pose, double margin, Floats widths, Ints codes, int threads) {
    const Buffer in(pose), wide(widths, true), code(codes, true);
    const auto limits = table(self, margin);
    for_each<3>("pose", {&in, &wide, &code}, {2, 1, 1}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* m = in.data<double>() + at[0];
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) return problem;
        const Freedom f = freedom_within(self.arm, limits, load_pose(m));
        double* to = wide.data<double>() + at[1];
        to[0] = f.total;
        to[1] = f.widest;
        to[2] = f.unproven;
        long long* c = code.data<long long>() + at[2];
        c[0] = f.gc;
        c[1] = f.arcs;
        c[2] = static_cast<long long>(f.status);
        return Problem::none;
    });
}

/// Writes the gradients (..., 6) of the total freedom with respect to the twist of each pose.
template <class Handle>
void freedom_gradient_many(const Handle& self, Floats pose, double margin, Floats out, int threads) {
    const Buffer in(pose), to(out, true);
    const auto limits = table(self, margin);
    for_each<2>("pose", {&in, &to}, {2, 1}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* m = in.data<double>() + at[0];
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) return problem;
        double slope[6];
        freedom_slope(self.arm, limits, load_pose(m), slope);
        std::memcpy(to.data<double>() + at[1], slope, sizeof(slope));
        return Problem::none;
    });
}

/// The turns of base or tool of one pose; `unproven` is the length (rad) of those that an own chain does not
/// exclude.
template <class AnyArm, class Table>
Status turns_of(const AnyArm& arm, const Table& limits, const Pose<double>& pose, Turned turned, ArcSet& out,
                double& unproven) noexcept {
    if constexpr (stepping_family<Table>)
        return proven_turn_arcs(limits, pose, turned, out, unproven);
    else
        return turn_arcs(arm, pose, limits, turned, out);
}

/// Collects the turns of base or tool for poses [begin, end), up to the first problem.
template <class Handle, class Table>
[[gnu::noinline]] void turns_range(const Handle& self, const Table& limits, Turned turned,
                                   const double* poses, std::size_t begin, std::size_t end,
                                   std::size_t thread, Watch& watch, Collected& to, double* unproven,
                                   Outcome& outcome) {
    for (std::size_t i = begin; i < end && !(i > begin && watch.ended(thread, i - begin)); ++i) {
        double value = 0;
        const Problem problem = check_pose(self.arm, poses + 16 * i, value);
        if (problem != Problem::none) return outcome.report(problem, i, value);
        ArcSet set;
        double left = 0;
        const Status status = turns_of(self.arm, limits, load_pose(poses + 16 * i), turned, set, left);
        to.add(nominal(self.arm), 0.0, configuration(0), set, status);
        unproven[i] = left;
    }
}

/// Computes the turns of base or tool at which each pose (n, 4, 4) is reachable; `unproven` (n,) receives the
/// length (rad) that is proven neither way.
template <class Handle>
ArcColumns turns_many(const Handle& self, Floats pose, Turned turned, double margin, Floats unproven,
                      int threads) {
    const Buffer p(pose), lost(unproven, true);
    const std::size_t n = p.elements(2);
    const auto limits = table(self, margin);
    Collected whole;
    whole.reserve(n);
    std::vector<Collected> parts(most_threads);
    Outcome outcomes[most_threads];
    watched(n, threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        Collected mine;
        mine.borrow(whole, begin, end - begin);
        turns_range(self, limits, turned, p.data<double>(), begin, end, thread, watch, mine,
                    lost.data<double>(), outcomes[thread]);
        parts[thread] = std::move(mine);
    });
    refuse(first_problem(outcomes, most_threads), p, 2, "pose");
    join(parts, whole);
    return whole.release();
}

/// The yaw angles at which a pose is reachable, where an own chain does not exclude others, and its weight.
struct OpenYaws {
    ArcSet arcs;
    double weight;
};

/// Work space of place_at().
struct YawWork {
    std::vector<YawEvent> events;
    std::vector<OpenYaws> open;
};

/// The yaw of a base at `at` (m) that reaches the most `weight` of the poses. `unproven` is the weight of
/// those that it is not proven to reach, of which some yaw is not excluded.
template <class AnyArm, class Table>
BestYaw place_at(const AnyArm& arm, const Table& limits, const std::vector<Pose<double>>& poses,
                 const double* weight, const Vec3<double>& at, YawWork& work, double& unproven) {
    std::vector<YawEvent>& events = work.events;
    events.clear();
    work.open.clear();
    double always = 0, at_seam = 0;
    ArcSet set;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        double left = 0;
        yaw_arcs(
            nominal(arm).base, poses[i], at,
            [&](const Pose<double>& pose, ArcSet& turns) {
                return turns_of(arm, limits, pose, Turned::base, turns, left);
            },
            set);
        if (left > 0) work.open.push_back({set, weight[i]});
        if (set.full) {
            always += weight[i];
            continue;
        }
        for (int k = 0; k < set.count; ++k) {
            const Arc& arc = set.arc[k];
            const bool over = arc.upper >= pi;
            events.push_back({arc.lower, weight[i]});
            events.push_back({over ? arc.upper - two_pi : arc.upper, -weight[i]});
            if (over) at_seam += weight[i];
        }
    }
    std::sort(events.begin(), events.end(), [](const YawEvent& a, const YawEvent& b) {
        return a.yaw != b.yaw ? a.yaw < b.yaw : a.weight > b.weight;
    });
    const BestYaw best = best_yaw(events.data(), static_cast<int>(events.size()), always + at_seam);
    unproven = 0;
    for (const OpenYaws& one : work.open)
        if (!contains(one.arcs, best.yaw)) unproven += one.weight;
    return best;
}

/// Checks a pose that an arm may see from any of several base positions (k, 3): it must be rigid, and in m as
/// seen from at least one of them.
template <class AnyArm>
Problem check_placed(const AnyArm& arm, const double* m, const Buffer& positions, double& value) noexcept {
    Problem problem = check_pose(m, value);
    for (Py_ssize_t i = 0; problem == Problem::none && i < positions.shape(0); ++i) {
        double seen[16];
        std::copy(m, m + 16, seen);
        for (int k = 0; k < 3; ++k) seen[4 * k + 3] -= positions.data<double>()[3 * i + k];
        if (check_pose(arm, seen, value) == Problem::none) return Problem::none;
        problem = i + 1 < positions.shape(0) ? Problem::none : Problem::pose_in_millimetres;
    }
    return problem;
}

/// Writes for each base position (k, 3), m: best yaw and its stretch (rad), weight reached, and weight of the
/// others that are not excluded, (k, 4).
template <class Handle>
void place_many(const Handle& self, Floats pose, Floats weight, Floats position, double margin, Floats out,
                int threads) {
    const Buffer p(pose), w(weight), at(position), to(out, true);
    const auto limits = table(self, margin);
    const auto n = static_cast<std::size_t>(p.shape(0)), k = static_cast<std::size_t>(at.shape(0));
    std::vector<Pose<double>> poses(n);
    Outcome outcome;
    for (std::size_t i = 0; i < n; ++i) {
        double value = 0;
        const Problem problem = check_placed(self.arm, p.data<double>() + 16 * i, at, value);
        if (problem != Problem::none) outcome.report(problem, i, value);
        poses[i] = load_pose(p.data<double>() + 16 * i);
    }
    refuse(outcome, p, 2, "poses");
    watched(k, threads, [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
        YawWork work;
        for (std::size_t i = begin; i < end && !(i > begin && watch.ended(thread, i - begin)); ++i) {
            const double* x = at.data<double>() + 3 * i;
            double* row = to.data<double>() + 4 * i;
            const BestYaw best =
                place_at(self.arm, limits, poses, w.data<double>(), {x[0], x[1], x[2]}, work, row[3]);
            row[0] = best.yaw;
            row[1] = best.stretch;
            row[2] = best.reached;
        }
    });
}

/// The tilts and turns of a map's cells (rad), and whether each turn has its opposite at the other end.
struct MapAngles {
    const double *tilt, *turn;
    std::size_t tilts, turns;
    bool opposed;

    /// Reads the angles of tilt and turn (rad).
    MapAngles(const Buffer& of_tilt, const Buffer& of_turn)
        : tilt(of_tilt.data<double>()),
          turn(of_turn.data<double>()),
          tilts(static_cast<std::size_t>(of_tilt.shape(0))),
          turns(static_cast<std::size_t>(of_turn.shape(0))),
          opposed(true) {
        for (std::size_t k = 0; k < turns; ++k) opposed &= turn[k] == -turn[turns - 1 - k];
    }
    /// The number of cells of one wrist position.
    std::size_t cells() const { return tilts * turns; }
};

/// Where the cells of one wrist position are written; null: not requested.
struct CellColumns {
    std::uint8_t* gc;
    float* freedom;
    std::uint8_t *yaw, *roll, *proven, *unproven;

    /// The columns from cell k on.
    CellColumns at(std::size_t k) const {
        const auto moved = [k](std::uint8_t* column) { return column ? column + k : nullptr; };
        return {gc + k, freedom + k, moved(yaw), moved(roll), moved(proven), moved(unproven)};
    }
    /// Writes the values of cell k.
    void write(const ReducedCell& cell, Proven certain, std::size_t k) const {
        gc[k] = cell.gc;
        freedom[k] = cell.freedom;
        if (yaw) yaw[k] = cell.yaw;
        if (roll) roll[k] = cell.roll;
        if (proven) proven[k] = static_cast<std::uint8_t>(certain);
        if (unproven) unproven[k] = cell.unproven;
    }
};

/// What is proven for a whole cell around its middle, the cell that `place` computed last: nothing for an own
/// chain, and Python does not ask for it.
template <class AnyArm>
Proven proven_of(const ReducedArm<AnyArm>& arm, const ReducedPlace<AnyArm>& place, const ReducedPose& middle,
                 const CellSize& half) {
    if constexpr (proven_arm<AnyArm>)
        return Proven::unknown;
    else {
        double free = 0;
        int gc = -1;
        place.widest(middle.turn, free, gc);
        return proven_cell(arm, middle, half, free, gc);
    }
}

/// Writes the cells of one wrist position, tilt by tilt. If turn and -turn have the same cell, each is
/// computed once.
template <class AnyArm>
void place_cells(const ReducedArm<AnyArm>& arm, double r, double height, const MapAngles& d,
                 const CellSize& half, const CellColumns& to) {
    ReducedPlace<AnyArm> place(arm, r, height);
    if (!place.any() && !to.proven) {
        for (std::size_t k = 0; k < d.cells(); ++k) to.write({}, Proven::unknown, k);
        return;
    }
    const bool halved = arm.mirrored && d.opposed;
    const std::size_t made = halved ? (d.turns + 1) / 2 : d.turns;
    for (std::size_t i = 0; i < d.tilts; ++i) {
        place.tilt(d.tilt[i]);
        const CellColumns row = to.at(i * d.turns);
        for (std::size_t k = 0; k < made; ++k) {
            const ReducedCell cell = place.cell(d.turn[k], to.yaw != nullptr, to.roll != nullptr);
            const Proven known = to.proven
                                     ? proven_of(arm, place, {r, height, d.tilt[i], d.turn[k], 0, 0}, half)
                                     : Proven::unknown;
            row.write(cell, known, k);
            if (halved) row.write(cell, known, d.turns - 1 - k);
        }
    }
}

/// Writes gc and freedom of the cells (k, tilts, turns) of a map at wrist positions (k, 2), r and height.
/// Optional: yaw, roll, the proof for cells of `size` along each axis (4,), and the unproven branches.
template <class Handle>
void map_cells(const Handle& self, Floats places, Floats tilt, Floats turn, Floats size, double margin,
               Bytes gc, Singles freedom, std::optional<Bytes> yaw, std::optional<Bytes> roll,
               std::optional<Bytes> proven, std::optional<Bytes> unproven, int threads) {
    const Buffer at(places), tilts(tilt), turns(turn), to_gc(gc, true), to_freedom(freedom, true);
    Buffer to_yaw, to_roll, to_proven, to_unproven;
    const Buffer whole(size);
    const double* w = whole.data<double>();
    const CellSize half{0.5 * w[0], 0.5 * w[1], 0.5 * w[2], 0.5 * w[3]};
    const auto column = [](const std::optional<Bytes>& of, Buffer& to) -> std::uint8_t* {
        if (!of) return nullptr;
        to.get(*of, true);
        return to.data<std::uint8_t>();
    };
    const MapAngles directions(tilts, turns);
    const CellColumns out{to_gc.data<std::uint8_t>(), to_freedom.data<float>(),
                          column(yaw, to_yaw),        column(roll, to_roll),
                          column(proven, to_proven),  column(unproven, to_unproven)};
    const auto arm = reduced_arm(self.arm, margin);
    watched(static_cast<std::size_t>(at.shape(0)), threads,
            [&](std::size_t begin, std::size_t end, std::size_t thread, Watch& watch) {
                for (std::size_t i = begin; i < end && !(i > begin && watch.ended(thread, i - begin)); ++i) {
                    const double* place = at.data<double>() + 2 * i;
                    place_cells(arm, place[0], place[1], directions, half, out.at(i * directions.cells()));
                }
            });
}

/// Writes the poses (n, 4, 4) of reduced coordinates (n, 6): r, height, tilt, turn, azimuth, roll.
template <class Handle>
void poses_of_reduced(const Handle& self, Floats coordinates, Floats out) {
    const Buffer in(coordinates), to(out, true);
    for (Py_ssize_t i = 0; i < in.shape(0); ++i) {
        const double* c = in.data<double>() + 6 * i;
        store_pose(pose_of(self.arm, {c[0], c[1], c[2], c[3], c[4], c[5]}), to.data<double>() + 16 * i);
    }
}

/// Writes the reduced coordinates (n, 6) of poses (n, 4, 4).
template <class Handle>
void reduced_of_poses(const Handle& self, Floats pose, Floats out) {
    const Buffer in(pose), to(out, true);
    for_each<2>("pose", {&in, &to}, {2, 1}, 1, [&](const Py_ssize_t* at, double& value) {
        const double* m = in.data<double>() + at[0];
        const Problem problem = check_pose(self.arm, m, value);
        if (problem != Problem::none) return problem;
        const ReducedPose p = reduced_pose(self.arm, load_pose(m));
        const double six[] = {p.r, p.height, p.tilt, p.turn, p.azimuth, p.roll};
        std::memcpy(to.data<double>() + at[1], six, sizeof(six));
        return Problem::none;
    });
}

/// Writes the derivatives of the ends of the feasible arcs of a pose by its twist to out, (arcs, 2, 6).
template <class Handle>
void end_slopes_one(const Handle& self, Floats pose, long long gc, double margin, Floats out) {
    const Buffer p(pose), to(out, true);
    const Pose<double> frame = load_pose(p.data<double>());
    ArcSet arcs;
    if constexpr (std::is_same_v<Handle, ArmHandle>) {
        const SelfMotion<double> m = self_motion(self.arm, frame, static_cast<int>(gc));
        (void)feasible(m, table(self, margin), arcs);
    } else if constexpr (std::is_same_v<Handle, ChainArmHandle>) {
        ProvenArcs found;
        feasible(self.arm, frame, static_cast<int>(gc), self.arm.nominal.limits, margin, found);
        arcs = found.arcs;
    } else {
        ProvenArcs found[configurations];
        feasible_all(self.arm, frame, nominal(self.arm).limits, found);
        arcs = in_robot_order(self.arm, found[gc].arcs);
    }
    EndSlopes slopes;
    end_slopes(self.arm, frame, static_cast<int>(gc), arcs, slopes);
    for (Py_ssize_t i = 0; i < to.shape(0) && i < arcs.count; ++i)
        std::memcpy(to.data<double>() + 12 * i, slopes.entry[i], sizeof(slopes.entry[i]));
}

/// The smallest and largest distance (m) of the wrist from the shoulder in reduced coordinates.
template <class Handle>
std::pair<double, double> reduced_distances(const Handle& self) {
    const ReducedReach reach = reduced_reach(self.arm);
    return {reach.inner, reach.outer};
}

/// Writes the middle and the radius (m) of a ball around all positions that the end effector can have.
template <class Handle>
void reach_ball_of(const Handle& self, Floats out) {
    const Buffer to(out, true);
    const ReachBall ball = reach_ball(self.arm);
    const double four[] = {ball.centre.x, ball.centre.y, ball.centre.z, ball.radius};
    std::memcpy(to.data<double>(), four, sizeof(four));
}

/// Binds reachability, freedom, turns, placement, maps and slopes, which arms of all kinds have.
template <class Handle>
void bind_reach_of(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("reachable_many", &reachable_many<Handle>, "pose"_a, "margin"_a, "out"_a, "threads"_a);
    arm.def("freedom_many", &freedom_many<Handle>, "pose"_a, "margin"_a, "widths"_a, "codes"_a, "threads"_a);
    arm.def("turns_many", &turns_many<Handle>, "pose"_a, "turned"_a, "margin"_a, "unproven"_a, "threads"_a);
    arm.def("place_many", &place_many<Handle>, "pose"_a, "weight"_a, "position"_a, "margin"_a, "out"_a,
            "threads"_a);
    arm.def("map_cells", &map_cells<Handle>, "places"_a, "tilt"_a, "turn"_a, "size"_a, "margin"_a, "gc"_a,
            "freedom"_a, "yaw"_a.none(), "roll"_a.none(), "proven"_a.none(), "unproven"_a.none(),
            "threads"_a);
    arm.def("poses_of_reduced", &poses_of_reduced<Handle>, "coordinates"_a, "out"_a);
    arm.def("reduced_of_poses", &reduced_of_poses<Handle>, "pose"_a, "out"_a);
    arm.def("reduced_distances", &reduced_distances<Handle>);
    arm.def("reach_ball", &reach_ball_of<Handle>, "out"_a);
    arm.def("freedom_gradient_many", &freedom_gradient_many<Handle>, "pose"_a, "margin"_a, "out"_a,
            "threads"_a);
    arm.def("end_slopes_one", &end_slopes_one<Handle>, "pose"_a, "gc"_a, "margin"_a, "out"_a);
}

}  // namespace

/// Binds reachability, maps, placement and slopes of an arm with an offset.
void bind_offset_reach(nb::class_<OffsetHandle>& arm) { bind_reach_of(arm); }
/// Binds freedom, turns, maps, placement and slopes of a nearly S-R-S arm.
void bind_chain_reach(nb::class_<ChainArmHandle>& arm) { bind_reach_of(arm); }
/// Binds freedom, turns, maps, placement and slopes of an arm with an offset and its own chain.
void bind_offset_chain_reach(nb::class_<OffsetChainHandle>& arm) { bind_reach_of(arm); }

/// Registers Turned, and reachability, maps, placement and slopes of an S-R-S arm.
void bind_reach(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<Turned>(m, "Turned").value("BASE", Turned::base).value("TOOL", Turned::tool);
    bind_reach_of(arm);
}

}  // namespace binding
