// Scenes prepared for an arm, and distances of the arm to them.
#include <algorithm>
#include <cmath>

#include "elements.hpp"
#include "offset_handle.hpp"
#include "scene_handle.hpp"

namespace binding {

using namespace armangle;

namespace {

/// The frame of a solid's row: the user's, the DH base, DH frame 7, or the tool's. A row of `points` only
/// reserves its number among the obstacles.
enum class Within : int { user, base, flange, tool, points };

/// kind, radius, a, b, three axes, and frame. Corners of hulls and distances of fields are stored separately.
constexpr Py_ssize_t solid_width = 18;
/// DH frame, radius, begin, end.
constexpr Py_ssize_t rod_width = 8;
/// x, y, z, radius, and its obstacle.
constexpr Py_ssize_t point_width = 5;
/// The row of its hull, x, y, z.
constexpr Py_ssize_t corner_width = 4;
/// The row of the field, number of nodes along each axis, spacing.
constexpr Py_ssize_t field_width = 5;

/// The vector of three numbers.
Vec3<double> vector_of(const double* x) noexcept { return {x[0], x[1], x[2]}; }

/// Raises an error unless an array has rows of this width.
void check_rows(const Buffer& rows, Py_ssize_t width) {
    if (rows.ndim() != 2 || !rows.is_array('d', {rows.shape(0), width}))
        throw std::invalid_argument("rows of another width were expected");
}

/// The frame in which the row of a solid is given.
Within frame_of(const double* row) noexcept { return static_cast<Within>(static_cast<int>(row[17])); }

/// Makes the solid of a row, in the DH base or in DH frame 7.
Solid solid_of(const Arm& arm, const Pose<double>& base, const double* row) noexcept {
    const Solid solid{static_cast<SolidKind>(static_cast<int>(row[0])),
                      row[1],
                      vector_of(row + 2),
                      vector_of(row + 5),
                      {vector_of(row + 8), vector_of(row + 11), vector_of(row + 14)}};
    switch (frame_of(row)) {
        case Within::user: return arm.has_base ? placed(arm.base_inverse, solid) : solid;
        case Within::base: return placed(base, solid);
        case Within::tool: return arm.has_tool ? placed(arm.tool, solid) : solid;
        default: return solid;
    }
}

/// The rod of a row of numbers.
Rod rod_of(const double* row) noexcept { return {vector_of(row + 2), vector_of(row + 5), row[1]}; }

/// A ball of the user, and its number among the obstacles.
struct PlacedBall {
    Vec3<double> centre;
    double radius;
    std::uint16_t id;
};

/// Spreads the bits of x (below 2^21): two zeros follow each bit.
std::uint64_t spaced(std::uint64_t x) noexcept {
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

/// The bounding box of points.
struct PairBounds {
    Vec3<double> low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};

    /// Extends the box to contain a point.
    void hold(const Vec3<double>& p) noexcept {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
};

/// Sorts balls in Morton order, in which neighbours are near in space.
void sort_by_place(std::vector<PlacedBall>& balls) {
    PairBounds bounds;
    for (const PlacedBall& ball : balls) bounds.hold(ball.centre);
    const Vec3<double> size = bounds.high - bounds.low;
    const double extent = std::max({size.x, size.y, size.z, 1e-9});
    const auto cell = [&](double x) { return spaced(static_cast<std::uint64_t>(x / extent * 2097151.0)); };
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    order.reserve(balls.size());
    for (const PlacedBall& ball : balls) {
        const Vec3<double> p = ball.centre - bounds.low;
        order.emplace_back(cell(p.x) | cell(p.y) << 1 | cell(p.z) << 2, order.size());
    }
    std::sort(order.begin(), order.end());
    std::vector<PlacedBall> sorted;
    sorted.reserve(balls.size());
    for (const auto& place : order) sorted.push_back(balls[place.second]);
    balls = std::move(sorted);
}

/// Makes bounding balls of `each` units of members {centre, radius}; `unit` members form a unit.
template <class Members>
std::vector<BallGroup> grouped(const Members& members, std::size_t each, std::size_t unit) {
    std::vector<BallGroup> out;
    for (std::size_t begin = 0; begin < members.size(); begin += each * unit) {
        const std::size_t end = std::min(members.size(), begin + each * unit);
        PairBounds bounds;
        for (std::size_t k = begin; k < end; ++k) bounds.hold(members[k].centre);
        BallGroup group{(bounds.low + bounds.high) * 0.5, 0.0, static_cast<int>(begin / unit),
                        static_cast<int>((end - begin + unit - 1) / unit)};
        for (std::size_t k = begin; k < end; ++k)
            group.radius = std::max(group.radius, norm(members[k].centre - group.centre) + members[k].radius);
        group.radius *= 1.0 + 1e-12;  // the rounding of this computation
        out.push_back(group);
    }
    return out;
}

/// Stores the balls: eight a block, blocks in groups, groups in clusters.
void fill_blocks(std::vector<PlacedBall>& balls, SceneHandle& to) {
    constexpr double nowhere = 1e8;  // m: the last block is filled up with balls that no arm reaches
    const PlacedBall filler{{nowhere, nowhere, nowhere}, 0.0, no_ball};
    sort_by_place(balls);
    for (std::size_t first = 0; first < balls.size(); first += 8) {
        BallBlock block;
        for (std::size_t i = 0; i < 8; ++i) {
            const PlacedBall& ball = first + i < balls.size() ? balls[first + i] : filler;
            block.x[i] = ball.centre.x;
            block.y[i] = ball.centre.y;
            block.z[i] = ball.centre.z;
            block.radius[i] = ball.radius;
            to.ball_id.push_back(ball.id);
        }
        to.blocks.push_back(block);
    }
    to.groups = grouped(balls, group_blocks, 8);
    to.clusters = grouped(to.groups, group_groups, 1);
}

/// Stores corners of hulls, grouped by row, and distances of fields, consecutively, and links each solid to
/// its data by its row. Distances are rounded down: they remain lower bounds.
void fill_hulls_and_fields(std::vector<Solid>& solids, const Buffer& corners, const Buffer& fields,
                           const Buffer& distances, SceneHandle& to) {
    check_rows(corners, corner_width);
    check_rows(fields, field_width);
    const double* row = corners.data<double>();
    for (Py_ssize_t k = 0; k < corners.shape(0); ++k, row += corner_width)
        to.corners.push_back(vector_of(row + 1));
    row = corners.data<double>();
    for (Py_ssize_t k = 0; k < corners.shape(0); ++k, row += corner_width) {
        Solid& solid = solids.at(static_cast<std::size_t>(row[0]));
        const Vec3<double>& corner = to.corners[static_cast<std::size_t>(k)];
        if (solid.corners == nullptr) solid.corners = &corner;
        ++solid.corner_count;
        solid.reach = std::max(solid.reach, norm(corner));
    }
    const double* value = distances.data<double>();
    to.distances.reserve(static_cast<std::size_t>(distances.shape(0)));
    for (Py_ssize_t k = 0; k < distances.shape(0); ++k) {
        const float near = static_cast<float>(value[k]);
        to.distances.push_back(near > value[k] ? std::nextafter(near, -std::numeric_limits<float>::infinity())
                                               : near);
    }
    row = fields.data<double>();
    std::size_t first = 0;
    to.fields.reserve(static_cast<std::size_t>(fields.shape(0)));
    for (Py_ssize_t k = 0; k < fields.shape(0); ++k, row += field_width) {
        Field field{to.distances.data() + first, {}, row[4]};
        std::size_t size = 1;
        for (int i = 0; i < 3; ++i) {
            field.size[i] = static_cast<int>(row[1 + i]);
            size *= static_cast<std::size_t>(field.size[i]);
        }
        first += size;
        if (first > to.distances.size())
            throw std::invalid_argument("a field needs a distance for each node");
        raise_to_lower_bounds(field, to.distances.data() + (first - size));
        to.fields.push_back(field);
        solids.at(static_cast<std::size_t>(row[0])).field = &to.fields.back();
    }
}

/// The pose of link 0 in the DH base.
Pose<double> base_link(const Arm&) noexcept { return identity_pose(); }
/// The pose of link 0 of an arm with an offset in the DH base: the identity.
Pose<double> base_link(const OffsetArm&) noexcept { return identity_pose(); }
/// The pose of link 0 of an arm on its own chain in the base of the nominal arm.
template <class AnyChain>
Pose<double> base_link(const AnyChain& arm) noexcept {
    const Arm& rows = nominal(arm);
    return rows.has_base ? rows.base_inverse * arm.link[0] : arm.link[0];
}

/// Makes a scene for an arm. Rows of solids: first the user's (points of clouds are separate), then link 0
/// from `first_base` on, then held shapes from `first_held` on. Rows of rods: links 3 and 4, then the
/// swinging ones. Also a byte for each pair that may touch, proven distances of own pairs (m), and the arm's
/// own pairs (obstacle, link).
template <class Handle>
void make_scene(SceneHandle* self, const Handle& of, Floats solids, Py_ssize_t first_base,
                Py_ssize_t first_held, Floats cloud, Floats corners, Floats fields, Floats distances,
                Floats rods, Codes ignored, Floats apart, Ints own, double clearance, double soft) {
    const Arm& arm = nominal(of.arm);
    const Pose<double> base = base_link(of.arm);
    const Buffer rows(solids), links(rods), touch(ignored);
    check_rows(rows, solid_width);
    check_rows(links, rod_width);
    new (self) SceneHandle();
    std::vector<PlacedBall> balls;
    std::vector<Solid> all;
    for (Py_ssize_t k = 0; k < rows.shape(0); ++k)
        all.push_back(solid_of(arm, base, rows.data<double>() + k * solid_width));
    fill_hulls_and_fields(all, Buffer(corners), Buffer(fields), Buffer(distances), *self);
    for (Py_ssize_t k = 0; k < rows.shape(0); ++k) {
        const Solid& solid = all[static_cast<std::size_t>(k)];
        const auto id = static_cast<std::uint16_t>(k);
        if (frame_of(rows.data<double>() + k * solid_width) == Within::points) continue;
        if (k >= first_held) {
            self->held.push_back(solid);
        } else if (solid.kind == SolidKind::ball && k < first_base) {
            balls.push_back({solid.a, solid.radius, id});
        } else {
            self->solids.push_back(solid);
            self->solid_id.push_back(id);
        }
    }
    const Buffer points(cloud);
    check_rows(points, point_width);
    for (Py_ssize_t k = 0; k < points.shape(0); ++k) {
        const double* row = points.data<double>() + k * point_width;
        const Vec3<double> p = vector_of(row);
        const Pose<double>& to = arm.base_inverse;
        balls.push_back(
            {arm.has_base ? to.rotation * p + to.position : p, row[3], static_cast<std::uint16_t>(row[4])});
    }
    fill_blocks(balls, *self);
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
    const Buffer proven(apart);
    if (!proven.is_array('d', {touch.shape(0) - first_base, touch.shape(1)}))
        throw std::invalid_argument("a distance for each own shape and link is needed");
    self->apart.assign(proven.data<double>(), proven.data<double>() + proven.shape(0) * proven.shape(1));
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
    v.groups = self->groups.data();
    v.clusters = self->clusters.data();
    v.cluster_count = count(self->clusters);
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
    v.apart = self->apart.data();
    v.link_count = static_cast<int>(touch.shape(1));
    v.clearance = clearance;
    v.soft = soft;
    v.base_tag = base_contact(v);
    bound_parts(v);
}

/// Writes the link on which each rod rests, 0, 3, 4 or 7, or minus the link with which it swings. The rods
/// are transformed to that link, or to its axis.
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

/// Finds two shapes of the arm that are always too near: obstacle * 256 + link, or -1; and their largest
/// distance (m).
nb::tuple always_near_of(const SceneHandle& scene, const ArmHandle& self) {
    const OwnDistance found = always_near(self.arm, scene.view);
    return nb::make_tuple(pair_number(found.pair), found.most);
}

/// Writes lower bounds of the distance (m) of each two rods over all joints, below the diagonal of out (n,
/// n), -infinity elsewhere and for links that one joint joins. The rods are in the order of their DH frames.
/// All pairs share the budget of `cells`.
void never_nearer_all(const ArmHandle& self, Floats rods, Floats out, int cells) {
    const Buffer rows(rods), to(out, true);
    check_rows(rows, rod_width);
    const Py_ssize_t count = rows.shape(0);
    if (!to.is_array('d', {count, count})) throw std::invalid_argument("out must be of shape (n, n)");
    const auto link = [&](Py_ssize_t k) { return static_cast<int>(rows.data<double>()[k * rod_width]); };
    const auto each = [&](const auto& visit) {
        for (Py_ssize_t a = 0; a < count; ++a)
            for (Py_ssize_t b = a + 1; b < count; ++b)
                if (link(b) - link(a) > 1) visit(a, b);
    };
    std::fill_n(to.data<double>(), count * count, not_apart);
    int pairs = 0;
    each([&](Py_ssize_t, Py_ssize_t) { ++pairs; });
    const nb::gil_scoped_release unlocked;
    each([&](Py_ssize_t a, Py_ssize_t b) {
        const Rod first = rod_of(rows.data<double>() + a * rod_width),
                  second = rod_of(rows.data<double>() + b * rod_width);
        to.data<double>()[b * count + a] =
            never_nearer(self.arm, first, link(a), second, link(b), cells / pairs);
    });
}

/// Writes the link of each rod of an arm whose axes do not all meet, also into its row: negative (swinging)
/// for links 1, 2, 5 and 6. Rods stay in the frames of their own links.
template <class Handle>
void true_links(const Handle&, Floats rods, Ints link) {
    const Buffer rows(rods, true), out(link, true);
    check_rows(rows, rod_width);
    for (Py_ssize_t k = 0; k < rows.shape(0); ++k) {
        double* row = rows.data<double>() + k * rod_width;
        const int given = static_cast<int>(row[0]);
        const bool swings = given == 1 || given == 2 || given == 5 || given == 6;
        out.data<long long>()[k] = swings ? -given : given;
        row[0] = static_cast<double>(out.data<long long>()[k]);
    }
}

/// Writes distance, psi_rate, and six coordinates of two points in the user's frame; the pair is obstacle *
/// 256 + link. Without a pair the points are NaN.
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

/// The rate of the self-motion of an S-R-S arm at a posture, as self_motion_rate() gives that of others.
Inverse rate_of(const Arm& arm, const Posture& at) noexcept {
    const SelfMotion<double> m = self_motion(arm, at.pose, at.gc);
    Inverse out{};
    const Joints dq = rate(arm, joint_functions(m), sin_cos(at.psi));
    std::copy(dq.q, dq.q + joints, out.q);
    return out;
}
Inverse rate_of(const ChainArm& arm, const Posture& at) noexcept {
    return self_motion_rate(arm, at.pose, at.psi, at.gc);
}
template <free_joint_arm AnyArm>
Inverse rate_of(const AnyArm& arm, const OffsetPosture& at) noexcept {
    return self_motion_rate(arm, at.pose, at.free, at.gc);
}

/// Writes the nearest pair at each q, as store_proximity() does.
template <class Handle>
void proximity_many(const Handle& self, const SceneHandle& scene, Floats q, Floats out, Ints pair,
                    int threads) {
    const Buffer in(q), to(out, true), who(pair, true);
    for_each<3>("q", {&in, &to, &who}, {1, 1, 0}, threads, [&](const Py_ssize_t* at, double& value) {
        const double* joint = in.data<double>() + at[0];
        const Problem problem = check_joints(self.arm, joint, value);
        if (problem != Problem::none) return problem;
        const Inverse rate = rate_of(self.arm, forward(self.arm, joint));
        double d[joints];
        for (int j = 0; j < joints; ++j) d[j] = rate.q[j];
        store_proximity(nominal(self.arm), proximity(self.arm, scene.view, joint, d),
                        to.data<double>() + at[1], who.data<long long>() + at[2]);
        return Problem::none;
    });
}

/// Writes for each (pose, gc) the psi with the largest clearance within the limits, its nearest pair, and the
/// status of the limits.
void widest_many(const ArmHandle& self, const SceneHandle& scene, Floats pose, Ints gc, double margin,
                 Floats psi, Floats out, Ints pair, Ints status, int threads) {
    const Buffer p(pose), g(gc), a(psi, true), to(out, true), who(pair, true), code(status, true);
    const LimitTable table = limit_table(self.arm, margin);
    for_each<6>("pose", {&p, &g, &a, &to, &who, &code}, {2, 0, 0, 1, 0, 0}, threads,
                [&](const Py_ssize_t* at, double& value) {
                    const double* m = p.data<double>() + at[0];
                    const Problem problem = check_pose(self.arm, m, value);
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

/// Computes the proven arcs of a pose and branch within the limits.
void feasible_of(const ChainArmHandle& self, const Pose<double>& pose, int gc, double margin,
                 ProvenArcs& out) noexcept {
    feasible(self.arm, pose, gc, self.arm.nominal.limits, margin, out);
}
/// Computes the proven arcs of a pose and branch of an arm with an offset, whose own margin counts.
template <class Handle>
void feasible_of(const Handle& self, const Pose<double>& pose, int gc, double, ProvenArcs& out) noexcept {
    feasible(self.arm, pose, gc, out);
}

/// Writes the arm angle (rad) in the middle of the widest arc at the greatest possible clearance, and the
/// nearest pair there, for arms with proven arcs; see widest_many.
template <class Handle>
void proven_widest_many(const Handle& self, const SceneHandle& scene, Floats pose, Ints gc, double margin,
                        Floats psi, Floats out, Ints pair, Ints status, int threads) {
    const Buffer p(pose), g(gc), a(psi, true), to(out, true), who(pair, true), code(status, true);
    for_each<6>("pose", {&p, &g, &a, &to, &who, &code}, {2, 0, 0, 1, 0, 0}, threads,
                [&](const Py_ssize_t* at, double& value) {
                    const double* m = p.data<double>() + at[0];
                    const Problem problem = check_pose(self.arm, m, value);
                    if (problem != Problem::none) return problem;
                    const long long branch = g.data<long long>()[at[1]];
                    value = static_cast<double>(branch);
                    if (branch < 0 || branch >= configurations) return Problem::gc_range;
                    const Pose<double> frame = load_pose(m);
                    const int sign = static_cast<int>(branch);
                    ProvenArcs own;
                    feasible_of(self, frame, sign, margin, own);
                    code.data<long long>()[at[5]] = static_cast<long long>(own.status);
                    const Widest found = widest(self.arm, scene.view, frame, sign, own.arcs);
                    a.data<double>()[at[2]] = found.psi;
                    store_proximity(nominal(self.arm), found.nearest, to.data<double>() + at[3],
                                    who.data<long long>() + at[4]);
                    return Problem::none;
                });
}

}  // namespace

/// Binds links, proximity and the widest arm angle of a nearly S-R-S arm.
void bind_chain_scenes(nb::class_<ChainArmHandle>& arm) {
    using namespace nb::literals;
    arm.def("resting_links", &true_links<ChainArmHandle>, "rods"_a, "link"_a);
    arm.def("proximity_many", &proximity_many<ChainArmHandle>, "scene"_a, "q"_a, "out"_a, "pair"_a,
            "threads"_a);
    arm.def("widest_many", &proven_widest_many<ChainArmHandle>, "scene"_a, "pose"_a, "gc"_a, "margin"_a,
            "psi"_a, "out"_a, "pair"_a, "status"_a, "threads"_a);
}

/// Binds links, proximity and the widest value of the free joint of an arm with an offset, with or without
/// its own chain.
template <class Handle>
void bind_free_joint_scenes(nb::class_<Handle>& arm) {
    using namespace nb::literals;
    arm.def("resting_links", &true_links<Handle>, "rods"_a, "link"_a);
    arm.def("proximity_many", &proximity_many<Handle>, "scene"_a, "q"_a, "out"_a, "pair"_a, "threads"_a);
    arm.def("widest_many", &proven_widest_many<Handle>, "scene"_a, "pose"_a, "gc"_a, "margin"_a, "psi"_a,
            "out"_a, "pair"_a, "status"_a, "threads"_a);
}
/// Binds links, proximity and the widest value of the free joint of an arm with an offset.
void bind_offset_scenes(nb::class_<OffsetHandle>& arm) { bind_free_joint_scenes(arm); }
/// Binds links, proximity and the widest value of the free joint of an arm with an offset and its own chain.
void bind_offset_chain_scenes(nb::class_<OffsetChainHandle>& arm) { bind_free_joint_scenes(arm); }

/// Registers SolidKind, Within, Scene, and links, proximity and the widest arm angle of an S-R-S arm.
void bind_scenes(nb::module_& m, nb::class_<ArmHandle>& arm) {
    using namespace nb::literals;
    nb::enum_<SolidKind>(m, "SolidKind")
        .value("BALL", SolidKind::ball)
        .value("CAPSULE", SolidKind::capsule)
        .value("BOX", SolidKind::box)
        .value("HALF_SPACE", SolidKind::half_space)
        .value("HULL", SolidKind::hull)
        .value("FIELD", SolidKind::field);
    nb::enum_<Within>(m, "Within")
        .value("USER", Within::user)
        .value("BASE", Within::base)
        .value("FLANGE", Within::flange)
        .value("TOOL", Within::tool)
        .value("POINTS", Within::points);
    m.attr("MOST_PARTS") = most_parts;
    m.attr("MOST_LINKS") = most_links;
    m.attr("MOST_OBSTACLES") = most_obstacles;
    nb::class_<SceneHandle>(m, "Scene")
        .def("__init__", &make_scene<ChainArmHandle>, "arm"_a, "solids"_a, "first_base"_a, "first_held"_a,
             "cloud"_a, "corners"_a, "fields"_a, "distances"_a, "rods"_a, "ignored"_a, "apart"_a, "own"_a,
             "clearance"_a, "soft"_a)
        .def("__init__", &make_scene<OffsetHandle>, "arm"_a, "solids"_a, "first_base"_a, "first_held"_a,
             "cloud"_a, "corners"_a, "fields"_a, "distances"_a, "rods"_a, "ignored"_a, "apart"_a, "own"_a,
             "clearance"_a, "soft"_a)
        .def("__init__", &make_scene<OffsetChainHandle>, "arm"_a, "solids"_a, "first_base"_a, "first_held"_a,
             "cloud"_a, "corners"_a, "fields"_a, "distances"_a, "rods"_a, "ignored"_a, "apart"_a, "own"_a,
             "clearance"_a, "soft"_a)
        .def("__init__", &make_scene<ArmHandle>, "arm"_a, "solids"_a, "first_base"_a, "first_held"_a,
             "cloud"_a, "corners"_a, "fields"_a, "distances"_a, "rods"_a, "ignored"_a, "apart"_a, "own"_a,
             "clearance"_a, "soft"_a)
        .def("always_near", &always_near_of, "arm"_a);
    arm.def("resting_links", &resting_links, "rods"_a, "link"_a);
    arm.def("never_nearer_all", &never_nearer_all, "rods"_a, "out"_a, "cells"_a);
    arm.def("proximity_many", &proximity_many<ArmHandle>, "scene"_a, "q"_a, "out"_a, "pair"_a, "threads"_a);
    arm.def("widest_many", &widest_many, "scene"_a, "pose"_a, "gc"_a, "margin"_a, "psi"_a, "out"_a, "pair"_a,
            "status"_a, "threads"_a);
}

}  // namespace binding
