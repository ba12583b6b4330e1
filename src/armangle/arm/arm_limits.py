"""What an arm may do: joint limits as margins, as functions of the arm angle, and as arcs of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._arrays import Floats, as_floats, as_gc, as_number, as_threads, broadcast, raise_problem
from ..errors import ConfigurationError, InputError, ShapeError
from ..models.description import JOINTS
from .arcs import ArcSet
from .arm_kinematics import ArmKinematics
from .configuration import COUNT as CONFIGURATIONS
from .diagnosis import Diagnosis, branch_of
from .joint_function import JointFunction

MOST_MARGIN: float = _core.MOST_MARGIN
_BRANCH, _JOINTS, _BRANCHES = 0, 1, 2  # what feasible_many is asked for
_SETS_OF: tuple[tuple[int, ...], ...] = ((), (JOINTS,), (CONFIGURATIONS,))


class ArmLimits(ArmKinematics):
    """Limit margins, joint functions and feasible arcs of an arm."""

    __slots__ = ()

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

    def explain(self, pose: ArrayLike, *, singularity_margin: float = 0.0) -> Diagnosis:
        """Return for each global configuration whether a pose can be held within all limits, and if not, why.

        Parameters
        ----------
        pose : array_like, shape (4, 4)
            Tool frame, position in m.
        singularity_margin : float
            As in `feasible`, rad.

        Returns
        -------
        Diagnosis
            ``branches[k]`` is that of GC k; ``explain()`` says it in words.

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
        frame = np.ascontiguousarray(as_floats("pose", pose, (4, 4)))
        if frame.ndim != 2:
            raise ShapeError(f"pose has shape {frame.shape}, wanted (4, 4)")
        problem = _core.check_transforms(frame[None])
        if problem:
            raise_problem(problem, ())
        margin = as_number("singularity_margin (rad)", singularity_margin, 0.0, MOST_MARGIN)
        segment = np.empty((1, _core.SEGMENT_WIDTH))
        _core.path_waypoints(frame[None], segment)
        return Diagnosis(tuple(map(branch_of, self._core.explain_pose(segment, margin))), path=False)

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
