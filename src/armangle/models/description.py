"""The data of an arm before it becomes an ``Arm``: lengths, joint map, frames and limits."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .._arrays import JOINTS, frozen
from ..errors import InputError
from ..scenes.ready import Shaped
from ..scenes.shapes import Shape

LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf")
ELBOW_OFFSETS = ("a_3", "a_4", "d_4")
END_OFFSETS = ("a_1", "a_6")
JOINT_ROWS = ("signs", "offsets", "lower", "upper", "velocity", "acceleration")
FRAMES = ("base", "tool")
_INFINITE = (float("inf"),) * JOINTS
_MINUS_INFINITE = (float("-inf"),) * JOINTS


def _identity() -> NDArray[np.float64]:
    """Return the identity (4, 4)."""
    return np.eye(4)


@dataclass(frozen=True, eq=False)
class ArmDescription:
    """Numbers of one S-R-S arm, in the joint coordinates q and frames of its own source.

    The one list of an arm's data: `Arm` accepts, shows, compares, copies and pickles these fields.

    The pose of the tip is ``base @ DH(theta) @ tool`` with ``theta_i = signs_i q_i + offsets_i`` and the
    classic Denavit-Hartenberg rows of the paper's Table 1, plus the lateral elbow offsets ``a_3`` and ``a_4``
    and the gap ``d_4``.

    The fields are the parameters of `Arm`, in its units; rows of joints are tuples, frames read-only arrays.
    `notes` do not count when two arms are compared.

    Source: Faria et al. (2018), Table 1 and Eq. (1).
    """

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float = 0.0
    a_4: float = 0.0
    d_4: float = 0.0
    lower: tuple[float, ...] = _MINUS_INFINITE
    upper: tuple[float, ...] = _INFINITE
    signs: tuple[int, ...] = (1,) * JOINTS
    offsets: tuple[float, ...] = (0.0,) * JOINTS
    base: NDArray[np.float64] = field(default_factory=_identity)
    tool: NDArray[np.float64] = field(default_factory=_identity)
    velocity: tuple[float, ...] = _INFINITE
    acceleration: tuple[float, ...] = _INFINITE
    name: str = "arm"
    joint_names: tuple[str, ...] = tuple(f"joint_{i}" for i in range(1, JOINTS + 1))
    reference: str | tuple[float, ...] = "base"
    chain: NDArray[np.float64] | None = None
    body: Shaped | None = None
    hand: tuple[Shape, ...] = ()
    notes: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in (*JOINT_ROWS, "joint_names"):
            values = getattr(self, name)
            if len(values) != JOINTS:
                raise InputError(f"{name} has {len(values)} entries, wanted {JOINTS}")
            row = values.tolist() if isinstance(values, np.ndarray) else values
            object.__setattr__(self, name, tuple(row))
        for name in FRAMES:
            frame = np.array(getattr(self, name), dtype=np.float64)
            if frame.shape != (4, 4):
                raise InputError(f"{name} has shape {frame.shape}, wanted (4, 4)")
            object.__setattr__(self, name, frozen(frame))
        if self.chain is not None:
            object.__setattr__(self, "chain", frozen(np.array(self.chain, dtype=np.float64)))


@dataclass(frozen=True, eq=False)
class OffsetDescription(ArmDescription):
    """Numbers of an arm with one offset in addition to S-R-S: `a_1` or `a_6` (m) as of `Arm`, the other is 0.

    Source: docs, background/other_wrists.
    """

    a_1: float = 0.0
    a_6: float = 0.0


@dataclass(frozen=True)
class ImportReport:
    """How an arm was read from a file, and how accurately it agrees with it.

    Parameters
    ----------
    source : str
        The file, or its kind.
    base, tip : str
        Names of the two links.
    joint_names : tuple of 7 str
        From base to tip.
    shoulder_miss, wrist_miss : float
        Largest distance of the file's axes from a common point, m; for an offset shoulder or wrist, its
        offset.
    angle_miss : float
        Largest deviation of two neighbouring axes from a right angle, rad.
    residual_position, residual_rotation : float
        Largest difference found between the arm (without its own chain, if it is nearly S-R-S) and the
        file's forward kinematics, m and rad: over ``postures`` random configurations, and uphill from the
        worst of them. 0 if an arm with an offset keeps the file's chain.
    postures : int
        Number of random configurations.
    notes : tuple of str
        Numbers of the file that are changed, not used or not trusted.
    """

    source: str
    base: str
    tip: str
    joint_names: tuple[str, ...]
    shoulder_miss: float
    wrist_miss: float
    angle_miss: float
    residual_position: float
    residual_rotation: float
    postures: int
    notes: tuple[str, ...]

    def __str__(self) -> str:
        """Return the findings and their accuracy, in mm and degrees, a line each."""
        rows = (
            ("three shoulder axes miss a point by", self.shoulder_miss * 1e3, "mm"),
            ("three wrist axes miss a point by", self.wrist_miss * 1e3, "mm"),
            ("neighbouring axes are square within", np.degrees(self.angle_miss), "deg"),
            ("nominal position agrees with the file within", self.residual_position * 1e3, "mm"),
            ("nominal orientation agrees with the file within", np.degrees(self.residual_rotation), "deg"),
        )
        lines = [f"{self.source}: {self.base} to {self.tip}", f"joints: {', '.join(self.joint_names)}"]
        lines += [f"{what:47}  {value:.6f} {unit}" for what, value, unit in rows]
        return "\n".join([*lines, *(f"note: {line}" for line in self.notes)])
