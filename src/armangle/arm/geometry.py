"""The numbers that define an arm's kinematics, as one value."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from .._arrays import Floats, Ints
from .._values import by_content


@by_content
@dataclass(frozen=True)
class Geometry:
    """The numbers of `Arm.geometry`: the constructor's arguments of the same names, and what follows.

    For an arm with its own `chain` these are the numbers of the nominal arm, which defines psi and gc.

    Parameters
    ----------
    d_bs, d_se, d_ew, d_wf : float
        Base to shoulder, shoulder to elbow, elbow to wrist, wrist to flange, m.
    a_3, a_4, d_4 : float
        Lateral elbow offsets of links 3 and 4, and the gap along axis 4, m.
    a_1, a_6 : float
        Offset between the axes of joints 1 and 2, or of joints 6 and 7, m.
    signs : int64, shape (7,)
        Directions of the joints.
    offsets : ndarray, shape (7,)
        Zero offsets, rad.
    reference : "base", "stereographic" or tuple of 3 float
        Zero of the arm angle.
    chain : ndarray, shape (8, 4, 4), or None
        The arm's own chain.
    joint_names : tuple of 7 str
        Names of the joints, as files have them.
    notes : tuple of str
        Notes about the origin of the numbers. They do not count when two values are compared.
    reach, inner_reach : float
        Largest and smallest distance shoulder-wrist, m.
    delta : float
        Model angle θ4 of the stretched arm, rad; 0 without elbow offset.
    """

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    d_4: float
    signs: Ints
    offsets: Floats
    reference: str | tuple[float, ...]
    chain: Floats | None
    joint_names: tuple[str, ...]
    notes: tuple[str, ...] = field(compare=False)
    reach: float
    inner_reach: float
    delta: float
    a_1: float = 0.0
    a_6: float = 0.0


GEOMETRY = frozenset(f.name for f in fields(Geometry))
"""The names that are in `Arm.geometry`, not on the arm."""
DERIVED = ("reach", "inner_reach", "delta")
"""The names among them that are not arguments of `Arm`."""
