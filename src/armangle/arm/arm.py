"""The arm: its numbers, where they come from, its kinematics, and what its limits allow."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from dataclasses import MISSING, Field, fields, replace
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any, Literal, Never, TypedDict, Unpack, cast, final

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
    Shape,
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
    one_or_seven,
    one_pose,
    output,
)
from .._core import Turned, Wanted
from .._progress import Progress, as_progress, progressing
from ..errors import ConfigurationError, InputError, LimitError, NotFiniteError, SceneError, ShapeError
from ..models.axes import rotation_angle
from ..models.body import Body
from ..models.catalogue import catalogue, load_robot
from ..models.chain import Chain
from ..models.description import (
    ELBOW_OFFSETS,
    FRAMES,
    JOINT_ROWS,
    LENGTHS,
    ArmDescription,
    ImportReport,
)
from ..models.detect import describe_chain
from ..models.mjcf import read_mjcf
from ..models.report import LIKE_DEGREES, LIKE_MILLIMETRES, degrees_notes, millimetre_notes, warn_of
from ..models.urdf import Source, read_urdf, write_urdf
from ..poses import as_transform, nearest_rotation
from ..scenes.clearance import Clearance, Widest, clearance_of
from ..scenes.ready import Ready, make_ready
from ..scenes.scene import Scene, as_shapes
from ..scenes.shapes import HOLDABLE
from ..scenes.shapes import Shape as SceneShape
from ..status import STATUSES, Status
from .allowed import Allowed
from .arcs import ArcSet
from .deviation import ChainDeviation, deviation_of, proven_share_of
from .diagnosis import Branch, Diagnosis, Verdict, branch_of
from .freedom import Freedom
from .frozen_value import FrozenValue
from .joint_function import JointFunction
from .keywords import names_keywords, says_order
from .near import NearHandle, check_kept_chain, check_near, leaves_out, moved_ends, unsupported
from .question import METRICS as _METRICS
from .question import PREFER, Beyond, MetricName, Prefer, Question, relaxing_length, weights_of
from .roll import ROLLS, Roll, check_free_roll, solve_free
from .solution import Solution, Solutions
from .wish import Direction, as_wish

__all__ = ["MOST_MARGIN", "Arm", "nearest_rotation"]

Enforce = Literal["ignore", "raise", "nan"]
Unreachable = Literal["raise", "nan"]
Reference = ArrayLike | Literal["base", "stereographic"]

BOUNDS = ("velocity", "acceleration")
_ONE_FOR_ALL = ("lower", "upper", *BOUNDS)
LEAST_LINK = 1e-6  # m: of upper arm and forearm; a shorter one is a mistake of units
MOST_MARGIN: float = _core.MOST_MARGIN
_ENFORCE = named(_core.Enforce)
_UNREACHABLE = ("raise", "nan")
_REFERENCES = {n: v for n, v in named(_core.Reference).items() if v is not _core.Reference.VECTOR}
_GC_ORDER = np.arange(CONFIGURATIONS, dtype=np.int64)
_FIELDS = fields(ArmDescription)
_KEYWORDS = {
    "psi": "inverse(pose, psi, gc) does; allowed=ArcSet([(psi, psi)]) keeps the search to one",
    "seed": "near= is the seed",
    "q0": "near= is the seed",
    "unreachable": "it never raises on geometry: status says why, q is NaN, and raise_for_status() raises",
    "limits": "it never leaves them; inverse(pose, psi, gc) takes limits=",
    "roll": "solve(pose, roll='free', prefer='margin') does, and feasible_roll(pose) gives every roll",
    "outside": "solve(pose, near, outside='nearest') does",
    "length": "solve(pose, near, outside='nearest', length=) does",
    **dict.fromkeys(("near", "metric", "weight"), "solve(pose, near=q) does: best is of no seed"),
    "prefer": "best is solve(pose, prefer='margin')",
    "elbow": "psi_towards(pose, gc, point) says which psi brings it there, the policy Towards leads it",
}
_names_keywords = names_keywords("Arm", _KEYWORDS)
_says_order = says_order("of joints q, pose, psi and gc are those of arm.forward(q)")
_NEAREST = "solve(pose, near=q) finds the nearest posture of all, solutions(pose, near=q) one for each way"
_ELSEWHERE = {
    **dict.fromkeys(("ik", "inverse_kinematics", "nearest", "closest", "ikine", "ik_LM"), _NEAREST),
    **dict.fromkeys(("fk", "forward_kinematics", "fkine"), "forward(q) gives pose, psi and gc"),
    **dict.fromkeys(("null_space", "nullspace"), "self_motion(pose, psi, gc) is its direction, dq/dpsi"),
    **dict.fromkeys(("jacob0", "jac"), "jacobian(q), (..., 6, 7)"),
    **dict.fromkeys(("step", "follow", "plan"), "it is a function: armangle.{name}(arm, ...)"),
    "limits": "lower and upper, (7,) each",
}
"""What to use in place of names that other libraries have, or that stand elsewhere."""
_OPTIONAL = (*JOINT_ROWS, *FRAMES, "joint_names", "chain")  # None stands for the default


class ArmArguments(TypedDict, total=False):
    """What `Arm` takes for each field of `ArmDescription`: the types for editors and type checkers."""

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    d_4: float
    lower: ArrayLike | None
    upper: ArrayLike | None
    signs: ArrayLike | None
    offsets: ArrayLike | None
    base: ArrayLike | None
    tool: ArrayLike | None
    velocity: ArrayLike | None
    acceleration: ArrayLike | None
    name: str
    joint_names: tuple[str, ...] | None
    reference: Reference
    chain: ArrayLike | None
    body: Body | None
    hand: Iterable[SceneShape]
    notes: tuple[str, ...] | str
    import_report: ImportReport | None


def _default(field: Field[Any]) -> Any:
    """Return what a field is where it is not given; MISSING where it must be."""
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _signature() -> Signature:
    """Return the keywords of `Arm` and their defaults, for help() and the pages."""
    shown = {f.name: None if f.name in _OPTIONAL else _default(f) for f in _FIELDS}
    shown["import_report"] = None
    return Signature(
        [
            Parameter(n, Parameter.KEYWORD_ONLY, default=Parameter.empty if default is MISSING else default)
            for n, default in shown.items()
        ]
    )


@final
class Arm(FrozenValue):
    """A 7-axis arm with spherical shoulder, elbow and spherical wrist (S-R-S).

    The tip's pose is ``base @ DH(theta) @ tool`` with ``theta_i = signs_i q_i + offsets_i`` and the
    classic DH rows of the paper's Table 1, to which the elbow's offsets a_3, a_4, d_4 are added.
    Everything public speaks q, the robot's own joint coordinates. Values are frozen.

    Parameters
    ----------
    d_bs, d_se, d_ew, d_wf : float
        Base to shoulder, shoulder to elbow, elbow to wrist, wrist to flange, m; d_se and d_ew may be 0 beside
        an elbow offset, which makes the links hypot(d_se, a_3) and hypot(d_ew, a_4), at least 1e-6, long.
    lower, upper : float or array_like, shape (7,), optional
        Joint limits in q, rad, lower <= upper, or one for all joints. Any: beyond ±π, of one sign, wider than
        a turn, infinite (the default).
    a_3, a_4 : float
        Lateral elbow offsets of links 3 and 4, m.
    d_4 : float
        Gap along axis 4 from the upper arm to the forearm, m (Kinova MOVO).
    signs : array_like of +1 or -1, shape (7,), optional
        Directions of the joints.
    offsets : array_like, shape (7,), optional
        Zero offsets, rad.
    base, tool : array_like, shape (4, 4), optional
        Frame of the DH base in the frame poses are given in; frame of the tool in the flange. Their
        rotations are replaced by the nearest exact ones.
    velocity, acceleration : float or array_like, shape (7,), optional
        Greatest joint speeds (rad/s) and accelerations (rad/s²), > 0, or one for all joints; infinite by
        default.
    name : str
        Name of the arm.
    reference : "base", "stereographic" or array_like, shape (3,)
        From what the arm angle is measured: see `with_reference`.
    chain : array_like, shape (8, 4, 4), optional
        The arm's own chain where it is only nearly S-R-S, as a calibration gives it: the pose of the tip is
        ``chain[0] Rz(q_1) chain[1] ... Rz(q_7) chain[7]``. The other numbers are then those of the nominal
        arm, which lends psi and gc; poses, joints and limits are the chain's. See `armangle.dh_chain` and
        `deviation`.
    body : Body, optional
        What the links look like: see `with_body`.
    hand : sequence of Ball, Capsule, Box or Hull
        What is fixed to the tool: see `with_hand`.
    joint_names : sequence of 7 str, optional
        Names of the joints, as files have them.
    notes : str or sequence of str, optional
        What was noted where the numbers come from.

    Attributes
    ----------
    import_report : ImportReport or None
        What was found in the file that the arm was read from; None of an arm that was made otherwise.

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

    __slots__ = (*(field.name for field in _FIELDS), "import_report", "_handle", "_ready")
    __signature__ = _signature()  # of the keywords that __init__ takes and checks by the list of fields

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    d_4: float
    lower: Floats
    upper: Floats
    signs: Ints
    offsets: Floats
    base: Floats
    tool: Floats
    velocity: Floats
    acceleration: Floats
    name: str
    joint_names: tuple[str, ...]
    reference: str | tuple[float, ...]
    chain: Floats | None
    body: Body | None
    hand: tuple[SceneShape, ...]
    notes: tuple[str, ...]
    import_report: ImportReport | None
    _handle: _core.Arm
    _ready: tuple[Scene, Ready] | None  # the scene asked last, made ready

    if not TYPE_CHECKING:  # a type checker is to know the attributes that there are

        def __getattr__(self, name: str) -> Never:
            """Raise what a name of another library is called here."""
            told = f"{type(self).__name__!r} object has no attribute {name!r}"
            if name in _ELSEWHERE:
                told += f": {_ELSEWHERE[name].format(name=name)}"
            raise AttributeError(told, name=name, obj=self)

    def __init__(self, *unnamed: Never, **numbers: Unpack[ArmArguments]) -> None:
        if unnamed:
            raise TypeError(
                f"Arm takes keywords alone, but {len(unnamed)} values came without: "
                "wanted Arm(d_bs=..., d_se=..., d_ew=..., d_wf=..., ...)"
            )
        given = dict(numbers)
        report = given.pop("import_report", None)
        values = _checked(given)
        lengths = np.array([values[name] for name in (*LENGTHS, *ELBOW_OFFSETS)])
        joints = np.concatenate([values[name] for name in ("signs", "offsets", "lower", "upper")])
        kind, vector = _core_reference(values["reference"])
        given_to_core = lengths, joints, values["base"], values["tool"], kind, vector
        if values["chain"] is None:
            handle = _core.Arm(*given_to_core)
        else:
            near = NearHandle(*given_to_core, values["chain"])
            check_near(values["name"], near)
            handle = cast(_core.Arm, near)
        self._fill({**values, "import_report": report, "_handle": handle, "_ready": None})

    # -- where it comes from -------------------------------------------------------------------------

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
        continuous_limits: str = "ignore",
        exact: bool = True,
    ) -> Arm:
        """Return the arm between two links of a URDF, in that file's own joint coordinates and frames.

        Parameters
        ----------
        source : path or str or bytes
            A URDF file, or its XML text.
        base, tip : str, optional
            Names of the two links; guessed where the file leaves one choice of seven rotating joints, or one
            that is S-R-S.
        angle_tolerance, length_tolerance : float
            How far axes may be from exact (rad, m). Beyond the default the arm is the nearest in the mean
            square; a warning and a note of ``import_report`` say by how much its tip then differs from the
            file's.
        continuous_limits : {"ignore", "use"}
            Limits of a continuous joint, which by the rules of URDF has none, though some files state them.
            Where they are ignored, a warning and a note of ``import_report`` say so.
        exact : bool
            False: keep the file's own chain where it is only nearly S-R-S (axes within 50 mm and 2 deg, or
            the tolerances where they are larger). Poses and joints are then the file's own to rounding; psi
            and gc are those of the S-R-S arm fitted to it. See `deviation`, and docs: howto/calibrated.

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
        chain = read_urdf(source, base=base, tip=tip, continuous_limits=continuous_limits)
        return cls._of_chain(chain, angle_tolerance, length_tolerance, exact)

    @classmethod
    def from_mjcf(
        cls,
        source: PathLike,
        base: str | None = None,
        tip: str | None = None,
        *,
        angle_tolerance: float = 1e-5,
        length_tolerance: float = 2e-5,
        exact: bool = True,
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
        exact : bool
            As in `from_urdf`.

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
        return cls._of_chain(chain, angle_tolerance, length_tolerance, exact)

    @classmethod
    def _of_chain(cls, chain: Chain, angle: float, length: float, exact: bool) -> Arm:
        description, report = describe_chain(chain, angle=angle, length=length, exact=as_flag("exact", exact))
        warn_of(report.notes)
        return cls._from_description(description, report)

    @classmethod
    def _from_description(cls, description: ArmDescription, report: ImportReport | None = None) -> Arm:
        numbers = {field.name: getattr(description, field.name) for field in _FIELDS}
        return cls(**numbers, import_report=report)

    def to_urdf(self) -> str:
        """Return a kinematic URDF (joints and limits, no geometry) that imports back to this arm."""
        return write_urdf(self._description())

    def _description(self) -> ArmDescription:
        return ArmDescription(**self._numbers())

    # -- the arm as a value --------------------------------------------------------------------------

    def with_(self, **changes: Unpack[ArmArguments]) -> Arm:
        """Return a copy with some constructor arguments changed, such as ``lower=``.

        ``tool=`` replaces the whole transform from flange to tip. An arm that was read from a file, or is of
        the catalogue, often has one already, and this drops it: the tip of openarm_v10 is turned against the
        flange, and a gripper 150 mm long would end 212 mm beside its place. To mount something on the
        present tip use `with_tool`.

        Parameters
        ----------
        **changes
            As `Arm`.

        Returns
        -------
        Arm

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, LimitError, InputError
            As `Arm`.
        """
        kept: dict[str, Any] = {**self._numbers(), "import_report": self.import_report}
        if self.chain is not None and "chain" not in changes:
            check_kept_chain(changes)
        if self.chain is not None and "chain" not in changes and not changes.keys().isdisjoint(FRAMES):
            frames = {name: as_transform(name, _given_frame(changes, name, kept[name])) for name in FRAMES}
            kept["chain"] = moved_ends(self.chain, (self.base, self.tool), (frames["base"], frames["tool"]))
        numbers = {**kept, **changes}
        if self.chain is None and changes.get("chain") is not None:
            return self._with_chain(numbers, [end for end in FRAMES if end not in changes])
        return Arm(**numbers)

    def _with_chain(self, numbers: dict[str, Any], ends: list[str]) -> Arm:
        """Return a copy with a chain of its own, which must not leave out the base or tool that the arm has.

        `ends`: those of them that are not given beside the chain.
        """
        made, wrong = None, None
        try:
            made = Arm(**numbers)
        except InputError as error:
            if type(error) is not InputError:  # a chain that cannot be read as one
                raise
            wrong = error
        for end in ends:
            frame, at = getattr(self, end), 0 if end == "base" else JOINTS
            whole = np.array(numbers["chain"], dtype=np.float64)
            whole[at] = frame @ whole[0] if end == "base" else whole[-1] @ frame
            try:
                other = Arm(**{**numbers, "chain": whole})
            except InputError:
                continue
            bare = None if made is None else made._handle
            if leaves_out(cast(NearHandle | None, bare), cast(NearHandle, other._handle), at):
                raise InputError(
                    f"the chain for {self.name!r} leaves out its {end}=: give it there too, "
                    f"as dh_chain(..., {end}=arm.{end})"
                )
        if made is None:
            assert wrong is not None
            raise wrong
        return made

    def with_tool(self, tool: ArrayLike) -> Arm:
        """Return a copy with a tool mounted on the present tip.

        Not to be confused with ``with_(tool=...)``, which replaces the transform from flange to tip.

        Parameters
        ----------
        tool : array_like, shape (4, 4)
            Frame of the new tip in the frame of the present one, position in m.

        Returns
        -------
        Arm
            Its ``tool`` is ``self.tool @ tool``, so that its poses are those of this arm times `tool`.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError

        Examples
        --------
        >>> arm = Arm.from_catalogue("openarm_v10")
        >>> gripper = np.eye(4)
        >>> gripper[2, 3] = 0.1
        >>> longer = arm.with_tool(gripper)
        >>> q = np.zeros(7)
        >>> bool(np.allclose(longer.forward(q)[0], arm.forward(q)[0] @ gripper, rtol=0, atol=1e-14))
        True
        """
        return self.with_(tool=self.tool @ as_transform("tool", tool))

    def with_reference(self, reference: Reference) -> Arm:
        """Return a copy whose arm angle is measured from another reference plane.

        The postures stay, and everything that takes or returns psi speaks of the new one: `forward`,
        `inverse`, arcs, policies, plans, files. The two differ by an angle of the pose (and not of the branch
        or the joints), so arcs are the same postures, shifted.

        Parameters
        ----------
        reference : "base", "stereographic" or array_like, shape (3,)
            "base": psi is 0 where the elbow lies in the plane of the wrist and the axis of joint 1, as the
            paper has it; it turns by half a turn where the wrist passes that axis, above or below the
            shoulder. A vector, of any length, in the frame that poses are given in: the same with this
            vector in place of the axis; singular where the wrist lies along it, on either side.
            "stereographic": the plane that "base" has where the wrist is straight above the shoulder (along
            the axis of joint 1), carried to the wrist's direction the shortest way; singular where the wrist
            is straight below the shoulder and nowhere else. At singular places a convention holds: psi is
            defined there, but jumps beside.

        Returns
        -------
        Arm

        Raises
        ------
        ShapeError, NotFiniteError, InputError

        Source: Elias and Wen (2024), "Redundancy parameterization and inverse kinematics of 7-DOF revolute
        manipulators": conventional and stereographic SEW angle.

        Examples
        --------
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> other = arm.with_reference("stereographic")
        >>> q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
        >>> pose, psi, gc = other.forward(q)
        >>> bool(np.allclose(other.inverse(pose, psi, gc), q)), bool(np.isclose(psi, arm.forward(q)[1]))
        (True, False)
        """
        return self.with_(reference=reference)

    def with_body(self, body: Body | Literal["guessed"] | None = "guessed") -> Arm:
        """Return a copy whose links have a shape, so that scenes can be asked.

        Parameters
        ----------
        body : Body, "guessed" or None
            Such as ``Body.bones(upper_arm=0.09, forearm=0.08)``; None takes it away. "guessed" is for a first
            look at any arm: bones and plates of a radius that is 0.24 of the mean of `d_se` and `d_ew`.
            Nobody measured it, so that its ``trusted`` is False and its ``notes`` say so.

        Returns
        -------
        Arm

        Raises
        ------
        SceneError

        Examples
        --------
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800").with_body()
        >>> arm.body, arm.body.trusted
        (Body.bones(upper_arm=0.096, forearm=0.096, plates=True), False)
        """
        if isinstance(body, str) and body == "guessed":
            body = Body._guessed(self.d_se, self.d_ew)
        return self.with_(body=body)

    def with_hand(self, shapes: Iterable[SceneShape]) -> Arm:
        """Return a copy with shapes fixed to its tool: a hand, and what it carries.

        Parameters
        ----------
        shapes : sequence of Ball, Capsule, Box or Hull
            In the tool frame, m. Without a name they are called "hand".

        Returns
        -------
        Arm

        Raises
        ------
        SceneError
        """
        return self.with_(hand=tuple(as_shapes("hand", shapes, HOLDABLE)))

    def _scene(self, scene: Scene | None) -> Ready | None:
        """Return a scene made ready for this arm; that asked last is kept."""
        if scene is None:
            return None
        last = self._ready
        if last is not None and last[0] is scene:
            return last[1]
        ready = make_ready(self, scene, None if last is None else last[1])
        object.__setattr__(self, "_ready", (scene, ready))
        return ready

    def _needed(self, scene: Scene) -> Ready:
        """Return a scene made ready, where there must be one."""
        return self._scene(scene) or make_ready(self, scene)

    def _numbers(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in _FIELDS}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Arm):
            return NotImplemented
        compared = [field.name for field in _FIELDS if field.compare]
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in compared)

    def __hash__(self) -> int:
        return hash((self.name, self.d_bs, self.d_se, self.d_ew, self.d_wf, (self.lower + 0.0).tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, ({**self._numbers(), "import_report": self.import_report},)

    def __repr__(self) -> str:
        """Return what makes this arm again: its name in the catalogue, or all that is not the default."""
        if self.name in catalogue() and self == Arm.from_catalogue(self.name):
            return f"Arm.from_catalogue({self.name!r})"
        shown = [
            f"{field.name}={_source_text(getattr(self, field.name))}"
            for field in _FIELDS
            if field.repr and not np.array_equal(getattr(self, field.name), _default(field))
        ]
        return f"Arm({', '.join(shown)})"

    def __str__(self) -> str:
        """Return the arm to be read: lengths in mm, limits in degrees."""
        offsets = [name for name in ELBOW_OFFSETS if getattr(self, name)]
        lengths = ", ".join(f"{n} {getattr(self, n) * MILLIMETRES:.6g}" for n in (*LENGTHS, *offsets))
        ranges = zip(np.degrees(self.lower), np.degrees(self.upper), strict=True)
        limits = ", ".join(f"{lower:.5g} to {upper:.5g}" for lower, upper in ranges)
        return (
            f"{self.name or 'arm'}: {lengths} mm, reach {self.reach * MILLIMETRES:.6g} mm\n"
            f"limits of joints 1 to 7: {limits} deg"
        )

    @property
    def reach(self) -> float:
        """Greatest distance shoulder-wrist, m."""
        return float(self._handle.reach)

    @property
    def inner_reach(self) -> float:
        """Least distance shoulder-wrist, m."""
        return float(self._handle.inner_reach)

    @property
    def delta(self) -> float:
        """Model angle θ4 of the stretched arm, rad; 0 without elbow offset."""
        return float(self._handle.delta)

    @property
    def nominal(self) -> Arm:
        """The S-R-S arm that lends psi and gc: the arm itself, or the one beside its own chain."""
        return self if self.chain is None else self.with_(chain=None)

    @property
    def deviation(self) -> ChainDeviation:
        """How far the arm's own chain is from its nominal arm, and where its branches merge.

        Measured at the first use over random postures within the limits; all zero without a chain.
        """
        return deviation_of(self)

    @property
    def proven_share(self) -> float:
        """At what share of poses, 0 to 1, the feasible intervals of all branches are proven throughout.

        Measured at the first use, at the poses of 50 random postures within the limits; 1 without a chain.
        At the others `feasible` leaves out what is not proven, and says how much in ``unproven``.
        """
        return proven_share_of(self)

    # -- kinematics ----------------------------------------------------------------------------------

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
        if isinstance(undefined, str) and undefined == "raise" and type(threads) is int and threads == 1:
            plain: tuple[Floats, np.float64, np.int64] | None = self._handle.forward_one(q)
            if plain is not None:
                return plain
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        pose, psi, gc = np.empty((*batch, 4, 4)), np.empty(batch), np.empty(batch, dtype=np.int64)
        nan = chosen("undefined", undefined, _UNREACHABLE) == "nan"
        self._handle.forward_many(joints, pose, psi, gc, nan, as_threads(threads))
        return pose, psi[()], gc[()]

    def inverse(
        self,
        pose: ArrayLike,
        psi: ArrayLike | None = None,
        gc: ArrayLike | None = None,
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
            Arm angle, rad, any real. Needed, as gc is: without them the error says what finds a posture of a
            pose alone.
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
        InputError
            Without psi or gc.
        UnreachableError
            If a pose is out of reach: by how many mm.
        LimitError
            With ``limits="raise"``.

        Source: Faria et al. (2018), Eqs. (12)-(24), in a form that holds the pose in every case.
        """
        plainly = isinstance(limits, str) and limits == "ignore" and isinstance(unreachable, str)
        if (
            plainly and unreachable == "raise" and seed is None and out is None
            and type(threads) is int and threads == 1
        ):  # fmt: skip
            plain: Floats | None = self._handle.inverse_one(pose, psi, gc)
            if plain is not None:
                return plain
        return self._inverse(pose, psi, gc, seed, limits, unreachable, out, threads)

    def _inverse(
        self,
        pose: ArrayLike,
        psi: ArrayLike | None,
        gc: ArrayLike | None,
        seed: ArrayLike | None,
        limits: Enforce,
        unreachable: Unreachable,
        out: Floats | None,
        threads: int,
        all_branches: bool = False,
    ) -> Floats:
        if psi is None or gc is None:
            raise InputError(
                "inverse is of a pose, psi and gc: which of its many postures is meant. "
                "solve(pose, near=q) finds the nearest of all, best(pose) the farthest from its limits, "
                "solutions(pose) one for each way to hold it"
            )
        seeds = [] if seed is None else [("seed", as_floats("seed", seed, (JOINTS,)), 1)]
        beyond = _ENFORCE[chosen("limits", limits, _ENFORCE)]
        out_of_reach = _ENFORCE[chosen("unreachable", unreachable, _UNREACHABLE)]
        batch, arrays = self._postures(pose, psi, gc, *seeds)
        result = output(out, (*batch, JOINTS))
        # written while the arguments are read: memory they share is written aside
        shared = out is not None and any(np.may_share_memory(result, array) for array in arrays)
        target = np.empty_like(result) if shared else result
        poses, angles, branches, *near = arrays
        self._handle.inverse_many(
            poses,
            angles,
            branches,
            near[0] if near else None,
            target,
            beyond,
            out_of_reach,
            as_threads(threads),
            all_branches,
        )
        if shared:
            result[...] = target
        return result

    def _postures(
        self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike, *more: tuple[str, NDArray[Any], int]
    ) -> tuple[Shape, list[NDArray[Any]]]:
        """Return poses, arm angles and branches, and what goes with them, of one batch shape."""
        poses, angles = as_poses("pose", pose, self._handle), as_floats("psi", psi)
        return broadcast([("pose", poses, 2), ("psi", angles, 0), ("gc", as_gc(gc), 0), *more])

    def _branches(
        self, pose: ArrayLike, gc: ArrayLike, *more: tuple[str, NDArray[Any], int]
    ) -> tuple[Shape, list[NDArray[Any]]]:
        """Return poses and branches, and what goes with them, of one batch shape."""
        return broadcast([("pose", as_poses("pose", pose, self._handle), 2), ("gc", as_gc(gc), 0), *more])

    def _of_joints(
        self, one: Callable[[Floats, Floats, int], None], q: ArrayLike, row: Shape, threads: int
    ) -> Floats:
        """Return what the core says of each q: rows of this shape."""
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], *row))
        one(joints, out, as_threads(threads))
        return out

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
            As in `inverse`; ``limits="nan"`` leaves NaN in the rows that violate a limit. Of an arm with a
            chain of its own a branch may have no certain posture where others have one: ``unreachable="nan"``
            leaves NaN in its row.

        Returns
        -------
        ndarray, shape (..., 8, 7)
            Joint values, rad.

        Raises
        ------
        As `inverse`.

        Source: Faria et al. (2018), Eqs. (2), (12)-(24).
        """
        poses = as_poses("pose", pose, self._handle)[..., None, :, :]
        angles = as_floats("psi", psi)[..., None]
        near = None if seed is None else as_floats("seed", seed, (JOINTS,))[..., None, :]
        return self._inverse(poses, angles, _GC_ORDER, near, limits, unreachable, None, threads, True)

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
        >>> from armangle import Arm
        >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
        >>> arm.frames([0, 0, 0, 0, 0, 0, 0])[:, 2, 3].round(3).tolist()
        [0.0, 0.34, 0.34, 0.74, 0.74, 1.14, 1.14, 1.266]
        """
        return self._of_joints(self._handle.frames_many, q, (JOINTS + 1, 4, 4), threads)

    def elbow(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return where the elbow is.

        It is the point of joint 4's axis that is nearest to the shoulder, the origin of DH frame 3: at any q
        hypot(d_se, a_3) from the shoulder and hypot(d_ew, a_4, d_4) from the wrist. On an arm without elbow
        offset both links end there; with a_3 it lies beside the end of the upper arm on axis 3.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad. Limits are not enforced.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 3)
            m, in the frame that poses are given in.

        Raises
        ------
        ShapeError, NotFiniteError

        Source: Faria et al. (2018), Table 1, Eq. (1).

        Examples
        --------
        >>> from armangle import Arm
        >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
        >>> arm.elbow([0, np.pi / 2, 0, 1, 0, 0, 0]).round(3).tolist()
        [0.4, 0.0, 0.34]
        """
        return self._of_joints(self._handle.elbow_many, q, (3,), threads)

    def psi_towards(
        self,
        pose: ArrayLike,
        gc: ArrayLike,
        point: ArrayLike | None = None,
        *,
        direction: Direction | None = None,
        undefined: Unreachable = "raise",
        threads: int = 1,
    ) -> Floats | np.float64:
        """Return the arm angle that brings the elbow nearest to a point, or farthest along a direction.

        In closed form: the elbow is on a circle about the axis shoulder-wrist. Limits are not asked: the
        nearest arm angle that keeps them is ``arm.feasible(pose, gc).nearest(psi)``, and for a moving arm
        the policy `armangle.Towards`. Of an arm with a chain of its own the elbow is the nominal arm's, from
        which the true one is off by `deviation`.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        point : array_like, shape (..., 3)
            m, in the frame that poses are given in; or
        direction : array_like, shape (..., 3), or a word
            Of any length, in that frame; "up" (+z), "down", "left" (+y), "right", "forward" (+x), "back".
        undefined : "raise" or "nan"
            Where all arm angles are alike, or there is none: raise, or return NaN. That is where the arm is
            stretched or folded, so that its elbow stays where it is; where the point lies on the axis
            shoulder-wrist, or the direction along it; and out of reach.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        float64, shape (...)
            Arm angle in (-π, π], rad.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError
            If an argument is not usable.
        UnreachableError
            Where it is undefined: which of the reasons.

        Examples
        --------
        >>> from armangle import Arm
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
        >>> up = arm.psi_towards(pose, gc, direction="up")
        >>> here, there = arm.elbow(arm.inverse(pose, [psi, up], gc))[:, 2]
        >>> bool(there > here)
        True
        """
        wish, target = as_wish(point, direction)
        batch, (poses, branches, targets) = self._branches(pose, gc, ("point or direction", target, 1))
        out = np.empty(batch)
        nan = chosen("undefined", undefined, _UNREACHABLE) == "nan"
        self.nominal._handle.psi_towards_many(poses, branches, wish, targets, out, nan, as_threads(threads))
        return out[()]

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
        return self._of_joints(self._handle.jacobian_many, q, (6, JOINTS), threads)

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
        batch, (poses, angles, branches) = self._postures(pose, psi, gc)
        out = np.empty((*batch, JOINTS))
        self._handle.self_motion_many(poses, angles, branches, out, as_threads(threads))
        return out

    def inverse_derivative(
        self,
        pose: ArrayLike,
        psi: ArrayLike,
        gc: ArrayLike,
        *,
        unreachable: Unreachable = "raise",
        threads: int = 1,
    ) -> Floats:
        """Return how the joints of `inverse` move with the pose and with the arm angle.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        psi : array_like, shape (...)
            Arm angle, rad.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        unreachable : "raise" or "nan"
            What to do where the geometry has no answer.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 7, 7)
            dq: columns 0-2 by the velocity of the tool's origin (rad/m), 3-5 by the angular velocity
            (rad/rad), both in the frame that poses are given in, and column 6 by psi, which is `self_motion`.
            The inverse of `jacobian` with `psi_gradient` as a seventh row. Infinite where a derivative does
            not exist: joints 1-3 (5-7) where θ2 (θ6) is 0 or π; columns 0-5 of all joints where the elbow is
            stretched or folded, and of all but joint 4 where psi jumps (the wrist over the base axis).

        Raises
        ------
        As `inverse`.

        Examples
        --------
        >>> from armangle import Arm
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
        >>> both = np.vstack([arm.jacobian(q), arm.psi_gradient(q)])
        >>> bool(np.allclose(arm.inverse_derivative(*arm.forward(q)) @ both, np.eye(7), rtol=0, atol=1e-12))
        True
        """
        batch, (poses, angles, branches) = self._postures(pose, psi, gc)
        out = np.empty((*batch, JOINTS, JOINTS))
        nan = chosen("unreachable", unreachable, _UNREACHABLE) == "nan"
        self._handle.inverse_derivative_many(poses, angles, branches, out, nan, as_threads(threads))
        return out

    def psi_gradient(self, q: ArrayLike, *, threads: int = 1) -> Floats:
        """Return how the arm angle moves with the joints.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 7)
            dψ/dq, rad/rad, of the arm's own reference plane; inf where ψ does not exist, or jumps: for
            the psi of the base axis where the wrist lies on it.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        return self._of_joints(self._handle.psi_gradient_many, q, (JOINTS,), threads)

    def feasible_derivative(
        self, pose: ArrayLike, gc: int, *, singularity_margin: float = 0.0
    ) -> tuple[ArcSet, Floats]:
        """Return the feasible arcs of one pose, and how their ends move with it.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m.
        gc : int
            Global configuration 0..7.
        singularity_margin : float
            As in `feasible`, rad.

        Returns
        -------
        ArcSet, ndarray of shape (k, 2, 6)
            The arcs of `feasible`; for the lower and upper end of each, dψ by the velocity of the tool's
            origin (rad/m) and by its angular velocity (rad/rad). NaN where an end does not move smoothly:
            the full circle has no end, a jump none, and where a joint only touches its limit an arc is born.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        frame = one_pose("pose", pose, self._handle)
        branch = as_gc(gc)
        if branch.ndim:
            raise ShapeError(f"gc has shape {branch.shape}, wanted one integer")
        arcs = self.feasible(frame, branch[()], singularity_margin=margin)
        out = np.full((int(arcs.count), 2, 6), np.nan)
        self._handle.end_slopes_one(frame, int(branch), margin, out)
        return arcs, out

    # -- limits --------------------------------------------------------------------------------------

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
        self._handle.limit_margin_many(joints, out)
        return out[()]

    def limit_margin_gradient(self, q: ArrayLike) -> Floats:
        """Return how `limit_margin` moves with the joints.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        ndarray, shape (..., 7)
            rad/rad: +1 or -1 at the joint whose limit is nearest, the first of several; 0 elsewhere, and
            without limits.

        Raises
        ------
        ShapeError, NotFiniteError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty(joints.shape)
        self._handle.limit_margin_gradient_many(joints, out)
        return out

    def within_limits(self, q: ArrayLike, tol: float = _core.ANGLE_TOLERANCE) -> NDArray[np.bool_] | np.bool_:
        """Return whether all joints are within their limits.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        tol : float
            Slack, rad: by default the 1e-9 within which angles are one angle everywhere here, so that
            postures at the ends of arcs are within. ``tol=0.0`` judges the last bit; joints that `solve`
            returns keep that too.

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
        scene: Scene | None = None,
        threads: int = 1,
        progress: Progress | bool | None = None,
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
        scene : Scene, optional
            Obstacles that links keep clear of too; the arm needs a body. Ends that they make name them.
        threads : int
            Threads for a batch; 0 for all cores.
        progress : function (done, total) or bool
            Told some times a second how many poses of a batch are done; True draws a bar on stderr.

        Returns
        -------
        ArcSet, shape (...)
            Empty with the reason in ``status`` where there is none; never raises on geometry. Of an arm with
            a chain of its own every arm angle in it is proven, and ends are those of the true joints; what
            is proven neither way is left out, and ``unproven`` says how much that is.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError

        Source: Faria et al. (2018), Eqs. (25), (31), (32), (35).
        """
        margins = singularity_margin, paper_margin, paper_discriminant
        return self._arcs(pose, gc, *margins, Wanted.BRANCH, (), threads, scene, progress)

    def feasible_all(
        self,
        pose: ArrayLike,
        *,
        singularity_margin: float = 0.0,
        scene: Scene | None = None,
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> ArcSet:
        """Return the feasible arm angles of all eight global configurations; entry k is GC k, always.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        singularity_margin : float
            As in `feasible`, rad.
        scene : Scene, optional
            As in `feasible`.
        threads : int
            Threads for a batch; 0 for all cores.
        progress : function (done, total) or bool
            Told some times a second how many poses of a batch are done; True draws a bar on stderr.

        Returns
        -------
        ArcSet, shape (..., 8)
            The sets of `feasible`, in about half the time of eight calls.

        Raises
        ------
        As `feasible`.

        Source: Faria et al. (2018), Eqs. (2), (25).
        """
        margins = singularity_margin, 0.0, 0.0
        return self._arcs(pose, 0, *margins, Wanted.BRANCHES, (CONFIGURATIONS,), threads, scene, progress)

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
        return self._arcs(pose, gc, singularity_margin, 0.0, 0.0, Wanted.JOINTS, (JOINTS,), threads)

    @_says_order
    def clear(self, pose: ArrayLike, gc: ArrayLike, scene: Scene, *, threads: int = 1) -> ArcSet:
        """Return the arm angles at which no link touches an obstacle, whatever the joint limits.

        Exact: an end is where a link and an obstacle are as far apart as the scene's clearance asks.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...)
            Global configuration 0..7; of its signs the elbow's alone matters.
        scene : Scene
            Obstacles; the arm needs a body (`with_body`) or a hand (`with_hand`).
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ArcSet, shape (...)
            Each end names its obstacle and link. Where it is empty, ``status`` says why: POSE_BLOCKED where
            hand or base meet an obstacle, which no arm angle changes, CLEARANCE else; and ``blocking`` names
            the pair, where one alone blocks the whole circle. Of more than 16 arcs the narrowest are
            left out, and ``coarse`` says so.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, SceneError

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> arm = arm.with_body(aa.Body.bones(upper_arm=0.09, forearm=0.08))
        >>> q = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 0.9, 0.0])
        >>> pose, psi, gc = arm.forward(q)
        >>> scene = aa.Scene([aa.Ball(arm.elbow(q) + [0, 0, 0.2], 0.12, name="lamp")])
        >>> arcs = arm.clear(pose, gc, scene)
        >>> bool(arcs.contains(psi)), arcs.ends[0][0].obstacle, arcs.ends[0][0].link
        (False, 'lamp', 'upper_arm')
        """
        self._needed(scene)
        return self._arcs(pose, gc, 0.0, 0.0, 0.0, Wanted.CLEAR, (), threads, scene)

    @_says_order
    def clearance(
        self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike, scene: Scene, *, threads: int = 1
    ) -> Clearance:
        """Return how near a posture comes to the obstacles, and which pair of obstacle and link is nearest.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        psi : array_like, shape (...)
            Arm angle, rad, any real.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        scene : Scene
            Its `clearance` is not taken off: distances are those of surfaces. Own links and the hand are
            obstacles too; where ``psi_rate`` is 0 the arm angle does not move the pair (`widest`).
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        Clearance

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, SceneError, UnreachableError
        """
        batch, (poses, angles, branches) = self._postures(pose, psi, gc)
        check_angles("psi", angles)
        ready = self._needed(scene)
        out, pair = np.empty((*batch, 8)), np.empty(batch, dtype=np.int64)
        self._handle.proximity_many(ready.handle, poses, angles, branches, out, pair, as_threads(threads))
        return clearance_of(ready, out, pair)

    @_says_order
    def widest(
        self,
        pose: ArrayLike,
        gc: ArrayLike,
        scene: Scene,
        *,
        singularity_margin: float = 0.0,
        threads: int = 1,
    ) -> Widest:
        """Return the feasible arm angle that keeps the links farthest from the obstacles.

        The arcs that keep clear shrink as the clearance that is asked grows; the greatest that leaves one is
        found by bisection. Where the nearest pair keeps its distance on a whole arc, as shoulder and floor
        do, or a hand and the forearm at the wrist, the next pair decides within that arc, and ``nearest`` is
        the one that decided; of all pairs `clearance` tells. (Of an arm with a chain of its own any pair
        decides.) Where nothing is clear it is the arm angle that fails by least: a distance below the scene's
        clearance says by how much. It is NaN where no arm angle keeps the limits, or where links stand in
        obstacles with their very axes at each of them.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...)
            Global configuration 0..7.
        scene : Scene
        singularity_margin : float
            As in `feasible`, rad.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        Widest

        Raises
        ------
        As `clear`.
        """
        arcs = self._arcs(pose, gc, singularity_margin, 0.0, 0.0, Wanted.BRANCH, (), threads, scene)
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        batch, (poses, branches) = self._branches(pose, gc)
        ready = self._needed(scene)
        psi, out = np.empty(batch), np.empty((*batch, 8))
        pair, status = (np.empty(batch, dtype=np.int64) for _ in range(2))
        self._handle.widest_many(
            ready.handle, poses, branches, margin, psi, out, pair, status, as_threads(threads)
        )
        return Widest(arcs, psi[()], clearance_of(ready, out, pair))

    def _arcs(
        self, pose: ArrayLike, gc: ArrayLike, margin: float, paper: float, threshold: float,
        wanted: Wanted, sets: Shape, threads: int, scene: Scene | None = None,
        progress: Progress | bool | None = None,
    ) -> ArcSet:  # fmt: skip
        """Return the sets of each pose, of shape (*batch, *sets)."""
        if self.chain is not None:
            return self._proven_arcs(pose, gc, margin, paper, wanted, sets, threads, scene, progress)
        ready = self._scene(scene)
        handle = None if ready is None else ready.handle
        if progress is None:
            of_one = self._handle.feasible_one(pose, gc, margin, paper, threshold, wanted, threads, handle)
            if of_one is not None:
                return ArcSet._of_one(sets, of_one, ready)
        margin = as_number("singularity_margin", margin, 0.0, MOST_MARGIN)
        paper = as_number("paper_margin", paper, 0.0, MOST_MARGIN)
        threshold = as_number("paper_discriminant", threshold, 0.0, np.inf)
        batch, (poses, branches) = self._branches(pose, gc)
        with progressing(as_progress(progress)):
            columns = self._handle.feasible_many(
                poses, branches, margin, paper, threshold, wanted, as_threads(threads), handle
            )
        return ArcSet._from_core((*batch, *sets), columns, ready)

    def _proven_arcs(
        self, pose: ArrayLike, gc: ArrayLike, margin: float, paper: float, wanted: Wanted, sets: Shape,
        threads: int, scene: Scene | None, progress: Progress | bool | None,
    ) -> ArcSet:  # fmt: skip
        """Return the sets of the true chain."""
        ready = self._scene(scene)
        if as_number("paper_margin", paper, 0.0, MOST_MARGIN) != 0.0:
            raise unsupported("paper_margin=")
        margin = as_number("singularity_margin", margin, 0.0, MOST_MARGIN)
        batch, (poses, branches) = self._branches(pose, gc)
        unproven = np.zeros((*batch, *sets)).reshape(-1)
        handle = cast(NearHandle, self._handle)
        obstacles = None if ready is None else ready.handle
        with progressing(as_progress(progress)):
            columns = handle.feasible_many(
                poses, branches, margin, wanted, unproven, as_threads(threads), obstacles
            )
        return ArcSet._from_core((*batch, *sets), columns, ready, unproven)

    def _left_out(
        self, pose: ArrayLike, gc: ArrayLike, margin: float = 0.0, wanted: Wanted = Wanted.BRANCH
    ) -> ArcSet:
        """Return what `feasible`, `joint_feasible` (JOINTS) or `clear` (CLEAR) leaves out as not proven.

        Of an arm without a chain of its own it is empty. What a scene's own proof loses is not told.
        """
        batch, (poses, branches) = self._branches(pose, gc)
        shape = (*batch, *((JOINTS,) if wanted is Wanted.JOINTS else ()))
        measure = np.zeros(shape).reshape(-1)
        if self.chain is None:
            codes, ends = np.zeros(measure.shape, dtype=np.int8), np.empty((0, 2), dtype=np.int8)
            return ArcSet._from_core(
                shape, (codes.astype(np.int64), np.empty((0, 2)), ends, ends, np.empty((0, 2)), codes)
            )
        handle = cast(NearHandle, self._handle)
        columns = handle.feasible_many(poses, branches, margin, wanted, measure, 1, None, left_out=True)
        return ArcSet._from_core(shape, columns)

    def _keeps_soft(
        self, pose: ArrayLike, gc: ArrayLike, scene: Scene | None, margin: float
    ) -> tuple[NDArray[np.int64] | None, Floats | None]:
        """Return numbers and ends of the arcs on which links keep a scene's soft clearance; None without."""
        if scene is None or scene.soft == 0.0:
            return None, None
        arcs = self._arcs(pose, gc, margin, 0.0, 0.0, Wanted.SOFT, (), 1, scene)
        return arcs._count, arcs._psi

    def reachable(
        self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1
    ) -> NDArray[np.bool_] | np.bool_:
        """Return whether any posture within the limits holds a pose: any branch, any arm angle.

        Exact, by closed form, in less than a microsecond a pose of a batch; which branches and how much of
        them is `freedom`, and why not is `explain`. Beside straight hinges, where closed forms run out of
        digits, and with locked joints, it is the answer of `solve`, and may take some milliseconds
        (docs: theory/feasible, isolated ψ); so it is of an arm with a chain of its own.

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
        bool, shape (...)

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> arm.reachable([pose([0.5, 0.0, 0.5]), pose([1.5, 0.0, 0.5])]).tolist()
        [True, False]
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        poses = as_poses("pose", pose, self._handle)
        if self.chain is not None:
            seed = np.clip(0.0, self.lower, self.upper)
            held = self.solve(poses, near=seed, singularity_margin=margin, threads=threads).ok
            return np.asarray(held)[()]
        out = np.empty(poses.shape[:-2], np.int64)
        self._handle.reachable_many(poses, margin, out, as_threads(threads))
        return out.astype(np.bool_)[()]

    def freedom(self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1) -> Freedom:
        """Return which branches hold a pose, and over how much of their circles.

        The numbers of `feasible_all` without its arcs: nine bytes a pose, for maps and statistics.

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
        Freedom
            ``gc``, ``total``, ``widest``, ``arcs``, ``status``, each of shape (...). Never raises on
            geometry.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError

        Source: Faria et al. (2018), Eqs. (2), (25).

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> has = arm.freedom(pose([0.4, 0.0, 0.5], rpy=[0.0, 3.0, 0.0]))
        >>> f"{has.gc:08b}", bool(has.total > has.widest > 0)
        ('11111111', True)
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        poses = as_poses("pose", pose, self._handle)
        batch = poses.shape[:-2]
        widths, codes = np.empty((*batch, 2)), np.empty((*batch, 3), np.int64)
        self._handle.freedom_many(poses, margin, widths, codes, as_threads(threads))
        gc, arcs = (codes[..., k].astype(np.uint8)[()] for k in (0, 1))
        status = codes[..., 2].astype(np.int8) if batch else STATUSES[int(codes[2])]
        return Freedom(gc, widths[..., 0][()], widths[..., 1][()], arcs, status)

    def freedom_gradient(
        self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1
    ) -> Floats:
        """Return how the total of `freedom` moves with the pose.

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
        ndarray, shape (..., 6)
            By the velocity of the tool's origin (rad/m) and by its angular velocity (rad/rad), in the frame
            that poses are given in: the ends of `feasible_derivative`, upper less lower, of all branches. 0
            where a pose is not held, or on whole circles alone; NaN where an end does not move smoothly.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError
        """
        margin = as_number("singularity_margin", singularity_margin, 0.0, MOST_MARGIN)
        poses = as_poses("pose", pose, self._handle)
        out = np.empty((*poses.shape[:-2], 6))
        self._handle.freedom_gradient_many(poses, margin, out, as_threads(threads))
        return out

    def feasible_yaw(self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1) -> ArcSet:
        """Return all turns about axis 1 of the base at which a pose can be held: exact arcs.

        A turn α stands for the pose turned by α about the axis of joint 1, which is the robot turned by -α
        under a pose that stays. Only joint 1 sees such a turn: it moves by α and the other joints stay. So
        the arcs follow from the feasible arm angles of the other joints, in closed form, for any tool.
        The intersection (``&``) of several poses' sets is where one turn serves them all.

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
        ArcSet, shape (...)
            Arcs of α, rad, from the pose given: ``0 in`` it where `reachable` is true. Ends name joint 1 and
            the limit it comes to. Empty, with the reason in ``status``, where the other joints allow nothing.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("openarm_v10")
        >>> turns = arm.feasible_yaw(pose([0.1, 0.3, 0.2]))
        >>> bool(0.0 < turns.measure < 2 * np.pi)
        True
        """
        return self._turns(pose, Turned.BASE, singularity_margin, threads)

    def feasible_roll(self, pose: ArrayLike, *, singularity_margin: float = 0.0, threads: int = 1) -> ArcSet:
        """Return all turns about axis 7 at which a pose can be held: exact arcs.

        A turn ρ stands for the pose turned by ρ about the axis of joint 7. For a tool whose working axis
        lies along that axis (drill, screwdriver, suction cup, welding torch along the flange) these are all
        rolls of the tool that the limits allow; for another tool a turn about axis 7 moves its tip.

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
        ArcSet, shape (...)
            Arcs of ρ, rad, from the pose given. Ends name joint 7 and the limit it comes to.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError
        """
        return self._turns(pose, Turned.TOOL, singularity_margin, threads)

    def _turns(self, pose: ArrayLike, turned: Turned, margin: float, threads: int) -> ArcSet:
        """Return the turns of each pose, of shape (...)."""
        margin = as_number("singularity_margin", margin, 0.0, MOST_MARGIN)
        poses = as_poses("pose", pose, self._handle)
        columns = self._handle.turns_many(np.ascontiguousarray(poses), turned, margin, as_threads(threads))
        return ArcSet._from_core(poses.shape[:-2], columns)

    @_names_keywords
    def solve(
        self,
        pose: ArrayLike,
        near: ArrayLike | None = None,
        *,
        metric: MetricName = "l2",
        weight: ArrayLike | None = None,
        prefer: Prefer = "near",
        gc: int | Iterable[int] | None = None,
        allowed: Allowed | None = None,
        scene: Scene | None = None,
        singularity_margin: float = 0.0,
        outside: Beyond = "refuse",
        length: float = 0.2,
        roll: Roll = "pose",
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> Solution:
        """Return the posture of a pose that is nearest to a seed, of all there are.

        All eight branches, all arm angles within the joint limits and all windings are compared, and no
        posture that the limits allow is nearer: pieces of the circle that hold no nearer one are excluded
        by bounds, not by sampling (docs: theory/nearest). Within 1e-5 rad of two or three of straight
        shoulder, elbow and wrist at once the arm angle has too few digits, and the search is local: one of a
        hundred such poses has a nearer posture, mostly by less than 0.001 rad. Beside singularities of an arm
        with a chain of its own it may not be proven: then the status is UNPROVEN, which is true, too. Not to
        be confused with `inverse`, which takes branch and arm angle, or with `step`, which keeps to the
        present branch and to a largest joint step.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m. One in float32 is taken to the reach, or to the limit of joint 4, where
            its rounding alone puts it beyond.
        near : array_like, shape (..., 7), optional
            The seed, rad. Without it the posture is that of `best`, and ``distance`` is NaN.
        metric : "l2" or "max"
            Distance: root of the weighted sum of squares of joint differences, or the largest of √weight
            times a difference. Of postures whose largest difference is the elbow's, which every arm angle
            shares, "max" takes the one whose other joints are nearest.
        weight : array_like, shape (7,) or scalar, optional
            Weights of the joints, >= 0, at least one positive; 1 by default.
        prefer : "near" or "margin"
            "margin": the largest least distance to a limit instead of the nearest, as `best`.
        gc : int or several of them, optional
            Global configurations that may be used; all by default. Where shoulder, elbow or wrist is exactly
            straight, two of them are one posture: each has it, whatever the seed.
        allowed : ArcSet or function (4, 4) -> ArcSet, optional
            Arcs of the user's own, intersected.
        scene : Scene, optional
            Obstacles that links keep clear of, as in `feasible`.
        singularity_margin : float
            As in `feasible`, rad.
        outside : "refuse" or "nearest"
            "nearest": where a pose has no posture, the posture of the nearest pose that the arm can take,
            ``found.pose``, ``found.gap`` away; ``status`` still says why the pose itself has none. It keeps
            the margin of singularities too, unless that leaves no posture at all (q is then NaN). A wrist
            out of reach is drawn towards the shoulder into what joint 4 reaches and the orientation kept: no
            posture of that orientation is nearer. Where limits forbid that too it is the least of
            ``sqrt(|dp|² + (length·angle)²)``, sought from many starts. Of all branches and arm angles, so not
            with `gc`, `allowed` or `scene`.
        length : float
            With "nearest": how many metres a radian counts as, m.
        roll : "pose" or "free"
            "free": the tool may turn about its own z axis, as a drill, a torch, a suction cup may; the pose
            taken is ``arm.forward(found.q)[0]``. Where that axis is axis 7 this is exact: no roll has a
            nearer posture, and there is none only where `feasible_roll` is empty. For any other tool, and an
            arm with a chain of its own, turns are sampled, each with its exact arcs: 72, 5° apart, and finer
            ones about the best; 720 where none of them has a posture, so that "none" is then of those.
            Not with ``outside="nearest"``.
        threads : int
            Threads for a batch; 0 for all cores.
        progress : function (done, total) or bool
            Told some times a second how many poses of a batch are done; True draws a bar on stderr.

        Returns
        -------
        Solution
            ``q (..., 7)``, ``psi``, ``gc``, ``distance``, ``status``, ``margin``, ``gap`` of shape (...),
            ``pose (..., 4, 4)``. Never raises on geometry: where there is no posture, ``status`` says why, q
            is NaN and gc is -1.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, ConfigurationError, InputError

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
        >>> found = arm.solve(arm.forward(q)[0], near=q)
        >>> found.q.tolist() == q, found.distance
        (True, 0.0)

        >>> far = arm.forward(q)[0].copy()
        >>> far[0, 3] += 2.0
        >>> beside = arm.solve(far, near=q, outside="nearest")
        >>> beside.status.name, round(beside.gap, 3)
        ('UNREACHABLE', 1.767)
        """
        plain = weight is None and gc is None and allowed is None and singularity_margin == 0.0
        plain = plain and isinstance(threads, int) and threads == 1 and progress is None
        plain = plain and scene is None and outside == "refuse" and isinstance(roll, str) and roll == "pose"
        if plain and prefer == "near" and near is not None and isinstance(metric, str) and metric in _METRICS:
            one = self._handle.solve_one(pose, near, _METRICS[metric], Solution, STATUSES)
            if one is not None:
                return cast(Solution, one)
        if self.chain is not None and outside == "nearest":
            raise unsupported("outside='nearest'")
        beyond = relaxing_length(outside, length, gc, allowed, scene)

        def ask(arm: Arm, poses: ArrayLike, seeds: ArrayLike | None, weights: ArrayLike | None) -> Solution:
            return Question(
                arm,
                poses,
                seeds,
                metric,
                weights,
                prefer,
                gc,
                allowed,
                scene,
                singularity_margin,
                threads,
                beyond,
                progress,
            ).solve()

        if chosen("roll", roll, ROLLS) == "pose":
            return ask(self, pose, near, weight)
        if beyond:
            raise InputError("roll is 'free', which does not go with outside='nearest': that keeps a roll")
        check_free_roll(self, scene)
        by_margin = near is None or chosen("prefer", prefer, PREFER) == "margin"
        kind = chosen("metric", metric, _METRICS)
        return solve_free(self, pose, near, weights_of(weight), by_margin, kind, ask)

    @_names_keywords
    def solutions(
        self,
        pose: ArrayLike,
        near: ArrayLike | None = None,
        *,
        metric: MetricName = "l2",
        weight: ArrayLike | None = None,
        prefer: Prefer = "near",
        gc: int | Iterable[int] | None = None,
        allowed: Allowed | None = None,
        scene: Scene | None = None,
        singularity_margin: float = 0.0,
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> Solutions:
        """Return one posture for each branch and arc of a pose: the nearest there, by rising distance.

        The first is what `solve` returns. Two postures of one arc can be joined without moving the tool and
        without leaving the limits; two of different arcs cannot. Without a seed the posture of each is that
        of the largest least margin.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        near : array_like, shape (..., 7), optional
            The seed, rad.
        weight : array_like, shape (7,) or scalar, optional
            Weights of the joints.
        metric, prefer, gc, allowed, scene, singularity_margin, threads, progress
            As in `solve`.

        Returns
        -------
        Solutions
            Of one pose a sequence of `Solution`; of a batch arrays (..., k), k the largest count, padded
            with NaN. Behind the first, equally far ones stand by branch, then by arc from -π up.

        Raises
        ------
        As `solve`.

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
        >>> [(found.gc, round(found.distance, 2)) for found in arm.solutions(arm.forward(q)[0], near=q)][:2]
        [(2, 0.0), (0, 2.95)]
        """
        asked = Question(
            self,
            pose,
            near,
            metric,
            weight,
            prefer,
            gc,
            allowed,
            scene,
            singularity_margin,
            threads,
            progress=progress,
        )
        return asked.solutions()

    @_names_keywords
    def best(
        self,
        pose: ArrayLike,
        *,
        gc: int | Iterable[int] | None = None,
        allowed: Allowed | None = None,
        scene: Scene | None = None,
        singularity_margin: float = 0.0,
        threads: int = 1,
        progress: Progress | bool | None = None,
    ) -> Solution:
        """Return the posture of a pose that keeps the largest least distance from the joint limits.

        Of all branches, arm angles and windings; as sure as `solve`. A joint with one limit alone is turned
        so far from it that another decides; without any limit a joint does not count.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc, allowed, scene, singularity_margin, threads, progress
            As in `solve`.

        Returns
        -------
        Solution
            ``distance`` is NaN: there is no seed.

        Raises
        ------
        As `solve`.

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> pose = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
        >>> round(float(np.degrees(arm.best(pose).margin)), 1)
        51.2
        """
        asked = Question(
            self,
            pose,
            None,
            "l2",
            None,
            "margin",
            gc,
            allowed,
            scene,
            singularity_margin,
            threads,
            progress=progress,
        )
        return asked.solve()

    def best_gradient(
        self, pose: ArrayLike, *, gc: int | Iterable[int] | None = None, threads: int = 1
    ) -> Floats:
        """Return how the margin of `best` moves with the pose.

        At the best posture a joint is nearest to a limit whose distance psi cannot make larger, or two joints
        are as near and psi moves them opposite ways; the gradient is theirs, psi following. The margin has a
        kink where two branches or arm angles are as good, or a third joint comes as near: there the gradient
        is that of one side, which a step may leave for the other.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : int or iterable of int, optional
            As in `solve`.
        threads : int
            Threads for a batch; 0 for all cores.

        Returns
        -------
        ndarray, shape (..., 6)
            By the velocity of the tool's origin (rad/m) and by its angular velocity (rad/rad), in the frame
            that poses are given in. NaN where the pose is not held, or a joint that decides has no
            derivative (`inverse_derivative`); and where the best posture has θ2 or θ6 at 0 or π, unless joint
            4 alone decides: two joints share a turn there as at no pose near by, so that the margin leaps.

        Raises
        ------
        As `best`.

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> pose = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
        >>> slope, higher = arm.best_gradient(pose), pose.copy()
        >>> higher[2, 3] += 1e-6
        >>> gained = arm.best(higher).margin - arm.best(pose).margin
        >>> bool(abs(gained - 1e-6 * slope[2]) < 1e-10)
        True
        """
        gradient_many = self._handle.best_gradient_many
        best = self.best(pose, gc=gc, threads=threads)
        poses = as_poses("pose", pose, self._handle)
        out = np.empty((*poses.shape[:-2], 6))
        given = poses, np.asarray(best.q), np.asarray(best.psi), np.asarray(best.gc, dtype=np.int64)
        gradient_many(*given, out, as_threads(threads))
        return out

    def explain(
        self, pose: ArrayLike, *, scene: Scene | None = None, singularity_margin: float = 0.0
    ) -> Diagnosis:
        """Return for each global configuration whether a pose can be held within all limits, and if not, why.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m.
        scene : Scene, optional
            Obstacles, as in `feasible`: a branch that the limits leave open and they do not names the pair
            that is nearest where it fails by least, and by how much.
        singularity_margin : float
            As in `feasible`, rad.

        Returns
        -------
        Diagnosis
            ``branches[k]`` is that of GC k; ``explain()`` says it in words. Of a pose beyond all limits
            ``instead`` is what ``solve(pose, outside="nearest")`` finds.

        Raises
        ------
        ShapeError, NotFiniteError, NotRotationError, InputError

        Examples
        --------
        >>> import armangle as aa
        >>> far = np.eye(4)
        >>> far[0, 3] = 2.0
        >>> round(aa.Arm.from_catalogue("kuka_iiwa7_r800").explain(far)[0].excess, 4)
        1.2536
        """
        frame = one_pose("pose", pose, self._handle)
        margin = as_number("singularity_margin (rad)", singularity_margin, 0.0, MOST_MARGIN)
        segment = np.empty((1, _core.SEGMENT_WIDTH))
        _core.path_waypoints(frame[None], np.zeros(1), segment)
        branches = tuple(map(branch_of, self._handle.explain_pose(segment, margin)))
        within = any(branch.ok for branch in branches)  # the limits; a scene may block it nevertheless
        if scene is not None:
            branches = tuple(
                replace(self._meets(branch, frame, scene, margin), scene=True) for branch in branches
            )
        nearest = np.empty((4, 4))
        gap = self._handle.nearest_pose(frame, nearest)
        found = Diagnosis(branches, path=False, nearest=nearest, nearest_gap=gap)
        return found if within else self._with_instead(found, frame, margin)

    def _with_instead(self, found: Diagnosis, pose: Floats, margin: float) -> Diagnosis:
        """Return the finding about a pose that no branch holds, with the nearest that the arm can take."""
        instead = self.solve(pose, singularity_margin=margin, outside="nearest")
        if not np.isfinite(instead.q).all():
            return found
        off = instead.pose - pose
        moved, turned = float(np.linalg.norm(off[:3, 3])), float(rotation_angle(off))
        return replace(found, instead=instead, instead_moved=moved, instead_turned=turned)

    def _meets(self, branch: Branch, pose: Floats, scene: Scene, margin: float) -> Branch:
        """Return a branch's finding, or that obstacles leave nothing of what its limits leave."""
        if not branch.ok:
            return branch
        found = self.widest(pose, branch.gc, scene, singularity_margin=margin)
        if found.arcs.count:
            return branch
        near = found.nearest
        if found.arcs.status == Status.POSE_BLOCKED or np.isnan(found.psi):
            pair = found.arcs.blocking
            return replace(branch, verdict=Verdict.IMPOSSIBLE, status=found.arcs.status, touching=pair)
        return replace(
            branch,
            verdict=Verdict.IMPOSSIBLE,
            status=Status.CLEARANCE,
            touching=(str(near.obstacle), str(near.link)),
            short=float(scene.clearance - near.distance),
        )

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
        frame = one_pose("pose", pose, self._handle)
        index = as_gc(gc)
        if index.ndim or not 0 <= index < CONFIGURATIONS:
            raise ConfigurationError(f"gc is {gc!r}, wanted an integer from 0 to 7")
        if isinstance(joint, bool) or not isinstance(joint, (int, np.integer)) or not 1 <= joint <= JOINTS:
            raise InputError(f"joint is {joint!r}, wanted an integer from 1 to 7")
        found = self._handle.joint_function(frame, int(index), int(joint) - 1)
        return JointFunction(found, (self, frame, int(index)), int(joint))


def _rebuilt(arguments: dict[str, Any]) -> Arm:
    return Arm(**arguments)


def _source_text(value: Any) -> str:
    """Return a number, name or array as Python source; infinities as float('inf')."""
    if not isinstance(value, np.ndarray):
        return repr(value)
    return (
        repr(value.tolist())
        .replace("-inf", "-float('inf')")
        .replace(" inf", " float('inf')")
        .replace("[inf", "[float('inf')")
    )


# -- the checks of the numbers -----------------------------------------------------------------------


def _checked(given: dict[str, Any]) -> dict[str, Any]:
    """Return all numbers of an arm, arrays read-only; those not given, or given as None, by default."""
    values = _complete(given)
    for name in (*LENGTHS, *ELBOW_OFFSETS):
        low = 0.0 if name in ("d_se", "d_ew") else -_core.LENGTH_LIMIT
        values[name] = as_number(f"{name} (m)", values[name], low, _core.LENGTH_LIMIT)
    _check_link("upper arm", "d_se", "a_3", values)
    _check_link("forearm", "d_ew", "a_4", values)
    for name in JOINT_ROWS:
        values[name] = _seven(name, values[name], infinite=name not in ("signs", "offsets"))
    for name in FRAMES:
        values[name] = as_transform(name, values[name])
    values["reference"] = _checked_reference(values["reference"])
    values["chain"] = _checked_chain(values["chain"])
    values["joint_names"] = _checked_names(values["name"], values["joint_names"])
    if not isinstance(values["body"], Body | None):
        raise SceneError(
            "arm", "body", values["body"], "an armangle.Body, as Body({3: [Ball(...)]}), or None"
        )
    values["hand"] = as_shapes("hand", values["hand"], HOLDABLE)
    _check_rows(values)
    notes = (values["notes"],) if isinstance(values["notes"], str) else tuple(values["notes"])
    of_units = {
        LIKE_DEGREES: degrees_notes(values["joint_names"], values["lower"], values["upper"]),
        LIKE_MILLIMETRES: millimetre_notes({name: values[name] for name in (*LENGTHS, *ELBOW_OFFSETS)}),
    }
    for what, found in of_units.items():
        kept = tuple(note for note in notes if not note.startswith(what))
        if found and len(kept) == len(notes):  # a copy of an arm that was warned of is not again
            warnings.warn(found[0], UserWarning, stacklevel=4)
        notes = (*kept, *found)
    values["notes"] = notes
    values["signs"] = frozen(values["signs"].astype(np.int64))
    return values


def _complete(given: dict[str, Any]) -> dict[str, Any]:
    """Return a value for each field, or raise what Python says where a keyword is wrong or missing."""
    for name in given:
        if name not in Arm.__slots__:
            raise TypeError(f"Arm() got an unexpected keyword argument {name!r}")
    missing = [f.name for f in _FIELDS if _default(f) is MISSING and f.name not in given]
    if missing and given.get("chain") is not None:
        raise InputError(
            f"a chain needs the S-R-S arm beside it, which lends psi and gc, and {', '.join(missing)} are "
            "not given: arm.with_(chain=...) of the data sheet's arm, or Arm.from_urdf(..., exact=False), "
            "which fits one"
        )
    if missing:
        arguments = f"argument{'s' * (len(missing) > 1)}: {', '.join(map(repr, missing))}"
        raise TypeError(f"Arm() missing {len(missing)} required keyword-only {arguments}")
    default = {f.name: _default(f) for f in _FIELDS}
    return default | {n: value for n, value in given.items() if value is not None or n not in _OPTIONAL}


def _given_frame(changes: ArmArguments, name: str, kept: Floats) -> ArrayLike:
    """Return a frame as it is changed: None stands for none."""
    if name not in changes:
        return kept
    given = cast(ArrayLike | None, changes.get(name))
    return np.eye(4) if given is None else given


def _checked_chain(value: ArrayLike | None) -> Floats | None:
    """Return eight rigid transforms, read-only, or None."""
    if value is None:
        return None
    links = as_floats("chain", value, (JOINTS + 1, 4, 4))
    if links.ndim != 3:
        raise ShapeError(f"chain has shape {links.shape}, wanted {(JOINTS + 1, 4, 4)}")
    return frozen(np.array([as_transform(f"chain[{k}]", link) for k, link in enumerate(links)]))


def _check_link(what: str, along: str, across: str, values: dict[str, Any]) -> None:
    """Raise where the upper arm or forearm, slanted by its elbow offset, has no length."""
    length = math.hypot(values[along], values[across])
    if length < LEAST_LINK:
        raise InputError(
            f"{along} (m) is {values[along]:g} and {across} is {values[across]:g}: "
            f"the {what} is {length:g} m long, wanted at least {LEAST_LINK:g}"
        )


def _seven(name: str, value: ArrayLike, *, infinite: bool) -> Floats:
    array = (one_or_seven(name, value) if name in _ONE_FOR_ALL else as_floats(name, value, (JOINTS,))).copy()
    if array.shape != (JOINTS,):
        raise ShapeError(f"{name} has shape {array.shape}, wanted ({JOINTS},)")
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if bad.any():
        at = int(np.argmax(bad))
        wanted = "real" if infinite else "finite"
        raise NotFiniteError(f"{name}[{at}] is {array[at]}, wanted a {wanted} number")
    return frozen(array)


def _checked_names(name: str, joint_names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the joints, seven different ones."""
    if not isinstance(name, str):
        raise InputError(f"name is {name!r}, wanted a string")
    names = tuple(joint_names)
    if len(names) != JOINTS or len({*names}) != JOINTS or not all(isinstance(n, str) for n in names):
        raise InputError(f"joint_names is {joint_names!r}, wanted {JOINTS} different strings")
    return names


def _checked_reference(reference: Reference) -> str | tuple[float, ...]:
    """Return a word, or a vector as a tuple."""
    if isinstance(reference, str):
        return chosen("reference", reference, _REFERENCES)
    vector = as_floats("reference", reference, (3,))
    if vector.ndim != 1:
        raise ShapeError(f"reference has shape {vector.shape}, wanted (3,)")
    if not np.isfinite(vector).all():
        raise NotFiniteError(f"reference is {vector.tolist()}, wanted finite numbers")
    if not (vector != 0).any():
        raise InputError("reference is zero, wanted a direction")
    return tuple((vector / np.abs(vector).max()).tolist())


def _core_reference(reference: str | tuple[float, ...]) -> tuple[_core.Reference, Floats]:
    if isinstance(reference, str):
        return _REFERENCES[reference], np.array([0.0, 0.0, 1.0])
    return _core.Reference.VECTOR, np.array(reference)


def _check_rows(values: dict[str, Any]) -> None:
    """Raise where the seven signs, limits or bounds contradict each other."""
    sign = values["signs"]
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
    for name in BOUNDS:
        if not (values[name] > 0).all():
            at = int(np.argmax(~(values[name] > 0)))
            raise LimitError(f"{name}[{at}] is {values[name][at]:g}, wanted a positive number")
