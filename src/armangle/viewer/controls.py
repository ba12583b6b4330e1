"""The viewer's controls: sliders, buttons, numbers, player."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS, JOINTS
from ..arm.configuration import gc_signs
from ..errors import InputError
from ..motion.joint_path import JointPath
from ..motion.policies import Centre, Hold, Policy, Repulsion, Towards
from .entry import pose_of_text, text_of_pose
from .panels import (
    arcs_panel,
    map_image,
    map_panel,
    note_panel,
    reasons_panel,
    row_style,
    status_panel,
)
from .state import ViewerState

_CHOSEN = (0, 114, 178)
_OPEN = (90, 98, 110)
_BUTTONS_A_ROW = 4
EXPORT_NAME = "configuration.json"

TRACK = "follow the dragged pose, or the nearest one"
HOLD = "hold ψ"
REPEL = "repel ψ from the ends of its arc"
CENTRE = "pull ψ to the middle of its arc"
TOWARDS = "move the elbow to where it is wished: up, or as the program says"
_GREATEST_ALPHA = 100.0
_MOST_CLEARANCE = 100.0  # mm

Act = Callable[[Callable[[], object]], None]


class Controls:
    """The panel of a viser server for a `ViewerState`.

    `act` executes a command on the state, one at a time, and shows the result. `runs` are the motions to
    choose from, by name; without any there is no player.
    """

    def __init__(self, server: Any, state: ViewerState, act: Act, runs: Mapping[str, JointPath]) -> None:
        """Build the panel with all its folders; `act` executes a command on the state."""
        self._state, self._act, self._runs = state, act, runs
        self._gui = server.gui
        self.playing = False
        self._image = ""
        self._taken: dict[int, float] = {}
        self._written: dict[int, str] = {}
        self._refusal = ""
        self._status = self._gui.add_html("")
        self._add_doors()
        self._add_player()
        self._add_arm_angle()
        self._add_configurations()
        self._add_joints()
        self._add_tool()
        self._add_obstacles()

    # -- construction --------------------------------------------------------------------------------

    def _add_doors(self) -> None:
        """Add the buttons to reset and to export the configuration."""
        self._gui.add_html(row_style("doors", 2, gap=9))
        self.reset = self._gui.add_button("Reset")
        self.reset.on_click(lambda _: self._act(self.begin_again))
        self.export = self._gui.add_button("Export configuration")
        self.export.on_click(self._download)

    def _add_player(self) -> None:
        """Add the folder that plays a motion, if there is one."""
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
        """Add the folder of the arm angle: slider, policy and its numbers."""
        policy = self._state.policy
        gain = float(policy.K) if isinstance(policy, Repulsion | Centre | Towards) else 0.1
        alpha = float(policy.alpha) if isinstance(policy, Repulsion) else Repulsion().alpha
        self._wish = policy if isinstance(policy, Towards) else Towards(direction="up")
        redundancy = self._state.arm.redundancy.replace("_", " ").capitalize()
        with self._gui.add_folder(redundancy):
            self.psi = self._gui.add_slider("ψ (deg)", -180.0, 180.0, 0.1, 0.0)
            self._arcs = self._gui.add_html("")
            self.policy = self._gui.add_dropdown(
                "dragging", (TRACK, HOLD, REPEL, CENTRE, TOWARDS), initial_value=_policy_name(policy),
                hint="What the arm does while the tool is dragged, or moved by numbers.",
            )  # fmt: skip
            self._gain = self._gui.add_slider("K", 0.0, 1.0, 0.01, gain)
            self._alpha = self._gui.add_slider(
                "α", 1.0, _GREATEST_ALPHA, 1.0, float(np.clip(alpha, 1.0, _GREATEST_ALPHA))
            )
        self.psi.on_update(lambda event: self._by_hand(event, self._turn))
        for control in (self.policy, self._gain, self._alpha):
            control.on_update(lambda event: self._by_hand(event, self._set_policy))

    def _add_configurations(self) -> None:
        """Add the folder with a button for each branch."""
        with self._gui.add_folder("Global configuration (shoulder, elbow, wrist)"):
            self._gui.add_html(row_style("configurations", _BUTTONS_A_ROW, gap=3))
            self.buttons = [self._gui.add_button(gc_name(gc)) for gc in range(CONFIGURATIONS)]
            self._reasons = self._gui.add_html("")
            self.ghosts = self._gui.add_checkbox(
                "ghosts", False, hint="The other configurations at this pose, as stick figures."
            )
        for gc, button in enumerate(self.buttons):
            button.on_click(lambda _, gc=gc: self._act(lambda: self._change(gc)))

    def _add_joints(self) -> None:
        """Add the folder with a slider for each joint."""
        with self._gui.add_folder("Joints (deg)"):
            self.joints = [self._add_joint(joint) for joint in range(1, JOINTS + 1)]
        for joint, slider in enumerate(self.joints, start=1):
            wish = partial(self._turn_joint, joint)
            slider.on_update(lambda event, wish=wish: self._by_hand(event, wish))

    def _add_joint(self, joint: int) -> Any:
        """Return the slider of a joint 1..7 between its limits (deg)."""
        low, high = slider_range(self._state.arm.lower[joint - 1], self._state.arm.upper[joint - 1])
        locked = high <= low
        return self._gui.add_slider(
            f"q{joint}", low, low + 0.1 if locked else high, 0.1, low, disabled=locked,
            hint="locked by its limits" if locked else None,
        )  # fmt: skip

    def _add_tool(self) -> None:
        """Add the folder in which the pose of the tool is typed as numbers."""
        with self._gui.add_folder("Tool by numbers"):
            self.xyz = self._gui.add_text("x y z (m)", "", hint="three numbers in m, or such as 400 0 500 mm")
            self.rpy = self._gui.add_text(
                "r p y (deg)", "", hint="roll, pitch, yaw about the fixed x, y, z axes, in degrees"
            )
            self._note = self._gui.add_html("")  # above the button: content below may be scrolled away
            self.go = self._gui.add_button("Move the tool there")
        self.moved()
        for text in (self.xyz, self.rpy):
            text.on_update(lambda event: self._by_hand(event, self._type))
        self.go.on_click(lambda _: self._act(self.move_there))

    def _add_obstacles(self) -> None:
        """Add the folder with the clearance, if there is a scene."""
        self.clearance: Any = None
        scene = self._state.scene
        if scene is None:
            return
        with self._gui.add_folder("Obstacles"):
            here = 1e3 * scene.clearance
            self.clearance = self._gui.add_slider(
                "clearance (mm)", 0.0, max(_MOST_CLEARANCE, here), 1.0, here,
                hint="Least distance that links keep from all obstacles.",
            )  # fmt: skip
        self.clearance.on_update(lambda event: self._by_hand(event, self._set_clearance))

    # -- actions -------------------------------------------------------------------------------------

    def _download(self, event: Any) -> None:
        """Send the configuration as a file to the browser that asked for it."""
        if event.client is not None:
            text = self._state.export()
            event.client.send_file_download(EXPORT_NAME, text.encode(), save_immediately=True)

    def _by_hand(self, event: Any, wish: Callable[[], object]) -> None:
        """Execute a command if a person changed the control; changes by this program come
        without a client.
        """
        if event.client_id is not None:
            self._act(wish)

    def moved(self) -> None:
        """Forget typed numbers that were not executed, because the arm has moved in another way."""
        self._written, self._refusal = {id(text): text.value for text in (self.xyz, self.rpy)}, ""

    def _turn(self) -> None:
        """Set the arm angle to the slider's."""
        self.moved()
        value = self._taken[id(self.psi)] = self.psi.value
        self._state.set_psi(np.radians(value))

    def _turn_joint(self, joint: int) -> None:
        """Set a joint 1..7 to its slider's value."""
        self.moved()
        slider = self.joints[joint - 1]
        value = self._taken[id(slider)] = slider.value
        self._state.set_joint(joint, float(np.radians(value)))

    def _change(self, gc: int) -> None:
        """Go to a branch."""
        self.moved()
        self._state.set_gc(gc)

    def _seek(self) -> None:
        """Go to the row of the motion that the slider shows."""
        self.moved()
        value = self._taken[id(self._row)] = self._row.value
        self._state.seek(int(value) - 1)

    def _type(self) -> None:
        """Hide the last error when the person types on."""
        self._refusal = ""

    def move_there(self) -> None:
        """Move the tool to the typed numbers, or show their fault."""
        try:
            pose = pose_of_text(self.xyz.value, self.rpy.value, self._state.arm)
        except InputError as error:
            self._refusal = str(error)
            return
        answer = self._state.set_pose(pose)
        if answer.ok:
            self.moved()
        self._refusal = answer.text

    def begin_again(self) -> None:
        """Return to the start of the viewer."""
        self.set_playing(False)
        self.moved()
        self._state.reset()

    def _set_slider(self, slider: Any, value: float) -> None:
        """Show the state's value on a slider, unless a person has moved the slider in between."""
        if slider.value == self._taken.pop(id(slider), slider.value):
            _show(slider, value=float(np.clip(value, slider.min, slider.max)))

    def _write(self, text: Any, words: str) -> None:
        """Show text in a box, unless a person has typed there in between."""
        if text.value == self._written[id(text)]:
            _show(text, value=words)
            self._written[id(text)] = words

    def _set_policy(self) -> None:
        """Set the policy and its numbers to those of the panel."""
        gain, alpha = float(self._gain.value), float(self._alpha.value)
        policies: dict[str, Policy | None] = {
            TRACK: None,
            HOLD: Hold(),
            REPEL: Repulsion(K=gain, alpha=alpha),
            CENTRE: Centre(K=gain),
            TOWARDS: replace(self._wish, K=gain),
        }
        self._state.policy = policies[self.policy.value]

    def _set_clearance(self) -> None:
        """Set the clearance of the scene to the slider's."""
        value = self._taken[id(self.clearance)] = self.clearance.value
        self._state.set_clearance(1e-3 * float(value))

    def choose(self, name: str) -> None:
        """Select a motion to play by its name, and go to its first solved row."""
        self.moved()
        motion = self._runs[name]
        self._image = map_image(motion, self._state.scene)
        self._row.max = max(len(motion), 2)
        self._state.set_motion(motion)

    def set_playing(self, playing: bool) -> None:
        """Start or stop playing, if there is a motion."""
        if self._row is not None:
            self.playing = playing
            self._play.label = "Pause" if playing else "Play"

    # -- display -------------------------------------------------------------------------------------

    def update(self) -> None:
        """Show the state in all controls."""
        state = self._state
        self._status.content = status_panel(state)
        self._set_slider(self.psi, _rounded_degrees(state.psi))
        self._arcs.content = arcs_panel(state)
        _show(self._gain, visible=state.policy is not None and not isinstance(state.policy, Hold))
        _show(self._alpha, visible=isinstance(state.policy, Repulsion))
        for slider, q in zip(self.joints, state.q, strict=True):
            self._set_slider(slider, _rounded_degrees(q))
        self._reasons.content = reasons_panel(state)
        for gc, button in enumerate(self.buttons):
            blocked = state.reason(gc) is not None
            _show(button, disabled=blocked, color=_CHOSEN if gc == state.gc else _OPEN)
        for text, words in zip((self.xyz, self.rpy), text_of_pose(state.pose), strict=True):
            self._write(text, words)
        self._note.content = note_panel(self._refusal)
        if self.clearance is not None and state.scene is not None:
            self._set_slider(self.clearance, 1e3 * state.scene.clearance)
        if self._row is not None and state.motion is not None:
            self._set_slider(self._row, state.row + 1)
            self._map.content = map_panel(state.motion, self._image, state.row)


def gc_name(gc: int) -> str:
    """Return the name of a configuration on a button.

    >>> gc_name(3)
    'GC 3 −−+'
    """
    return f"GC {gc} {''.join('+' if sign > 0 else '−' for sign in gc_signs(gc))}"


def slider_range(lower: float, upper: float) -> tuple[float, float]:
    """Return the ends of a joint's slider, deg: its limits (rad) cut to 0.1 deg; ±360 or farther without.

    A file's -1.396263 rad becomes -80 deg: limits are rounded within 0.001 deg.

    >>> slider_range(-np.inf, 1.5), slider_range(-1.396263, 1.570796)
    ((-360.0, 85.9), (-80.0, 90.0))
    """
    low = lower if np.isfinite(lower) else min(-2 * np.pi, upper - 2 * np.pi)
    high = upper if np.isfinite(upper) else max(2 * np.pi, lower + 2 * np.pi)
    inward = np.array([np.ceil(np.degrees(low) * 10 - 0.01), np.floor(np.degrees(high) * 10 + 0.01)]) / 10
    return float(inward[0]), float(inward[1])


def _policy_name(policy: Policy | None) -> str:
    """Return the menu's name of a policy."""
    match policy:
        case None:
            return TRACK
        case Repulsion():
            return REPEL
        case Centre():
            return CENTRE
        case Towards():
            return TOWARDS
    return HOLD


def _rounded_degrees(angle: float) -> float:
    """Return an angle (rad) in degrees, rounded to 0.1."""
    return round(float(np.degrees(angle)), 1)


def _show(control: Any, **values: Any) -> None:
    """Set values of a control that differ from those shown."""
    for name, value in values.items():
        if getattr(control, name) != value:
            setattr(control, name, value)
