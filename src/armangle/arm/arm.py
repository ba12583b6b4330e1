"""The arm, and where it comes from: numbers, the catalogue, URDF or MJCF."""

from __future__ import annotations

import os

from ..models.catalogue import load_robot
from ..models.description import ArmDescription, ImportReport
from ..models.detect import describe_chain
from ..models.mjcf import read_mjcf
from ..models.urdf import Source, read_urdf, write_urdf
from ..poses import nearest_rotation
from .arm_limits import MOST_MARGIN, ArmLimits

__all__ = ["MOST_MARGIN", "Arm", "nearest_rotation"]


class Arm(ArmLimits):
    """A 7-axis arm with spherical shoulder, elbow and spherical wrist (S-R-S).

    The tip's pose is ``base @ DH(theta) @ tool`` with ``theta_i = signs_i q_i + offsets_i`` and the
    classic DH rows of the paper's Table 1, to which the lateral elbow offsets a_3, a_4 are added.
    Everything public speaks q, the robot's own joint coordinates. Values are frozen.

    Parameters
    ----------
    d_bs, d_se, d_ew, d_wf : float
        Base to shoulder, shoulder to elbow, elbow to wrist, wrist to flange, m; the two links at least 1e-6.
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

    __slots__ = ()

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
            square; what then differs from the file is kept in ``import_report``.
        continuous_limits : {"ignore", "use"}
            Limits of a continuous joint, which by the rules of URDF has none, though some files state them.
            Where they are ignored, a warning and a note of ``import_report`` say so.

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
