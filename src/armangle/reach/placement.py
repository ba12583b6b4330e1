"""Robot placement: base positions, each with its best yaw."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import JOINTS, Floats, as_floats, as_number, frozen, many_poses, shaped_if_empty
from .._core import LENGTH_LIMIT
from .._progress import Progress, as_progress, progressing
from .._threads import thread_count
from .._values import by_content
from ..arm.arm import Arm, check_arm
from ..errors import InputError
from ..models.axes import NEAR_ANGLE
from ..poses import as_transform
from ..status import STATUSES, Status

_UPRIGHT = 1e-6  # rad: largest tilt of axis 1; turning the base about z then moves no pose by more


@by_content
@dataclass(frozen=True, eq=False)
class Placement:
    """The poses that a robot reaches from each base position, at the best yaw there.

    Attributes
    ----------
    arm : Arm
        The arm that was placed; a pose closer to a singularity than its margin does not count as reached. Of
        an own chain, on the base that puts its own axis 1 upright, through the origin.
    poses : ndarray, shape (n, 4, 4)
        The poses to reach, in the world.
    weight : ndarray, shape (n,)
        Their weights.
    x, y : ndarray, shapes (nx,), (ny,)
        Base positions, m; `z` is their common height.
    reached : ndarray, shape (nx, ny)
        Sum of the weights of the poses reached at the best yaw.
    yaw : ndarray, shape (nx, ny)
        That yaw in (-π, π], rad: the middle of the widest interval of equally good yaws.
    stretch : ndarray, shape (nx, ny)
        Length of this interval, rad; 2π if every yaw is equally good.
    unproven : ndarray, shape (nx, ny)
        Sum of the weights of the poses that are not proven to be reached at that yaw, and for which some yaw
        is not excluded; 0 unless the arm has its own chain.
    """

    arm: Arm
    poses: Floats = field(repr=False)
    weight: Floats = field(repr=False)
    x: Floats = field(repr=False)
    y: Floats = field(repr=False)
    z: float
    reached: Floats = field(repr=False)
    yaw: Floats = field(repr=False)
    stretch: Floats = field(repr=False)
    unproven: Floats = field(repr=False)

    def base(self, i: int, j: int) -> Floats:
        """Return the base (4, 4) of position (x[i], y[j]) at its best yaw, for ``arm.with_(base=...)``."""
        sine, cosine = np.sin(self.yaw[i, j]), np.cos(self.yaw[i, j])
        out = np.eye(4)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        out[:3, :3] = turn @ self.arm.base[:3, :3]
        out[:3, 3] = turn @ _off_axis(self.arm) + (self.x[i], self.y[j], self.z)
        return out

    def _best_index(self) -> tuple[int, int]:
        """Return the base (i, j) with the largest weight of poses; among equals the widest yaw interval."""
        most = self.reached >= self.reached.max() - 1e-9 * max(1.0, abs(float(self.reached.max())))
        i, j = np.unravel_index(int(np.argmax(np.where(most, self.stretch, -1.0))), self.reached.shape)
        return int(i), int(j)

    def best(self) -> Floats:
        """Return the base (4, 4) with the largest weight; among equals the one whose yaw may vary most."""
        return self.base(*self._best_index())

    def missed(self, base: ArrayLike | None = None) -> tuple[tuple[int, Status], ...]:
        """Return the poses that the arm cannot reach from a base, and the reasons.

        Parameters
        ----------
        base : array_like, shape (4, 4), optional
            A base in the world; by default that of `best`.

        Returns
        -------
        tuple of (int, Status)
            Index of each such pose, and the reason in the branch nearest to a solution.

        Raises
        ------
        InputError
        """
        there = self.arm.with_(base=self.best() if base is None else as_transform("base", base))
        if not len(self.poses):
            return ()
        has = there.freedom(self.poses)
        codes = np.asarray(has.status)
        return tuple((int(k), STATUSES[int(codes[k])]) for k in np.flatnonzero(codes != Status.OK))

    def __str__(self) -> str:
        """Return the best base as a sentence."""
        i, j = self._best_index()
        if not self.reached[i, j] > 0:
            return f"0 of {self.weight.sum():g} reached from any of {self.reached.size} positions"
        more = self.unproven[i, j]
        return (
            f"{self.reached[i, j]:g} of {self.weight.sum():g} reached from x = {self.x[i]:g} m, "
            f"y = {self.y[j]:g} m, yaw {np.degrees(self.yaw[i, j]):.1f}°, which may vary over "
            f"{np.degrees(self.stretch[i, j]):.1f}°; the best of {self.reached.size} positions"
            f"{f'; {more:g} more are neither proven nor excluded' if more > 0 else ''}"
        )


def place(
    arm: Arm,
    poses: ArrayLike,
    x: ArrayLike,
    y: ArrayLike,
    *,
    z: float = 0.0,
    weight: ArrayLike | None = None,
    progress: Progress | bool | None = None,
) -> Placement:
    """Return the weight of the poses that an arm reaches from each base position, at the best yaw.

    The yaw is not scanned: each pose gives exact arcs of yaw (`Arm.feasible_turns`), and one sweep over all
    their ends finds the yaw of greatest weight. No scan can find more.

    Parameters
    ----------
    arm : Arm
        Its axis 1 must be vertical, up or down; the rotation of ``arm.base`` is kept, but for the little by
        which axis 1 of an own chain leans. Its `scene` is ignored.
    poses : array_like, shape (n, 4, 4)
        Poses of the end effector in the world, position in m; n may be 0.
    x, y : array_like, shapes (nx,), (ny,)
        Positions of axis 1, m: all pairs are tried.
    z : float
        Height of the base's origin (frame 0, from which d_bs counts), m. It is not scanned; for several
        heights use ``max((place(arm, poses, x, y, z=z) for z in heights), key=lambda p: p.reached.max())``.
    weight : array_like, shape (n,), optional
        Weight of each pose, >= 0; 1 by default.
    progress : function (done, total) or bool
        Called some times a second with the number of finished positions; True draws a bar on stderr.

    Returns
    -------
    Placement
        ``reached``, ``yaw``, ``stretch`` of shape (nx, ny); ``best()`` is the best base, and ``missed()`` the
        poses that it does not reach, with reasons. Of an own chain only proven poses count as reached.

    Raises
    ------
    InputError
        If an argument is invalid, or axis 1 is not vertical.

    Examples
    --------
    >>> import armangle as aa, numpy as np
    >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    >>> grasps = aa.pose([[0.6, 0.2, 0.3], [0.6, -0.4, 0.3], [1.9, 0.0, 0.3]], rpy=[0.0, np.pi, 0.0])
    >>> found = aa.place(arm, grasps, x=np.linspace(-0.5, 0.5, 11), y=[0.0])
    >>> float(found.reached.max()), [(k, why.name) for k, why in found.missed()]
    (2.0, [(2, 'UNREACHABLE')])
    """
    check_arm(arm)
    up = float(arm.base[2, 2])
    lean = float(np.arccos(min(1.0, abs(up))))
    if arm.geometry.chain is not None and lean < NEAR_ANGLE:  # the base fitted to a chain leans a little
        arm = _upright(arm)
    elif np.hypot(arm.base[0, 2], arm.base[1, 2]) > _UPRIGHT:
        raise InputError(
            f"arm.base leans axis 1 by {np.degrees(lean):.3g} deg, wanted it upright or straight down: "
            "the yaw that place() chooses is a turn about a vertical axis 1"
        )
    wanted = many_poses("poses", shaped_if_empty(poses, (4, 4)), arm._handle, "(n, 4, 4)").copy()
    along, across = _line("x", x), _line("y", y)
    height = as_number("z", z, -LENGTH_LIMIT, LENGTH_LIMIT)
    weights = _weights(weight, len(wanted))
    at = np.empty((len(along) * len(across), 3))
    at[:, 0], at[:, 1], at[:, 2] = np.repeat(along, len(across)), np.tile(across, len(along)), height
    at += _off_axis(arm)
    rows = np.empty((len(at), 4))
    with progressing(as_progress(progress)):
        arm._handle.place_many(wanted, weights, at, arm.singularity_margin, rows, thread_count(0))
    shape = len(along), len(across)
    yaw, stretch, reached, unproven = (frozen(np.ascontiguousarray(c).reshape(shape)) for c in rows.T)
    return Placement(
        arm, frozen(wanted), frozen(weights), frozen(along), frozen(across), height, reached, yaw, stretch,
        unproven,
    )  # fmt: skip


def _upright(arm: Arm) -> Arm:
    """Return an arm on its own chain on the base that puts its own axis 1 upright, or straight down, through
    the origin; the base's origin is at height 0.
    """
    frame = arm.frames(np.zeros(JOINTS))[0]
    axis, up = frame[:3, 2], np.array([0.0, 0.0, np.sign(arm.base[2, 2])])
    turn = np.eye(4)
    across, along = np.cross(axis, up), float(axis @ up)
    wedge = np.cross(np.eye(3), across)
    turn[:3, :3] = np.eye(3) + wedge + wedge @ wedge / (1.0 + along)
    moved = arm.with_(base=turn @ arm.base)
    shift = np.eye(4)
    shift[:2, 3] = -moved.frames(np.zeros(JOINTS))[0, :2, 3]
    shift[2, 3] = -moved.base[2, 3]
    return moved.with_(base=shift @ moved.base)


def _off_axis(arm: Arm) -> Floats:
    """Return the origin of the base (m) from axis 1: 0 unless the arm has its own chain."""
    return np.zeros(3) if arm.geometry.chain is None else arm.base[:3, 3]


def _line(name: str, values: ArrayLike) -> Floats:
    """Return positions (n,) along an axis, m; raise unless they are finite and below the size limit."""
    out = np.array(as_floats(name, values))
    if out.ndim != 1 or not len(out):
        raise InputError(f"{name} has shape {out.shape}, wanted (n,) with n >= 1")
    if not np.isfinite(out).all():
        raise InputError(f"{name} is {out[~np.isfinite(out)][0]}, wanted finite numbers")
    if (np.abs(out) > LENGTH_LIMIT).any():
        raise InputError(f"{name} reaches {np.abs(out).max():g} m, wanted metres within {LENGTH_LIMIT:g}")
    return out


def _weights(weight: ArrayLike | None, count: int) -> Floats:
    """Return the weight of each pose, all 1 by default."""
    if weight is None:
        return np.ones(count)
    out = np.array(as_floats("weight", weight))
    if out.shape != (count,):
        raise InputError(f"weight has shape {out.shape}, wanted ({count},), one for each pose")
    if not np.isfinite(out).all():
        raise InputError("weight holds a number that is not finite, wanted finite ones")
    if (out < 0).any():
        raise InputError(f"weight[{int(np.argmax(out < 0))}] is {out.min():g}, wanted weights >= 0")
    return out
