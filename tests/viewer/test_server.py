"""The viewer's server, as far as no browser is needed."""

from __future__ import annotations

import socket
from typing import Any

import numpy as np
import pytest
from support.moves import refused
from support.needs import need

import armangle as aa
from armangle.viewer import Viewer, ViewerState
from armangle.viewer.controls import CENTRE, HOLD, REPEL, TOWARDS, TRACK

from .conftest import PAPER_ARM, PAPER_POSES, PAPER_Q, Served, paper


def test_a_busy_port_is_refused_by_its_number() -> None:
    """`Viewer` refuses a port that is taken or none, and an address that is not this machine's."""
    need("viser")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        refused(aa.OutputError, f"port {port} of .* is taken", lambda: Viewer(paper(), port=port))
    refused(aa.OutputError, "port is 70000", lambda: Viewer(paper(), port=70000))
    with pytest.raises(aa.OutputError, match=r"192\.0\.2\.1 cannot be had"):
        Viewer(paper(), port=8080, host="192.0.2.1")


def test_a_motion_of_another_arm_is_refused_before_anything_is_served() -> None:
    """`Viewer` refuses a motion of another arm."""
    need("viser")
    other = PAPER_ARM.with_(d_bs=0.5)
    run = aa.follow(other, PAPER_POSES[:3], start=PAPER_Q)
    refused(aa.InputError, "the motion is of", lambda: Viewer(paper(), {"foreign": run}, port=0))


def test_it_serves_this_machine_alone_and_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    """`Viewer` serves 127.0.0.1, prints nothing, and can be stopped."""
    need("viser")
    viewer = Viewer(paper(), port=0)
    assert viewer.url.startswith("http://127.0.0.1:")
    assert viewer.note == ""
    viewer.stop()
    viewer.wait()
    assert capsys.readouterr().out == ""


OWN, OTHER = "http://127.0.0.1:{port}", "https://example.org"
PAGES = {
    "its own": (OWN, "127.0.0.1", True),
    "this machine under its other name": ("http://localhost:{port}", "127.0.0.1", True),
    "another site": (OTHER, "127.0.0.1", False),
    "another site whose name leads here": ("http://example.org:{port}", "example.org", False),
    "a page without a site": ("null", "127.0.0.1", False),
    "no page": (None, "127.0.0.1", True),
}


@pytest.mark.parametrize("page", PAGES)
def test_only_its_own_pages_may_talk_to_it(page: str, served: Served) -> None:
    """The server answers 403 to a websocket of another site's page."""

    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    origin, host, expected = PAGES[page]
    viewer = served()
    port = int(viewer.url.rpartition(":")[2])
    end = socket.create_connection(("127.0.0.1", port))
    given: Any = {} if origin is None else {"origin": origin.format(port=port)}
    try:
        with connect(f"ws://{host}:{port}", sock=end, **given):
            opened = True
    except InvalidStatus as answer:
        opened = False
        assert answer.response.status_code == 403
    assert opened == expected


def test_a_hand_that_is_faster_than_the_arm_is_not_pulled_back(served: Served) -> None:
    """A slider that moved on meanwhile keeps its value; one that is blocked goes to the limit."""
    viewer = served()
    slider = viewer.controls.psi

    def moved_on_meanwhile() -> None:
        viewer.controls._turn()
        slider.value = 120.0

    slider.value = 100.0
    viewer.act(moved_on_meanwhile)
    assert slider.value == 120.0
    assert np.degrees(viewer.state.psi) == pytest.approx(100.0)
    slider.value = 34.0
    viewer.act(viewer.controls._turn)
    assert slider.value == pytest.approx(42.7)


def test_numbers_that_are_typed_stay_until_the_arm_is_moved_otherwise(served: Served) -> None:
    """Typed numbers stay, refused or not, until Reset or another move."""
    viewer = served(ViewerState(PAPER_ARM))
    controls, state = viewer.controls, viewer.state
    shown = controls.xyz.value
    controls.xyz.value = "1 2"
    viewer.act(lambda: None)  # what is typed while another wish is shown, before `_type` hears of it
    assert controls.xyz.value == "1 2"
    viewer.act(controls._type)
    viewer.act(controls.move_there)
    assert "x y z has 2 numbers" in controls._note.content
    assert controls.xyz.value == "1 2" and state.message == ""
    far = "0 0 3"
    controls.xyz.value = far
    viewer.act(controls.move_there)
    assert controls.xyz.value == far and state.message in controls._note.content
    assert state.target is not None and viewer.scene._target.visible
    red = {node.color for _, node in viewer.scene._solids}
    assert len(red) == 1
    viewer.act(controls.begin_again)
    assert controls.xyz.value == shown and controls._note.content == ""
    assert [node.color for _, node in viewer.scene._solids] == [own for own, _ in viewer.scene._solids]
    assert not viewer.scene._target.visible
    controls.xyz.value = " ".join(f"{1000 * float(x) - 50:g}" for x in shown.split()) + " mm"
    viewer.act(controls._type)
    place = state.pose[:3, 3] - 0.05
    viewer.act(controls.move_there)
    np.testing.assert_allclose(state.pose[:3, 3], place, atol=1e-4)


def test_the_policy_is_what_the_panel_says(served: Served) -> None:
    """The panel begins with the state's policy, shows its numbers and gives it back unchanged."""
    for policy, name, seen in (
        (None, TRACK, (False, False)),  # unless told otherwise
        (aa.Hold(), HOLD, (False, False)),
        (aa.Centre(K=0.3), CENTRE, (True, False)),
        (aa.Repulsion(K=0.2, alpha=7.0), REPEL, (True, True)),
        (aa.Towards(point=[0.0, 1.0, 0.5], K=0.4), TOWARDS, (True, False)),
    ):
        given = {} if policy is None else {"policy": policy}
        viewer = served(ViewerState(PAPER_ARM, **given))
        controls = viewer.controls
        assert controls.policy.value == name
        assert (controls._gain.visible, controls._alpha.visible) == seen
        viewer.act(controls._set_policy)
        assert viewer.state.policy == policy


def test_play_runs_to_the_end_and_stops(served: Served) -> None:
    """Playing a motion ends at its last row."""
    poses = PAPER_POSES[:6]
    run = aa.follow(PAPER_ARM, poses, start=PAPER_Q)
    viewer = served(ViewerState(PAPER_ARM), {"short": run})
    np.testing.assert_allclose(viewer.state.q, run.q[0])
    viewer.controls.set_playing(True)
    for _ in range(100):
        if not viewer.controls.playing:
            break
        viewer._stopped.wait(0.05)
    assert viewer.state.row == 5
    assert not viewer.controls.playing


def test_voxels_are_points_coloured_by_their_share(served: Served) -> None:
    """`show_voxels` draws points, the brighter the larger the share; None removes them."""

    from armangle.reach.voxels import voxels_of

    found = voxels_of(PAPER_ARM, 0.3, 20)
    shown = served()
    shown.show_voxels(found)
    cloud = shown.scene._voxels
    assert np.allclose(cloud.points, found.position, atol=1e-3)
    order = np.argsort(found.share)
    assert (np.diff(cloud.colors[order].astype(int).sum(axis=1)) >= -1).all()
    shown.show_voxels(None)
    assert shown.scene._voxels is None
