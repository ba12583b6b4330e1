"""Obstacles, collision models of links, and their nearest pair on a viser server."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..poses import rows_from_poses
from ..scenes.shapes import Box, Cloud, Field, Shape
from .state import ViewerState
from .surfaces import points_of, surface

OBSTACLE_RGB, BODY_RGB, TOUCHED_RGB = (92, 120, 160), (230, 170, 60), (214, 48, 39)
_OBSTACLE_OPACITY, _BODY_OPACITY = 0.55, 0.3
_HANDLE, _LARGEST, _BEYOND = 0.12, 0.3, 0.8  # of the reach, of it, of the largest edge: a box's handle
_LINE = 0.008


class Surroundings:
    """The obstacles around the arm of a state with a scene, and the collision model of its links.

    `tool` is the node of a viser server at the tool.
    """

    def __init__(self, server: Any, state: ViewerState, tool: str) -> None:
        """Create the nodes of obstacles and collision shapes; `tool` is the node of the tool."""
        self._state, self._api = state, server.scene
        self._size = state.arm.geometry.reach
        self._nodes: dict[str, list[tuple[Any, Any]]] = {}  # by name, each with its own colour
        shapes = () if state.scene is None else zip(state.scene.names, state.scene.shapes, strict=True)
        for at, (name, shape) in enumerate(shapes):
            self._add(f"/obstacles/{at}", name, shape, OBSTACLE_RGB, _OBSTACLE_OPACITY)
        for at, (parent, name, shape) in enumerate(self._links(tool)):
            self._add(f"{parent}/body_{at}", name, shape, BODY_RGB, _BODY_OPACITY)
        self.handles = {name: self._add_handle(at, box) for at, (name, box) in enumerate(state.boxes)}
        self._gap = self._api.add_line_segments(
            "/nearest", np.zeros((1, 2, 3)), TOUCHED_RGB, thickness=_LINE * self._size, visible=False
        )
        self._label = self._api.add_label("/nearest_mm", "", visible=False)
        self._red: set[str] = set()

    def _links(self, tool: str) -> list[tuple[str, str, Shape]]:
        """Return the parent node, the name and the shape of each collision shape of the arm."""
        arm = self._state.arm
        shapes = [] if arm.body is None else arm.body._shapes(arm.geometry)
        links = [(f"/arm/{frame}", shape.name or f"link_{frame}", shape) for frame, shape in shapes]
        return links + [(tool, shape.name or "hand", shape) for shape in arm.hand]

    def _add(self, path: str, name: str, shape: Shape, colour: Any, opacity: float) -> None:
        """Create the node of one shape."""
        if isinstance(shape, Cloud | Field):
            points, size = points_of(shape)
            node = self._api.add_point_cloud(path, points.astype(np.float32), colour, point_size=size)
        else:
            frame = np.array(shape.pose) if isinstance(shape, Box) else np.eye(4)
            if isinstance(shape, Box):
                shape = Box(np.eye(4), shape.size, shape.radius)
            vertices, faces = surface(shape, self._size)
            node = self._api.add_mesh_simple(
                path, vertices, faces, color=colour, opacity=opacity, side="double", cast_shadow=False
            )
            place(node, frame)
        self._nodes.setdefault(name, []).append((node, colour))

    def _add_handle(self, at: int, box: Box) -> Any:
        """Return the handle that moves a box."""
        scale = min(max(_HANDLE * self._size, _BEYOND * max(box.size)), _LARGEST * self._size)
        return self._api.add_transform_controls(f"/boxes/{at}", scale=scale, depth_test=False, opacity=0.7)

    def update(self, held: str | None) -> None:
        """Show the state; the handle of a held box stays where the person has it."""
        for name, box in self._state.boxes:
            place(self._nodes[name][0][0], box.pose)
            if name != held:
                place(self.handles[name], box.pose)
        near, red = self._state.nearest, set[str]()
        known = near is not None and near.obstacle is not None
        self._gap.visible = self._label.visible = known
        if near is not None and known:
            touching = self._state.touching is not None
            red = {str(near.obstacle), str(near.link)} if touching else red
            self._gap.points = near.points[None].astype(np.float32)
            _paint(self._gap, TOUCHED_RGB if touching else OBSTACLE_RGB)
            self._label.position = near.points.mean(axis=0)
            self._label.text = f"{1e3 * float(near.distance):.1f} mm"
        for name in red ^ self._red:
            for node, colour in self._nodes.get(name, []):
                _paint(node, TOUCHED_RGB if name in red else colour)
        self._red = red


def place(node: Any, pose: Any) -> None:
    """Set a node to a pose (4, 4)."""
    row = rows_from_poses(np.array(pose)[None])[0]
    node.position, node.wxyz = row[:3], row[3:]


def _paint(node: Any, rgb: tuple[int, int, int]) -> None:
    """Set the colour of a node."""
    name = "colors" if hasattr(node, "colors") else "color"
    setattr(node, name, np.array(rgb, dtype=np.uint8) if name == "colors" else rgb)
