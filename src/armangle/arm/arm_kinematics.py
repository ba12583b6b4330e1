"""What an arm does: forward and inverse kinematics and their derivatives."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import (
    Floats,
    Ints,
    as_floats,
    as_gc,
    as_threads,
    broadcast,
    output,
    raise_problem,
)
from ..errors import InputError
from ..models.description import JOINTS
from .arm_value import ArmValue
from .configuration import COUNT as CONFIGURATIONS

Enforce = Literal["ignore", "raise", "nan"]
Unreachable = Literal["raise", "nan"]
_ENFORCE = ("ignore", "raise", "nan")
_GC_ORDER = np.arange(CONFIGURATIONS, dtype=np.int64)


class ArmKinematics(ArmValue):
    """Forward and inverse kinematics, frames, Jacobian and self-motion of an arm."""

    __slots__ = ()

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
        plainly = isinstance(limits, str) and limits == "ignore" and isinstance(unreachable, str)
        if plainly and unreachable == "raise" and seed is None and out is None and threads == 1:
            plain: Floats | None = self._core.inverse_one(pose, psi, gc)
            if plain is not None:
                return plain
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
        # written while the arguments are read: memory they share is written aside
        shared = out is not None and any(np.may_share_memory(result, array) for array in arrays)
        target = np.empty_like(result) if shared else result
        problem = self._core.inverse_many(
            *arrays[:3], arrays[3] if seed is not None else None, target, *codes, as_threads(threads)
        )
        if problem:
            raise_problem(problem, batch, joints="seed")
        if shared:
            result[...] = target
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
        >>> from armangle import Arm
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


def _choice(name: str, value: str, options: tuple[str, ...]) -> int:
    if not isinstance(value, str) or value not in options:
        raise InputError(f"{name} is {value!r}, wanted one of {', '.join(map(repr, options))}")
    return options.index(value)
