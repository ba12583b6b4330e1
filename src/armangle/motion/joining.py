"""Several consecutive joint paths as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from .._arrays import Floats, Ints
from .._values import by_content
from ..arm.arm import Arm
from ..errors import InputError, PathError
from ..scenes.scene import Scene
from .curves import AnyCurve, Placed
from .joint_path import JointPath
from .paths import Chain, greatest

SAME_JOINTS = 1e-6
"""Largest gap of a joint between the end of a path and the start of the next, rad."""
_TURN = 2 * np.pi


@by_content
@dataclass(frozen=True, eq=False)
class JoinedCurve:
    """Consecutive curves, each over its part of s.

    `ends` (K + 1,) are their ends in s, `turns` (K,) full turns added to the arm angle of each, rad;
    `segments` are those of the end effector's path.
    """

    curves: Sequence[AnyCurve]
    ends: Floats
    turns: Floats
    segments: Floats

    @property
    def end(self) -> float:
        """The s where the curve ends."""
        return 1.0

    @property
    def gc(self) -> int:
        """Global configuration at the start."""
        return self.curves[0].gc

    @property
    def knots(self) -> Floats:
        """The s between which the curve is smooth, shape (k,)."""
        spans = zip(self.ends[:-1], np.diff(self.ends), self.curves, strict=True)
        return np.concatenate([low + width * curve.knots for low, width, curve in spans])

    @property
    def leads_the_tool(self) -> bool:
        """Whether the joints determine the path of the end effector in at least one part."""
        return any(curve.leads_the_tool for curve in self.curves)

    def at(self, handle: Any, s: Floats) -> Placed:
        """Return the rows at s (N,); `handle` is the arm's."""
        k, inner = self._parts(s)
        rows = Placed.empty(len(s))
        for part, curve in enumerate(self.curves):
            here = k == part
            found = curve.at(handle, np.ascontiguousarray(inner[here]))
            for row, values in zip(rows, found, strict=True):
                row[here] = values
            rows.psi[here] += self.turns[part]
        return rows

    def derivatives(self, handle: Any, s: Floats) -> Floats:
        """Return q', q'', q''' with respect to s, shape (N, 3, 7)."""
        k, inner = self._parts(s)
        out = np.empty((len(s), 3, 7))
        for part, curve in enumerate(self.curves):
            here = k == part
            width = self.ends[part + 1] - self.ends[part]
            found = curve.derivatives(handle, np.ascontiguousarray(inner[here]))
            out[here] = found / width ** np.arange(1, 4)[:, None]
        return out

    def _parts(self, s: Floats) -> tuple[Ints, Floats]:
        """Return for each s the index of its curve and the parameter on that curve."""
        k = np.clip(np.searchsorted(self.ends, s, side="right") - 1, 0, len(self.curves) - 1)
        inner = (s - self.ends[k]) / (self.ends[k + 1] - self.ends[k])
        return k, np.asarray(np.clip(inner, 0.0, 1.0))


def join(paths: Sequence[JointPath]) -> JointPath:
    """Return several joint paths as one, with all their rows, for `save`, `retime` and `at`.

    Not to be confused with `Segments`, which are joined before a motion is planned: those are planned as a
    whole, in one branch if necessary, and may have blends.

    Parameters
    ----------
    paths : sequence of JointPath
        For one arm, with any obstacles and margin, all solved. Each begins with the joints and the pose at
        the end of the one before, within 1e-6 rad and m. s is divided by their rows; paths of one row add
        nothing to others.

    Returns
    -------
    JointPath
        Certified if all are.

    Raises
    ------
    InputError
        If there is none, they belong to different arms, or there is a gap between two of them.
    PathError
        If one of them is not solved.

    Examples
    --------
    >>> import numpy as np
    >>> from armangle import Arm, Line, plan
    >>> arm = Arm.from_catalogue("kuka_iiwa7_r800")
    >>> q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    >>> a = arm.forward(q)[0]
    >>> b, c = a.copy(), a.copy()
    >>> b[1, 3], c[1, 3], c[2, 3] = b[1, 3] - 0.1, c[1, 3] - 0.1, c[2, 3] - 0.1
    >>> down = plan(arm, Line(a, b), start=q)
    >>> join([down, plan(arm, Line(b, c), start=down.q[-1])])
    <JointPath of 399 poses, certified>
    """
    if not isinstance(paths, (list, tuple)) or not paths or not all(isinstance(p, JointPath) for p in paths):
        raise InputError(f"paths is {paths!r:.100}, wanted a list of JointPath")
    first = paths[0]
    for k, path in enumerate(paths):
        if path.arm != first.arm and _bare(path.arm) != _bare(first.arm):
            raise InputError(f"paths: path {k} is of another arm than path 0")
        if len(path) == 0:
            raise InputError(f"paths: path {k} has no rows, wanted one at least")
        if not path.ok:
            raise PathError(f"paths: path {k} is not solved: {path.explain()}")
    for k, (before, after) in enumerate(pairwise(paths), start=1):
        joint = np.abs(after.q[0] - before.q[-1]).max()
        pose = np.abs(after.poses[0] - before.poses[-1]).max()
        if not max(joint, pose) <= SAME_JOINTS:
            raise InputError(
                f"paths: path {k} begins {joint:.3g} rad and {pose:.3g} m from where path {k - 1} ends"
            )
    return _joined([path for path in paths if len(path) > 1] or paths[:1])


def _bare(arm: Arm) -> Arm:
    """Return the arm without obstacles and singularity margin."""
    return arm.with_(scene=None, singularity_margin=0.0)


def _scenes(paths: Sequence[JointPath]) -> tuple[Scene, ...]:
    """Return the obstacles of all paths: none if one path has none, one scene, or one for each row."""
    if not all(path.scenes for path in paths):
        return ()
    rows = [
        path.scenes[row if len(path.scenes) > 1 else 0]
        for k, path in enumerate(paths)
        for row in range(int(k > 0), len(path))
    ]
    return tuple(rows[:1]) if all(scene is rows[0] for scene in rows) else tuple(rows)


def _joined(paths: Sequence[JointPath]) -> JointPath:
    """Return paths that were checked as one path, with s in proportion to their rows."""
    curves = [path._drawn for path in paths]
    if len(paths) == 1:
        return paths[0]
    counts = np.array([len(path) - 1 for path in paths])
    ends = np.concatenate([[0.0], np.cumsum(counts)]) / counts.sum()
    ends[-1] = 1.0
    spans = list(zip(ends[:-1], np.diff(ends), strict=True))
    segments = np.concatenate([curve.segments for curve in curves])
    bounds = [low + width * curve.segments[:, :2] for (low, width), curve in zip(spans, curves, strict=True)]
    segments[:, :2] = np.concatenate(bounds)
    turns = np.zeros(len(paths))
    for k in range(1, len(paths)):
        before = paths[k - 1].psi[-1] + turns[k - 1]
        turns[k] = _TURN * np.round((before - paths[k].psi[0]) / _TURN)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(path, name)[k > 0 :] for k, path in enumerate(paths)])
        for name in ("poses", "q", "gc", "status", "margin", "residual")
    }
    parts = list(zip(paths, spans, turns, strict=True))
    s = np.concatenate([(low + width * path.s)[k > 0 :] for k, (path, (low, width), _) in enumerate(parts)])
    psi = np.concatenate([(path.psi + turn)[k > 0 :] for k, (path, _, turn) in enumerate(parts)])
    open_ = [low + width * path.uncertified for path, (low, width), _ in parts if not path.certified]
    s[-1] = 1.0
    off = greatest(path.deviation for path in paths)
    arm = paths[0].arm if all(path.arm == paths[0].arm for path in paths) else _bare(paths[0].arm)
    return JointPath(
        arm=arm, s=s, psi=psi, **columns, certified=not open_,
        uncertified=np.concatenate(open_) if open_ else np.empty((0, 2)), path=Chain(segments, off),
        curve=JoinedCurve(curves, ends, turns, segments), start=paths[0].start, scenes=_scenes(paths),
    )  # fmt: skip
