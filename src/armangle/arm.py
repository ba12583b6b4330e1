"""The arm: forward and inverse kinematics, joint functions and feasible arcs."""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import (
    Floats,
    Ints,
    as_floats,
    as_gc,
    as_number,
    as_threads,
    broadcast,
    check_angles,
    output,
    raise_problem,
)
from ._catalogue import load_robot
from .arcs import ArcSet
from .configuration import COUNT as CONFIGURATIONS
from .description import JOINTS, ArmDescription, ImportReport
from .detect import describe_chain
from .errors import ConfigurationError, InputError, LimitError, NotFiniteError, ShapeError
from .joint_function import JointFunction
from .mjcf import read_mjcf
from .urdf import Source, read_urdf, write_urdf

Enforce = Literal["ignore", "raise", "nan"]
Unreachable = Literal["raise", "nan"]
_ENFORCE = ("ignore", "raise", "nan")
_BRANCH, _JOINTS, _BRANCHES = 0, 1, 2  # what feasible_many is asked for
_SETS_OF: tuple[tuple[int, ...], ...] = ((), (JOINTS,), (CONFIGURATIONS,))
_GC_ORDER = np.arange(CONFIGURATIONS, dtype=np.int64)
MOST_MARGIN = 1.5
ROUNDING = 4e-15  # of a rotation that is as exact as double precision makes it


def nearest_rotation(pose: ArrayLike) -> Floats:
    """Return poses with each 3x3 block replaced by the nearest rotation matrix.

    Parameters
    ----------
    pose : array_like, shape (..., 4, 4)
        Homogeneous matrices, position in m; the 3x3 blocks may be off by rounding or by calibration.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        The same positions with proper rotations (least squares, by the singular value decomposition).

    Raises
    ------
    ShapeError, NotFiniteError
        If the shape is not (..., 4, 4), or a number is not finite.

    Examples
    --------
    >>> float(nearest_rotation(np.diag([1.001, 1.0, 1.0, 1.0]))[0, 0])
    1.0
    """
    out = as_floats("pose", pose, (4, 4)).copy()
    if not np.isfinite(out).all():
        raise NotFiniteError("pose holds NaN or infinity, wanted finite numbers")
    u, _, vt = np.linalg.svd(out[..., :3, :3])
    flip = np.ones((*out.shape[:-2], 3))
    flip[..., 2] = np.linalg.det(u @ vt)
    out[..., :3, :3] = (u * flip[..., None, :]) @ vt
    return out


def _orthonormality_error(frame: Floats) -> float:
    rotation = frame[:3, :3]
    return float(np.abs(rotation.T @ rotation - np.eye(3)).max())


def _seven(name: str, value: ArrayLike | None, default: float, *, infinite: bool = False) -> Floats:
    array = np.full(JOINTS, default) if value is None else as_floats(name, value, (JOINTS,)).copy()
    if array.shape != (JOINTS,):
        raise ShapeError(f"{name} has shape {array.shape}, wanted ({JOINTS},)")
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if bad.any():
        at = int(np.argmax(bad))
        raise NotFiniteError(
            f"{name}[{at}] is {array[at]}, wanted a {'real' if infinite else 'finite'} number"
        )
    array.setflags(write=False)
    return array


def _length(name: str, value: float, *, positive: bool = False) -> float:
    low = 0.0 if positive else -_core.LENGTH_LIMIT
    return as_number(f"{name} (m)", value, low, _core.LENGTH_LIMIT, low_open=positive)


def _transform(name: str, value: ArrayLike | None) -> Floats:
    frame = np.eye(4) if value is None else as_floats(name, value, (4, 4)).copy()
    if frame.shape != (4, 4):
        raise ShapeError(f"{name} has shape {frame.shape}, wanted (4, 4)")
    problem, number = _core.check_transform(frame)
    if problem:
        try:
            raise_problem((problem, 0, number), ())
        except InputError as error:
            raise type(error)(str(error).replace("pose", name)) from None
    if _orthonormality_error(frame) > ROUNDING:  # else kept to the bit, so that a copy is the same arm
        frame = nearest_rotation(frame)
    frame.setflags(write=False)
    return frame


class Arm:
    """A 7-axis arm with spherical shoulder, elbow and spherical wrist (S-R-S).

    The tip's pose is ``base @ DH(theta) @ tool`` with ``theta_i = signs_i q_i + offsets_i`` and the
    classic DH rows of the paper's Table 1, to which the lateral elbow offsets a_3, a_4 are added.
    Everything public speaks q, the robot's own joint coordinates. Values are frozen.

    Parameters
    ----------
    d_bs, d_se, d_ew, d_wf : float
        Base to shoulder, shoulder to elbow (> 0), elbow to wrist (> 0), wrist to flange, m.
    lower, upper : array_like, shape (7,), optional
        Joint limits in q, rad, lower <= upper. Any: beyond ±π, of one sign, wider than a turn, infinite
        (the default).
    a_3, a_4 : float
        Lateral elbow offsets of links 3 and 4, m.
    signs : array_like of +1 or -1, shape (7,), optional
        Directions of the joints.
    offsets : array_like, shape (7,), optional
        Zero offsets, rad.
    base, tool : array_like, shape (4, 4), optional
        Frame of the DH base in the frame poses are given in; frame of the tool in the flange. Their
        rotations are replaced by the nearest exact ones.
    velocity, acceleration : array_like, shape (7,), optional
        Greatest joint speeds (rad/s) and accelerations (rad/s²), > 0; infinite by default.
    name : str
        Name of the arm.

    Raises
    ------
    ShapeError, NotFiniteError, NotRotationError, LimitError, InputError
        Each naming the argument, the index, the value and what was wanted.

    Source: Faria et al. (2018), Table 1 and Eq. (1).

    Examples
    --------
    >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    >>> pose, psi, gc = arm.forward([0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7])
    >>> arm.inverse(pose, psi, gc).round(12).tolist()
    [0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7]
    """

    __slots__ = (
        "_core", "a_3", "a_4", "acceleration", "base", "d_bs", "d_ew", "d_se", "d_wf", "import_report",
        "joint_names", "lower", "name", "notes", "offsets", "signs", "tool", "upper", "velocity",
    )  # fmt: skip

    name: str
    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    lower: Floats
    upper: Floats
    signs: Ints
    offsets: Floats
    base: Floats
    tool: Floats
    velocity: Floats
    acceleration: Floats
    joint_names: tuple[str, ...]
    notes: tuple[str, ...]
    import_report: ImportReport | None
    _core: Any

    def __init__(
        self,
        *,
        d_bs: float,
        d_se: float,
        d_ew: float,
        d_wf: float,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        a_3: float = 0.0,
        a_4: float = 0.0,
        signs: ArrayLike | None = None,
        offsets: ArrayLike | None = None,
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        name: str = "arm",
        joint_names: tuple[str, ...] | None = None,
        notes: tuple[str, ...] = (),
        import_report: ImportReport | None = None,
    ) -> None:
        values: dict[str, Any] = {
            "name": name,
            "d_bs": _length("d_bs", d_bs),
            "d_se": _length("d_se", d_se, positive=True),
            "d_ew": _length("d_ew", d_ew, positive=True),
            "d_wf": _length("d_wf", d_wf),
            "a_3": _length("a_3", a_3),
            "a_4": _length("a_4", a_4),
            "lower": _seven("lower", lower, -np.inf, infinite=True),
            "upper": _seven("upper", upper, np.inf, infinite=True),
            "offsets": _seven("offsets", offsets, 0.0),
            "velocity": _seven("velocity", velocity, np.inf, infinite=True),
            "acceleration": _seven("acceleration", acceleration, np.inf, infinite=True),
            "base": _transform("base", base),
            "tool": _transform("tool", tool),
            "joint_names": tuple(joint_names or _joint_names()),
            "notes": tuple(notes),
            "import_report": import_report,
        }
        sign = _seven("signs", signs, 1.0)
        _check_joints(values, sign)
        values["signs"] = sign.astype(np.int64)
        values["signs"].setflags(write=False)
        lengths = np.array([values[k] for k in ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")])
        joints = np.concatenate([sign, values["offsets"], values["lower"], values["upper"]])
        values["_core"] = _core.Arm(lengths, joints, values["base"], values["tool"])
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"Arm is frozen: {name} cannot be set; use with_()")

    # -- making ----------------------------------------------------------------------------------

    @classmethod
    def from_catalogue(cls, name: str) -> Arm:
        """Return an arm of the catalogue.

        Parameters
        ----------
        name : str
            One of ``armangle.catalogue()``, such as "kuka_iiwa7_r800".

        Returns
        -------
        Arm

        Raises
        ------
        UnknownRobotError
            If there is none of this name; the message lists near names.
        """
        return cls._from_description(load_robot(name).description)

    @classmethod
    def from_urdf(
        cls,
        source: Source,
        base: str | None = None,
        tip: str | None = None,
        *,
        angle_tolerance: float = 1e-5,
        length_tolerance: float = 2e-5,
    ) -> Arm:
        """Return the arm between two links of a URDF, in that file's own joint coordinates and frames.

        Parameters
        ----------
        source : path or str or bytes
            A URDF file, or its XML text.
        base, tip : str, optional
            Names of the two links; guessed where the file leaves one choice.
        angle_tolerance, length_tolerance : float
            How far axes may be from exact (rad, m) to be snapped; the residual that remains is kept in
            ``import_report``.

        Returns
        -------
        Arm

        Raises
        ------
        UrdfError
            If the file cannot be read as a chain of seven rotating joints.
        NotSRSError
            If the arm is not S-R-S; the message says which axes miss which point, and by how much.
        """
        chain = read_urdf(source, base=base, tip=tip)
        description, report = describe_chain(chain, angle=angle_tolerance, length=length_tolerance)
        return cls._from_description(description, report)

    @classmethod
    def from_mjcf(
        cls,
        source: str | os.PathLike[str],
        base: str | None = None,
        tip: str | None = None,
        *,
        angle_tolerance: float = 1e-5,
        length_tolerance: float = 2e-5,
    ) -> Arm:
        """Return the arm between two bodies of a MuJoCo model; needs the extra ``mujoco``.

        Parameters
        ----------
        source : path or str
            An MJCF file, or its XML text.
        base, tip : str, optional
            Names of two bodies, or of a site as the tip; guessed where the file leaves one choice.
        angle_tolerance, length_tolerance : float
            As in `from_urdf`, rad and m.

        Returns
        -------
        Arm

        Raises
        ------
        MissingExtraError
            If the package ``mujoco`` is not installed.
        FileFormatError, NotSRSError
            As `from_urdf`.
        """
        chain = read_mjcf(source, base=base, tip=tip)
        description, report = describe_chain(chain, angle=angle_tolerance, length=length_tolerance)
        return cls._from_description(description, report)

    @classmethod
    def _from_description(cls, d: ArmDescription, report: ImportReport | None = None) -> Arm:
        return cls(
            d_bs=d.d_bs, d_se=d.d_se, d_ew=d.d_ew, d_wf=d.d_wf, a_3=d.a_3, a_4=d.a_4,
            signs=d.signs, offsets=d.offsets, base=d.base, tool=d.tool, lower=d.lower, upper=d.upper,
            velocity=d.velocity, name=d.name, joint_names=d.joint_names, notes=d.notes, import_report=report,
        )  # fmt: skip

    def with_(self, **changes: Any) -> Arm:
        """Return a copy with some constructor arguments changed, such as ``tool=`` or ``lower=``."""
        return Arm(**{**self._arguments(), **changes})

    def _arguments(self) -> dict[str, Any]:
        return {key: getattr(self, key) for key in self.__slots__ if key != "_core"}

    def to_urdf(self) -> str:
        """Return a kinematic URDF (joints and limits, no geometry) that imports back to this arm."""
        return write_urdf(self._description())

    def _description(self) -> ArmDescription:
        return ArmDescription(
            name=self.name, d_bs=self.d_bs, d_se=self.d_se, d_ew=self.d_ew, d_wf=self.d_wf,
            a_3=self.a_3, a_4=self.a_4, signs=tuple(int(s) for s in self.signs),
            offsets=tuple(self.offsets.tolist()), base=self.base, tool=self.tool,
            lower=tuple(self.lower.tolist()), upper=tuple(self.upper.tolist()),
            velocity=tuple(self.velocity.tolist()), joint_names=self.joint_names, notes=self.notes,
        )  # fmt: skip

    # -- facts -----------------------------------------------------------------------------------

    @property
    def reach(self) -> float:
        """Greatest distance shoulder-wrist, m."""
        return float(self._core.reach)

    @property
    def inner_reach(self) -> float:
        """Least distance shoulder-wrist, m."""
        return float(self._core.inner_reach)

    @property
    def delta(self) -> float:
        """Model angle θ4 of the stretched arm, rad; 0 without elbow offset."""
        return float(self._core.delta)

    # -- forward and inverse -----------------------------------------------------------------------

    def forward(
        self, q: ArrayLike, *, undefined: Unreachable = "raise", threads: int = 1
    ) -> tuple[Floats, Floats | np.float64, Ints | np.int64]:
        """Return pose, arm angle and global configuration of joint values.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad. Limits are not enforced.
        undefined : "raise" or "nan"
            Where the wrist lies on the shoulder (folded arm of equal links) the arm angle does not
            exist: raise `UnreachableError`, or return NaN for it.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        pose : ndarray, shape (..., 4, 4)
            Tool frame, position in m.
        psi : float64, shape (...)
            Arm angle in (-π, π], rad.
        gc : int64, shape (...)
            Global configuration 0..7.

        Raises
        ------
        ShapeError, NotFiniteError, UnreachableError

        Source: Faria et al. (2018), Eqs. (1)-(11).
        """
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        pose, psi, gc = np.empty((*batch, 4, 4)), np.empty(batch), np.empty(batch, dtype=np.int64)
        nan = _choice("undefined", undefined, ("raise", "nan")) == 1
        problem = self._core.forward_many(joints, pose, psi, gc, nan, as_threads(threads))
        if problem:
            raise_problem(problem, batch)
        return pose, psi[()], gc[()]

    def inverse(
        self,
        pose: ArrayLike,
        psi: ArrayLike,
        gc: ArrayLike,
        *,
        seed: ArrayLike | None = None,
        limits: Enforce = "ignore",
        unreachable: Unreachable = "raise",
        out: Floats | None = None,
        threads: int = 1,
    ) -> Floats:
        """Return the one posture that a pose, an arm angle and a global configuration define.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m; rotations orthonormal within 1e-6 are solved as given.
        psi : array_like, shape (...)
            Arm angle, rad, any real.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        seed : array_like, shape (..., 7), optional
            Of several turns within a joint's limits the nearest to this is returned; without it, the
            nearest to the middle of the range.
        limits : "ignore", "raise" or "nan"
            What to do where a joint has no turn within its limits. "ignore" returns the turn nearest to
            the range: check with `within_limits`.
        unreachable : "raise" or "nan"
            What to do where the geometry has no answer.
        out : ndarray, shape (..., 7), optional
            Written and returned, instead of a new array. After an error its contents are undefined.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 7)
            Joint values, rad.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError
            If an argument is not usable.
        UnreachableError
            If a pose is out of reach: by how many mm.
        LimitError
            With ``limits="raise"``.

        Source: Faria et al. (2018), Eqs. (12)-(24), in a form that holds the pose in every case.
        """
        if seed is None and out is None and limits == "ignore" and unreachable == "raise" and threads == 1:
            plain = self._core.inverse_one(pose, psi, gc)
            if plain is not None:
                return plain  # type: ignore[no-any-return]
        return self._inverse(pose, psi, gc, seed, limits, unreachable, out, threads)

    def _inverse(
        self,
        pose: ArrayLike,
        psi: ArrayLike,
        gc: ArrayLike,
        seed: ArrayLike | None,
        limits: Enforce,
        unreachable: Unreachable,
        out: Floats | None,
        threads: int,
    ) -> Floats:
        named: list[tuple[str, NDArray[Any], int]] = [
            ("pose", as_floats("pose", pose, (4, 4)), 2),
            ("psi", as_floats("psi", psi), 0),
            ("gc", as_gc(gc), 0),
        ]
        if seed is not None:
            named.append(("seed", as_floats("seed", seed, (JOINTS,)), 1))
        codes = _choice("limits", limits, _ENFORCE), 2 * _choice("unreachable", unreachable, ("raise", "nan"))
        batch, arrays = broadcast(named)
        result = output(out, (*batch, JOINTS))
        problem = self._core.inverse_many(
            *arrays[:3], arrays[3] if seed is not None else None, result, *codes, as_threads(threads)
        )
        if problem:
            raise_problem(problem, batch, joints="seed")
        return result

    def inverse_all(
        self,
        pose: ArrayLike,
        psi: ArrayLike,
        *,
        seed: ArrayLike | None = None,
        limits: Enforce = "ignore",
        unreachable: Unreachable = "raise",
        threads: int = 1,
    ) -> Floats:
        """Return the postures of all eight global configurations; row k is GC k, always.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        psi : array_like, shape (...)
            Arm angle, rad. The same number is another elbow for GC_4 = +1 and -1.
        seed : array_like, shape (..., 7), optional
        limits, unreachable, threads
            As in `inverse`; ``limits="nan"`` leaves NaN in the rows that violate a limit.

        Returns
        -------
        ndarray, shape (..., 8, 7)
            Joint values, rad.

        Raises
        ------
        As `inverse`.

        Source: Faria et al. (2018), Eqs. (2), (12)-(24).
        """
        poses = as_floats("pose", pose, (4, 4))[..., None, :, :]
        angles = as_floats("psi", psi)[..., None]
        near = None if seed is None else as_floats("seed", seed, (JOINTS,))[..., None, :]
        return self._inverse(poses, angles, _GC_ORDER, near, limits, unreachable, None, threads)

    def frames(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return the poses of the arm's DH frames: where its joints are in space.

        Not to be confused with `forward`, whose pose includes the tool and is that of the user's tip alone.

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
            z axis of frame i - 1; frames 1 and 2 are at the shoulder, 3 at the elbow's axis, 5 and 6 at
            the wrist, 7 is the flange: ``frames[7] @ tool`` is the pose.

        Raises
        ------
        ShapeError, NotFiniteError

        Source: Faria et al. (2018), Table 1, Eqs. (1), (40)-(46).

        Examples
        --------
        >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
        >>> arm.frames([0, 0, 0, 0, 0, 0, 0])[:, 2, 3].round(3).tolist()
        [0.0, 0.34, 0.34, 0.74, 0.74, 1.14, 1.14, 1.266]
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], JOINTS + 1, 4, 4))
        problem = self._core.frames_many(joints, out, as_threads(threads))
        if problem:
            raise_problem(problem, joints.shape[:-1])
        return out

    # -- differential ------------------------------------------------------------------------------

    def jacobian(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return the geometric Jacobian of the tool.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 6, 7)
            Rows 0-2: linear velocity of the tool frame's origin (m/rad), rows 3-5: angular velocity, in the
            frame that poses are given in.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], 6, JOINTS))
        problem = self._core.jacobian_many(joints, out, as_threads(threads))
        if problem:
            raise_problem(problem, joints.shape[:-1])
        return out

    def self_motion(self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike, *, threads: int = 1) -> Floats:
        """Return dq/dpsi at a fixed pose: the motion that leaves the tool where it is.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
        psi : array_like, shape (...)
            Arm angle, rad.
        gc : array_like of int, shape (...)
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 7)
            rad/rad; joint 4 is 0. Where θ2 (θ6) is 0 or π at this arm angle alone, the derivative of joints
            1, 2, 3 (5, 6, 7) does not exist and is returned as ±inf; where it is so for every arm angle
            (arm straight up), θ1 (θ5) is held and the motion is finite.

        Raises
        ------
        As `inverse`.

        Source: Faria et al. (2018), Eqs. (28), (33).
        """
        batch, arrays = broadcast(
            [
                ("pose", as_floats("pose", pose, (4, 4)), 2),
                ("psi", as_floats("psi", psi), 0),
                ("gc", as_gc(gc), 0),
            ]
        )
        out = np.empty((*batch, JOINTS))
        problem = self._core.self_motion_many(*arrays, out, as_threads(threads))
        if problem:
            raise_problem(problem, batch)
        return out

    # -- limits ------------------------------------------------------------------------------------

    def limit_margin(self, q: ArrayLike) -> Floats | np.float64:
        """Return the least distance of a joint to one of its limits.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        float64, shape (...)
            rad; negative outside, inf without limits.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty(joints.shape[:-1])
        problem = self._core.limit_margin_many(joints, out)
        if problem:
            raise_problem(problem, joints.shape[:-1])
        return out[()]

    def within_limits(self, q: ArrayLike, tol: float = 0.0) -> NDArray[np.bool_] | np.bool_:
        """Return whether all joints are within their limits.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        tol : float
            Slack, rad.

        Returns
        -------
        bool, shape (...)

        Raises
        ------
        ShapeError, NotFiniteError
        """
        return self.limit_margin(q) >= -as_number("tol", tol, -_core.LARGEST_ANGLE, _core.LARGEST_ANGLE)

    def feasible(
        self,
        pose: ArrayLike,
        gc: ArrayLike,
        *,
        singularity_margin: float = 0.0,
        paper_margin: float = 0.0,
        paper_discriminant: float = 1e-3,
        threads: int = 1,
    ) -> ArcSet:
        """Return the arm angles that keep all joints within their limits, Ψ_all.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        singularity_margin : float
            Keep |sin θ2|, |sin θ6|, |sin(θ4 - δ)| >= sin(margin); rad, in [0, 1.5].
        paper_margin : float
            The paper's own avoidance, for comparison: remove ψ_sing ± paper_margin (rad) where the
            discriminant of Eq. (30) is within `paper_discriminant` of zero.
        paper_discriminant : float
            Its threshold, >= 0.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ArcSet, shape (...)
            Empty with the reason in ``status`` where there is none; never raises on geometry.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError

        Source: Faria et al. (2018), Eqs. (25), (31), (32), (35).
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        paper = as_number("paper_margin", paper_margin, 0.0, MOST_MARGIN)
        threshold = as_number("paper_discriminant", paper_discriminant, 0.0, np.inf)
        return self._arcs(pose, gc, margin, paper, threshold, _BRANCH, threads)

    def feasible_all(self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1) -> ArcSet:
        """Return the feasible arm angles of all eight global configurations; entry k is GC k, always.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        singularity_margin : float
            As in `feasible`, rad.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ArcSet, shape (..., 8)
            The sets of `feasible`, in about half the time of eight calls.

        Raises
        ------
        As `feasible`.

        Source: Faria et al. (2018), Eqs. (2), (25).
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        return self._arcs(pose, 0, margin, 0.0, 0.0, _BRANCHES, threads)

    def joint_feasible(
        self, pose: ArrayLike, gc: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1
    ) -> ArcSet:
        """Return the arm angles that keep each joint alone within its limits, Ψ_i.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
        gc : array_like of int, shape (...)
        singularity_margin : float
            As in `feasible`; it belongs to joints 2, 4 and 6.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ArcSet, shape (..., 7)
            Entry i is that of joint i + 1.

        Raises
        ------
        As `feasible`.

        Source: Faria et al. (2018), Eq. (25).
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        return self._arcs(pose, gc, margin, 0.0, 0.0, _JOINTS, threads)

    def _arcs(
        self, pose: ArrayLike, gc: ArrayLike, margin: float, paper: float, threshold: float,
        wanted: int, threads: int,
    ) -> ArcSet:  # fmt: skip
        batch, arrays = broadcast([("pose", as_floats("pose", pose, (4, 4)), 2), ("gc", as_gc(gc), 0)])
        result = self._core.feasible_many(*arrays, margin, paper, threshold, wanted, as_threads(threads))
        if len(result) == 3:
            raise_problem(result, batch)
        return ArcSet._from_core((*batch, *_SETS_OF[wanted]), result)

    def joint_function(self, pose: ArrayLike, gc: int, joint: int) -> JointFunction:
        """Return one joint as a function of the arm angle, at a fixed pose and global configuration.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m.
        gc : int
            Global configuration 0..7.
        joint : int
            Joint 1..7.

        Returns
        -------
        JointFunction

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError, UnreachableError

        Source: Faria et al. (2018), Eqs. (26)-(31), (33), (34).
        """
        frame = as_floats("pose", pose, (4, 4))
        if frame.ndim != 2:
            raise ShapeError(f"pose has shape {frame.shape}, wanted (4, 4)")
        index = as_gc(gc)
        if index.ndim or not 0 <= index < CONFIGURATIONS:
            raise ConfigurationError(f"gc is {gc!r}, wanted an integer from 0 to 7")
        if isinstance(joint, bool) or not isinstance(joint, (int, np.integer)) or not 1 <= joint <= JOINTS:
            raise InputError(f"joint is {joint!r}, wanted an integer from 1 to 7")
        result = self._core.joint_function(frame, int(index), int(joint) - 1)
        if isinstance(result, tuple):
            raise_problem(result, (), joints="pose")
        return JointFunction(result, int(joint))

    # -- as a value ----------------------------------------------------------------------------------

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Arm):
            return NotImplemented
        mine, theirs = self._arguments(), other._arguments()
        skip = {"import_report", "notes"}
        return all(np.array_equal(mine[k], theirs[k]) for k in mine if k not in skip)

    def __hash__(self) -> int:
        return hash((self.name, self.d_bs, self.d_se, self.d_ew, self.d_wf, self.lower.tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (self._arguments(),)

    def __repr__(self) -> str:
        shown = [f"{k}={getattr(self, k)!r}" for k in ("d_bs", "d_se", "d_ew", "d_wf")]
        shown += [f"{k}={getattr(self, k)!r}" for k in ("a_3", "a_4") if getattr(self, k)]
        defaults = _arm_defaults()
        for key, default in defaults.items():
            value = getattr(self, key)
            if not np.array_equal(value, default):
                shown.append(f"{key}={_list_text(value)}")
        shown.append(f"name={self.name!r}")
        if self.joint_names != _joint_names():
            shown.append(f"joint_names={self.joint_names!r}")
        return f"Arm({', '.join(shown)})"


def _rebuild(arguments: dict[str, Any]) -> Arm:
    return Arm(**arguments)


def _joint_names() -> tuple[str, ...]:
    return tuple(f"joint_{i}" for i in range(1, JOINTS + 1))


def _arm_defaults() -> dict[str, NDArray[Any]]:
    infinite = np.full(JOINTS, np.inf)
    return {
        "lower": -infinite, "upper": infinite, "signs": np.ones(JOINTS), "offsets": np.zeros(JOINTS),
        "base": np.eye(4), "tool": np.eye(4), "velocity": infinite, "acceleration": infinite,
    }  # fmt: skip


def _list_text(value: NDArray[Any]) -> str:
    """Return an array as Python source; infinities as float('inf')."""
    return (
        repr(value.tolist())
        .replace("-inf", "-float('inf')")
        .replace(" inf", " float('inf')")
        .replace("[inf", "[float('inf')")
    )


def _check_joints(values: dict[str, Any], sign: Floats) -> None:
    """Raise where the seven signs, limits or bounds contradict each other."""
    if not np.all(np.abs(sign) == 1):
        at = int(np.argmax(np.abs(sign) != 1))
        raise InputError(f"signs[{at}] is {sign[at]:g}, wanted +1 or -1")
    for name in ("lower", "upper", "offsets"):
        check_angles(name, np.where(np.isinf(values[name]), 0.0, values[name]))
    lower, upper = values["lower"], values["upper"]
    crossed = ~(lower <= upper) | (lower == np.inf) | (upper == -np.inf)
    if crossed.any():
        at = int(np.argmax(crossed))
        raise LimitError(
            f"lower[{at}] is {lower[at]:g} and upper[{at}] is {upper[at]:g}, wanted lower <= upper"
        )
    for name in ("velocity", "acceleration"):
        if not (values[name] > 0).all():
            at = int(np.argmax(~(values[name] > 0)))
            raise LimitError(f"{name}[{at}] is {values[name][at]:g}, wanted a positive number")


def _choice(name: str, value: str, options: tuple[str, ...]) -> int:
    if value not in options:
        raise InputError(f"{name} is {value!r}, wanted one of {', '.join(map(repr, options))}")
    return options.index(value)
