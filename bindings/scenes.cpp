// Scenes made ready for an arm, and how near the arm is to them.
#include "elements.hpp"
#include "scene_handle.hpp"

namespace binding {

using namespace armangle;

namespace {

/// Whose frame a row of a solid is in: the user's, the DH base, DH frame 7, or the tool's.
enum class Within : int { user, base, flange, tool };

/// kind, radius, a, b, three axes, and whose frame.
constexpr Py_ssize_t solid_width = 18;
/// DH frame, radius, begin, end.
constexpr Py_ssize_t rod_width = 8;

Vec3<double> vector_of(const double* x) noexcept { return {x[0], x[1], x[2]}; }

void check_rows(const Buffer& rows, Py_ssize_t width) {
    if (rows.ndim() != 2 || !rows.is_array('d', {rows.shape(0), width}))
        throw std::invalid_argument("rows of another width were expected");
}

Solid solid_of(const Arm& arm, const double* row) noexcept {
    const Solid solid{static_cast<SolidKind>(static_cast<int>(row[0])),
                      row[1],
                      vector_of(row + 2),
                      vector_of(row + 5),
                      {vector_of(row + 8), vector_of(row + 11), vector_of(row + 14)}};
    switch (static_cast<Within>(static_cast<int>(row[17]))) {
        case Within::user: return arm.has_base ? placed(arm.base_inverse, solid) : solid;
        case Within::tool: return arm.has_tool ? placed(arm.tool, solid) : solid;
        default: return solid;
    }
}

Rod rod_of(const double* row) noexcept { return {vector_of(row + 2), vector_of(row + 5), row[1]}; }

/// The balls, eight a block.
void fill_blocks(const std::vector<std::size_t>& ids, const std::vector<Solid>& solids, SceneHandle& to) {
    constexpr double nowhere = 1e8;  // m: what fills up the last block is reached by no arm
    for (std::size_t first = 0; first < ids.size(); first += 8) {
        BallBlock block;
        for (std::size_t i = 0; i < 8; ++i) {
            const bool is = first + i < ids.size();
            const std::size_t id = is ? ids[first + i] : no_ball;
            block.x[i] = is ? solids[id].a.x : nowhere;
            block.y[i] = is ? solids[id].a.y : nowhere;
            block.z[i] = is ? solids[id].a.z : nowhere;
            block.radius[i] = is ? solids[id].radius : 0.0;
            to.ball_id.push_back(static_cast<std::uint16_t>(id));
        }
        to.blocks.push_back(block);
    }
}

/// Rows of solids: those of the user, then of link 0 from `first_base` on, then what is held from
/// `first_held` on; rows of rods of links 3 and 4, then of those that swing; which pairs may touch, a byte
/// each; pairs (obstacle, link) of the arm's own.
void make_scene(SceneHandle* self, const ArmHandle& arm, Floats solids, Py_ssize_t first_base,
                Py_ssize_t first_held, Floats rods, Codes ignored, Ints own, double clearance) {
    const Buffer rows(solids), links(rods), touch(ignored);
    check_rows(rows, solid_width);
    check_rows(links, rod_width);
    new (self) SceneHandle();
    std::vector<Solid> all;
    std::vector<std::size_t> balls;
    for (Py_ssize_t k = 0; k < rows.shape(0); ++k) {
        const Solid solid = solid_of(arm.arm, rows.data<double>() + k * solid_width);
        all.push_back(solid);
        if (k >= first_held) {
            self->held.push_back(solid);
        } else if (solid.kind == SolidKind::ball) {
            balls.push_back(static_cast<std::size_t>(k));
        } else {
            self->solids.push_back(solid);
            self->solid_id.push_back(static_cast<std::uint16_t>(k));
        }
    }
    fill_blocks(balls, all, *self);
    for (Py_ssize_t k = 0; k < links.shape(0); ++k) {
        const double* row = links.data<double>() + k * rod_width;
        const int link = static_cast<int>(row[0]);
        if (link == 3 || link == 4)
            self->parts.push_back({rod_of(row), link == 4});
        else
            self->swings.push_back({rod_of(row), link});
    }
    const auto* bytes = touch.data<std::uint8_t>();
    self->ignored.assign(bytes, bytes + touch.shape(0) * touch.shape(1));
    const Buffer pairs(own);
    for (Py_ssize_t k = 0; k < pairs.shape(0); ++k) {
        const long long* pair = pairs.data<long long>() + 2 * k;
        self->own.push_back({static_cast<std::uint16_t>(pair[0]), static_cast<std::uint16_t>(pair[1])});
    }
    const auto count = [](const auto& vector) { return static_cast<int>(vector.size()); };
    Scene& v = self->view;
    v.blocks = self->blocks.data();
    v.ball_id = self->ball_id.data();
    v.block_count = count(self->blocks);
    v.solids = self->solids.data();
    v.solid_id = self->solid_id.data();
    v.solid_count = count(self->solids);
    v.held = self->held.data();
    v.held_count = count(self->held);
    v.first_held = static_cast<int>(first_held);
    v.parts = self->parts.data();
    v.part_count = count(self->parts);
    v.swings = self->swings.data();
    v.swing_count = count(self->swings);
    v.own = self->own.data();
    v.own_count = count(self->own);
    v.base_count = static_cast<int>(first_held - first_base);
    v.first_base = static_cast<int>(first_base);
    v.ignored = self->ignored.data();
    v.link_count = static_cast<int>(touch.shape(1));
    v.clearance = clearance;
    v.base_tag = base_contact(v);
}

/// Where each rod rests, link 0, 3, 4 or 7, or minus the link that it swings with; the rods are taken to
/// where they rest, or swing about.
void resting_links(const ArmHandle& self, Floats rods, Ints link) {
    const Buffer rows(rods, true), out(link, true);
    check_rows(rows, rod_width);
    for (Py_ssize_t k = 0; k < rows.shape(0); ++k) {
        double* row = rows.data<double>() + k * rod_width;
        Rod rod = rod_of(row);
        const int given = static_cast<int>(row[0]);
        const Resting found = resting_link(self.arm, given, rod);
        out.data<long long>()[k] = found.swings ? -given : found.link;
        row[0] = static_cast<double>(out.data<long long>()[k]);
        const double ends[6] = {rod.begin.x, rod.begin.y, rod.begin.z, rod.end.x, rod.end.y, rod.end.z};
        std::memcpy(row + 2, ends, sizeof(ends));
    }
}

/// distance, psi_rate, six coordinates of two points in the user's frame; the pair is obstacle * 256 + link.
/// Without a pair the points are NaN.
void store_proximity(const Arm& arm, const Proximity& found, double* out, long long* pair) noexcept {
    out[0] = found.distance;
    out[1] = found.psi_rate;
    const Vec3<double> points[2] = {found.on_link, found.on_obstacle};
    for (int k = 0; k < 2; ++k) {
        const Vec3<double> p = arm.has_base ? arm.base.rotation * points[k] + arm.base.position : points[k];
        const double coordinates[3] = {p.x, p.y, p.z};
        for (int i = 0; i < 3; ++i) out[2 + 3 * k + i] = found.pair ? coordinates[i] : not_a_number;
    }
    *pair = pair_number(found.pair);
}

Problem reached(const SelfMotion<double>& m, double& value) noexcept {
    value = m.circle.triangle.excess;
    if (is_unreachable(m.circle)) return Problem::unreachable;
    return is_folded(m.circle) ? Problem::folded : Problem::none;
}

/// The nearest pair of each (pose, psi, gc).
void proximity_many(const ArmHandle& self, const SceneHandle& scene, Floats pose, Floats psi, Ints gc,
                    Floats out, Ints pair, int threads) {
    const Buffer p(pose), a(psi), g(gc), to(out, true), who(pair, true);
    for_each<5>(
        "pose", {&p, &a, &g, &to, &who}, {2, 0, 0, 1, 0}, threads, [&](const Py_ssize_t* at, double& value) {
            const double* m = p.data<double>() + at[0];
            const Problem problem = check_pose(m, value);
            if (problem != Problem::none) return problem;
            const long long branch = g.data<long long>()[at[2]];
            value = static_cast<double>(branch);
            if (branch < 0 || branch >= configurations) return Problem::gc_range;
            const SelfMotion<double> motion = self_motion(self.arm, load_pose(m), static_cast<int>(branch));
            if (const Problem far = reached(motion, value); far != Problem::none) return far;
            const double angle = a.data<double>()[at[1]];
            store_proximity(self.arm, proximity(self.arm, scene.view, motion, angle),
                            to.data<double>() + at[3], who.data<long long>() + at[4]);
            return Problem::none;
        });
}

/// The widest psi of each (pose, gc) within the limits: psi, its nearest pair, and the status of the limits.
void widest_many(const ArmHandle& self, const SceneHandle& scene, Floats pose, Ints gc, double margin,
                 Floats psi, Floats out, Ints pair, Ints status, int threads) {
    const Buffer p(pose), g(gc), a(psi, true), to(out, true), who(pair, true), code(status, true);
    const LimitTable table = limit_table(self.arm, margin);
    for_each<6>("pose", {&p, &g, &a, &to, &who, &code}, {2, 0, 0, 1, 0, 0}, threads,
                [&](const Py_ssize_t* at, double& value) {
                    const double* m = p.data<double>() + at[0];
                    const Problem problem = check_pose(m, value);
                    if (problem != Problem::none) return problem;
                    const long long branch = g.data<long long>()[at[1]];
                    value = static_cast<double>(branch);
                    if (branch < 0 || branch >= configurations) return Problem::gc_range;
                    const SelfMotion<double> motion =
                        self_motion(self.arm, load_pose(m), static_cast<int>(branch));
                    ArcSet own;
                    code.data<long long>()[at[5]] = static_cast<long long>(feasible(motion, table, own));
                    const Widest found = widest(self.arm, scene.view, motion, own);
                    a.data<double>()[at[2]] = found.psi;
                    store_proximity(self.arm, found.nearest, to.data<double>() + at[3],
                                    who.data<long long>() + at[4]);
                    return Problem::none;
                });
}

}  // namespace

void bind_scenes(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<SolidKind>(m, "SolidKind")
        .value("BALL", SolidKind::ball)
        .value("CAPSULE", SolidKind::capsule)
        .value("BOX", SolidKind::box)
        .value("HALF_SPACE", SolidKind::half_space);
    nb::enum_<Within>(m, "Within")
        .value("USER", Within::user)
        .value("BASE", Within::base)
        .value("FLANGE", Within::flange)
        .value("TOOL", Within::tool);
    m.attr("MOST_PARTS") = most_parts;
    m.attr("MOST_LINKS") = most_links;
    m.attr("MOST_OBSTACLES") = most_obstacles;
    nb::class_<SceneHandle>(m, "Scene")
        .def("__init__", &make_scene, "arm"_a, "solids"_a, "first_base"_a, "first_held"_a, "rods"_a,
             "ignored"_a, "own"_a, "clearance"_a);
    arm.def("resting_links", &resting_links, "rods"_a, "link"_a);
    arm.def("proximity_many", &proximity_many, "scene"_a, "pose"_a, "psi"_a, "gc"_a, "out"_a, "pair"_a,
            "threads"_a);
    arm.def("widest_many", &widest_many, "scene"_a, "pose"_a, "gc"_a, "margin"_a, "psi"_a, "out"_a, "pair"_a,
            "status"_a, "threads"_a);
}

}  // namespace binding
