"""The server for browsers, and its display."""

from __future__ import annotations

import errno
import io
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Floats
from ..errors import OutputError, needed
from ..motion.joint_path import JointPath
from ..poses import poses_from_rows
from ..reach.voxels import Voxels
from .controls import Controls
from .meshes import solids_of
from .origin import checked_origins
from .scene import Scene
from .state import ViewerState

LOOPBACK = "127.0.0.1"
FIRST_PORT = 8080
_PORTS_TRIED = 20
_FRAME_TIME = 1 / 30


class Viewer:
    """A running viewer: a server for browsers, and the state they share.

    Parameters
    ----------
    state : ViewerState
        The state that is shown and moved; may be read at any time.
    runs : mapping of names to JointPath, optional
        Motions of the same arm to play.
    port : int, optional
        Port to serve at, 0 for any; by default the first free one of 8080 to 8099.
    host : str
        Address to bind to; this machine alone by default.
    urdf : path, optional
        File from which the arm was read, for its meshes.
    base, tip : str, optional
        Links given when the arm was read.

    Attributes
    ----------
    url : str
        Its address.
    note : str
        Unreadable parts of the meshes, or "".

    Raises
    ------
    MissingExtraError
        Without viser.
    OutputError
        If the port is taken or not allowed.
    InputError
        If a motion belongs to another arm, or has no solved row.
    """

    def __init__(
        self,
        state: ViewerState,
        runs: Mapping[str, JointPath] | None = None,
        *,
        port: int | None = None,
        host: str = LOOPBACK,
        urdf: Path | None = None,
        base: str | None = None,
        tip: str | None = None,
    ) -> None:
        """Start the server and show the state."""
        viser = needed("viser", "the viewer needs", "view")
        for motion in (runs or {}).values():
            state.check_motion(motion)
        solids, self.note = solids_of(state.arm, urdf, base, tip)
        chosen = _free_port(host) if port is None else _checked_port(host, port)
        self.state = state
        self._lock = threading.RLock()
        self._stopped = threading.Event()
        self._held = False
        self._held_box: str | None = None
        with _quiet(), checked_origins():
            self._server = viser.ViserServer(host=host, port=chosen, verbose=False)
        bound = self._server.get_port()
        if port and bound != port:  # taken since the test
            with _quiet():
                self._server.stop()
            raise _taken(host, port)
        self.url = f"http://{'localhost' if host in ('0.0.0.0', '::') else host}:{bound}"
        self._server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self._server.gui.set_panel_label(f"armangle: {state.arm.name}")
        self.scene = Scene(self._server, state, solids)
        self.controls = Controls(self._server, state, self.act, dict(runs or {}))
        self._wire(dict(runs or {}))

    def _wire(self, runs: dict[str, JointPath]) -> None:
        """Connect the handles and controls with the functions that they call."""
        self.scene.gizmo.on_update(self._drag)
        if self.scene.surroundings is not None:
            for name, handle in self.scene.surroundings.handles.items():
                handle.on_update(partial(self._drag_box, name))
        self.controls.ghosts.on_update(lambda _: self.act(self._take_ghosts))
        self.act(lambda: self.controls.choose(next(iter(runs))) if runs else None)
        self._player = threading.Thread(target=self._play, daemon=True)
        self._player.start()

    def _take_ghosts(self) -> None:
        """Show or hide the other configurations as the switch says."""
        self.scene.show_ghosts = bool(self.controls.ghosts.value)

    def show_voxels(self, found: Voxels | None) -> None:
        """Show the positions that the tool reaches and the share of orientations; None hides them.

        Parameters
        ----------
        found : Voxels or None
            The result of `ReachMap.voxels`.
        """
        with self._lock, self._server.atomic():
            self.scene.show_voxels(found)

    def act(self, wish: Callable[[], object], *, gizmo: bool = True) -> None:
        """Execute a command on the state, exclusively, and show it; with `gizmo` the tool's handle too."""
        with self._lock, self._server.atomic():
            wish()
            self.scene.update(gizmo=gizmo, held=self._held_box)
            self.controls.update()

    def _drag(self, event: Any) -> None:
        """Move the arm with the handle of the tool; put the handle back to the tool when it is released."""
        handle = self.scene.gizmo
        if event.phase != "update":  # events may overtake each other: the last one is start or end
            self._held = event.phase == "start"

        def follow_hand() -> None:
            """Move the arm to the pose of the handle."""
            self.controls.moved()
            self.state.set_pose(_pose(np.array(handle.position), np.array(handle.wxyz)))

        self.act(follow_hand, gizmo=not self._held)

    def _drag_box(self, name: str, event: Any) -> None:
        """Follow the handle of a box while it is held."""
        handle = event.target
        if event.phase != "update":
            self._held_box = name if event.phase == "start" else None
        self.act(
            lambda: self.state.move_box(name, _pose(np.array(handle.position), np.array(handle.wxyz))),
            gizmo=not self._held,
        )

    def _play(self) -> None:
        """Step through the motion while it is played; runs in a thread of its own."""
        while not self._stopped.wait(_FRAME_TIME):
            motion = self.state.motion
            if not self.controls.playing or motion is None:
                continue
            self.act(partial(self.state.seek, (self.state.row + 1) % len(motion)))
            if self.state.row >= len(motion) - 1:
                self.controls.set_playing(False)

    def wait(self) -> None:
        """Serve until `stop`, or until the process is interrupted."""
        while not self._stopped.wait(1.0):
            pass

    def stop(self) -> None:
        """Stop serving."""
        self._stopped.set()
        self._player.join()
        with _quiet():
            self._server.stop()


def _pose(position: Floats, wxyz: Floats) -> Floats:
    """Return the pose (4, 4) of a position (m) and a unit quaternion."""
    pose: Floats = poses_from_rows(np.hstack([position, wxyz])[None])[0]
    return pose


def _quiet() -> redirect_stdout[io.StringIO]:
    """Suppress viser's output: the caller prints the address."""
    return redirect_stdout(io.StringIO())


def _checked_port(host: str, port: int) -> int:
    """Return the port, or raise if it is not available; 0 lets the system choose."""
    if not 0 <= port <= 65535:
        raise OutputError(f"port is {port}, wanted an integer from 0 to 65535")
    try:
        _bind(host, port)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise _taken(host, port) from None
        raise OutputError(f"port {port} of {host} cannot be had: {error.strerror or error}") from None
    return port


def _free_port(host: str) -> int:
    """Return the first free one of 20 ports from 8080 on; raise if none is."""
    for port in range(FIRST_PORT, FIRST_PORT + _PORTS_TRIED):
        try:
            return _checked_port(host, port)
        except OutputError as error:
            refused = error
    raise refused


def _taken(host: str, port: int) -> OutputError:
    """Return the error of a port that another program uses."""
    return OutputError(f"port {port} of {host} is taken by another program; name another, or 0 for any")


def _bind(host: str, port: int) -> None:
    """Bind and release: raises OSError if the port is not available."""
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind, protocol) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        trial.bind(address)
