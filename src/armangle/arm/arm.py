"""The arm: its numbers and their origin, its kinematics, and its feasible configurations."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Never, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import (
    CONFIGURATIONS,
    JOINTS,
    MILLIMETRES,
    BoolOrArray,
    FloatOrArray,
    Floats,
    IntOrArray,
    PathLike,
    Shape,
    as_flag,
    as_floats,
    as_gc,
    as_number,
    as_poses,
    broadcast,
    check_source,
    chosen,
    hint_degrees,
    one_pose,
    output,
)
from .._core import Turned, Wanted
from .._progress import Progress, as_progress, progressing
from .._threads import thread_count
from .._values import fill
from ..errors import InputError, ModelError
from ..models.axes import MAX_ANGLE, MAX_LENGTH, NEAR_ANGLE, NEAR_LENGTH, Axes, rotation_angle
from ..models.body import Body
from ..models.catalogue import catalogue, is_file_or_text, load_robot
from ..models.chain import Chain
from ..models.description import (
    ELBOW_OFFSETS,
    END_OFFSETS,
    FRAMES,
    LENGTHS,
    ArmDescription,
    ImportReport,
)
from ..models.detect import describe_chain, nearness
from ..models.mjcf import MjcfModel, is_mjcf
from ..models.one_offset import describe_near_offset, describe_offset_chain
from ..models.report import warn_of
from ..models.urdf import Source, UrdfModel, write_urdf
from ..poses import as_transform, nearest_rotation
from ..scenes.clearance import Clearance, Widest, clearance_of
from ..scenes.ready import Ready, make_ready
from ..scenes.scene import Scene
from ..scenes.shapes import Shape as SceneShape
from ..status import STATUSES, Status
from .allowed import Allowed
from .arcs import ArcSet
from .chain import ChainHandle, check_chain, check_kept_chain, leaves_out, moved_ends
from .deviation import ChainDeviation
from .diagnosis import Branch, Diagnosis, Verdict, branch_of
from .freedom import Freedom
from .frozen_value import FrozenValue
from .geometry import DERIVED, GEOMETRY, Geometry
from .interval_diagnosis import branches_by_intervals
from .keywords import names_keywords
from .numbers import FIELDS, ArmArguments, checked, checked_chain, core_reference, default_of, signature
from .question import METRICS as _METRICS
from .question import (
    PREFER,
    Fallback,
    MetricName,
    Prefer,
    Question,
    relaxing_length,
    weights_of,
    widest_solution,
)
from .roll import ROLLS, Roll, check_free_roll, solve_free
from .solution import Solution, Solutions
from .wish import Direction, as_wish

__all__ = ["MOST_MARGIN", "Arm", "nearest_rotation"]

OnError = Literal["raise", "nan"]
Fit = Literal["own", "srs"]

MOST_MARGIN: float = _core.MOST_MARGIN
ON_ERROR = ("raise", "nan")
_FITS = ("own", "srs")
_TURNED = {"base": Turned.BASE, "tool": Turned.TOOL}
_GC_ORDER = np.arange(CONFIGURATIONS, dtype=np.int64)
_KEYWORDS = {
    "psi": "inverse(pose, psi, gc) does; allowed=ArcSet([(psi, psi)]) keeps the search to one",
    **dict.fromkeys(("near", "q0", "q_init", "start"), "seed= is the word"),
    "on_error": "it never raises on geometry: status says why, q is NaN, and raise_for_status() raises",
    "limits": "it always keeps them; inverse(pose, psi, gc) takes limits=",
    "roll": "solve(pose, roll='free', prefer='margin') does",
    **dict.fromkeys(("fallback", "length"), "solve(pose, seed, fallback='nearest_pose') does"),
    **dict.fromkeys(("scene", "singularity_margin"), "arm.with_({name}=...) is an arm that keeps it"),
    "threads": "armangle.set_threads(n) is for all calls",
    "elbow": "psi_towards(pose, gc, point) says which psi brings it there, the policy Towards leads it",
}
names_keywords_of_arm = names_keywords("Arm", _KEYWORDS)
_NEAREST = (
    "solve(pose, seed=q) finds the nearest solution of all, solutions(pose, seed=q) one for each interval"
)
_ELSEWHERE = {
    **dict.fromkeys(("ik", "inverse_kinematics", "nearest", "closest", "ikine", "ik_LM"), _NEAREST),
    **dict.fromkeys(("fk", "forward_kinematics", "fkine"), "forward(q) gives pose, psi and gc"),
    **dict.fromkeys(("null_space", "nullspace"), "self_motion(pose, psi, gc) is its direction, dq/dpsi"),
    **dict.fromkeys(("jacob0", "jac"), "jacobian(q), (..., 6, 7)"),
    **dict.fromkeys(("step", "follow", "plan"), "it is a function: armangle.{name}(arm, ...)"),
    "limits": "lower and upper, (7,) each",
}
"""Replacements for names that other libraries have, or that are elsewhere."""
_KEPT = ("report", "scene", "singularity_margin")  # fields besides the numbers of the description
_OWN = tuple(field.name for field in FIELDS if field.name not in GEOMETRY)


class Arm(FrozenValue):
    """A 7-axis arm with one redundant joint: S-R-S, nearly S-R-S, or with an offset wrist or shoulder.

    The pose of the end effector is ``base @ DH(theta) @ tool`` with ``theta_i = signs_i q_i + offsets_i``.
    The DH rows are the classic ones of the paper's Table 1, plus the elbow's offsets a_3, a_4, d_4. All
    public functions use q, the robot's own joint coordinates. Values are frozen.

    Parameters
    ----------
    d_bs, d_se, d_ew, d_wf : float
        Base to shoulder, shoulder to elbow, elbow to wrist, wrist to flange, m. d_se and d_ew may be 0 with
        an elbow offset; the links are then hypot(d_se, a_3) and hypot(d_ew, a_4) long, at least 1e-6.
    lower, upper : float or array_like, shape (7,), optional
        Joint limits in q, rad, lower <= upper, or one for all joints. They may be beyond ±π, of one sign,
        wider than a turn, or infinite (the default).
    a_3, a_4 : float
        Lateral elbow offsets of links 3 and 4, m.
    a_1, a_6 : float
        Offset between the axes of joints 1 and 2 (PR2, Fetch), or of joints 6 and 7 (Franka, xArm 7), m; at
        most one of them. Such an arm has no arm angle: psi is then the value of joint 1, or 7 (`redundancy`).
        gc has bit 1 if theta_2 < 0 (a_1: theta_6), 2 if theta_4 is below that of the stretched arm, 4 if
        cos(theta_5) < 0 (theta_3).
    d_4 : float
        Gap along axis 4 from the upper arm to the forearm, m (Kinova MOVO).
    signs : array_like of +1 or -1, shape (7,), optional
        Directions of the joints.
    offsets : array_like, shape (7,), optional
        Zero offsets, rad.
    base, tool : array_like, shape (4, 4), optional
        Frame of the DH base in the frame that poses are given in; frame of the tool in the flange. Their
        rotations are replaced by the nearest exact ones.
    velocity, acceleration : float or array_like, shape (7,), optional
        Largest joint velocities (rad/s) and accelerations (rad/s²), > 0, or one for all joints; infinite by
        default.
    name : str
        Name of the arm.
    reference : "base", "stereographic" or array_like, shape (3,)
        Zero of the arm angle. "base": psi is 0 if the elbow lies in the plane of the wrist and the axis of
        joint 1, as in the paper; it jumps by half a turn if the wrist passes that axis. A vector, of any
        length, in the frame that poses are given in: the same with this vector as the axis. "stereographic":
        the plane of "base" for a wrist straight above the shoulder, carried to the wrist's direction by the
        shortest rotation; singular only if the wrist is straight below the shoulder. The solutions are the
        same; the two arm angles differ by an angle that depends on the pose. Source: Elias and Wen (2024).
    chain : array_like, shape (8, 4, 4), optional
        The arm's own chain if it is only nearly S-R-S, for example from a calibration. The pose of the end
        effector is ``chain[0] Rz(q_1) chain[1] ... Rz(q_7) chain[7]``. The other numbers are then those of
        the nominal arm, which defines psi and gc; poses, joints and limits are the chain's. See
        `armangle.dh_chain` and `deviation`.
    body : Body or "guessed", optional
        Collision model of the links, such as ``Body.bones(upper_arm=0.09, forearm=0.08)``. "guessed" gives
        any arm a first model: bones and plates with a radius of 0.24 times the mean of `d_se` and `d_ew`. It
        is not measured, so its ``trusted`` is False and its ``notes`` say so.
    hand : sequence of Ball, Capsule, Box or Hull
        Geometry fixed to the tool, in its frame: a gripper and its payload. Shapes without a name are called
        "hand".
    scene : Scene, optional
        Obstacles that every query, step, plan and tracker of this arm avoids; needs `body` or `hand`.
    singularity_margin : float
        Margin to singularities for every query, step and plan, and a wish for a tracker: |sin θ2|, |sin θ6|,
        |sin(θ4 - δ)| >= sin(margin); rad, in [0, 1.5]. An offset wrist has none for θ6, an offset shoulder
        none for θ2: if its free joint is held, the other six are singular where the two remaining sines are
        0, and at folds, which end an interval and keep no margin (at a fold one value of θ6 makes all seven
        singular). An arm on its own chain with an offset has no margin.
    joint_names : sequence of 7 str, optional
        Names of the joints, as files have them.
    notes : str or sequence of str, optional
        Notes about the origin of the numbers.

    Attributes
    ----------
    geometry : Geometry
        Lengths, signs, offsets, reference, chain, names of the joints and notes, as given, and the reach.
    report : ImportReport or None
        Findings in the file from which the arm was read; None for an arm made otherwise.

    Raises
    ------
    InputError, LimitError
        With the argument, the index, the value and the permitted range.

    Source: Faria et al. (2018), Table 1 and Eq. (1).

    Examples
    --------
    >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    >>> pose, psi, gc = arm.forward([0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7])
    >>> arm.inverse(pose, psi, gc).round(12).tolist()
    [0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7]
    """

    __slots__ = (*_OWN, "geometry", *_KEPT, "_handle", "_ready", "_apart")
    __signature__ = signature()  # the keywords that __init__ checks by the list of fields

    geometry: Geometry
    lower: Floats
    upper: Floats
    base: Floats
    tool: Floats
    velocity: Floats
    acceleration: Floats
    name: str
    body: Body | None
    hand: tuple[SceneShape, ...]
    report: ImportReport | None
    scene: Scene | None
    singularity_margin: float
    _handle: _core.Arm
    _ready: Ready | None  # the scene, prepared
    _apart: Floats | None  # lower bounds of the distances of own links, once a scene was prepared
    _described: ClassVar[type[ArmDescription]] = ArmDescription

    if not TYPE_CHECKING:  # a type checker should know the existing attributes

        def __getattr__(self, name: str) -> Never:
            """Raise an error that gives armangle's name for another library's name."""
            told = f"'Arm' object has no attribute {name!r}"
            if name in _ELSEWHERE:
                told += f": {_ELSEWHERE[name].format(name=name)}"
            elif name in GEOMETRY:
                told += f": arm.geometry.{name}"
            raise AttributeError(told, name=name, obj=self)

    def __new__(cls, *_: Never, **numbers: Any) -> Arm:
        """Return an arm of the kind that its numbers determine."""
        given = [numbers.get(name, 0.0) for name in ("a_1", "a_6")]
        plain = all(isinstance(x, (int, float)) and x == 0 for x in given)
        kind = KINDS[numbers.get("chain") is not None]
        return cast(Arm, object.__new__(cls if plain or cls is not Arm else kind))

    def __init__(self, *unnamed: Never, **numbers: Unpack[ArmArguments]) -> None:
        """Check the numbers and create the core's arm; all arguments are keywords."""
        if unnamed:
            raise TypeError(
                f"Arm takes keywords alone, but {len(unnamed)} values came without: "
                "wanted Arm(d_bs=..., d_se=..., d_ew=..., d_wf=..., ...)"
            )
        given: dict[str, Any] = dict(numbers)
        report, scene = given.pop("report", None), given.pop("scene", None)
        for name in ("a_1", "a_6"):  # otherwise `__new__` creates another kind
            as_number(f"{name} (m)", given.pop(name, 0.0), 0.0, 0.0)
        margin = as_number("singularity_margin (rad)", given.pop("singularity_margin", 0.0), 0.0, MOST_MARGIN)
        values = checked(given)
        lengths = np.array([values[name] for name in (*LENGTHS, *ELBOW_OFFSETS)])
        joints = np.concatenate([values[name] for name in ("signs", "offsets", "lower", "upper")])
        kind, vector = core_reference(values["reference"])
        given_to_core = lengths, joints, values["base"], values["tool"], kind, vector
        if values["chain"] is None:
            handle = _core.Arm(*given_to_core)
        else:
            near = ChainHandle(*given_to_core, values["chain"])
            check_chain(values["name"], near)
            handle = cast(_core.Arm, near)
        geometry = Geometry(
            **{n: value for n, value in values.items() if n in GEOMETRY},
            **cast(dict[str, Any], {n: float(getattr(handle, n)) for n in DERIVED}),
        )
        own = {n: value for n, value in values.items() if n not in GEOMETRY}
        kept = {"geometry": geometry, "report": report, "scene": scene, "singularity_margin": margin}
        fill(self, **{**own, **kept, "_handle": handle, "_ready": None, "_apart": None})
        if scene is not None:
            fill(self, _ready=self._prepared(scene))

    # -- origin -------------------------------------------------------------------------------------------

    @classmethod
    def load(cls, source: Source, base: str | None = None, tip: str | None = None) -> Arm:
        """Return an arm by its name, from a robot's file, or from a model of another library.

        The arm keeps the source's own kinematics: exactly S-R-S, with an offset wrist or shoulder, or its own
        chain if it is only nearly S-R-S. `kind` names it, and `report` has the findings in the file.

        Parameters
        ----------
        source : str, path, bytes or object
            A name of ``armangle.catalogue()``; a URDF or MJCF file, or its XML text; or an object with
            ``to_xml()`` or ``write_xml_string()``, such as mujoco's MjSpec or yourdfpy's URDF.
        base, tip : str, optional
            Names of the two links or bodies of a file; may be omitted if the file leaves one choice.

        Returns
        -------
        Arm

        Raises
        ------
        InputError
            If the catalogue has no such name; the message lists similar ones.
        ModelError
            If the file cannot be read as an arm of seven rotating joints that armangle solves.
        MissingExtraError
            If MJCF is given and the package ``mujoco`` is not installed.

        Examples
        --------
        >>> from armangle import Arm
        >>> Arm.load("kuka_iiwa7_r800").kind, Arm.load("franka_fr3").kind
        ('srs', 'offset_wrist')
        """
        for method in ("to_xml", "write_xml_string"):
            text = getattr(source, method, None)
            if callable(text):
                source = text()
        check_source(source, bytes)
        if isinstance(source, str) and base is tip is None and not is_file_or_text(source):
            return cls.from_catalogue(source)
        if not is_mjcf(source):
            return cls.from_urdf(source, base, tip)
        return cls.from_mjcf(source.decode() if isinstance(source, bytes) else source, base, tip)

    @classmethod
    def from_catalogue(cls, name: str) -> Arm:
        """Return an arm of the catalogue.

        Parameters
        ----------
        name : str
            One of ``armangle.catalogue()``, such as "kuka_iiwa7_r800" or "franka_fr3".

        Returns
        -------
        Arm

        Raises
        ------
        InputError
            If the catalogue has no such name; the message lists similar names.
        """
        return cls._from_description(load_robot(name).description)

    @classmethod
    def from_urdf(
        cls,
        source: Source,
        base: str | None = None,
        tip: str | None = None,
        *,
        fit: Fit = "own",
        angle_tolerance: float | None = None,
        length_tolerance: float | None = None,
        continuous_limits: str = "ignore",
    ) -> Arm:
        """Return the arm between two links of a URDF, in that file's own joint coordinates and frames.

        Parameters
        ----------
        source : path or str or bytes
            A URDF file, or its XML text.
        base, tip : str, optional
            Names of the two links. They may be omitted if the file leaves one choice of seven rotating
            joints, or one that armangle solves.
        fit : "own" or "srs"
            "own": the arm has the file's own kinematics. If its axes are exactly those of an S-R-S arm, or
            of one with an offset wrist or shoulder, the closed form is exact. Otherwise its own chain is
            kept, up to 50 mm and 2 degrees from S-R-S or from an arm with one such offset: poses and joints
            are then the file's to rounding, and psi and gc are those of that arm (`deviation.nominal`).
            "srs": the S-R-S arm fitted to the file, whose tip is off by what a warning and ``report`` say.
        angle_tolerance, length_tolerance : float, optional
            With "own": how far from S-R-S an own chain may be, if more than 2 degrees and 50 mm. If it is
            farther: how far an arm with an offset wrist or shoulder may be from the file; a warning reports
            it. With "srs": how far the axes may be from S-R-S, 0.1 rad and 100 mm by default. Rad, m.
        continuous_limits : {"ignore", "use"}
            How to treat limits of a continuous joint, which URDF forbids but some files contain. If they are
            ignored, a warning and a note of ``report`` say so.

        Returns
        -------
        Arm

        Raises
        ------
        ModelError
            If the file cannot be read as a chain of seven rotating joints, or the arm is of none of these
            kinds; the message names the axes, the point that they miss, and the distance.
        """
        model, limits = UrdfModel(source), continuous_limits
        return cls._of_file(
            lambda offset: model.chain(base, tip, continuous_limits=limits, offset=offset),
            fit, angle_tolerance, length_tolerance,
        )  # fmt: skip

    @classmethod
    def from_mjcf(
        cls,
        source: PathLike,
        base: str | None = None,
        tip: str | None = None,
        *,
        fit: Fit = "own",
        angle_tolerance: float | None = None,
        length_tolerance: float | None = None,
    ) -> Arm:
        """Return the arm between two bodies of a MuJoCo model; needs the extra ``mujoco``.

        Parameters
        ----------
        source : path or str
            An MJCF file, or its XML text.
        base, tip : str, optional
            Names of two bodies, or of a site as the end effector; optional if the file leaves one choice.
        fit, angle_tolerance, length_tolerance
            As in `from_urdf`.

        Returns
        -------
        Arm

        Raises
        ------
        MissingExtraError
            If the package ``mujoco`` is not installed.
        ModelError
            As `from_urdf`.
        """
        model = MjcfModel(source)
        return cls._of_file(
            lambda offset: model.chain(base, tip, offset=offset), fit, angle_tolerance, length_tolerance
        )

    @classmethod
    def _of_file(
        cls, read: Callable[[bool], Chain], fit: Fit, angle: float | None, length: float | None
    ) -> Arm:
        """Return the arm of the file that `read` reads: the first kind of arm that fits within the
        tolerances.

        The argument of `read`: whether base and tip are guessed for an offset wrist or shoulder.
        """

        def srs(chain: Chain, **options: Any) -> Arm:
            """Return the S-R-S arm of a chain, after a warning for each important note about it."""
            found, report = describe_chain(chain, **options)
            warn_of(report.notes)
            return cls._from_description(found, report)

        idealised, read = chosen("fit", fit, _FITS) == "srs", cache(read)
        most = (MAX_ANGLE, MAX_LENGTH) if idealised else (None, None)
        given: dict[str, Any] = {
            name: value if value is not None else default
            for name, value, default in zip(("angle", "length"), (angle, length), most, strict=True)
            if value is not None or default is not None
        }
        try:
            chain = read(False)
        except ModelError:  # the chain may contain an arm with an offset
            arm = None if idealised else cls._of_offset(read, given) or cls._of_offset_chain(read)
            if arm is None:
                raise
            return arm
        if idealised:
            return srs(chain, **given)
        found = nearness(Axes(*chain.lines()))
        if found.srs:
            return srs(chain)
        return (
            cls._of_offset(read, {}, least=NEAR_LENGTH)
            or (found.near and srs(chain, **given, exact=False))
            or (given and cls._of_offset(read, given))
            or cls._of_offset_chain(read)
            or srs(chain, **given, exact=not given)
        )

    @classmethod
    def _of_offset(
        cls, read: Callable[[bool], Chain], given: dict[str, float], least: float = 0.0
    ) -> Arm | None:
        """Return the arm of a file if it has an offset above `least` (m), else None; `given`: tolerances."""
        try:
            found, report = describe_offset_chain(read(True), **given)
        except ModelError:
            return None
        if max(abs(found.a_1), abs(found.a_6)) <= least:
            return None
        warn_of(report.notes)
        return cls._from_description(found, report)

    @classmethod
    def _of_offset_chain(cls, read: Callable[[bool], Chain]) -> Arm | None:
        """Return the arm of a file on its own chain if it nearly is one with an offset, else None."""
        try:
            found, report = describe_near_offset(read(True))
            arm = cls._from_description(found, report)
        except (ModelError, InputError):  # InputError: a link is too far off
            return None
        off = np.array(cast(ChainHandle, arm._handle).deviations)
        return arm if (off <= (NEAR_LENGTH, NEAR_ANGLE)).all() else None

    @classmethod
    def _from_description(cls, description: ArmDescription, report: ImportReport | None = None) -> Arm:
        """Return the arm with the numbers of a description."""
        numbers = {field.name: getattr(description, field.name) for field in fields(description)}
        return cls(**numbers, report=report)

    def to_urdf(self) -> str:
        """Return a kinematic URDF, whose import has the same poses, limits, velocities and joint names.

        It has no geometry and no accelerations.

        Raises
        ------
        LimitError
            If a joint is limited on one side only, which URDF cannot express.
        """
        return write_urdf(self._description())

    def _description(self) -> ArmDescription:
        """Return the numbers of this arm as a description."""
        return self._described(**{f.name: self._number(f.name) for f in fields(self._described)})

    def _number(self, name: str) -> Any:
        """Return one of the constructor's arguments."""
        return getattr(self.geometry if name in GEOMETRY else self, name)

    # -- the arm as a value --------------------------------------------------------------------------

    def with_(self, **changes: Unpack[ArmArguments]) -> Arm:
        """Return a copy with some constructor arguments changed, such as ``lower=``.

        ``tool=`` replaces the whole transform from flange to end effector. An arm from a file or the
        catalogue often has one already, and this discards it. For example, the tool frame of openarm_v10 is
        rotated against the flange, so a gripper 150 mm long would end 212 mm from its place. Use `with_tool`
        to mount something on the present tool frame. ``scene=`` and ``singularity_margin=`` apply to every
        query, step, plan and tracker of the copy.

        Parameters
        ----------
        **changes
            As `Arm`.

        Returns
        -------
        Arm

        Raises
        ------
        InputError, LimitError
            As `Arm`, also for an unknown keyword, and for an own chain a number of its nominal arm alone.
        """
        for name in changes:
            chosen("a keyword of with_", name, ArmArguments.__annotations__)
        if changes.keys() <= {"scene", "singularity_margin"}:
            return self._keeping(**{**{name: getattr(self, name) for name in _KEPT[1:]}, **changes})
        numbers, chain = {**self._numbers(), **changes}, self.geometry.chain
        if chain is not None and "chain" not in changes:
            check_kept_chain(changes)
            if not changes.keys().isdisjoint(FRAMES):
                given = [np.eye(4) if numbers[name] is None else numbers[name] for name in FRAMES]
                base, tool = map(as_transform, FRAMES, given)
                numbers["chain"] = moved_ends(chain, (self.base, self.tool), (base, tool))
        if chain is None and changes.get("chain") is not None:
            return self._with_chain(numbers, [end for end in FRAMES if end not in changes])
        return Arm(**numbers)

    def _keeping(self, scene: Scene | None, singularity_margin: float) -> Arm:
        """Return this arm with another scene (None: none) and singularity margin (rad)."""
        margin = as_number("singularity_margin (rad)", singularity_margin, 0.0, MOST_MARGIN)
        ready = self._ready_for(scene)
        new = object.__new__(type(self))
        slots = [name for kind in type(self).__mro__ for name in getattr(kind, "__slots__", ())]
        fill(new, **{name: getattr(self, name) for name in slots})
        fill(new, scene=scene, singularity_margin=margin, _ready=ready)
        return new

    def _with_chain(self, numbers: dict[str, Any], ends: list[str]) -> Arm:
        """Return a copy with its own chain, which must include the arm's base and tool.

        `ends`: which of base and tool are not given with the chain.
        """
        made, wrong = None, None
        checked_chain(numbers["chain"])
        try:
            made = Arm(**numbers)
        except InputError as error:
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
            if leaves_out(cast(ChainHandle | None, bare), cast(ChainHandle, other._handle), at):
                raise InputError(
                    f"the chain for {self.name!r} leaves out its {end}=: give it there too, "
                    f"as dh_chain(..., {end}=arm.{end})"
                )
        if made is None:
            assert wrong is not None
            raise wrong
        return made

    def with_tool(self, tool: ArrayLike) -> Arm:
        """Return a copy with a tool mounted on the present tool frame.

        Not to be confused with ``with_(tool=...)``, which replaces the transform from flange to end effector.

        Parameters
        ----------
        tool : array_like, shape (4, 4)
            Frame of the new end effector in the present tool frame, position in m.

        Returns
        -------
        Arm
            Its ``tool`` is ``self.tool @ tool``, so its poses are this arm's poses times `tool`.

        Raises
        ------
        InputError

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

    def _ready_for(self, scene: Scene | None) -> Ready | None:
        """Return a scene prepared for this arm: its own, or another one; None if `scene` is None."""
        return self._ready if scene is self.scene else None if scene is None else self._needed(scene)

    def _needed(self, scene: Scene | None) -> Ready:
        """Return a scene prepared for this arm; raise if there is none."""
        own = self._ready if scene is self.scene else None
        return own or self._prepared(cast(Scene, scene))

    def _prepared(self, scene: Scene) -> Ready:
        """Return a scene prepared for this arm; which links never collide is found once for each arm."""
        ready = make_ready(self, scene, self._ready)
        fill(self, _apart=ready.apart)
        return ready

    def _numbers(self) -> dict[str, Any]:
        """Return all constructor arguments of this arm by name, for ``Arm(**numbers)``."""
        return {name: self._number(name) for name in (*(f.name for f in fields(self._described)), *_KEPT)}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Arm):
            return NotImplemented
        mine, its = ((arm._described, arm.scene, arm.singularity_margin) for arm in (self, other))
        if mine != its:
            return False
        compared = [field.name for field in fields(self._described) if field.compare]
        return all(np.array_equal(self._number(name), other._number(name)) for name in compared)

    def __hash__(self) -> int:
        return hash((self.name, *map(self._number, LENGTHS), (self.lower + 0.0).tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._numbers(),)

    def __repr__(self) -> str:
        """Return source code of this arm: its catalogue name, or all values that are not the default."""
        if self.name in catalogue() and self == Arm.from_catalogue(self.name):
            return f"Arm.from_catalogue({self.name!r})"
        return self._source()

    def _source(self) -> str:
        """Return Python source of this arm: all values that are not the default."""
        shown = [
            f"{field.name}={_source_text(self._number(field.name))}"
            for field in fields(self._described)
            if field.repr and not np.array_equal(self._number(field.name), default_of(field))
        ]
        shown += [f"scene={self.scene!r}"] * (self.scene is not None)
        shown += [f"singularity_margin={self.singularity_margin:.17g}"] * (self.singularity_margin != 0)
        return f"Arm({', '.join(shown)})"

    def __str__(self) -> str:
        """Return a readable description: lengths in mm, limits in degrees."""
        shown = [n for n in (*END_OFFSETS, *LENGTHS, *ELBOW_OFFSETS) if n in LENGTHS or self._number(n)]
        lengths = ", ".join(f"{n} {self._number(n) * MILLIMETRES:.6g}" for n in shown)
        ranges = zip(np.degrees(self.lower), np.degrees(self.upper), strict=True)
        limits = ", ".join(f"{lower:.5g} to {upper:.5g}" for lower, upper in ranges)
        return (
            f"{self.name or 'arm'}: {lengths} mm, reach {self.geometry.reach * MILLIMETRES:.6g} mm\n"
            f"limits of joints 1 to 7: {limits} deg"
        )

    @property
    def kind(self) -> str:
        """The kind of arm.

        "srs", "srs_chain" (its own chain, nearly S-R-S), "offset_wrist" or "offset_shoulder",
        "offset_wrist_chain" or "offset_shoulder_chain" (its own chain, nearly such an arm).
        """
        own = self.geometry
        kind = "offset_shoulder" if own.a_1 else "offset_wrist" if own.a_6 else "srs"
        return kind if own.chain is None else f"{kind}_chain"

    @property
    def redundancy(self) -> str:
        """The meaning of ``psi``: "arm_angle", or "joint_7" or "joint_1", the value of that joint."""
        return "joint_1" if self.geometry.a_1 else "joint_7" if self.geometry.a_6 else "arm_angle"

    @property
    def deviation(self) -> ChainDeviation:
        """Deviation of the arm's own chain from its nominal arm, and that arm: ``deviation.nominal``."""
        return ChainDeviation(self)

    @property
    def _nominal(self) -> Arm:
        """The arm that defines psi and gc: the arm itself, or the one fitted to its own chain."""
        return self if self.geometry.chain is None else self.with_(chain=None, scene=None)

    # -- kinematics ----------------------------------------------------------------------------------

    def forward(
        self, q: ArrayLike, *, on_error: OnError = "raise"
    ) -> tuple[Floats, FloatOrArray, IntOrArray]:
        """Return pose, arm angle and global configuration of joint values.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad. Limits are not enforced.
        on_error : "raise" or "nan"
            If the wrist coincides with the shoulder (folded arm with equal links), the arm angle does not
            exist: raise `UnreachableError`, or return NaN for it.

        Returns
        -------
        pose : ndarray, shape (..., 4, 4)
            Pose of the end effector, position in m.
        psi : float64, shape (...)
            Arm angle in (-π, π], rad: the value of `redundancy`.
        gc : int64, shape (...)
            Global configuration 0..7.

        Raises
        ------
        InputError, UnreachableError

        Source: Faria et al. (2018), Eqs. (1)-(11).
        """
        if isinstance(on_error, str) and on_error == "raise" and thread_count() == 1:
            plain: tuple[Floats, np.float64, np.int64] | None = self._handle.forward_one(q)
            if plain is not None:
                return plain
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        pose, psi, gc = np.empty((*batch, 4, 4)), np.empty(batch), np.empty(batch, dtype=np.int64)
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        self._handle.forward_many(joints, pose, psi, gc, nan, thread_count())
        return pose, psi[()], gc[()]

    def inverse(
        self,
        pose: ArrayLike,
        psi: ArrayLike | None = None,
        gc: ArrayLike | None = None,
        *,
        seed: ArrayLike | None = None,
        limits: bool = True,
        on_error: OnError = "raise",
        out: Floats | None = None,
    ) -> Floats:
        """Return the one configuration that a pose, an arm angle and a global configuration define.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m; rotations orthonormal within 1e-6 are solved as given.
        psi : array_like, shape (...)
            Arm angle, rad, any real number.
        gc : array_like of int, shape (...), optional
            Global configuration 0..7. Without it the result has an axis of 8: row k is branch k. Rows without
            an answer are NaN; an error is raised if no row has one.
        seed : array_like, shape (..., 7), optional
            Among several turns within a joint's limits, the one nearest to this is returned; without it, the
            nearest to the middle of the range.
        limits : bool
            True: an answer has all joints within their limits. False: limits are not enforced, as in
            Eqs. (17)-(24) of the paper; each joint takes the turn nearest to its range.
        on_error : "raise" or "nan"
            If there is no solution: raise, or return NaN in that row.
        out : ndarray, shape (..., 7), optional
            Written and returned instead of a new array. After an error its contents are undefined.

        Returns
        -------
        ndarray, shape (..., 7) or (..., 8, 7)
            Joint values, rad.

        Raises
        ------
        InputError
            If an argument is invalid.
        UnreachableError
            If a pose is out of reach; the message says by how many mm.
        LimitError
            If a joint has no turn within its limits.

        Source: Faria et al. (2018), Eqs. (12)-(24), in a form that also holds at singularities.
        """
        known = type(limits) is bool and isinstance(on_error, str) and on_error in ON_ERROR
        if known and gc is not None and seed is None and out is None and thread_count() == 1:
            plain: Floats | None = self._handle.inverse_few(pose, psi, gc, limits)
            if plain is not None:
                return plain
        if psi is None:
            raise InputError(
                "inverse takes a pose and psi, and gives one answer for each gc. solve(pose, seed=q) finds "
                "the nearest of all solutions, solve(pose, prefer='margin') the farthest from the limits, "
                "solutions(pose) one for each feasible interval"
            )
        keep = as_flag("limits", limits)
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        if gc is None:
            return self._every_branch(pose, psi, seed, keep, nan, out)
        return self._inverse(pose, psi, gc, seed, _beyond(keep, nan), nan, out)

    def _every_branch(
        self,
        pose: ArrayLike,
        psi: ArrayLike,
        seed: ArrayLike | None,
        keep: bool,
        nan: bool,
        out: Floats | None,
    ) -> Floats:
        """Return all eight branches, NaN in rows without one; unless `nan` raise if no row has one."""
        poses = as_poses("pose", pose, self._handle)[..., None, :, :]
        angles = as_floats("psi", psi)[..., None]
        seeds = None if seed is None else as_floats("seed", seed, (JOINTS,))[..., None, :]
        given = poses, angles, _GC_ORDER, seeds
        found = self._inverse(*given, _beyond(keep, True), True, out, all_branches=True)
        if not nan and not np.isfinite(found[..., 0]).any(axis=-1).all():
            self._inverse(*given, _beyond(keep, False), False, None, all_branches=True)
        return found

    def _inverse(
        self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike, seed: ArrayLike | None, beyond: _core.Enforce,
        nan: bool, out: Floats | None, *, all_branches: bool = False,
    ) -> Floats:  # fmt: skip
        """Return joint values (..., 7) of poses, arm angles and branches; NaN or an error where
        none exist. `beyond` is the outcome outside the limits; `all_branches` only words the error.
        """
        seeds = [] if seed is None else [("seed", as_floats("seed", seed, (JOINTS,)), 1)]
        batch, arrays = self._postures(pose, psi, gc, *seeds)
        result = output(out, (*batch, JOINTS))
        # written while the arguments are read: shared memory is copied first
        shared = out is not None and any(np.may_share_memory(result, array) for array in arrays)
        target = np.empty_like(result) if shared else result
        poses, angles, branches, *near = arrays
        self._handle.inverse_many(
            poses, angles, branches, near[0] if near else None, target, beyond,
            _core.Enforce.NAN if nan else _core.Enforce.RAISE, thread_count(), all_branches,
        )  # fmt: skip
        if shared:
            result[...] = target
        return result

    def _postures(
        self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike, *more: tuple[str, NDArray[Any], int]
    ) -> tuple[Shape, list[NDArray[Any]]]:
        """Return poses, arm angles, branches and accompanying arrays, broadcast to one batch shape."""
        poses, angles = as_poses("pose", pose, self._handle), as_floats("psi", psi)
        hint_degrees("psi", angles)
        return broadcast([("pose", poses, 2), ("psi", angles, 0), ("gc", as_gc(gc), 0), *more])

    def _branches(
        self, pose: ArrayLike, gc: ArrayLike, *more: tuple[str, NDArray[Any], int]
    ) -> tuple[Shape, list[NDArray[Any]]]:
        """Return poses, branches and accompanying arrays, broadcast to one batch shape."""
        return broadcast([("pose", as_poses("pose", pose, self._handle), 2), ("gc", as_gc(gc), 0), *more])

    def _of_joints(self, one: Callable[[Floats, Floats, int], None], q: ArrayLike, row: Shape) -> Floats:
        """Return what `one`, a function of the core, writes for each q: arrays of shape `row`."""
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty((*joints.shape[:-1], *row))
        one(joints, out, thread_count())
        return out

    def frames(self, q: ArrayLike) -> Floats:
        """Return the poses of the arm's DH frames, which locate its joints in space.

        Not to be confused with `forward`, which returns the pose of the end effector, including the tool.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        ndarray, shape (..., 8, 4, 4)
            Frames 0..7 in the frame that poses are given in, positions in m: joint i turns about the
            z axis of frame i - 1; frames 1 and 2 are at the shoulder, 3 at the elbow's axis, 5 and 6 at
            the wrist, 7 is the flange: ``frames[7] @ tool`` is the pose. The offset of a wrist or shoulder
            lies along x of frame 6, or 1.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Table 1, Eqs. (1), (40)-(46).

        Examples
        --------
        >>> from armangle import Arm
        >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
        >>> arm.frames([0, 0, 0, 0, 0, 0, 0])[:, 2, 3].round(3).tolist()
        [0.0, 0.34, 0.34, 0.74, 0.74, 1.14, 1.14, 1.266]
        """
        return self._of_joints(self._handle.frames_many, q, (JOINTS + 1, 4, 4))

    def elbow(self, q: ArrayLike) -> Floats:
        """Return the position of the elbow.

        It is the point of joint 4's axis nearest to the shoulder, the origin of DH frame 3. Its distance is
        hypot(d_se, a_3) from the shoulder and hypot(d_ew, a_4, d_4) from the wrist at any q. On an arm
        without elbow offset both links end there; with a_3 it lies at the end of the upper arm, off axis 3.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad. Limits are not enforced.

        Returns
        -------
        ndarray, shape (..., 3)
            m, in the frame that poses are given in.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Table 1, Eq. (1).

        Examples
        --------
        >>> from armangle import Arm
        >>> arm = Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
        >>> arm.elbow([0, np.pi / 2, 0, 1, 0, 0, 0]).round(3).tolist()
        [0.4, 0.0, 0.34]
        """
        return self._of_joints(self._handle.elbow_many, q, (3,))

    def psi_towards(
        self,
        pose: ArrayLike,
        gc: ArrayLike,
        point: ArrayLike | None = None,
        *,
        direction: Direction | None = None,
        on_error: OnError = "raise",
    ) -> FloatOrArray:
        """Return the arm angle that brings the elbow nearest to a point, or farthest along a direction.

        In closed form: the elbow is on a circle about the axis shoulder-wrist. Limits are ignored: the
        nearest arm angle within them is ``arm.feasible(pose, gc).nearest(psi)``; for a moving arm use the
        policy `armangle.Towards`. For an arm with its own chain the elbow is the nominal arm's; the true one
        differs by `deviation`. For an offset wrist or shoulder the elbow does not move on a circle: branch
        and bound finds the best value of the free joint over the whole branch.

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
        on_error : "raise" or "nan"
            If no arm angle is best, or none exists: raise, or return NaN. This happens if the arm is
            stretched or folded, so that its elbow does not move; if the point lies on the axis
            shoulder-wrist, or the direction is along it (for an offset wrist on the shoulder, for an offset
            shoulder on the wrist); and out of reach.

        Returns
        -------
        float64, shape (...)
            Arm angle in (-π, π], rad.

        Raises
        ------
        InputError
            If an argument is not usable.
        UnreachableError
            If the arm angle is undefined; the message gives the reason.

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
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        self._nominal._handle.psi_towards_many(poses, branches, wish, targets, out, nan, thread_count())
        return out[()]

    # -- differential ------------------------------------------------------------------------------

    def jacobian(self, q: ArrayLike) -> Floats:
        """Return the geometric Jacobian of the end effector.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.

        Returns
        -------
        ndarray, shape (..., 6, 7)
            Rows 0-2: linear velocity of the tool frame's origin (m/rad), rows 3-5: angular velocity, in the
            frame that poses are given in.

        Raises
        ------
        InputError
        """
        return self._of_joints(self._handle.jacobian_many, q, (6, JOINTS))

    def self_motion(self, pose: ArrayLike, psi: ArrayLike, gc: ArrayLike) -> Floats:
        """Return dq/dpsi at a fixed pose: the motion that does not move the end effector.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
        psi : array_like, shape (...)
            Arm angle, rad.
        gc : array_like of int, shape (...)

        Returns
        -------
        ndarray, shape (..., 7)
            rad/rad; joint 4 is 0, for an own chain nearly. If θ2 (θ6) is 0 or π at this arm angle alone, the
            derivative of joints 1, 2, 3 (5, 6, 7) does not exist and is ±inf. If it is so at every arm angle
            (arm straight up), θ1 (θ5) is constant and the motion is finite. For an offset wrist or shoulder
            it is the derivative by the free joint, and joint 4 moves too; at a fold it is ±inf.

        Raises
        ------
        As `inverse`.

        Source: Faria et al. (2018), Eqs. (28), (33).
        """
        batch, (poses, angles, branches) = self._postures(pose, psi, gc)
        out = np.empty((*batch, JOINTS))
        self._handle.self_motion_many(poses, angles, branches, out, thread_count())
        return out

    # -- limits --------------------------------------------------------------------------------------

    def limit_margin(self, q: ArrayLike) -> FloatOrArray:
        """Return the distance to the nearest joint limit.

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
        InputError
        """
        joints = as_floats("q", q, (JOINTS,))
        out = np.empty(joints.shape[:-1])
        self._handle.limit_margin_many(joints, out)
        return out[()]

    def within_limits(self, q: ArrayLike, tol: float = _core.ANGLE_TOLERANCE) -> BoolOrArray:
        """Return whether all joints are within their limits.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        tol : float
            Tolerance, rad. By default 1e-9, within which angles count as equal, so that configurations at the
            ends of arcs are within. ``tol=0.0`` is exact; joints that `solve` returns satisfy that too.

        Returns
        -------
        bool, shape (...)

        Raises
        ------
        InputError
        """
        return self.limit_margin(q) >= -as_number("tol", tol, -_core.LARGEST_ANGLE, _core.LARGEST_ANGLE)

    def feasible(
        self,
        pose: ArrayLike,
        gc: ArrayLike | None = None,
        *,
        per_joint: bool = False,
        progress: Progress | bool | None = None,
    ) -> ArcSet:
        """Return the feasible intervals of the arm angle.

        All joints stay within their limits, clear of the arm's `scene` and at its `singularity_margin`.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        gc : array_like of int, shape (...), optional
            Global configuration 0..7. Without it the result has an axis of 8: entry k is branch k, in about
            half the time of eight calls.
        per_joint : bool
            True: the result has one more axis of 7, the intervals in which each joint alone is within its
            limits, independent of the others; the margin applies to joints 2, 4 and 6. Without obstacles.
        progress : function (done, total) or bool
            Called a few times a second with the number of finished poses; True draws a bar on stderr.

        Returns
        -------
        ArcSet, shape (...), (..., 8), (..., 7) or (..., 8, 7)
            If it is empty, ``status`` gives the reason; geometry never raises. For an own chain every arm
            angle in it is proven, and ``unproven`` is the length that is proven neither way. An end caused by
            an obstacle names it. For an offset wrist or shoulder the intervals are those of the free joint.
            An end is then a joint at its limit, or a place where two branches meet (``side`` "singular"): a
            fold, of joint 5 (3 of an offset shoulder), or the end of the reach, of joint 4.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Eqs. (2), (25), (31), (32), (35).
        """
        if as_flag("per_joint", per_joint):
            if gc is None:
                pose, gc = as_poses("pose", pose, self._handle)[..., None, :, :], _GC_ORDER
            return self._arcs(pose, gc, Wanted.JOINTS, (JOINTS,), None, progress)
        if gc is None:
            return self._arcs(pose, 0, Wanted.BRANCHES, (CONFIGURATIONS,), self.scene, progress)
        return self._arcs(pose, gc, Wanted.BRANCH, (), self.scene, progress)

    def feasible_turns(self, pose: ArrayLike, about: Literal["base", "tool"]) -> ArcSet:
        """Return all angles of rotation about joint 1's or joint 7's axis at which a pose can be reached.

        Only that joint depends on such a turn: it moves by the angle and the other joints stay. So the
        intervals follow from the feasible arm angles of the other joints, in closed form. Obstacles are
        ignored, for every kind of arm: an arm that turns meets others.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        about : "base" or "tool"
            "base": a turn α rotates the pose by α about the axis of joint 1, which equals the robot rotated
            by -α under a fixed pose. The intersection (``&``) of several poses' sets contains the turns that
            suit all. "tool": a turn rotates the pose about the axis of joint 7. For a tool whose working axis
            is along it (drill, suction cup, torch) these are all rolls within the limits.

        Returns
        -------
        ArcSet, shape (...)
            Intervals of the turn, rad, relative to the given pose: ``0 in`` it if the pose is `reachable`.
            Ends name the joint and the limit. If other joints allow nothing it is empty; ``status`` gives the
            reason. Of an arm on its own chain they hold proven turns about its own axis; ``unproven`` is the
            length of the others that are not excluded (the status is NEAR_SINGULAR if no turn is proven).

        Raises
        ------
        InputError

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("openarm_v10")
        >>> turns = arm.feasible_turns(pose([0.1, 0.3, 0.2]), about="base")
        >>> bool(0.0 < turns.measure < 2 * np.pi)
        True
        """
        turned = _TURNED[chosen("about", about, _TURNED)]
        poses = np.ascontiguousarray(as_poses("pose", pose, self._handle))
        unproven = np.zeros(poses.shape[:-2]).reshape(-1)
        columns = self._handle.turns_many(poses, turned, self.singularity_margin, unproven, thread_count())
        told = None if self.geometry.chain is None else unproven
        return ArcSet._from_core(poses.shape[:-2], columns, unproven=told)

    def _clear(self, pose: ArrayLike, gc: ArrayLike, scene: Scene) -> ArcSet:
        """Return the collision-free arm angles, ignoring joint limits."""
        self._needed(scene)
        return self._arcs(pose, gc, Wanted.CLEAR, (), scene)

    def clearance(self, q: ArrayLike, scene: Scene | None = None) -> Clearance:
        """Return the distance to the obstacles, and the nearest pair of obstacle and link.

        Parameters
        ----------
        q : array_like, shape (..., 7)
            Joint values, rad.
        scene : Scene, optional
            Obstacles; by default those of the arm, ``arm.with_(scene=...)``. Its ``clearance`` is not
            subtracted: distances are between surfaces. Own links and the gripper are obstacles too.

        Returns
        -------
        Clearance

        Raises
        ------
        InputError

        Examples
        --------
        >>> import armangle as aa
        >>> scene = aa.Scene([aa.Ball([0.6, 0.0, 0.5], 0.05, name="lamp")])
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(body="guessed", scene=scene)
        >>> near = arm.clearance([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
        >>> near.obstacle, near.link, near.distance > 0
        ('lamp', 'forearm', True)
        """
        ready = self._needed(self.scene if scene is None else scene)
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        out, pair = np.empty((*batch, 8)), np.empty(batch, dtype=np.int64)
        self._handle.proximity_many(ready.handle, joints, out, pair, thread_count())
        return clearance_of(ready, out, pair)

    def _widest(self, pose: ArrayLike, gc: ArrayLike, scene: Scene | None) -> Widest:
        """Return the feasible arcs, the arm angle in them with the largest distance of the links to the
        obstacles, and that clearance.
        The feasible intervals shrink as the required clearance grows; bisection finds the greatest clearance
        with a solution. If the nearest pair has the same distance on a whole interval, the next pair decides
        within it. If no arm angle is collision-free, the result is the one that fails by least.
        """
        arcs = self._arcs(pose, gc, Wanted.BRANCH, (), scene)
        batch, (poses, branches) = self._branches(pose, gc)
        ready = self._needed(scene)
        psi, out = np.empty(batch), np.empty((*batch, 8))
        pair, status = (np.empty(batch, dtype=np.int64) for _ in range(2))
        self._handle.widest_many(
            ready.handle, poses, branches, self.singularity_margin, psi, out, pair, status, thread_count()
        )
        return Widest(arcs, psi[()], clearance_of(ready, out, pair))

    def _arcs(
        self, pose: ArrayLike, gc: ArrayLike, wanted: Wanted, sets: Shape, scene: Scene | None,
        progress: Progress | bool | None = None, paper: tuple[float, float] = (0.0, 0.0),
    ) -> ArcSet:  # fmt: skip
        """Return the `wanted` sets, of shape (*batch, *sets): `sets` is the shape for each pose.

        `paper`: the paper's own avoidance of singularities, a margin and the threshold of the discriminant.
        """
        margin = 0.0 if wanted is Wanted.CLEAR else self.singularity_margin
        ready = self._ready_for(scene)
        if not isinstance(self._handle, _core.Arm):
            return self._proven_arcs(pose, gc, margin, wanted, sets, ready, progress)
        handle, threads = None if ready is None else ready.handle, thread_count()
        if progress is None:
            few = self._handle.feasible_few(pose, gc, margin, *paper, wanted, threads, handle)
            if few is not None:
                return ArcSet._of_few(sets, few, ready)
        batch, (poses, branches) = self._branches(pose, gc)
        with progressing(as_progress(progress)):
            columns = self._handle.feasible_many(poses, branches, margin, *paper, wanted, threads, handle)
        return ArcSet._from_core((*batch, *sets), columns, ready)

    def _proven_arcs(
        self, pose: ArrayLike, gc: ArrayLike, margin: float, wanted: Wanted, sets: Shape, ready: Ready | None,
        progress: Progress | bool | None,
    ) -> ArcSet:  # fmt: skip
        """Return the `wanted` sets, of shape `sets` for each pose, of proven arcs with `unproven` lengths."""
        batch, (poses, branches) = self._branches(pose, gc)
        unproven = np.zeros((*batch, *sets)).reshape(-1)
        handle = cast(ChainHandle, self._handle)
        obstacles = None if ready is None else ready.handle
        with progressing(as_progress(progress)):
            columns = handle.feasible_many(
                poses, branches, margin, wanted, unproven, thread_count(), obstacles
            )
        return ArcSet._from_core((*batch, *sets), columns, ready, unproven)

    def _left_out(self, pose: ArrayLike, gc: ArrayLike, wanted: Wanted = Wanted.BRANCH) -> ArcSet:
        """Return the unproven part that `feasible`, per joint (JOINTS) or `_clear` (CLEAR) leaves out.

        It is empty for an S-R-S arm. Losses of a scene's own proof are not included.
        """
        batch, (poses, branches) = self._branches(pose, gc)
        shape = (*batch, *((JOINTS,) if wanted is Wanted.JOINTS else ()))
        if self.kind == "srs":
            return ArcSet._empty(shape)
        measure = np.zeros(shape).reshape(-1)
        handle = cast(ChainHandle, self._handle)
        margin = 0.0 if wanted is Wanted.CLEAR else self.singularity_margin
        columns = handle.feasible_many(poses, branches, margin, wanted, measure, 1, None, left_out=True)
        return ArcSet._from_core(shape, columns)

    def _keeps_soft(
        self, pose: ArrayLike, gc: ArrayLike, scene: Scene | None
    ) -> tuple[NDArray[np.int64] | None, Floats | None]:
        """Return numbers and ends of the intervals with a scene's soft clearance; None, None without one."""
        if scene is None or scene.soft == 0.0:
            return None, None
        arcs = self._arcs(pose, gc, Wanted.SOFT, (), scene)
        return arcs._count, arcs._psi

    def reachable(self, pose: ArrayLike) -> BoolOrArray:
        """Return whether any branch and arm angle reaches a pose within the limits and `singularity_margin`.

        Exact, in closed form, for an S-R-S arm, in less than a microsecond a pose of a batch. An own chain
        with an offset may miss a branch near a pose where branches meet. `freedom` tells which branches
        reach a pose and over what length, `explain` why none does. Obstacles are ignored: ``solve(pose).ok``
        includes them.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        bool, shape (...)

        Raises
        ------
        InputError

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> arm.reachable([pose([0.5, 0.0, 0.5]), pose([1.5, 0.0, 0.5])]).tolist()
        [True, False]
        """
        poses = as_poses("pose", pose, self._handle)
        out = np.empty(poses.shape[:-2], np.int64)
        self._handle.reachable_many(poses, self.singularity_margin, out, thread_count())
        return out.astype(np.bool_)[()]

    def freedom(self, pose: ArrayLike) -> Freedom:
        """Return which branches reach a pose, and the length of their feasible intervals.

        The numbers of `feasible` without its intervals: nine bytes a pose, for maps and statistics. Obstacles
        are ignored. For an arm with its own chain the intervals are the proven ones, and a branch whose only
        solutions are near where branches meet may be missed.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.

        Returns
        -------
        Freedom
            ``gc``, ``total``, ``widest``, ``arcs``, ``status``, each of shape (...). Never raises on
            geometry.

        Raises
        ------
        InputError

        Source: Faria et al. (2018), Eqs. (2), (25).

        Examples
        --------
        >>> from armangle import Arm, pose
        >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
        >>> has = arm.freedom(pose([0.4, 0.0, 0.5], rpy=[0.0, 3.0, 0.0]))
        >>> f"{has.gc:08b}", bool(has.total > has.widest > 0)
        ('11111111', True)
        """
        poses = as_poses("pose", pose, self._handle)
        batch = poses.shape[:-2]
        widths, codes = np.empty((*batch, 3)), np.empty((*batch, 3), np.int64)
        self._handle.freedom_many(poses, self.singularity_margin, widths, codes, thread_count())
        gc, arcs = (codes[..., k].astype(np.uint8)[()] for k in (0, 1))
        status = codes[..., 2].astype(np.int8) if batch else STATUSES[int(codes[2])]
        total, widest, unproven = (widths[..., k][()] for k in range(3))
        return Freedom(gc, total, widest, arcs, unproven, status)

    @names_keywords_of_arm
    def solve(
        self,
        pose: ArrayLike,
        seed: ArrayLike | None = None,
        *,
        metric: MetricName = "l2",
        weight: ArrayLike | None = None,
        prefer: Prefer = "seed",
        gc: int | Iterable[int] | None = None,
        allowed: Allowed | None = None,
        fallback: Fallback = None,
        length: float = 0.2,
        roll: Roll = "pose",
        progress: Progress | bool | None = None,
    ) -> Solution:
        """Return the solution of a pose that is nearest to a seed.

        It compares all eight branches, all arm angles and all turns of the joints. No configuration permitted
        by the arm's limits, `scene` and `singularity_margin` is nearer: bounds exclude parts of the circle
        without a nearer one, not sampling. Within 1e-5 rad of two or three of straight shoulder, elbow and
        wrist at once the arm angle has too few digits, and the search is local: one of a hundred such poses
        has a nearer solution, mostly by less than 0.001 rad. If such a search is cut short, or the proof
        fails near singularities of an own chain, the status is UNPROVEN; NEAR_SINGULAR if nothing was found.
        For an arm with an offset too, OK says that no solution is nearer. Where two joints turn about one
        axis, at a fold and at the stretched elbow, the search is local: the status is UNPROVEN if a nearer
        solution could be there.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Pose of the end effector, position in m. A float32 pose that rounding alone puts beyond the reach,
            or beyond the limit of joint 4, is moved onto it.
        seed : array_like, shape (..., 7), optional
            Present joint values, rad. Without it "seed" means "margin", and ``distance`` is NaN.
        metric : "l2" or "max"
            Distance: root of the weighted sum of squares of joint differences, or the largest of √weight
            times a difference.
        weight : array_like, shape (7,) or scalar, optional
            Weights of the joints, >= 0, at least one positive; 1 by default.
        prefer : "seed", "margin" or "clearance"
            "seed": nearest to the seed. "margin": the largest distance to the nearest joint limit.
            "clearance": the largest distance to the obstacles of the arm's `scene`, over all branches and arm
            angles; not with `metric`, `weight`, `allowed`, ``fallback`` or ``roll="free"``.
        gc : int or several of them, optional
            Global configurations that may be used; all by default.
        allowed : ArcSet or function (4, 4) -> ArcSet, optional
            Intervals given by the user, intersected with the feasible ones.
        fallback : None or "nearest_pose"
            "nearest_pose": if a pose has no solution, return that of the nearest reachable pose,
            ``found.pose``, which is ``found.gap`` away. ``status`` still gives the reason for the requested
            pose, and ``ok`` is False. A wrist out of reach moves towards the shoulder and keeps its
            orientation. If limits forbid that, it is the least ``sqrt(|dp|² + (length·angle)²)``: a local
            minimum, the best that Newton's method finds from 24 of 129 starts in all branches. For an arm
            with an offset or an own chain, the position of a kept orientation is found in the same way. It
            uses all branches and arm angles, so not with `gc`, `allowed` or obstacles.
        length : float
            With ``fallback``: metres that count as one radian, m.
        roll : "pose" or "free"
            "free": the tool may turn about its own z axis, as a drill, a torch or a suction cup may;
            ``found.pose`` is the pose reached. If that axis is axis 7, no roll is tried, and the result is
            as good as without a roll. For any other tool, and for an own chain, it tries 72 turns and finer
            ones near the best; 720 if none of them has a solution. Not with ``fallback``.
        progress : function (done, total) or bool
            Called a few times a second with the number of finished poses; True draws a bar on stderr.

        Returns
        -------
        Solution
            ``q (..., 7)``, ``psi``, ``gc``, ``distance``, ``status``, ``margin``, ``gap`` of shape (...),
            ``pose (..., 4, 4)``, and ``ok``. Geometry never raises: if there is no solution, ``status`` gives
            the reason, q is NaN and gc is -1.

        Raises
        ------
        InputError

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
        >>> found = arm.solve(arm.forward(q)[0], seed=q)
        >>> found.q.tolist() == q, found.distance
        (True, 0.0)

        >>> far = arm.forward(q)[0].copy()
        >>> far[0, 3] += 2.0
        >>> nearest = arm.solve(far, seed=q, fallback="nearest_pose")
        >>> nearest.status.name, nearest.ok, round(nearest.gap, 3)
        ('UNREACHABLE', False, 1.767)
        """
        plain = weight is None and gc is None and allowed is None and self.scene is None
        plain = plain and fallback is None and progress is None
        plain = plain and self.singularity_margin == 0.0 and isinstance(roll, str) and roll == "pose"
        if plain and prefer == "seed" and seed is not None and isinstance(metric, str) and metric in _METRICS:
            one = None if thread_count() != 1 else (
                self._handle.solve_few(pose, seed, _METRICS[metric], Solution, STATUSES)
            )  # fmt: skip
            if one is not None:
                return cast(Solution, one)
        beyond = relaxing_length(fallback, length, gc, allowed, self.scene)

        def ask(arm: Arm, poses: ArrayLike, seeds: ArrayLike | None, weights: ArrayLike | None) -> Solution:
            """Return the solutions of poses with the options of this call."""
            return Question(
                arm, poses, seeds, metric, weights, prefer, gc, allowed, beyond, progress
            ).solve()  # fmt: skip

        if chosen("prefer", prefer, PREFER) == "clearance":
            if beyond or roll != "pose" or any(x is not None for x in (allowed, weight)) or metric != "l2":
                raise InputError("prefer is 'clearance', which does not go with the other wishes but gc")
            return widest_solution(self, pose, seed, gc)
        if chosen("roll", roll, ROLLS) == "pose":
            return ask(self, pose, seed, weight)
        if beyond:
            raise InputError("roll is 'free', which does not go with fallback: that keeps a roll")
        check_free_roll(self, self.scene)
        by_margin = seed is None or prefer == "margin"
        kind = chosen("metric", metric, _METRICS)
        return solve_free(self, pose, seed, weights_of(weight), by_margin, kind, ask)

    @names_keywords_of_arm
    def solutions(
        self,
        pose: ArrayLike,
        seed: ArrayLike | None = None,
        *,
        metric: MetricName = "l2",
        weight: ArrayLike | None = None,
        prefer: Prefer = "seed",
        gc: int | Iterable[int] | None = None,
        allowed: Allowed | None = None,
        progress: Progress | bool | None = None,
    ) -> Solutions:
        """Return one solution for each branch and feasible interval of a pose, the nearest first.

        The first is the result of `solve`. Two solutions of one interval can be connected without moving the
        end effector or violating the limits; two of different intervals cannot. Without a seed each solution
        has the largest distance to the nearest limit in its interval.

        Parameters
        ----------
        pose : array_like, shape (..., 4, 4)
            Tool frame, position in m.
        seed : array_like, shape (..., 7), optional
            Present joint values, rad.
        metric, weight, gc, allowed, progress
            As in `solve`.
        prefer : "seed" or "margin"
            As in `solve`.

        Returns
        -------
        Solutions
            For one pose a sequence of `Solution`; for a batch arrays (..., k), k the largest count, padded
            with NaN. After the first, equally distant ones are ordered by branch, then by interval from -π.

        Raises
        ------
        InputError

        Examples
        --------
        >>> import armangle as aa
        >>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
        >>> q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
        >>> [(found.gc, round(found.distance, 2)) for found in arm.solutions(arm.forward(q)[0], seed=q)][:2]
        [(2, 0.0), (0, 2.95)]
        """
        return Question(
            self, pose, seed, metric, weight, chosen("prefer", prefer, PREFER[:2]), gc, allowed,
            progress=progress,
        ).solutions()  # fmt: skip

    def explain(self, pose: ArrayLike) -> Diagnosis:
        """Return for each global configuration whether it reaches a pose, and if not, why.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m.

        Returns
        -------
        Diagnosis
            ``branches[k]`` is that of GC k; ``explain()`` says it in words. If limits permit a branch but the
            arm's `scene` blocks it, the finding names the blocking pair and, if it depends on the arm angle,
            the missing distance. For a pose beyond all limits ``instead`` is the result of
            ``solve(pose, fallback="nearest_pose")`` without the scene. For an arm with its own chain
            ``excess`` and ``nearest`` are those of `nominal`, and the other findings are the true arm's.

        Raises
        ------
        InputError

        Examples
        --------
        >>> import armangle as aa
        >>> far = np.eye(4)
        >>> far[0, 3] = 2.0
        >>> round(aa.Arm.from_catalogue("kuka_iiwa7_r800").explain(far)[0].excess, 4)
        1.2536
        """
        frame, scene = one_pose("pose", pose, self._handle), self.scene
        branches = tuple(replace(branch, path=False) for branch in self._branches_of(frame))
        within = any(branch.ok for branch in branches)  # the limits; a scene may still block it
        if scene is not None:
            branches = tuple(replace(self._meets(branch, frame, scene), scene=True) for branch in branches)
        nearest = np.empty((4, 4))
        gap = self._nominal._handle.nearest_pose(frame, nearest)
        found = Diagnosis(branches, path=False, nearest=nearest, nearest_gap=gap)
        return found if within else self._with_instead(found, frame)

    def _without_scene(self) -> Arm:
        """Return this arm without its obstacles."""
        return self if self.scene is None else self.with_(scene=None)

    def _branches_of(self, pose: Floats) -> tuple[Branch, ...]:
        """Return for each branch whether the limits permit one pose, and if not, which of them forbid it."""
        if not isinstance(self._handle, _core.Arm):
            return branches_by_intervals(self._without_scene(), pose)
        segment = np.empty((1, _core.SEGMENT_WIDTH))
        _core.path_waypoints(pose[None], np.zeros(1), segment)
        return tuple(map(branch_of, self._handle.explain_pose(segment, self.singularity_margin)))

    def _with_instead(self, found: Diagnosis, pose: Floats) -> Diagnosis:
        """Return the diagnosis of a pose that no branch reaches, with the nearest reachable pose."""
        instead = self.with_(scene=None).solve(pose, fallback="nearest_pose")
        if not np.isfinite(instead.q).all():
            return found
        off = instead.pose - pose
        moved, turned = float(np.linalg.norm(off[:3, 3])), float(rotation_angle(off))
        return replace(found, instead=instead, instead_moved=moved, instead_turned=turned)

    def _meets(self, branch: Branch, pose: Floats, scene: Scene) -> Branch:
        """Return `branch`, or if obstacles block every arm angle within limits, one that says so."""
        if not branch.ok:
            return branch
        found = self._widest(pose, branch.gc, scene)
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


def check_arm(arm: object) -> None:
    """Raise if it is not an `Arm`."""
    if not isinstance(arm, Arm):
        raise InputError(f"arm is {type(arm).__name__}, wanted an Arm")


def _beyond(keep: bool, nan: bool) -> _core.Enforce:
    """Return the core's treatment of joints outside the limits: none unless `keep`; NaN (`nan`) or raise."""
    return _core.Enforce.IGNORE if not keep else _core.Enforce.NAN if nan else _core.Enforce.RAISE


KINDS: list[Any] = []
"""The classes of an arm with an offset wrist or shoulder, registered when the folder is imported: in closed
form, and on its own chain."""


def _rebuilt(arguments: dict[str, Any]) -> Arm:
    """Return an arm from its constructor arguments (for pickle)."""
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
