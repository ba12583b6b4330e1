"""Output of commands: results, JSON, notes, and progress."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from typing import Any

import numpy as np

from .._arrays import Floats
from .._progress import bar, progressing
from ..arm.arm import Arm
from ..arm.chain import edge_of_reach
from ..arm.configuration import gc_signs
from ..errors import UnreachableError
from ..files.sheets import plain
from ..files.tables import save
from ..files.trajectories import TrajectoryTable
from ..motion.joint_path import JointPath
from ..status import Status
from ..timing.trajectory import Trajectory
from .messages import note
from .tables import WIDTH, colourful, paint, plain_text, table

_PATIENCE = 0.5
_IN_ASCII = str.maketrans("█·", "#.")
_BLINK = 0.2
_MOST_ROWS = 20
_SHOWN = 10


def show(text: str = "") -> None:
    """Print text, in colour on a terminal only; characters that its encoding lacks are replaced."""
    text = text if colourful(sys.stdout) else plain_text(text)
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        text = text.translate(_IN_ASCII).encode(encoding, "replace").decode(encoding)
    print(text)


def show_json(value: Any) -> None:
    """Print JSON: arrays as lists, NaN as null, infinities as "inf", statuses as their names."""
    print(json.dumps(_jsonable(value), indent=1, allow_nan=False))


def _jsonable(value: Any) -> Any:
    """Return a value as what JSON can hold: arrays as lists, enums as names, NaN as None."""
    if isinstance(value, dict):
        return {key: _jsonable(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(item) for item in value]
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, (float, np.ndarray, np.generic)):
        return plain(np.asarray(value))
    return value


def fixed(value: float, digits: int) -> str:
    """Return a number with fixed digits, without a sign if all digits are zero.

    >>> fixed(-1e-9, 3), fixed(-0.25, 3)
    ('0.000', '-0.250')
    """
    text = f"{value:.{digits}f}"
    return text if float(text) else text.removeprefix("-")


def degrees(value: float, digits: int = 4) -> str:
    """Return an angle (rad) in degrees as text; "none" for an infinite one, "-" for NaN.

    >>> degrees(1.0225696851)
    '58.5889'
    """
    if np.isnan(value):
        return "-"
    return fixed(np.degrees(value), digits) if np.isfinite(value) else "none"


def counted(count: int, thing: str) -> str:
    """Return a count of things in words.

    >>> counted(1, "pose"), counted(0, "pose")
    ('1 pose', '0 poses')
    """
    return f"{count} {plural(count, thing)}"


def plural(count: int, thing: str) -> str:
    """Return the noun, with an s unless count is 1."""
    return thing if count == 1 else f"{thing}s"


def signs_text(gc: int) -> str:
    """Return a global configuration in words.

    >>> signs_text(3)
    'shoulder -, elbow -, wrist +'
    """
    signs = zip(("shoulder", "elbow", "wrist"), gc_signs(gc), strict=True)
    return ", ".join(f"{name} {'+' if sign > 0 else '-'}" for name, sign in signs)


def joint_margins(arm: Arm, q: Floats) -> Floats:
    """Return the distance of each joint to the nearer of its limits, rad, negative outside; shape of q."""
    return np.minimum(q - arm.lower, arm.upper - q)


def called(arm: Arm) -> str:
    """Return an arm's name and kind for errors about options that need an arm angle."""
    end = arm.kind.split("_")[1]
    return f"{arm.name or 'the arm'}, which has an offset {end} and no arm angle"


def violations(arm: Arm, q: Floats) -> str:
    """Return in words which joints of q (7,) violate limits, and by how much; empty if none does."""
    found = []
    for i, margin in enumerate(joint_margins(arm, q)):
        if margin < 0:
            side = "upper" if q[i] > arm.upper[i] else "lower"
            found.append(f"joint {i + 1} is {degrees(-margin)} deg beyond its {side} limit")
    return ", ".join(found)


def redundancy_name(arm: Arm) -> str:
    """Return the name of psi on screen: the arm angle, or the redundant joint of an arm with an offset."""
    return "psi" if arm.redundancy == "arm_angle" else arm.redundancy.replace("_", " ")


def unsolved_text(arm: Arm, pose: Floats, gc: int, status: Status) -> str:
    """Return in words why a pose (4, 4) has no solution; of an arm with an arm angle how far beyond reach."""
    if status == Status.UNREACHABLE and arm.redundancy == "arm_angle":
        try:
            arm.inverse(pose, 0.0, gc, limits=False)
        except UnreachableError as error:
            said = str(error)
            return f"{said}{'' if said.endswith('?') else '.'} {status.sentence}"
    if status == Status.NEAR_SINGULAR:
        return f"{status.sentence}{edge_of_reach(arm, pose)}"
    return status.sentence


def left_out(measures: Iterable[tuple[str, float]]) -> str:
    """Return in words how much of each circle is unproven (rad), by its name; empty if nothing is.

    >>> left_out([("gc 3", 0.1), ("gc 4", 0.0)])
    'not proven and left out, where branches meet: 5.73 deg of gc 3'
    """
    found = [f"{degrees(width, 2)} deg of {name}" for name, width in measures if width > 0]
    return f"not proven and left out, where branches meet: {', '.join(found)}" if found else ""


def head_and_tail(rows: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Return rows for the screen: all, or the first and last with a gap between."""
    if len(rows) <= _MOST_ROWS:
        return list(rows)
    return [*rows[:_SHOWN], ["..."] * len(rows[0]), *rows[-_SHOWN:]]


def show_configuration(arm: Arm, q: Floats, psi: float, gc: int) -> None:
    """Print joints with limits and margins, their arm angle and their branch."""
    angle = f"{paint(redundancy_name(arm), 'bold')} {degrees(psi)} deg"
    signs = "" if arm.redundancy != "arm_angle" else f" ({signs_text(gc)})"
    show(f"{angle}, {paint('gc', 'bold')} {gc}{signs}\n")
    margins = joint_margins(arm, q)
    rows = [
        [str(i + 1), arm.geometry.joint_names[i], degrees(q[i]), degrees(arm.lower[i], 2),
         degrees(arm.upper[i], 2), degrees(margins[i], 2)]
        for i in range(len(q))
    ]  # fmt: skip
    show(table(["joint", "name", "q deg", "lower", "upper", "margin"], rows, left=(1,)))


def show_speeds(arm: Arm, fastest: Floats, hardest: Floats) -> None:
    """Print the largest velocity (rad/s) and acceleration (rad/s²) of each joint, (7,), in degrees."""
    names = arm.geometry.joint_names
    rows = [[str(i + 1), names[i], degrees(fastest[i], 2), degrees(hardest[i], 2)] for i in range(len(names))]
    show(table(["joint", "name", "fastest deg/s", "hardest deg/s^2"], rows, left=(1,)))


def show_many(q: Floats, outcomes: Iterable[str]) -> None:
    """Print joints (N, 7) and the status of each, a row a pose."""
    pairs = enumerate(zip(q, outcomes, strict=True))
    rows = [[str(i), *(degrees(v, 2) for v in joints), name] for i, (joints, name) in pairs]
    show(table(["row", *(f"q{i}" for i in range(1, 8)), "deg"], head_and_tail(rows), left=(8,)))


def write(value: JointPath | Trajectory | TrajectoryTable | Floats, file: str) -> None:
    """Save a motion or poses and report it on stderr."""
    with progress(f"writing {file}"):
        save(value, file)
    note(f"wrote {file}")


@contextmanager
def progress(what: str) -> Iterator[None]:
    """Show a running task and its duration on a terminal, after half a second.

    Calls of the core that report their progress get a bar.
    """
    if not sys.stderr.isatty():
        yield
        return
    over, share = threading.Event(), list[tuple[int, int]]()
    ticker = threading.Thread(target=_tick, args=(what, over, share), daemon=True)
    ticker.start()
    try:
        with progressing(lambda done, total: share.__setitem__(slice(None), [(done, total)])):
            yield
    finally:
        over.set()
        ticker.join()


def _tick(what: str, over: threading.Event, share: list[tuple[int, int]]) -> None:
    """Print a task's progress and duration on a terminal until `over` is set."""
    start = time.monotonic()
    if over.wait(_PATIENCE):
        return
    while not over.wait(_BLINK):
        seconds = time.monotonic() - start
        line = f"{what} {bar(*share[0], seconds)}" if share else f"{what} ... {seconds:.1f} s"
        print(f"\r{line[: WIDTH - 1]:{WIDTH - 1}}", end="", file=sys.stderr, flush=True)
    print(f"\r{' ' * (WIDTH - 1)}\r", end="", file=sys.stderr, flush=True)
