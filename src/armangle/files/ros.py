"""A trajectory as YAML in the shape of ROS trajectory_msgs/JointTrajectory."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

_NANOSECONDS = 1_000_000_000
_FIELDS = {"positions": "q", "velocities": "qd", "accelerations": "qdd"}


def write_joint_trajectory(
    names: tuple[str, ...], blocks: Mapping[str, NDArray[Any]], file: BinaryIO, frame: str = ""
) -> None:
    """Write joint names and the blocks t (N,), q, qd, qdd (N, 7) as one message.

    Words are quoted as JSON strings and lists are flow lists, which YAML reads alike.
    """
    head = ["header:", "  stamp: {sec: 0, nanosec: 0}", f"  frame_id: {json.dumps(frame)}"]
    head += [f"joint_names: {json.dumps(list(names))}", "points:"]
    file.write(("\n".join(head) + "\n").encode())
    columns = [np.asarray(blocks[name]).tolist() for name in _FIELDS.values()]
    for t, *rows in zip(np.asarray(blocks["t"]).tolist(), *columns, strict=True):
        seconds, rest = divmod(round(t * _NANOSECONDS), _NANOSECONDS)
        lines = [f"{field}: {json.dumps(row)}" for field, row in zip(_FIELDS, rows, strict=True)]
        lines += ["effort: []", f"time_from_start: {{sec: {seconds}, nanosec: {rest}}}"]
        file.write(("- " + "\n  ".join(lines) + "\n").encode())
