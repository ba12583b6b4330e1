"""The viewer's scene: solids on the DH frames, elbow circle, ghosts, gizmo."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..colours import JOINT_COLOURS
from ..poses import rows_from_poses
from .solids import Solid
from .state import ViewerState

_FREE_RGB = (40, 40, 40)
_GHOST_RGB = (150, 160, 190)
_COLOURS = np.array([_FREE_RGB, *(tuple(bytes.fromhex(colour[1:])) for colour in JOINT_COLOURS)])
_EYE = np.array([0.95, -1.15, 0.75])
_PANEL_SIDE = np.array([0.19, 0.16, 0.0])  # to the right as the eye sees it: the panel covers that side
_GIZMO = 0.22
_LINE, _GHOST_LINE = 0.012, 0.02
_GRID_CELL = 0.1


class Scene:
    """What a viser server shows of a state.

    Parameters
    ----------
    server : viser.ViserServer
    state : ViewerState
    solids : list of Solid
        The arm's looks.
    """

    def __init__(self, server: Any, state: ViewerState, solids: list[Solid]) -> None:
        self._state = state
        self._size = state.arm.reach
        api = server.scene
        api.set_up_direction("+z")
        self._add_room(server)
        self._frames = [api.add_frame(f"/arm/{i}", show_axes=False) for i in range(8)]
        for solid in solids:
            api.add_mesh_simple(
                f"/arm/{solid.frame}/{solid.name}",
                solid.vertices,
                solid.faces,
                color=solid.colour,
                side="double",
            )
        none = np.zeros((1, 2, 3))
        self._circle = api.add_line_segments(
            "/circle", none, np.zeros((1, 2, 3), dtype=np.uint8), thickness=_LINE * self._size
        )
        self._elbow = api.add_icosphere("/elbow", radius=0.035 * self._size, color=_FREE_RGB)
        self._ghosts = api.add_line_segments(
            "/ghosts", none, _GHOST_RGB, thickness=_GHOST_LINE * self._size, visible=False
        )
        self.gizmo = api.add_transform_controls(
            "/tool", scale=_GIZMO * self._size, depth_test=False, opacity=0.9
        )
        self.show_ghosts = False
        self._circle_of: tuple[bytes, int] | None = None

    def _add_room(self, server: Any) -> None:
        state, size = self._state, self._size
        base = state.arm.base[:3, 3]
        centre = base + np.array([0.0, 0.0, 0.6 * (size + state.arm.d_bs)])
        centre += _PANEL_SIDE * size
        camera = server.initial_camera
        camera.position, camera.look_at, camera.up = centre + _EYE * size, centre, (0.0, 0.0, 1.0)
        server.scene.add_grid(
            "/floor", width=3 * size, height=3 * size, cell_size=_GRID_CELL, position=base, plane="xy"
        )

    def update(self, *, gizmo: bool) -> None:
        """Show the state; the gizmo is put on the tool unless a hand holds it."""
        state = self._state
        for node, row in zip(self._frames, rows_from_poses(state.arm.frames(state.q)), strict=True):
            _place(node, row)
        self._elbow.position = state.arm.frames(state.q)[3, :3, 3]
        self._update_circle()
        self._update_ghosts()
        if gizmo:
            _place(self.gizmo, rows_from_poses(state.pose[None])[0])

    def _update_circle(self) -> None:
        """Draw the circle anew where pose or configuration have changed."""
        key = (self._state.pose.tobytes(), self._state.gc)
        if key == self._circle_of:
            return
        self._circle_of = key
        circle = self._state.elbow_circle()
        self._circle.points = circle.segments.astype(np.float32)
        self._circle.colors = segment_colours(circle.blocker)

    def _update_ghosts(self) -> None:
        figures = list(self._state.ghosts().values()) if self.show_ghosts else []
        self._ghosts.visible = bool(figures)
        if figures:
            self._ghosts.points = figure_segments(figures).astype(np.float32)


def segment_colours(blocker: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the RGB (n, 2, 3) of circle pieces: dark where feasible, else that of the joint.

    The browser takes the colours of line ends as linear light, not as sRGB.
    """
    return np.repeat(_linear(_COLOURS)[blocker][:, None], 2, axis=1)


def _linear(srgb: Any) -> NDArray[np.uint8]:
    """Return sRGB bytes as linear ones (IEC 61966-2-1)."""
    share = np.asarray(srgb) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)


def figure_segments(figures: list[Floats]) -> Floats:
    """Return stick figures (8, 3) each as line segments (n, 2, 3), m."""
    corners = np.stack(figures)
    return np.stack([corners[:, :-1], corners[:, 1:]], axis=2).reshape(-1, 2, 3)


def _place(node: Any, row: Floats) -> None:
    node.position, node.wxyz = row[:3], row[3:]
