"""The viewer's scene: solids on the DH frames, elbow circle, ghosts, the target, gizmo."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..colours import FREE, JOINT_COLOURS, OBSTACLE, PALE
from ..reach.voxels import Voxels
from .solids import Solid
from .state import ViewerState
from .surfaces import lowest
from .surroundings import Surroundings, place

_ELBOW_RGB = (20, 20, 20)
_GHOST_RGB = (150, 160, 190)
_REFUSED_RGB = (214, 48, 39)
_TARGET_OPACITY = 0.35
_AXIS_LENGTH, _AXIS_RADIUS = 0.1, 0.006
_HAND = 7  # the DH frame that carries flange and tool
_TOOL = f"/arm/{_HAND}/tool"
_COLOURS = np.array([tuple(bytes.fromhex(colour[1:])) for colour in (FREE, *JOINT_COLOURS, OBSTACLE, PALE)])
_EYE = 1.2 * np.array([0.95, -1.15, 0.75])
_PANEL_SIDE = np.array([0.41, 0.34, 0.0])  # to the right on screen: the panel covers that side
_PANEL_SHARE = 0.6  # of the height of a window that is taller than wide: covered by the panel
_GIZMO = 0.22
_LINE, _FREE_LINE, _GHOST_LINE = 0.012, 0.03, 0.02
_GRID_CELL, _BELOW = 0.1, 0.002  # m
_FEW_RGB, _ALL_RGB = (60, 20, 90), (250, 230, 40)
_POINT = 0.25  # of a voxel's edge: small enough to see behind


class Scene:
    """The display of a `ViewerState` with the solids of its arm on a viser server."""

    def __init__(self, server: Any, state: ViewerState, solids: list[Solid]) -> None:
        """Create all nodes: arm, handle, circle, other configurations and obstacles."""
        self._state = state
        self._size = state.arm.geometry.reach
        self._api = api = server.scene
        self._voxels: Any = None
        api.set_up_direction("+z")
        self._add_room(server)
        self._frames = [api.add_frame(f"/arm/{i}", show_axes=False) for i in range(8)]
        self._solids = [
            (solid.colour, _add_solid(api, f"/arm/{solid.frame}", solid, solid.vertices)) for solid in solids
        ]
        self._target = self._add_target(api, solids)
        self.surroundings: Surroundings | None = None
        if state.scene is not None:
            tool = api.add_frame(_TOOL, show_axes=False)
            place(tool, state.arm.tool)
            self.surroundings = Surroundings(server, state, _TOOL)
        none = np.zeros((1, 2, 3))
        self._gap = api.add_line_segments(
            "/gap", none, _REFUSED_RGB, thickness=_LINE * self._size, visible=False
        )
        self._free, self._blocked = (
            api.add_line_segments(
                f"/circle/{name}", none, np.zeros((1, 2, 3), dtype=np.uint8), thickness=width * self._size
            )
            for name, width in (("free", _FREE_LINE), ("blocked", _LINE))
        )
        self._elbow = api.add_icosphere("/elbow", radius=0.035 * self._size, color=_ELBOW_RGB)
        self._ghosts = api.add_line_segments(
            "/ghosts", none, _GHOST_RGB, thickness=_GHOST_LINE * self._size, visible=False
        )
        self.gizmo = api.add_transform_controls(
            "/tool", scale=_GIZMO * self._size, depth_test=False, opacity=0.9
        )
        self.show_ghosts = False
        self._circle_of: tuple[bytes, int, int] | None = None

    def _add_room(self, server: Any) -> None:
        """Add floor and light, and place the camera."""
        state, size = self._state, self._size
        base = state.arm.base[:3, 3]
        centre = base + np.array([0.0, 0.0, 0.45 * (size + state.arm.geometry.d_bs)])
        centre += _PANEL_SIDE * size
        camera = server.initial_camera
        camera.position, camera.look_at, camera.up = centre + _EYE * size, centre, (0.0, 0.0, 1.0)
        server.on_client_connect(lambda client: self._fit(client.camera))
        floor = base.copy()  # below the obstacles too, because it hides everything under it
        shapes = () if state.scene is None else state.scene.shapes
        below = min([floor[2], *(lowest(shape) - _BELOW for shape in shapes)])
        floor[2] = max(below, floor[2] - 3 * size)
        server.scene.add_grid(
            "/floor", width=3 * size, height=3 * size, cell_size=_GRID_CELL, position=floor, plane="xy"
        )

    def _fit(self, camera: Any) -> None:
        """Show the whole arm above the panel if the window is taller than wide, as on a phone."""
        if camera.aspect >= 1.0:
            return
        arm = self._state.arm
        height = (1.0 + _GIZMO) * (self._size + arm.geometry.d_bs)  # includes the gizmo on top
        half = np.tan(camera.fov / 2)
        distance = height / (2 * half * min(1.0 - _PANEL_SHARE, camera.aspect))
        eye = _EYE / np.linalg.norm(_EYE)
        right = np.cross([0.0, 0.0, 1.0], eye)
        up = np.cross(eye, right / np.linalg.norm(right))
        middle = arm.base[:3, 3] + np.array([0.0, 0.0, 0.5 * height])
        centre = middle - _PANEL_SHARE * half * distance * up
        camera.position, camera.look_at = centre + distance * eye, centre

    def _add_target(self, api: Any, solids: list[Solid]) -> Any:
        """Return the node of the unreached pose: axes, and the gripper as a ghost."""
        node = api.add_frame(
            "/target", axes_length=_AXIS_LENGTH * self._size, axes_radius=_AXIS_RADIUS * self._size,
            origin_radius=2 * _AXIS_RADIUS * self._size, visible=False,
        )  # fmt: skip
        tool = self._state.arm.tool
        for solid in (solid for solid in solids if solid.frame == _HAND):
            vertices = (solid.vertices - tool[:3, 3]) @ tool[:3, :3]
            ghost = _add_solid(api, "/target", solid, vertices)
            ghost.color, ghost.opacity, ghost.cast_shadow = _REFUSED_RGB, _TARGET_OPACITY, False
        return node

    def show_voxels(self, found: Voxels | None) -> None:
        """Show the positions that the tool reaches, lighter for more orientations; None hides them."""
        if self._voxels is not None:
            self._voxels.remove()
            self._voxels = None
        if found is not None:
            self._voxels = self._api.add_point_cloud(
                "/voxels", found.position.astype(np.float32), share_colours(found.share),
                point_size=_POINT * found.spacing, point_shape="circle",
            )  # fmt: skip

    def update(self, *, gizmo: bool, held: str | None = None) -> None:
        """Show the state; with `gizmo` also the tool's handle, and those of all boxes but the `held` one."""
        state = self._state
        frames = state.arm.frames(state.q)
        for node, frame in zip(self._frames, frames, strict=True):
            place(node, frame)
        self._elbow.position = frames[3, :3, 3]
        self._update_circle()
        self._update_ghosts()
        self._update_target()
        if self.surroundings is not None:
            self.surroundings.update(held)
        if gizmo:
            place(self.gizmo, state.pose)

    def _update_circle(self) -> None:
        """Redraw the circle if pose, configuration or scene have changed."""
        key = (self._state.pose.tobytes(), self._state.gc, id(self._state.scene))
        if key == self._circle_of:
            return
        self._circle_of = key
        circle = self._state.elbow_circle()
        for node, shown in ((self._free, circle.blocker == 0), (self._blocked, circle.blocker != 0)):
            node.visible = bool(shown.any())
            if node.visible:
                node.points = circle.segments[shown].astype(np.float32)
                node.colors = segment_colours(circle.blocker[shown])

    def _update_ghosts(self) -> None:
        """Show the other configurations as stick figures if that is switched on."""
        figures = list(self._state.ghosts().values()) if self.show_ghosts else []
        self._ghosts.visible = bool(figures)
        if figures:
            self._ghosts.points = figure_segments(figures).astype(np.float32)

    def _update_target(self) -> None:
        """Show the unreached pose and its distance, and the arm in red meanwhile."""
        target = self._state.target
        if target is not None:
            place(self._target, target)
            ends = np.stack([self._state.pose[:3, 3], target[:3, 3]])
            self._gap.points = ends[None].astype(np.float32)
        if self._target.visible == (target is not None):
            return
        self._target.visible = self._gap.visible = target is not None
        for colour, node in self._solids:
            node.color = colour if target is None else _REFUSED_RGB


def share_colours(share: Floats) -> NDArray[np.uint8]:
    """Return the RGB (n, 3) of shares in [0, 1]: from few, dark, to all, light."""
    mixed = np.outer(1 - share, _FEW_RGB) + np.outer(share, _ALL_RGB)
    return np.round(mixed).astype(np.uint8)


def segment_colours(blocker: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the RGB (n, 2, 3) of circle pieces: light if feasible, otherwise the colour of the blocker.

    The browser takes the colours of line ends as linear light, not as sRGB.
    """
    return np.repeat(_linear(_COLOURS)[blocker][:, None], 2, axis=1)


def _linear(srgb: Any) -> NDArray[np.uint8]:
    """Return sRGB bytes as linear ones (IEC 61966-2-1)."""
    share = np.asarray(srgb) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)


def figure_segments(figures: list[Floats]) -> Floats:
    """Return stick figures (k, 3) each as line segments (n, 2, 3), m."""
    corners = np.stack(figures)
    return np.stack([corners[:, :-1], corners[:, 1:]], axis=2).reshape(-1, 2, 3)


def _add_solid(api: Any, parent: str, solid: Solid, vertices: Floats) -> Any:
    """Add a solid to the page as a mesh and return its node."""
    return api.add_mesh_simple(
        f"{parent}/{solid.name}", vertices, solid.faces, color=solid.colour, side="double"
    )
