"""The viewer in a real browser: what a person sees and what a hand does there.

Screenshots are kept in the folder that ARMANGLE_SCREENSHOTS names, else in the test's own.
"""

from __future__ import annotations

import io
import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.needs import need, need_tool

import armangle as aa
from armangle import plots
from armangle.cli import paper_example
from armangle.viewer import Viewer, ViewerState
from armangle.viewer.controls import HOLD, REPEL, TRACK

FLAGS = (
    "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--no-first-run", "--disable-component-update", "--disable-sync",
    "--disable-quic",
)  # fmt: skip
WIDTH, HEIGHT, PANEL = 1100, 900, 680
PATIENCE = 30.0
SHARP = "/?fixedDpr=1"  # the page otherwise draws fewer pixels on a slow machine, and a thin piece is lost
FULL, _START, _POSES = paper_example.example()
# Joint 6 of one sign: the four configurations with a wrist - are blocked, and the others are not.
ARM = FULL.with_(lower=np.where(np.arange(7) == 5, 0.0, FULL.lower))
ALPHAS = (20, 100)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A Chromium without a window, for all tests of this file."""
    chromium = need_tool("chromium")
    need("matplotlib.image")
    need("viser")
    with need("playwright.sync_api").sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder for screenshots."""
    named = os.environ.get("ARMANGLE_SCREENSHOTS")
    path = Path(named) if named else tmp_path_factory.mktemp("screenshots")
    path.mkdir(parents=True, exist_ok=True)
    return path


def served(state: ViewerState, *runs: Any) -> Viewer:
    """Return a viewer in even light: without a GPU, mirrors and shadows take most of the time."""
    viewer = Viewer(state, *runs, port=0)
    room = viewer._server.scene
    room.configure_environment_map(None)
    room.configure_default_lights(cast_shadow=False)
    room.add_light_ambient("/light", intensity=2.0)
    return viewer


def opened(browser: Any, viewer: Viewer, width: int = WIDTH, height: int = HEIGHT) -> Any:
    """Return a page that shows a viewer, once its first picture is drawn."""
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(4e3 * PATIENCE)
    page.goto(viewer.url + SHARP)
    page.wait_for_selector("canvas")
    page.locator("[data-panel=reasons]").wait_for()
    page.get_by_role("alert").get_by_role("button").dispatch_event("click")  # the remark that no GPU draws
    until(lambda: picture(page).std() * 255 > 5, "the canvas is not blank", 4 * PATIENCE)
    return page


@pytest.fixture(scope="module")
def shown(browser: Any) -> Iterator[tuple[Viewer, Any]]:
    """One viewer and one page for all tests: a page takes seconds to begin without a GPU."""
    runs = {f"α = {a}": aa.follow(ARM, _POSES, start=_START, policy=aa.Repulsion(alpha=a)) for a in ALPHAS}
    viewer = served(ViewerState(ARM, _START), runs)
    try:
        yield viewer, opened(browser, viewer)
    finally:
        viewer.stop()


@pytest.fixture
def viewer(shown: tuple[Viewer, Any]) -> Viewer:
    """The viewer of all tests, set back to its start."""
    viewer, _ = shown
    viewer.controls.set_playing(False)
    viewer.controls.policy.value = HOLD
    viewer.state.policy = aa.Hold()
    viewer.act(viewer.controls.begin_again)
    viewer.act(lambda: [viewer.state.set_joint(joint, q) for joint, q in enumerate(_START, start=1)])
    return viewer


@pytest.fixture
def page(shown: tuple[Viewer, Any], viewer: Viewer) -> Any:
    """The page of that viewer, once it shows the start."""
    _, page = shown
    says(page, "GC 3, ψ = 58.6°")
    return page


def until(holds: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    """Wait for something that the browser or the server does in its own time."""
    end = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < end, f"not within {patience:g} s: {what}"
        time.sleep(0.05)


def says(page: Any, text: str) -> None:
    """Wait until the panel at the top holds a text."""
    until(lambda: text in page.locator("[data-panel=status]").inner_text(), f"the panel says {text!r}")


def picture(page: Any) -> np.ndarray:
    """Return a screenshot of all but the panel at the right, RGB 0..1."""
    from matplotlib.image import imread

    clip = {"x": 0, "y": 0, "width": PANEL, "height": HEIGHT}
    return imread(io.BytesIO(page.screenshot(clip=clip)), format="png")[..., :3]


def near(image: np.ndarray, colour: str, off: float = 0.1) -> np.ndarray:
    """Return where a picture has a colour "#RRGGBB", each channel within `off`."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.abs(image - wanted).max(axis=-1) < off


def number(page: Any, label: str) -> Any:
    """Return the box for text on the row of a label."""
    row = page.locator("div:has(> div > p)", has=page.get_by_text(label, exact=True))
    return row.last.locator("input:not([type=hidden])")


def type_pose(page: Any, xyz: str, rpy: str) -> None:
    """Write a tool pose (m, unless `xyz` ends in mm; degrees) and ask for it."""
    number(page, "x y z (m)").fill(xyz)
    number(page, "r p y (deg)").fill(rpy)
    page.get_by_role("button", name="Move the tool there").click()


def type_psi(page: Any, degrees: str) -> None:
    """Write an arm angle into the box beside its slider."""
    box = number(page, "ψ (deg)")
    box.fill(degrees)
    box.press("Enter")


# -- pages of their own, first: a page that is open draws, and takes half of the processor from another -----

PHONE = (390, 844)
"""px: width and height."""
_WHOLE = "b => [...b.querySelectorAll('*')].every(e => e.scrollWidth <= e.clientWidth)"


def test_a_phone_shows_the_whole_arm_and_tells_the_branches_apart(browser: Any, folder: Path) -> None:
    """On a phone the whole arm is above the panel, and no name of a branch is cut."""
    viewer = served(ViewerState(FULL, _START))
    try:
        page = opened(browser, viewer, *PHONE)
        covered = page.get_by_text(f"armangle: {FULL.name}").bounding_box()["y"]
        client = next(iter(viewer._server.get_clients().values()))
        points = viewer.state.arm.frames(viewer.state.q)[:, :3, 3]

        def is_in_view() -> bool:
            at = _on_screen(client.camera, points)  # the camera arrives after the first picture
            return bool(((at > 0) & (at < [PHONE[0], covered])).all())

        until(is_in_view, "the whole arm is in view")
        page.get_by_role("button", name="GC 7", exact=False).scroll_into_view_if_needed()
        page.screenshot(path=folder / "14_phone.png")
        for gc in range(8):
            button = page.get_by_role("button", name=f"GC {gc}", exact=False)
            assert button.evaluate(_WHOLE), f"the name of GC {gc} is cut"
        page.close()
    finally:
        viewer.stop()


def _on_screen(camera: Any, points: np.ndarray) -> np.ndarray:
    """Return where a camera sees points (n, 3), px from the upper left."""
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up_direction)
    right /= np.linalg.norm(right)
    seen = (points - camera.position) @ np.stack([right, np.cross(forward, right), forward], axis=1)
    scale = PHONE[1] / 2 / np.tan(camera.fov / 2)
    return seen[:, :2] / seen[:, 2:] * scale + np.array(PHONE) / 2


BODY_ARM = FULL.with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
SMALL = (1000, 600)
"""px: width and height of a window, in which drawing takes half the time."""
APART, BESIDE = 470, 580
"""px: in such a window the arm is left of the first, and the panel right of the second."""


def test_a_box_is_dragged_and_what_touches_is_red(browser: Any, folder: Path) -> None:
    """Dragging a box's handle moves it; a box on the elbow turns red and the panel names it; Reset."""
    elbow = BODY_ARM.elbow(_START)
    crate = aa.Box(aa.pose([0.5, 0.4, 0.5]), [0.12, 0.12, 0.12], name="crate")
    scene = aa.Scene([crate, aa.Ball(elbow + np.array([0, 0, 0.5]), 0.08, name="lamp")], clearance=0.01)
    viewer = served(ViewerState(BODY_ARM.with_(scene=scene), _START))
    try:
        page = opened(browser, viewer, *SMALL)
        state, before = viewer.state, viewer.state.arcs
        says(page, f"mm from {state.nearest.link} to {state.nearest.obstacle}")
        page.screenshot(path=folder / "12_scene.png")
        image = picture(page)
        blue = (image[..., 2] > 0.8) & (image[..., 0] < 0.4) & (image[..., 1] > 0.35) & (image[..., 1] < 0.65)
        rows, columns = np.nonzero(blue[:, APART:BESIDE])
        assert len(rows) > 10, "the handle of the box is seen"
        top = rows.argmin()
        x, y = float(columns[top] + APART), float(rows[top]) + 3
        page.mouse.move(x, y)
        page.mouse.down()
        for k in range(1, 11):
            page.mouse.move(x, y - 4 * k)
        until(lambda: state.boxes[0][1].pose != crate.pose, "the box follows its handle")
        page.mouse.up()
        untouched = red_of(picture(page))  # the arrows of handles
        assert state.touching is None
        viewer.act(lambda: state.move_box("crate", aa.pose(elbow + np.array([0, 0, 0.12]))))
        assert state.arcs != before
        says(page, "too near to crate")
        until(lambda: red_of(picture(page)) > untouched + 1.3e-3, "what touches is red")
        shown = viewer.scene.surroundings
        assert shown is not None and shown._label.text == f"{1e3 * float(state.nearest.distance):.1f} mm"
        page.screenshot(path=folder / "13_touched.png")
        page.get_by_role("button", name="Reset").click()
        until(lambda: state.scene == scene, "the box is back")
        page.close()
    finally:
        viewer.stop()


def red_of(image: np.ndarray) -> float:
    """The share of a picture that is of a touched shape, through which one sees."""
    seen = image[:, :BESIDE]
    return float(((seen[..., 0] > 0.6) & (seen[..., 1] < 0.45) & (seen[..., 2] < 0.45)).mean())


# -- one page for the rest ----------------------------------------------------------------------------


def test_the_slider_moves_the_arm(viewer: Viewer, page: Any, folder: Path) -> None:
    """The slider and box of psi turn the elbow and keep the tool."""
    state = viewer.state
    page.screenshot(path=folder / "1_begin.png")
    before, q = picture(page), state.q.copy()
    thumb = page.get_by_role("slider").nth(1).bounding_box()
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y, steps=10)
    page.mouse.up()
    until(lambda: 70 < np.degrees(state.psi) < 130, "the slider turns the elbow")
    assert np.abs(state.q - q).max() > 0.1
    type_psi(page, "150")
    says(page, "ψ = 150.0°")
    assert number(page, "ψ (deg)").input_value() == "150"
    np.testing.assert_allclose(state.pose, ARM.forward(_START)[0], atol=1e-9)
    until(lambda: np.abs(picture(page) - before).max(axis=-1).mean() > 0.005, "the picture changes")
    page.screenshot(path=folder / "2_turned.png")


def test_a_limit_stops_the_slider_and_is_named(viewer: Viewer, page: Any, folder: Path) -> None:
    """A psi that is blocked stops at the limit, and the panel names the joint."""
    type_psi(page, "34")
    says(page, "ψ = 34.0° is blocked by joint 5.")
    assert np.degrees(viewer.state.psi) == pytest.approx(42.70, abs=0.01)
    page.screenshot(path=folder / "3_limit.png")


def test_the_circle_has_the_colours_of_the_joints_that_block(page: Any) -> None:
    """The elbow's circle has the colours of joints 1 and 5, which block it."""
    image = picture(page)
    for joint in (1, 5):
        assert near(image, plots.JOINT_COLOURS[joint - 1], 0.17).sum() > 20, f"joint {joint}'s piece"


def test_a_blocked_configuration_is_grey_and_says_why(viewer: Viewer, page: Any, folder: Path) -> None:
    """Buttons of blocked branches are disabled, with the reason; another keeps the pose."""
    state = viewer.state
    reasons = state.reasons()
    assert [gc for gc, reason in enumerate(reasons) if reason is None] == [0, 1, 2, 3]
    for gc, reason in enumerate(reasons):
        button = page.get_by_role("button", name=f"GC {gc}", exact=False)
        assert button.is_disabled() == (reason is not None)
        if reason is not None:
            assert reason in page.locator(f"[data-gc~='{gc}']").inner_text()
    page.locator("[data-gc~='7']").scroll_into_view_if_needed()
    boxes = [page.get_by_role("button", name=f"GC {gc}", exact=False).bounding_box() for gc in range(8)]
    assert len({round(box["y"]) for box in boxes}) == 2, "two rows"
    assert len({round(box["x"]) for box in boxes}) == 4, "of four"
    page.screenshot(path=folder / "4_blocked.png")
    pose = state.pose.copy()
    page.get_by_role("button", name="GC 0", exact=False).click()
    until(lambda: state.gc == 0, "the button changes the configuration")
    np.testing.assert_allclose(state.pose, pose, atol=1e-9)


def test_ghosts_and_export(viewer: Viewer, page: Any, folder: Path) -> None:
    """The checkbox shows ghosts of other branches, and Export downloads the posture as JSON."""
    box = page.get_by_role("checkbox").last
    box.click()
    until(lambda: viewer.scene.show_ghosts, "ghosts are asked for")
    until(lambda: near(picture(page), "#96A0BE", 0.12).sum() > 200, "ghosts are seen")
    page.screenshot(path=folder / "5_ghosts.png")
    box.click()
    until(lambda: not viewer.scene.show_ghosts, "and gone")
    with page.expect_download() as download:
        page.get_by_role("button", name="Export configuration").click()
    assert download.value.suggested_filename == "configuration.json"
    assert '"gc": 3' in Path(download.value.path()).read_text()


def test_a_joint_slider_drives_the_arm(viewer: Viewer, page: Any, folder: Path) -> None:
    """A joint's slider moves that joint alone."""
    state = viewer.state
    q = state.q.copy()
    label = page.get_by_text("q2", exact=True)
    label.scroll_into_view_if_needed()
    row = page.locator("div:has(> div > p)", has=label).last
    thumb = row.get_by_role("slider").bounding_box()
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 25, y, steps=5)
    page.mouse.up()
    until(lambda: bool(state.q[1] > q[1] + 0.2), "the slider turns joint 2")
    np.testing.assert_array_equal(np.delete(state.q, 1), np.delete(q, 1))
    field = number(page, "q2")  # the last of the moves may still be on its way
    until(lambda: float(field.input_value()) == round(math.degrees(state.q[1]), 1), "it shows the angle")
    page.screenshot(path=folder / "8_joint.png")


def test_numbers_move_the_tool_or_are_refused(viewer: Viewer, page: Any, folder: Path) -> None:
    """Typed numbers, in mm too, move the tool; too few are refused with a note."""
    state = viewer.state
    pose = state.pose.copy()
    type_pose(page, "0.1 0.2", "0 0 0")
    until(lambda: page.locator("[data-panel=note]").count() == 1, "the panel refuses")
    assert "x y z has 2 numbers" in page.locator("[data-panel=note]").inner_text()
    np.testing.assert_array_equal(state.pose, pose)
    turn = number(page, "r p y (deg)")
    page.get_by_role("button", name="Reset").click()
    until(lambda: turn.input_value() != "0 0 0", "the numbers are those of the arm again")
    pose = state.pose.copy()
    place = 1000 * (pose[:3, 3] + [0.0, 0.0, 0.05])
    type_pose(page, " ".join(f"{x:.2f}" for x in place) + " mm", turn.input_value())
    until(lambda: bool(abs(state.pose[2, 3] - pose[2, 3] - 0.05) < 1e-3), "the tool goes there")
    assert state.target is None


def test_what_is_out_of_reach_turns_the_arm_red_and_shows_a_ghost(
    viewer: Viewer, page: Any, folder: Path
) -> None:
    """A target out of reach turns the arm red and is shown, until Reset."""
    assert (near(picture(page), "#D63027", 0.2)).sum() < 200
    type_pose(page, "0.3 -0.6 1.2", "0 90 0")
    until(lambda: viewer.state.target is not None, "the target is refused")
    until(lambda: near(picture(page), "#D63027", 0.2).sum() > 1000, "the arm is red")
    assert viewer.scene._target.visible
    says(page, viewer.state.message)
    page.screenshot(path=folder / "9_refused.png")
    page.get_by_role("button", name="Reset").click()
    until(lambda: near(picture(page), "#D63027", 0.2).sum() < 200, "and no more")


def test_the_hand_is_followed_to_the_nearest_pose_and_the_gap_is_drawn(
    viewer: Viewer, page: Any, folder: Path
) -> None:
    """With tracking, the tool goes as near as it can, and a line spans the gap."""
    number(page, "dragging").click()
    page.get_by_role("option", name=TRACK).click()
    until(lambda: viewer.state.policy is None, "the tracker is chosen")
    assert not viewer.scene._gap.visible
    type_pose(page, "0.3 -0.6 1.2", "0 90 0")
    until(lambda: viewer.state.target is not None, "the target cannot be met")
    says(page, "mm short of it.")
    until(lambda: near(picture(page), "#D63027", 0.2).sum() > 1000, "the arm is red")
    state = viewer.state
    assert viewer.scene._gap.visible and viewer.scene._target.visible
    ends = viewer.scene._gap.points[0]
    np.testing.assert_allclose(ends, [state.pose[:3, 3], state.target[:3, 3]], atol=1e-6)
    page.screenshot(path=folder / "11_tracked.png")
    page.get_by_role("button", name="Reset").click()
    until(lambda: not viewer.scene._gap.visible, "and no more")


def test_the_policy_is_seen_and_chosen(viewer: Viewer, page: Any, folder: Path) -> None:
    """The menu chooses the policy, and shows its numbers alone."""
    assert page.get_by_text("dragging", exact=True).is_visible()
    assert number(page, "dragging").input_value() == HOLD
    assert not page.get_by_text("α", exact=True).is_visible()
    number(page, "dragging").click()
    page.get_by_role("option", name=REPEL).click()
    until(lambda: viewer.state.policy == aa.Repulsion(), "the policy is chosen")
    page.get_by_text("α", exact=True).wait_for()
    page.screenshot(path=folder / "10_policy.png")


def test_a_motion_plays_beside_its_map(viewer: Viewer, page: Any, folder: Path) -> None:
    """Play and Pause run a motion, whose row the map states."""
    state = viewer.state
    assert page.locator("[data-panel=map] img").evaluate("image => image.naturalWidth") == 200
    page.get_by_role("button", name="Play").click()
    until(lambda: state.row > 20, "the motion runs")
    page.get_by_role("button", name="Pause").click()
    until(lambda: not viewer.controls.playing, "and pauses")
    np.testing.assert_allclose(state.q, state.motion.q[state.row])
    until(lambda: f"pose {state.row + 1} of 251" in page.locator("[data-panel=map]").inner_text(), "the map")
    page.screenshot(path=folder / "6_motion.png")


def test_the_gizmo_drags_the_arm(viewer: Viewer, page: Any, folder: Path) -> None:
    """Dragging the handle at the tool moves the arm within its limits and branch."""
    state = viewer.state
    pose = state.pose.copy()
    image = picture(page)
    red = (image[..., 0] > 0.9) & (image[..., 1] < 0.35) & (image[..., 2] > 0.3) & (image[..., 2] < 0.6)
    assert red.sum() > 20, "the gizmo is seen"
    rows, columns = np.nonzero(red)
    at = np.hypot(columns - np.median(columns), rows - np.median(rows)).argmin()
    x, y = float(columns[at]), float(rows[at])
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 11):
        page.mouse.move(x + 5 * k, y + 3 * k)
    until(lambda: bool(np.abs(state.pose - pose).max() > 0.01), "the arm follows the gizmo")
    page.mouse.up()
    assert state.gc == 3
    assert ARM.within_limits(state.q, tol=1e-9)
    page.screenshot(path=folder / "7_dragged.png")
