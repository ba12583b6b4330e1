"""Obstacles in the viewer, without a browser: what blocks, what touches, boxes that are moved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.moves import moved, refused

import armangle as aa
from armangle.arm.skeleton import BY_OBSTACLE
from armangle.viewer import ViewerState
from armangle.viewer.panels import arcs_panel, map_image, status_panel
from armangle.viewer.scene import segment_colours
from armangle.viewer.surfaces import MOST_POINTS, lowest, points_of, surface
from armangle.viewer.surroundings import TOUCHED_RGB

from .conftest import Served

Q = np.radians([20, 45, 10, -80, 10, 60, 0])
ARM = (
    aa.Arm.from_catalogue("kuka_iiwa7_r800")
    .with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
    .with_(hand=[aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.02, name="drill")])
)
OVER = ARM.elbow(Q) + np.array([0.0, 0.0, 0.13])
LAMP = aa.Ball([0.28, 0.26, 0.6], 0.05, name="lamp")
CRATE = aa.Box(aa.pose([-0.5, -0.6, 0.6]), [0.2, 0.3, 0.1], 0.01, name="crate")
SCENE = aa.Scene([LAMP, CRATE, aa.HalfSpace([0, 0, 1], 0.0, name="floor")], clearance=0.005)


def _state(**options: Any) -> ViewerState:
    """A viewer's state of the arm in the scene."""
    return ViewerState(ARM.with_(scene=SCENE), Q, **options)


def _least(state: ViewerState) -> float:
    """The distance (m) to the nearest obstacle."""
    assert state.nearest is not None
    return float(state.nearest.distance)


def test_its_arcs_are_those_of_limits_and_scene() -> None:
    """The state's arcs are `feasible` in the scene, and panels name the nearest obstacle."""
    state = _state()
    assert state.arcs == ARM.with_(scene=SCENE).feasible(state.pose, state.gc)
    assert state.nearest is not None and state.nearest.obstacle == "lamp"
    assert state.touching is None
    assert "lamp" in arcs_panel(state) and "from forearm to lamp" in status_panel(state)


def test_an_arm_without_a_body_is_refused_and_names_that_are_not_there() -> None:
    """A scene without a body, or that ignores unknown names, is refused."""
    with pytest.raises(aa.errors.SceneError, match="wanted a body"):
        ViewerState(ARM.with_(body=None).with_(hand=[]).with_(scene=SCENE), Q)
    with pytest.raises(aa.errors.SceneError, match="'sofa'"):
        ViewerState(ARM.with_(scene=aa.Scene([LAMP], ignore=[("sofa", "forearm")])), Q)


def test_an_elbow_that_is_turned_stops_at_an_obstacle_and_names_it() -> None:
    """`set_psi` stops at the clearance of an obstacle and names it."""
    state = _state()
    answer = state.set_psi(-0.4)
    assert not answer.ok and "lamp, which forearm would touch" in answer.text
    assert _least(state) == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize("policy", [None, aa.Hold(), aa.Repulsion()], ids=repr)
def test_a_dragged_tool_leads_no_link_into_an_obstacle(policy: Any) -> None:
    """`set_pose` keeps the clearance under every policy."""
    state = _state(policy=policy)
    begin = state.pose
    for step in ([0.1, 0.2, 0], [0, 0.3, -0.1], [0, 0, -0.6]):
        wanted = moved(begin, step)
        state.set_pose(wanted)
        assert _least(state) >= 0.005 - 1e-9
    assert state.message


def test_a_box_that_is_moved_changes_the_arcs_and_touches() -> None:
    """`move_box` changes arcs and says what is too near, and the arm stays; `reset` puts the box back.

    What is no box of the scene is refused.
    """
    state = _state()
    before = state.arcs
    answer = state.move_box("crate", aa.pose(OVER))
    assert not answer.ok and "too near to crate" in answer.text
    assert state.arcs != before
    moved = aa.Scene([LAMP, aa.Box(aa.pose(OVER), CRATE.size, 0.01, name="crate"),
                      SCENE.shapes[2]], clearance=0.005)  # fmt: skip
    assert state.arcs == ARM.with_(scene=moved).feasible(state.pose, state.gc)
    assert _least(state) < 0.005 and state.touching is not None
    np.testing.assert_array_equal(state.q, Q)
    assert state.set_psi(state.psi).ok is False and _least(state) >= 0.005 - 1e-9
    state.reset()
    assert state.scene == SCENE and state.arcs == before
    refused(aa.InputError, "wanted a box of the scene: crate", lambda: state.move_box("lamp", np.eye(4)))
    refused(aa.InputError, "it has none", lambda: ViewerState(ARM, Q).move_box("crate", np.eye(4)))


def test_a_tool_in_a_box_that_was_put_on_the_arm_stays_and_names_it() -> None:
    """`set_pose` of an arm within a box stays and names it."""
    state = _state()
    state.move_box("crate", aa.pose(ARM.elbow(state.q)))
    wanted = state.pose.copy()
    wanted[2, 3] += 0.05
    answer = state.set_pose(wanted)
    assert not answer.ok and "crate" in answer.text
    np.testing.assert_array_equal(state.q, Q)


def test_more_clearance_leaves_less() -> None:
    """`set_clearance` to more shortens the arcs; a negative one is refused."""
    state = _state()
    wide = float(state.arcs.measure)
    assert not state.set_clearance(0.05).ok
    assert float(state.arcs.measure) < wide and state.touching is not None
    assert state.set_clearance(0.0).ok
    with pytest.raises(aa.errors.SceneError):
        state.set_clearance(-1.0)
    refused(aa.InputError, "no scene", lambda: ViewerState(ARM, Q).set_clearance(0.1))


def test_the_circle_and_the_reasons_know_obstacles() -> None:
    """`elbow_circle` and `reason` say what obstacles alone block."""
    state = _state()
    circle = state.elbow_circle()
    psi = np.linspace(-np.pi, np.pi, len(circle.blocker) + 1)
    middle = 0.5 * (psi[1:] + psi[:-1])
    own = ARM.feasible(state.pose, state.gc).contains(middle)
    clear = ARM._clear(state.pose, state.gc, SCENE).contains(middle)
    np.testing.assert_array_equal(circle.blocker == BY_OBSTACLE, own & ~clear)
    assert (circle.blocker == BY_OBSTACLE).any()
    np.testing.assert_array_equal((circle.blocker == 0), own & clear)
    count = BY_OBSTACLE + 1
    assert len({tuple(c) for c in segment_colours(np.arange(count))[:, 0].tolist()}) == count
    post = aa.Scene([aa.Ball([0, 0.12, 0.34], 0.06, name="post")])
    blocked = ViewerState(ARM.with_(scene=post), Q)
    assert blocked.reason(blocked.gc) == "upper_arm meets post at every ψ."
    assert blocked.touching is not None


def test_the_map_of_a_motion_shows_what_obstacles_alone_block() -> None:
    """`map_image` in a scene differs from that without obstacles."""
    poses = np.tile(ARM.forward(Q)[0], (20, 1, 1))
    motion = aa.follow(ARM.with_(scene=SCENE), poses, start=Q)
    assert map_image(motion, SCENE) != map_image(motion)
    assert map_image(motion, aa.Scene()) == map_image(motion)


def test_the_floor_is_below_what_stands_about() -> None:
    """`lowest` is the height of the lowest point of a shape; walls have none."""
    assert lowest(aa.Box(aa.pose([0.6, 0, -0.1]), [1.2, 0.8, 0.04])) == pytest.approx(-0.12)
    assert lowest(aa.Ball([0, 0, 0.5], 0.1)) == pytest.approx(0.4)
    assert lowest(aa.Cloud([[0, 0, -0.3], [0, 0, 1]], 0.01)) == pytest.approx(-0.3)
    assert lowest(aa.HalfSpace([0, 0, 1], -0.8)) == -0.8 and lowest(aa.HalfSpace([1, 0, 0], -2)) == np.inf


def test_surfaces_are_those_of_their_shapes() -> None:
    """Vertices of `surface` lie on the shape, and its faces leave no gap."""
    frame = aa.pose([0.1, 0.2, 0.3], rpy=[0.3, -0.5, 1.0])
    corners = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.4]], dtype=float)
    along = np.array([0.2, 0.1, 0.4])
    apart = {
        aa.Ball([1, 2, 3], 0.1): lambda p: np.linalg.norm(p - [1, 2, 3], axis=1) - 0.1,
        aa.Box(frame, [0.2, 0.4, 0.6], 0.03): lambda p: np.linalg.norm(
            np.maximum(np.abs((p - frame[:3, 3]) @ frame[:3, :3]) - [0.1, 0.2, 0.3], 0), axis=1
        ) - 0.03,
        aa.Capsule([0, 0, 0], along, 0.05): lambda p: np.linalg.norm(
            p - np.clip(p @ along / (along @ along), 0, 1)[:, None] * along, axis=1
        ) - 0.05,
        aa.HalfSpace([0, 0.6, 0.8], 0.2): lambda p: p @ np.array([0, 0.6, 0.8]) - 0.2,
    }  # fmt: skip
    for shape, distance in apart.items():
        vertices, faces = surface(shape, 1.0)
        assert np.abs(distance(vertices)).max() < 1e-12, shape
        assert faces.min() >= 0 and faces.max() < len(vertices)
        if not isinstance(shape, aa.HalfSpace):  # each edge of the grid of faces is met from both sides
            directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
            inner = {tuple(e) for e in directed.tolist()}
            ring = set(range(32)) | set(range(len(vertices) - 32, len(vertices)))
            assert all((b, a) in inner for a, b in inner if not {a, b} <= ring)
    for size in ([1.2, 0.8, 0.04], [0.2, 0.2, 0.2], [0.02, 0.3, 0.4]):  # no side of a box is left open
        vertices, faces = surface(aa.Box(np.eye(4), size), 1.0)
        a, b, c = vertices[faces].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        x, y, z = size
        assert area == pytest.approx(2 * (x * y + y * z + z * x), rel=1e-12)
    vertices, _ = surface(aa.Hull(corners), 1.0)
    assert {tuple(v) for v in vertices.tolist()} == {tuple(c) for c in corners.tolist()}
    with pytest.raises(TypeError):
        surface(aa.Cloud(corners, 0.1), 1.0)


def test_points_of_clouds_and_fields() -> None:
    """`points_of` draws at most MOST_POINTS of a cloud, and the points at a field's surface."""
    many = np.random.default_rng(1).normal(size=(3 * MOST_POINTS, 3))
    points, size = points_of(aa.Cloud(many, 0.01))
    assert len(points) <= MOST_POINTS and size == pytest.approx(0.02)
    nodes = np.stack(np.meshgrid(*[np.linspace(-0.2, 0.2, 21)] * 3, indexing="ij"), axis=-1)
    field = aa.Field(np.linalg.norm(nodes, axis=-1) - 0.1, [0.3, -0.2, 0.4], 0.02)
    points, _ = points_of(field)
    assert np.linalg.norm(points - [0.5, 0, 0.6], axis=1).max() <= 0.12 + 1e-9


def test_what_touches_is_red_and_says_how_near(served: Served) -> None:
    """What is too near is red, boxes move with their handles, and Reset puts all back."""
    cloud = aa.Cloud([OVER + 0.4], 0.01, name="seen")
    scene = aa.Scene([*SCENE.shapes, cloud], clearance=0.005)
    viewer = served(ViewerState(ARM.with_(scene=scene), Q))
    shown = viewer.scene.surroundings
    assert shown is not None and set(shown.handles) == {"crate"}

    def red() -> set[str]:
        """The names that are drawn in red."""
        return {n for n, nodes in shown._nodes.items() if tuple(_rgb(nodes[0][0])) == TOUCHED_RGB}

    assert red() == set() and shown._label.text == f"{1e3 * _least(viewer.state):.1f} mm"
    viewer.act(lambda: viewer.state.move_box("crate", aa.pose(OVER)))
    assert red() == {"crate", str(viewer.state.nearest.link)}  # type: ignore[union-attr]  # has a scene
    np.testing.assert_allclose(shown.handles["crate"].position, OVER)
    np.testing.assert_allclose(shown._nodes["crate"][0][0].position, OVER)
    viewer.controls.clearance.value = 0.0
    viewer.act(viewer.controls._set_clearance)
    assert viewer.state.scene is not None and viewer.state.scene.clearance == 0.0
    viewer.act(viewer.controls.begin_again)
    assert red() == set() and viewer.controls.clearance.value == 5.0
    np.testing.assert_allclose(shown._nodes["crate"][0][0].position, [-0.5, -0.6, 0.6])


def _rgb(node: Any) -> Any:
    """The colour of a node."""
    return np.ravel(node.colors)[:3].tolist() if hasattr(node, "colors") else node.color
