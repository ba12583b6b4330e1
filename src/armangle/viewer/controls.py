"""The viewer's controls: slider, buttons, panels, player."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS
from ..arm.configuration import gc_signs
from ..errors import PolicyError
from ..motion.joint_path import JointPath
from ..motion.policies import Repulsion
from .panels import (
    arcs_panel,
    joints_panel,
    map_image,
    map_panel,
    reasons_panel,
    status_panel,
)
from .state import ViewerState

_CHOSEN = (0, 114, 178)
_OPEN = (90, 98, 110)
EXPORT_NAME = "posture.json"

Act = Callable[[Callable[[], object]], None]


class Controls:
    """The panel of a viser server.

    Parameters
    ----------
    server : viser.ViserServer
    state : ViewerState
    act : function
        Runs a wish on the state, one at a time, and shows what came of it.
    runs : mapping of names to JointPath
        Motions to choose from; without any the player is left out.
    """

    def __init__(self, server: Any, state: ViewerState, act: Act, runs: Mapping[str, JointPath]) -> None:
        self._state, self._act, self._runs = state, act, runs
        self._gui = server.gui
        self.playing = False
        self._image = ""
        self._taken: dict[int, float] = {}
        self._status = self._gui.add_html("")
        self._add_player()
        self._add_arm_angle()
        with self._gui.add_folder("Joints"):
            self._joints = self._gui.add_html("")
        self._add_configurations()
        self._add_rest()

    # -- making --------------------------------------------------------------------------------------

    def _add_player(self) -> None:
        self._row: Any = None
        if not self._runs:
            return
        with self._gui.add_folder("Motion"):
            names = list(self._runs)
            self._run = self._gui.add_dropdown("run", names, initial_value=names[0])
            self._play = self._gui.add_button("Play")
            self._row = self._gui.add_slider("pose", 1, max(len(self._runs[names[0]]), 2), 1, 1)
            self._map = self._gui.add_html("")
        self._run.on_update(lambda event: self._by_hand(event, lambda: self.choose(self._run.value)))
        self._row.on_update(lambda event: self._by_hand(event, self._seek))
        self._play.on_click(lambda _: self.set_playing(not self.playing))

    def _add_arm_angle(self) -> None:
        with self._gui.add_folder("Arm angle"):
            self.psi = self._gui.add_slider("ψ (deg)", -180.0, 180.0, 0.1, 0.0)
            self._arcs = self._gui.add_html("")
        self.psi.on_update(lambda event: self._by_hand(event, self._turn))

    def _add_configurations(self) -> None:
        with self._gui.add_folder("Global configuration (shoulder, elbow, wrist)"):
            self.buttons = [self._gui.add_button(gc_name(gc)) for gc in range(CONFIGURATIONS)]
            self._reasons = self._gui.add_html("")
        for gc, button in enumerate(self.buttons):
            button.on_click(lambda _, gc=gc: self._act(lambda: self._state.set_gc(gc)))

    def _add_rest(self) -> None:
        policy = self._state.policy
        repulsion = policy if isinstance(policy, Repulsion) else Repulsion()
        with self._gui.add_folder("While the tool is dragged: eq. (36)", expand_by_default=False):
            self._gain = self._gui.add_slider("K", 0.0, 1.0, 0.01, float(repulsion.K))
            self._alpha = self._gui.add_slider("α", 1.0, 100.0, 1.0, float(np.clip(repulsion.alpha, 1, 100)))
        for slider in (self._gain, self._alpha):
            slider.on_update(lambda event: self._by_hand(event, self._set_policy))
        self.ghosts = self._gui.add_checkbox("ghosts of the other configurations", False)
        self.reset = self._gui.add_button("Reset")
        self.reset.on_click(lambda _: self._act(self._state.reset))
        self.export = self._gui.add_button("Export posture as JSON")
        self.export.on_click(self._download)

    # -- acting --------------------------------------------------------------------------------------

    def _download(self, event: Any) -> None:
        if event.client is not None:
            event.client.send_file_download(EXPORT_NAME, self._state.export().encode())

    def _by_hand(self, event: Any, wish: Callable[[], object]) -> None:
        """Act on what a person moved; what the program itself sets comes without a client."""
        if event.client_id is not None:
            self._act(wish)

    def _turn(self) -> None:
        value = self._taken[id(self.psi)] = self.psi.value
        self._state.set_psi(np.radians(value))

    def _seek(self) -> None:
        value = self._taken[id(self._row)] = self._row.value
        self._state.seek(int(value) - 1)

    def _set_slider(self, slider: Any, value: float) -> None:
        """Put a slider where the state is, unless a hand has moved it on since it was read."""
        if slider.value == self._taken.pop(id(slider), slider.value):
            slider.value = value

    def _set_policy(self) -> None:
        try:
            self._state.policy = Repulsion(K=float(self._gain.value), alpha=float(self._alpha.value))
        except PolicyError as error:
            self._state.message = str(error)

    def choose(self, name: str) -> None:
        """Take a motion to play by its name, and go to its beginning."""
        motion = self._runs[name]
        self._image = map_image(motion)
        self._row.max = max(len(motion), 2)
        self._state.set_motion(motion)

    def set_playing(self, playing: bool) -> None:
        """Begin or end to play."""
        self.playing = playing and self._row is not None
        self._play.label = "Pause" if self.playing else "Play"

    # -- showing -------------------------------------------------------------------------------------

    def update(self) -> None:
        """Show the state."""
        state = self._state
        self._status.content = status_panel(state)
        self._set_slider(self.psi, float(np.clip(round(float(np.degrees(state.psi)), 1), -180.0, 180.0)))
        self._arcs.content = arcs_panel(state)
        self._joints.content = joints_panel(state)
        self._reasons.content = reasons_panel(state)
        for gc, button in enumerate(self.buttons):
            _show_button(button, gc, state)
        if self._row is not None and state.motion is not None:
            self._set_slider(self._row, state.row + 1)
            self._map.content = map_panel(state.motion, self._image, state.row)


def gc_name(gc: int) -> str:
    """Return a configuration as a button names it.

    >>> gc_name(3)
    'GC 3 (− − +)'
    """
    return f"GC {gc} ({' '.join('+' if sign > 0 else '−' for sign in gc_signs(gc))})"


def _show_button(button: Any, gc: int, state: ViewerState) -> None:
    """Grey a configuration that has no solution, and say why on it."""
    reason = state.short_reason(gc)
    label = gc_name(gc) if reason is None else f"{gc_name(gc)}: {reason}"
    for name, value in (
        ("label", label),
        ("disabled", reason is not None),
        ("color", _CHOSEN if gc == state.gc else _OPEN),
        ("hint", state.reason(gc)),
    ):
        if getattr(button, name) != value:
            setattr(button, name, value)
