"""An arm with an offset wrist or shoulder: `OffsetArm`, whose free joint takes the place of the arm angle."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from inspect import Parameter, Signature, signature
from typing import Any, Literal, NamedTuple, Never, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import (
    CONFIGURATIONS,
    JOINTS,
    MILLIMETRES,
    Floats,
    Ints,
    PathLike,
    as_flag,
    as_floats,
    as_gc,
    as_number,
    as_poses,
    as_threads,
    broadcast,
    check_angles,
    chosen,
    frozen,
    named,
)
from .._progress import Progress, as_progress, progressing
from .._values import by_content
from ..errors import ConfigurationError, InputError, NoSolutionError, UnknownRobotError, UnreachableError
from ..models.axes import MAX_ANGLE, MAX_LENGTH
from ..models.catalogue import catalogue
from ..models.chain import Chain, chain_of
from ..models.description import ImportReport, OffsetDescription
from ..models.mjcf import read_mjcf
from ..models.offset import (
    ANGLE_TOLERANCE,
    LENGTH_TOLERANCE,
    load_offset_robot,
    offset_catalogue,
)
from ..models.one_offset import describe_offset_chain
from ..models.report import warn_of
from ..models.urdf import Source, read_urdf
from ..models.urdf.writing import write_chain
from ..poses import as_transform
from ..status import STATUSES, Status
from .arcs import ArcSet
from .arm import Arm, Enforce, Unreachable
from .frozen_value import FrozenValue
from .keywords import names_keywords
from .question import branch_bits, weights_of

_ENFORCE = named(_core.Enforce)
_UNREACHABLE = ("raise", "nan")
_NO_FIELDS = ("d_4", "chain", "reference", "body", "hand")
_OUT_OF_REACH = (Status.UNREACHABLE, Status.NO_POSTURE)


def _signature() -> Signature:
    """Return the keywords of `OffsetArm` and their defaults, for help() and the pages."""
    own = [Parameter(name, Parameter.KEYWORD_ONLY, default=0.0) for name in ("a_1", "a_6")]
    shared = signature(Arm).parameters.values()
    return Signature([*own, *(parameter for parameter in shared if parameter.name not in _NO_FIELDS)])


_NO_SCENES = "no scenes are made for it: frames(q) says where its links are"
_INSTEAD = {
    "solutions": "solve(pose, gc=k) is the nearest posture of branch k, feasible_all(pose) all there are",
    "best": "solve(pose) is the posture nearest to the middles of the ranges",
    "explain": "feasible_all(pose) has a status and the joints at its ends",
    "reachable": "solve(pose).ok, or that of a whole batch, says so",
    "freedom": "feasible_all(pose).measure is how much of its free joint each branch has",
    "self_motion": "the null space of jacobian(q) is the same, up to its length",
    "nominal": "it is exact itself",
    "deviation": "it is exact itself",
    **dict.fromkeys(("clear", "clearance", "widest", "with_body", "with_hand", "body", "hand"), _NO_SCENES),
    **dict.fromkeys(("with_reference", "reference"), "it has no arm angle"),
}
_KEYWORDS = {
    "metric": "the distance is the root of a weighted sum of squares, weight=",
    "prefer": "leave near= out for the middles of the ranges",
    "outside": "aa.Tracker goes as near as it can",
    "roll": "give the pose for each roll, as one batch",
    "scene": _NO_SCENES,
    "allowed": "step and follow take it; here intersect feasible(pose, gc) with it",
    "singularity_margin": "it has no margin but that of limits, with_(lower=..., upper=...)",
    "psi": "free is its place",
}
_names_keywords = names_keywords("OffsetArm", _KEYWORDS)

_Numbers = NDArray[np.float64]
_Codes = NDArray[np.int64]
_ArcColumns = tuple[_Numbers, _Codes, _Codes, _Numbers, _Codes, _Numbers]
"""Ends, joints, sides, values, codes and what is unproven, as the core fills them."""


@by_content
class OffsetSolution(NamedTuple):
    """The posture of an `OffsetArm` that is nearest to given joints, and why there is none.

    ``q (..., 7)`` rad; ``free (...)`` value of the free joint as an angle in (-π, π], rad; ``gc (...)`` 0..7;
    ``distance (...)`` to the joints given, rad, NaN without; ``status (...)`` a `Status`, of a batch its
    codes as int8; ``margin (...)`` least distance of a joint to one of its limits, rad. Where the status is
    not OK the numbers are NaN and gc is -1.
    """

    q: Floats
    free: np.float64 | Floats
    gc: np.int64 | Ints
    distance: np.float64 | Floats
    status: Status | NDArray[np.int8]
    margin: np.float64 | Floats

    @property
    def ok(self) -> bool | NDArray[np.bool_]:
        """Whether there is a posture, shape (...)."""
        found = np.asarray(self.status) == Status.OK
        return found if found.ndim else bool(found)

    def raise_for_status(self) -> OffsetSolution:
        """Return the solution itself; raise where there is none.

        Raises
        ------
        UnreachableError
            If no value of the free joint brings the wrist within reach, or none has a posture.
        NoSolutionError
            If limits leave no posture.
        """
        codes = np.asarray(self.status)
        bad = np.argwhere(codes != Status.OK)
        if len(bad):
            at = tuple(int(i) for i in bad[0])
            status = STATUSES[int(codes[at])]
            kind = UnreachableError if status in _OUT_OF_REACH else NoSolutionError
            where = f"pose{list(at)}: " if at else ""
            raise kind(f"{where}{status.sentence} arm.feasible_all(pose) has the status of every branch.")
        return self


@final
class OffsetArm(FrozenValue):
    """A 7-axis arm that is S-R-S but for one offset: between axes 6 and 7, or between axes 1 and 2.

    Franka's arms, the xArm 7 and their like have such a wrist (a_6), PR2 and Fetch such a shoulder (a_1).
    The arm angle does not exist there. What takes its place is the *free joint*: joint 7 of an offset
    wrist, joint 1 of an offset shoulder. A pose, a value of the free joint and a branch gc have exactly one
    posture, in closed form, or none. Bits of gc: 1 where theta_2 < 0 (offset shoulder: theta_6), 2 where
    theta_4 lies below the stretched arm's, 4 where cos(theta_5) < 0 (theta_3).

    Parameters
    ----------
    a_1, a_6 : float
        Offset between the axes of joints 1 and 2, or of joints 6 and 7, m: one of them.
    **numbers
        As `Arm`: d_bs, d_se, d_ew, d_wf, a_3, a_4, signs, offsets, lower, upper, velocity, acceleration,
        base, tool, name, joint_names, notes. The pose of the tip is ``base @ DH(theta) @ tool`` with a_1 and
        a_6 in rows 1 and 6.

    Attributes
    ----------
    rows : Arm
        The S-R-S arm of the same numbers without a_1 and a_6.
    a_1, a_6 : float
    free_joint : int
        7 or 1.
    d_bs, d_se, d_ew, d_wf, a_3, a_4, signs, offsets, lower, upper, velocity, acceleration, base, tool, name,
    joint_names, notes, import_report
        As `Arm`.

    Raises
    ------
    ShapeError, NotFiniteError, NotRotationError, LimitError, InputError
        As `Arm`, or where not exactly one of a_1 and a_6 is other than 0.

    Source: docs, theory/offset_wrist.

    Examples
    --------
    >>> arm = OffsetArm.from_catalogue("franka_fr3")
    >>> pose, free, gc = arm.forward([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
    >>> arm.free_joint, round(float(free), 9)
    (7, 0.5)
    >>> arm.inverse(pose, free, gc).round(9).tolist()
    [0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5]
    >>> bool(free in arm.feasible(pose, gc))
    True
    """

    __signature__ = _signature()  # of the keywords of `Arm` that it takes, and its own
    __slots__ = ("_handle", "a_1", "a_6", "free_joint", "rows")

    a_1: float
    a_6: float
    free_joint: Literal[1, 7]
    rows: Arm
    _handle: _core.OffsetArm

    def __init__(self, *unnamed: Never, a_1: float = 0.0, a_6: float = 0.0, **numbers: Any) -> None:
        if unnamed:
            raise TypeError(f"OffsetArm takes keywords alone, but {len(unnamed)} values came without")
        for name in _NO_FIELDS:
            if name in numbers:
                raise InputError(f"{name} is given, wanted none: an OffsetArm has no {name}")
        try:
            rows = Arm(**numbers)
        except TypeError as error:  # a keyword is wrong or missing
            raise TypeError(str(error).replace("Arm()", "OffsetArm()")) from None
        limit = _core.LENGTH_LIMIT
        offsets = {n: as_number(f"{n} (m)", x, -limit, limit) for n, x in (("a_1", a_1), ("a_6", a_6))}
        if bool(offsets["a_1"]) == bool(offsets["a_6"]):
            raise InputError(
                f"a_1 is {offsets['a_1']:g} and a_6 is {offsets['a_6']:g}, wanted one of them: "
                "with neither it is an armangle.Arm, and with both there is no closed form"
            )
        mirrored = offsets["a_1"] != 0.0
        lengths = np.array([rows.d_bs, rows.d_se, rows.d_ew, rows.d_wf, rows.a_3, rows.a_4])
        joints = np.array([rows.signs, rows.offsets, rows.lower, rows.upper], dtype=np.float64)
        handle = _core.OffsetArm(
            lengths, joints, rows.base, rows.tool, offsets["a_1"] if mirrored else offsets["a_6"], mirrored
        )
        self._fill({**offsets, "rows": rows, "free_joint": 1 if mirrored else 7, "_handle": handle})

    # -- where it comes from -----------------------------------------------------------------------

    @classmethod
    def from_catalogue(cls, name: str) -> OffsetArm:
        """Return an arm of ``armangle.offset_catalogue()``, such as "franka_fr3".

        Raises
        ------
        UnknownRobotError
            If there is none of this name.
        """
        if name in catalogue():
            raise UnknownRobotError(f"{name!r} is an S-R-S arm: armangle.Arm.from_catalogue({name!r})")
        return cls._of(load_offset_robot(name))

    @classmethod
    def from_urdf(
        cls,
        source: Source,
        base: str | None = None,
        tip: str | None = None,
        *,
        angle_tolerance: float = ANGLE_TOLERANCE,
        length_tolerance: float = LENGTH_TOLERANCE,
        continuous_limits: str = "ignore",
        exact: bool = True,
    ) -> OffsetArm:
        """Return the arm between two links of a URDF, in that file's own joint coordinates and frames.

        Parameters
        ----------
        source : path or str or bytes
            A URDF file, or its XML text.
        base, tip : str, optional
            Names of the two links; guessed where the file leaves one choice of seven rotating joints, or one
            with an offset wrist or shoulder.
        angle_tolerance, length_tolerance : float
            How far its forward kinematics may be from the file's at most, rad, m. Files write right angles to
            five digits or so; what they then differ by is below the default. Beyond the default, as for
            a calibrated robot, its axes are made square and to meet; a warning and a note of
            ``import_report`` say by how much its tip then differs from the file's.
        continuous_limits : {"ignore", "use"}
            Limits of a continuous joint, which by the rules of URDF has none, though some files state them.
            Where they are ignored, a warning and a note of ``import_report`` say so.
        exact : bool
            True. An `Arm` keeps a file's own chain with False; here the tolerances take what is nearly such
            an arm.

        Raises
        ------
        UrdfError
            If the file cannot be read as a chain of seven rotating joints.
        InputError
            With ``exact=False``.
        NotSRSError
            If the arm has other offsets than these; the message says by how much.
        """
        _check_exact(exact)
        chain = read_urdf(source, base=base, tip=tip, continuous_limits=continuous_limits, offset=True)
        return cls._of_chain(chain, angle_tolerance, length_tolerance)

    @classmethod
    def from_mjcf(
        cls,
        source: PathLike,
        base: str | None = None,
        tip: str | None = None,
        *,
        angle_tolerance: float = ANGLE_TOLERANCE,
        length_tolerance: float = LENGTH_TOLERANCE,
        exact: bool = True,
    ) -> OffsetArm:
        """Return the arm between two bodies of a MuJoCo model; needs the extra ``mujoco``.

        Parameters
        ----------
        source : path or str
            An MJCF file, or its XML text.
        base, tip : str, optional
            Names of two bodies, or of a site as the tip; guessed where the file leaves one choice.
        angle_tolerance, length_tolerance : float
            As in `from_urdf`, rad and m.
        exact : bool
            As in `from_urdf`.

        Raises
        ------
        MissingExtraError
            If the package ``mujoco`` is not installed.
        FileFormatError, NotSRSError, InputError
            As `from_urdf`.
        """
        _check_exact(exact)
        chain = read_mjcf(source, base=base, tip=tip, offset=True)
        return cls._of_chain(chain, angle_tolerance, length_tolerance)

    @classmethod
    def _of_chain(cls, chain: Chain, angle_tolerance: float, length_tolerance: float) -> OffsetArm:
        angle = as_number("angle_tolerance", angle_tolerance, 0.0, MAX_ANGLE)
        length = as_number("length_tolerance", length_tolerance, 0.0, MAX_LENGTH)
        found, report = describe_offset_chain(chain, angle=angle, length=length)
        warn_of(found.notes)
        return cls._of(found, report)

    @classmethod
    def _of(cls, found: OffsetDescription, report: ImportReport | None = None) -> OffsetArm:
        numbers = {f.name: getattr(found, f.name) for f in fields(found) if f.name not in _NO_FIELDS}
        return cls(**numbers, import_report=report)

    def to_urdf(self) -> str:
        """Return a kinematic URDF (joints and limits, no geometry) that imports back to this arm."""
        return write_chain(chain_of(OffsetDescription(**self._numbers())), self.name)

    # -- the arm as a value --------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """Name of the arm."""
        return self.rows.name

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self.rows.joint_names

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noted where the numbers come from."""
        return self.rows.notes

    @property
    def import_report(self) -> ImportReport | None:
        """What was found in the file that the arm was read from; None of an arm that was made otherwise."""
        return self.rows.import_report

    @property
    def d_bs(self) -> float:
        """Base to shoulder, m."""
        return self.rows.d_bs

    @property
    def d_se(self) -> float:
        """Shoulder to elbow, m."""
        return self.rows.d_se

    @property
    def d_ew(self) -> float:
        """Elbow to wrist, m."""
        return self.rows.d_ew

    @property
    def d_wf(self) -> float:
        """Wrist to flange along axis 7, m."""
        return self.rows.d_wf

    @property
    def a_3(self) -> float:
        """Lateral elbow offset of link 3, m."""
        return self.rows.a_3

    @property
    def a_4(self) -> float:
        """Lateral elbow offset of link 4, m."""
        return self.rows.a_4

    @property
    def reach(self) -> float:
        """Greatest distance from where axes 2 and 3 meet to where axes 5 and 6 meet, m."""
        return self.rows.reach

    @property
    def signs(self) -> Ints:
        """Directions of the joints, +1 or -1, shape (7,)."""
        return self.rows.signs

    @property
    def offsets(self) -> Floats:
        """Zero offsets, rad, shape (7,)."""
        return self.rows.offsets

    @property
    def lower(self) -> Floats:
        """Lower joint limits, rad, shape (7,)."""
        return self.rows.lower

    @property
    def upper(self) -> Floats:
        """Upper joint limits, rad, shape (7,)."""
        return self.rows.upper

    @property
    def velocity(self) -> Floats:
        """Greatest joint speeds, rad/s, shape (7,); infinite where none is stated."""
        return self.rows.velocity

    @property
    def acceleration(self) -> Floats:
        """Greatest joint accelerations, rad/s², shape (7,); infinite where none is stated."""
        return self.rows.acceleration

    @property
    def base(self) -> Floats:
        """Frame of the DH base in the frame that poses are given in, shape (4, 4), m."""
        return self.rows.base

    @property
    def tool(self) -> Floats:
        """Frame of the tip in the flange, shape (4, 4), m."""
        return self.rows.tool

    def with_(self, **changes: Any) -> OffsetArm:
        """Return a copy with some constructor arguments changed, such as ``lower=``.

        ``tool=`` replaces the whole transform from flange to tip. To mount something on the present tip use
        `with_tool`.

        Parameters
        ----------
        **changes
            As `OffsetArm`.

        Returns
        -------
        OffsetArm

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, LimitError, InputError
            As `OffsetArm`.

        Examples
        --------
        >>> arm = OffsetArm.from_catalogue("franka_fr3")
        >>> slower = arm.with_(velocity=1.0, lower=arm.lower + 0.1)
        >>> float(slower.velocity[0]), bool((slower.lower > arm.lower).all())
        (1.0, True)
        """
        return OffsetArm(**{**self._all(), **changes})

    def with_tool(self, tool: ArrayLike) -> OffsetArm:
        """Return a copy with a tool mounted on the present tip.

        Not to be confused with ``with_(tool=...)``, which replaces the transform from flange to tip.

        Parameters
        ----------
        tool : array_like, shape (4, 4)
            Frame of the new tip in the frame of the present one, position in m.

        Returns
        -------
        OffsetArm
            Its poses are those of this arm times `tool`.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError

        Examples
        --------
        >>> arm = OffsetArm.from_catalogue("franka_fr3")
        >>> hand = np.eye(4)
        >>> hand[2, 3] = 0.1034
        >>> q = [0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5]
        >>> bool(np.allclose(arm.with_tool(hand).forward(q)[0], arm.forward(q)[0] @ hand))
        True
        """
        return self.with_(tool=self.tool @ as_transform("tool", tool))

    def __getattr__(self, name: str) -> Never:
        """Raise what there is in place of a door that an `Arm` alone has."""
        if name.startswith("_") or not hasattr(Arm, name):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        there = _INSTEAD.get(name, "there are forward, inverse, feasible, solve, step, follow and Tracker")
        raise AttributeError(f"an OffsetArm has no {name}: {there}", name=name, obj=self)

    def _numbers(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.rows._numbers().items() if name not in _NO_FIELDS}
        return {"a_1": self.a_1, "a_6": self.a_6, **kept}

    def _all(self) -> dict[str, Any]:
        """Return what a copy is made of: the numbers, and what was found in the file."""
        return {**self._numbers(), "import_report": self.import_report}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OffsetArm):
            return NotImplemented
        return (self.a_1, self.a_6) == (other.a_1, other.a_6) and self.rows == other.rows

    def __hash__(self) -> int:
        return hash((self.a_1, self.a_6, self.rows))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._all(),)

    def __repr__(self) -> str:
        """Return what makes this arm again: its name in the catalogue, or all that is not the default."""
        if self.name in offset_catalogue() and self == OffsetArm.from_catalogue(self.name):
            return f"OffsetArm.from_catalogue({self.name!r})"
        offset = f"a_1={self.a_1!r}" if self.a_1 else f"a_6={self.a_6!r}"
        return f"OffsetArm({offset}, {repr(self.rows).removeprefix('Arm(')}"

    def __str__(self) -> str:
        """Return the arm to be read: lengths in mm, limits in degrees."""
        offset = ("a_1", self.a_1) if self.a_1 else ("a_6", self.a_6)
        first, rest = str(self.rows).split(": ", 1)
        return f"{first}: {offset[0]} {offset[1] * MILLIMETRES:.6g}, {rest}"

    # -- kinematics --------------------------------------------------------------------------------

    def forward(
        self, q: ArrayLike, *, threads: int = 1
    ) -> tuple[Floats, Floats | np.float64, Ints | np.int64]:
        """Return pose, value of the free joint and branch of joint values.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad. Limits are not enforced.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        pose : ndarray, shape (..., 4, 4)
            Tool frame, position in m.
        free : float64, shape (...)
            Value of the free joint as an angle in (-π, π], rad.
        gc : int64, shape (...)
            Branch 0..7.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        pose, free, gc = np.empty((*batch, 4, 4)), np.empty(batch), np.empty(batch, dtype=np.int64)
        self._handle.forward_many(joints, pose, free, gc, as_threads(threads))
        return pose, free[()], gc[()]

    @_names_keywords
    def inverse(
        self,
        pose: ArrayLike,
        free: ArrayLike,
        gc: ArrayLike,
        *,
        seed: ArrayLike | None = None,
        limits: Enforce = "ignore",
        unreachable: Unreachable = "raise",
        threads: int = 1,
    ) -> Floats:
        """Return the one posture that a pose, a value of the free joint and a branch define.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        free : array_like, shape (...)
            Value of the free joint as an angle, rad, any real.
        gc : array_like of int, shape (...)
            Branch 0..7.
        seed : array_like, shape (..., 7), optional
            Of several turns within a joint's limits the nearest to this is returned; without it, the
            nearest to the middle of the range.
        limits : "ignore", "raise" or "nan"
            What to do where a joint has no turn within its limits. "ignore" returns the turn nearest to
            the range: check with `within_limits`.
        unreachable : "raise" or "nan"
            What to do where there is no posture: at this value of the free joint the wrist is out of reach,
            or axis 5 cannot be square to axis 6 (`feasible` gives the values that have one).
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 7)
            Joint values, rad.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, UnreachableError
        LimitError
            With ``limits="raise"``.
        """
        beyond = _ENFORCE[chosen("limits", limits, _ENFORCE)]
        skip = chosen("unreachable", unreachable, _UNREACHABLE) == "nan"
        values = as_floats("free", free)
        check_angles("free", values)
        named: list[tuple[str, NDArray[Any], int]] = [
            ("pose", as_poses("pose", pose), 2), ("free", values, 0), ("gc", _checked_gc(gc), 0),
        ]  # fmt: skip
        if seed is not None:
            seeds = as_floats("seed", seed, (JOINTS,))
            self._handle.check_joints(seeds, "seed")
            named.append(("seed", seeds, 1))
        batch, (poses, values, branches, *near) = broadcast(named)
        q, codes = np.empty((*batch, JOINTS)), np.empty(batch, dtype=np.int64)
        by = near[0] if near else None
        self._handle.inverse_many(poses, values, branches, by, q, codes, beyond, as_threads(threads))
        bad = np.argwhere(codes != Status.OK.value)
        if len(bad) and not skip:
            at = tuple(int(i) for i in bad[0])
            status = STATUSES[int(codes[at])]
            raise UnreachableError(f"pose{list(at) if at else ''}: {status.sentence}")
        return q

    @_names_keywords
    def inverse_all(
        self,
        pose: ArrayLike,
        free: ArrayLike,
        *,
        seed: ArrayLike | None = None,
        limits: Enforce = "ignore",
        unreachable: Unreachable = "nan",
        threads: int = 1,
    ) -> Floats:
        """Return the postures of all eight branches; row k is branch k, always.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        free : array_like, shape (...)
            Value of the free joint as an angle, rad.
        seed : array_like, shape (..., 7), optional
        limits, threads
            As in `inverse`; ``limits="nan"`` leaves NaN in the rows that violate a limit.
        unreachable : "nan" or "raise"
            As in `inverse`, but NaN by default: often some of the branches have a posture and others none.

        Returns
        -------
        ndarray, shape (..., 8, 7)
            Joint values, rad.

        Raises
        ------
        As `inverse`.

        Examples
        --------
        >>> arm = OffsetArm.from_catalogue("franka_fr3")
        >>> pose, free, gc = arm.forward([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
        >>> q = arm.inverse_all(pose, free, limits="nan")
        >>> q.shape, np.flatnonzero(np.isfinite(q[:, 0])).tolist()
        ((8, 7), [6])
        """
        poses = as_poses("pose", pose)[..., None, :, :]
        values = as_floats("free", free)[..., None]
        near = None if seed is None else as_floats("seed", seed, (JOINTS,))[..., None, :]
        return self.inverse(
            poses, values, np.arange(CONFIGURATIONS), seed=near, limits=limits, unreachable=unreachable,
            threads=threads,
        )  # fmt: skip

    def frames(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return the poses of the arm's DH frames: where its joints are in space.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 8, 4, 4)
            Frames 0..7 in the frame that poses are given in, positions in m: joint i turns about the
            z axis of frame i - 1; ``frames[7] @ tool`` is the pose. The offset lies along x of frame 6, or 1.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], JOINTS + 1, 4, 4))
        self._handle.frames_many(joints, out, as_threads(threads))
        return out

    def elbow(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return where the elbow is: the origin of DH frame 3, on the axis of joint 4, m, shape (..., 3).

        Raises
        ------
        ShapeError, NotFiniteError
        """
        return self.frames(q, threads=threads)[..., 3, :3, 3].copy()

    def jacobian(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return the geometric Jacobian of the tool, shape (..., 6, 7).

        Rows 0-2 are linear, 3-5 angular velocity per rad/s of q, in the frame that poses are given in.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], 6, JOINTS))
        self._handle.jacobian_many(joints, out, as_threads(threads))
        return out

    def limit_margin(self, q: ArrayLike) -> Floats | np.float64:
        """Return the least distance of a joint to one of its limits, rad, shape (...); negative outside."""
        return self.rows.limit_margin(q)

    def within_limits(self, q: ArrayLike, tol: float = _core.ANGLE_TOLERANCE) -> NDArray[np.bool_] | np.bool_:
        """Return whether all joints are within their limits and a slack `tol`, rad; shape (...)."""
        return self.rows.within_limits(q, tol)

    # -- which values of the free joint --------------------------------------------------------------

    @_names_keywords
    def feasible(
        self,
        pose: ArrayLike,
        gc: ArrayLike,
        *,
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> ArcSet:
        """Return the values of the free joint with which a branch holds the pose within all limits.

        Every limit is a root of a trigonometric polynomial of the free joint; between roots one evaluation
        decides. An end is a joint at its limit, or a place where two branches meet and the free joint turns
        back (``side`` "singular"): a fold, of joint 5 (3 of an offset shoulder), or the end of the reach, of
        joint 4. Where limits touch within rounding interval arithmetic decides; what it cannot prove either
        is left out and counted in ``ArcSet.unproven``.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...)
            Branch 0..7.
        threads : int
            Threads for a batch; 0 for all cores.
        progress : function (done, total) or bool
            Told some times a second how many poses of a batch are done; True draws a bar on stderr.

        Returns
        -------
        ArcSet
            Of shape (...), its angles values of the free joint in rad; its status says why it is empty.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError
        """
        batch, (poses, branches) = broadcast(
            [("pose", as_poses("pose", pose), 2), ("gc", _checked_gc(gc), 0)]
        )
        return self._arc_set(
            batch,
            lambda columns: self._handle.feasible_many(poses, branches, *columns, as_threads(threads)),
            progress,
        )

    @staticmethod
    def _arc_set(
        batch: tuple[int, ...],
        fill: Callable[[_ArcColumns], None],
        progress: Progress | bool | None,
    ) -> ArcSet:
        """Return the set whose columns the core fills."""
        most = _core.ARC_CAPACITY
        shape = (*batch, most, 2)
        ends, values, unproven = np.empty(shape), np.empty(shape), np.empty(batch)
        joint, side = np.empty(shape, dtype=np.int64), np.empty(shape, dtype=np.int64)
        codes = np.empty((*batch, 2), dtype=np.int64)
        with progressing(as_progress(progress)):
            fill((ends, joint, side, values, codes, unproven))
        count = codes[..., 0].reshape(-1)
        kept = np.arange(most) < count[:, None]
        columns = [array.reshape(-1, most, 2)[kept] for array in (ends, joint, side, values)]
        angles, joints, sides, at = columns
        status = codes[..., 1].reshape(-1).astype(np.int8)
        narrow = (joints.astype(np.int8), sides.astype(np.int8))
        return ArcSet._from_core(
            batch, (count.copy(), angles, *narrow, at, status), unproven=unproven.reshape(-1)
        )

    @_names_keywords
    def feasible_all(
        self, pose: ArrayLike, *, threads: int = 1, progress: Progress | bool | None = None
    ) -> ArcSet:
        """Return the arcs of all eight branches of each pose, of shape (..., 8); otherwise as `feasible`.

        The branches share their ends, so that all of them cost little more than one.
        """
        poses = as_poses("pose", pose)
        return self._arc_set(
            (*poses.shape[:-2], CONFIGURATIONS),
            lambda columns: self._handle.feasible_all_many(poses, *columns, as_threads(threads)),
            progress,
        )

    @_names_keywords
    def solve(
        self,
        pose: ArrayLike,
        near: ArrayLike | None = None,
        *,
        weight: ArrayLike | None = None,
        gc: int | Iterable[int] | None = None,
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> OffsetSolution:
        """Return, of all postures of a pose within the limits, the one nearest to given joints.

        Branch and bound over all branches, values of the free joint and turns: the nearest of all, not of a
        grid.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        near : array_like, shape (..., 7), optional
            Joint values to be near to, rad; without it the middles of the ranges (0 of a joint without
            limits).
        weight : array_like, shape (7,) or one number, optional
            The distance is the root of the sum of ``weight * (q - near)**2``.
        gc : int or iterable of int, optional
            Branches that may be used; all by default.
        threads : int
            Threads for a batch; 0 for all cores.
        progress : function (done, total) or bool
            Told some times a second how many poses of a batch are done; True draws a bar on stderr.

        Returns
        -------
        OffsetSolution

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError

        Examples
        --------
        >>> arm = OffsetArm.from_catalogue("franka_fr3")
        >>> q = np.array([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5])
        >>> found = arm.solve(arm.forward(q)[0], near=q)
        >>> found.q.round(6).tolist(), found.status
        ([0.1, 0.4, 0.2, -1.8, 0.3, 2.0, 0.5], <Status.OK: 0>)
        """
        named: list[tuple[str, NDArray[Any], int]] = [("pose", as_poses("pose", pose), 2)]
        if near is not None:
            seed = as_floats("near", near, (JOINTS,))
            self._handle.check_joints(seed, "near")
            named.append(("near", seed, 1))
        batch, (poses, *seeds) = broadcast(named)
        q, numbers = np.empty((*batch, JOINTS)), np.empty((*batch, 3))
        codes = np.empty((*batch, 2), dtype=np.int64)
        by = seeds[0] if seeds else None
        with progressing(as_progress(progress)):
            self._handle.nearest_many(
                poses, by, weights_of(weight), branch_bits(gc), q, numbers, codes, as_threads(threads)
            )
        status = codes[..., 1].astype(np.int8)
        return OffsetSolution(
            frozen(q), numbers[..., 0][()], codes[..., 0][()], numbers[..., 1][()],
            status if batch else STATUSES[int(status)], numbers[..., 2][()],
        )  # fmt: skip


def as_srs(arm: Arm | OffsetArm) -> Arm:
    """Return an arm that is an `Arm`.

    Raises
    ------
    InputError
        If it is an `OffsetArm`.
    """
    if isinstance(arm, OffsetArm):
        raise InputError(
            f"{arm.name or 'the arm'} is an OffsetArm: what needs the arm angle or the links of an Arm is "
            "not made for it"
        )
    return arm


def _rebuilt(numbers: dict[str, Any]) -> OffsetArm:
    return OffsetArm(**numbers)


def _check_exact(exact: bool) -> None:
    if not as_flag("exact", exact):
        raise InputError(
            "exact=False keeps the chain of a file, which is made for an armangle.Arm alone: an OffsetArm "
            "takes what is nearly one with length_tolerance= and angle_tolerance=, which its refusal names"
        )


def _checked_gc(gc: ArrayLike) -> Ints:
    branches = as_gc(gc)
    if ((branches < 0) | (branches >= CONFIGURATIONS)).any():
        at = np.argwhere((branches < 0) | (branches >= CONFIGURATIONS))[0]
        raise ConfigurationError(f"gc is {branches[tuple(at)]}, wanted 0 to 7")
    return branches
