"""The arm with an offset wrist or shoulder: an `Arm` whose free joint replaces the arm angle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Never, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import (
    CONFIGURATIONS,
    JOINTS,
    FloatOrArray,
    Floats,
    IntOrArray,
    Ints,
    as_codes,
    as_flag,
    as_floats,
    as_number,
    as_poses,
    broadcast,
    check_angles,
    chosen,
    hint_degrees,
    output,
)
from .._threads import thread_count
from .._values import fill
from ..errors import InputError, LimitError, UnreachableError, UnsupportedError
from ..models.description import OffsetDescription
from ..scenes.scene import Scene
from ..status import STATUSES, Status
from .arm import KINDS, ON_ERROR, Arm, OnError
from .chain import refusing

_NO_FIELDS = ("d_4", "chain", "reference")
INSTEAD = {
    "resolve": "step chooses the next value of the free joint, and the joints",
    "carry=": "psi is the value of a joint of this arm",
    "gradients.joint_function": "use arm.inverse, which gives all joints over the value of the free joint",
    "kuka": "KUKA's controllers describe S-R-S arms alone",
}


def unsupported(what: str, instead: str = "") -> UnsupportedError:
    """Return the error of a function that does not support an arm with an offset wrist or shoulder."""
    hint = instead or INSTEAD.get(what, "")
    return UnsupportedError(
        f"{what} is not made for an arm with an offset wrist or shoulder{': ' * bool(hint)}{hint}"
    )


class OffsetHandle(_core.OffsetArm):
    """A core arm with an offset; unsupported functions raise an error with their name."""

    __getattr__ = refusing(unsupported)


class OffsetArm(Arm):
    """An `Arm` that is S-R-S except for one offset: between axes 6 and 7, or between axes 1 and 2.

    Created by the constructors of `Arm`, and by ``Arm(a_1=...)`` and ``Arm(a_6=...)``. `_rows` is the S-R-S
    arm of the same numbers without a_1, a_6 and scene.
    """

    __slots__ = ("_rows",)

    _rows: Arm
    _handle: Any  # an OffsetHandle
    _described = OffsetDescription

    def __init__(self, *unnamed: Never, a_1: float = 0.0, a_6: float = 0.0, **numbers: Any) -> None:
        """Check the numbers and create the core's arm; exactly one of a_1 and a_6 is not 0."""
        for name in _NO_FIELDS:
            given = numbers.pop(name, None)
            if isinstance(given, np.ndarray) or given not in (None, 0.0, "base", (), []):
                raise unsupported(f"{name}=")
        scene = numbers.pop("scene", None)
        rows = Arm(*unnamed, **numbers)
        limit = _core.LENGTH_LIMIT
        offsets: dict[str, Any] = {
            n: as_number(f"{n} (m)", x, -limit, limit) for n, x in (("a_1", a_1), ("a_6", a_6))
        }
        if bool(offsets["a_1"]) == bool(offsets["a_6"]):
            raise InputError(
                f"a_1 is {offsets['a_1']:g} and a_6 is {offsets['a_6']:g}, wanted one of them: "
                "with both there is no closed form"
            )
        kept = {name: getattr(rows, name) for name in Arm.__slots__ if not name.startswith("_")}
        own = {"_rows": rows, "_ready": None, "_apart": None}
        fill(self, **{**kept, **own, "geometry": replace(rows.geometry, **offsets), "scene": scene})
        fill(self, _handle=OffsetHandle(*self._core_numbers(), self.singularity_margin))
        if scene is not None:
            fill(self, _ready=self._prepared(scene))

    def _core_numbers(self) -> tuple[Floats, Floats, Floats, Floats, float, bool]:
        """Return lengths (m), rows of joint data, base, tool, offset (m), and if it is at the shoulder."""
        rows, own = self._rows, self.geometry
        mirrored = own.a_1 != 0.0
        lengths = np.array([own.d_bs, own.d_se, own.d_ew, own.d_wf, own.a_3, own.a_4])
        joints = np.array([own.signs, own.offsets, rows.lower, rows.upper], dtype=np.float64)
        return lengths, joints, rows.base, rows.tool, own.a_1 if mirrored else own.a_6, mirrored

    def _keeping(self, scene: Scene | None, singularity_margin: float) -> Arm:
        """See `Arm._keeping`: the core's arm holds the singularity margin."""
        new = cast(OffsetArm, super()._keeping(scene, singularity_margin))
        margin = new.singularity_margin
        if margin != self.singularity_margin:
            fill(new, _rows=self._rows.with_(singularity_margin=margin))
            fill(new, _handle=OffsetHandle(*new._core_numbers(), margin))
        return new

    # -- kinematics --------------------------------------------------------------------------------

    def forward(
        self, q: ArrayLike, *, on_error: OnError = "raise"
    ) -> tuple[Floats, FloatOrArray, IntOrArray]:
        """See `Arm.forward`: psi is the value of the free joint as an angle, and always exists."""
        chosen("on_error", on_error, ON_ERROR)
        joints = as_floats("q", q, (JOINTS,))
        batch = joints.shape[:-1]
        pose, psi, gc = np.empty((*batch, 4, 4)), np.empty(batch), np.empty(batch, dtype=np.int64)
        self._handle.forward_many(joints, pose, psi, gc, thread_count())
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
        """See `Arm.inverse`. UNREACHABLE: at this value of the free joint the wrist is out of reach, or axis
        5 cannot be perpendicular to axis 6; `feasible` returns the values with a solution.
        """
        if psi is None:
            raise InputError(
                f"inverse takes a pose and psi, the value of {self.redundancy.replace('_', ' ')}, and gives "
                "one answer for each gc. solve(pose, seed=q) finds the nearest of all solutions"
            )
        keep = as_flag("limits", limits)
        nan = chosen("on_error", on_error, ON_ERROR) == "nan"
        poses, values = as_poses("pose", pose), as_floats("psi", psi)
        seeds = None if seed is None else as_floats("seed", seed, (JOINTS,))
        if gc is None:
            poses, values = poses[..., None, :, :], values[..., None]
            seeds = None if seeds is None else seeds[..., None, :]
        check_angles("psi", values)
        hint_degrees("psi", values)
        branches = np.arange(CONFIGURATIONS) if gc is None else as_codes("gc", gc, CONFIGURATIONS)
        named: list[tuple[str, NDArray[Any], int]] = [
            ("pose", poses, 2), ("psi", values, 0), ("gc", branches, 0),
        ]  # fmt: skip
        if seeds is not None:
            self._handle.check_joints(seeds, "seed")
            named.append(("seed", seeds, 1))
        batch, (poses, values, branches, *by) = broadcast(named)
        q, codes = np.empty((*batch, JOINTS)), np.empty(batch, dtype=np.int64)
        beyond = _core.Enforce.NAN if keep else _core.Enforce.IGNORE
        self._handle.inverse_many(
            poses, values, branches, by[0] if by else None, q, codes, beyond, thread_count()
        )
        missing = np.isnan(q[..., 0])
        if not nan and (missing.all(axis=-1).any() if gc is None else missing.any()):
            self._raise(codes, missing, one_of_eight=gc is None)
        if out is None:
            return q
        result = output(out, q.shape)
        result[...] = q
        return result

    def _raise(self, codes: Ints, missing: NDArray[np.bool_], *, one_of_eight: bool) -> None:
        """Raise the error of the first pose that is `missing` a solution; `codes` holds the status of each.

        With `one_of_eight` the last axis is the branch, and a pose has no solution if no branch has one.
        """
        if one_of_eight:  # the reason of the branch nearest to a solution
            at = tuple(int(i) for i in np.argwhere(missing.all(axis=-1))[0])
            ok = codes[at] == Status.OK.value
            code = Status.OK.value if ok.any() else int(codes[at][0])
        else:
            at = tuple(int(i) for i in np.argwhere(missing)[0])
            code = int(codes[at])
        where = f"pose{list(at) if at else ''}"
        if code == Status.OK.value:
            raise LimitError(f"{where}: the solution has a joint outside its limits")
        raise UnreachableError(f"{where}: {STATUSES[code].sentence}")

    def elbow(self, q: ArrayLike) -> Floats:
        """See `Arm.elbow`."""
        return self.frames(q)[..., 3, :3, 3].copy()


KINDS.append(OffsetArm)


def as_srs(arm: Arm, what: str) -> Arm:
    """Return the arm if it has no offset wrist or shoulder; raise `UnsupportedError` if it has: `what` lacks
    it.
    """
    if isinstance(arm, OffsetArm):
        raise unsupported(what)
    return arm
