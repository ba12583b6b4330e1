"""Fuzz the readers: URDF, robot TOML, poses as CSV, joints as CSV, NPZ, JSON.

Usage: texts.py [SECONDS] [SEED].

Valid files are cut, doubled, swapped and sprinkled with bytes and hostile tokens. A reader may return or
raise an `ArmangleError`, within two seconds; anything else is printed with its text, exit code 1.
"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import numpy as np

import armangle as aa
from armangle.models.catalogue import read_robot

TOKENS = (
    *(b"nan", b"inf", b"-inf", b"1e999", b"-0", b"0", b"1e-320", b"9" * 400, b"1 2", b"1 2 3 4", b"True"),
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\n", b"\r\n", b"\r", b"\t", "ψ".encode()),
    *(b'"', b"'", b"<", b">", b"&", b"&amp;", b",", b",,", b";", b"[", b"]", b"[[", b"{}", b"=", b"#"),
    *(b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&b;", b"prismatic", b"<joint/>", b"<link/>", b"utf-16"),
)
SECONDS_EACH = 2


def mutate(text: bytes, rng: random.Random) -> bytes:
    """Return the text with one to six wounds."""
    for _ in range(rng.randint(1, 6)):
        at, to = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        to = min(to, at + rng.choice([1, 4, 20, 300]))
        match rng.randrange(5):
            case 0:
                text = text[:at] + text[to:]
            case 1:
                text = text[:to] + text[at:]
            case 2:
                text = text[:at] + rng.choice(TOKENS) + text[to:]
            case 3:
                text = text[:at] + rng.choice(TOKENS) + text[at:]
            case _:
                text = text[:at] + bytes(rng.randrange(256) for _ in range(rng.randint(1, 4))) + text[to:]
    return text


def readers(folder: Path) -> list[tuple[str, bytes, Callable[[bytes], object]]]:
    """Return (name, valid text, function that reads bytes) of every reader."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    toml = Path(aa.__file__).parent / "models" / "robots" / "kuka_iiwa7_r800.toml"
    q = np.linspace(0.1, 0.7, 7) * np.linspace(0.9, 1.1, 12)[:, None]
    poses, joints = folder / "poses.csv", folder / "joints.csv"
    blocks = [folder / f"joints{ending}" for ending in (".npz", ".json")]
    aa.io.save(arm.forward(q)[0], poses)
    for path in (joints, *blocks):
        aa.io.save(aa.follow(arm, arm.forward(q)[0], start=q[0]), path)

    def from_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
        def run(text: bytes) -> object:
            path = folder / name
            path.write_bytes(text)
            return read(path)

        return run

    return [
        ("urdf", arm.to_urdf().encode(), lambda text: aa.Arm.from_urdf(text)),
        ("poses.csv", poses.read_bytes(), from_file("in.csv", aa.io.load_poses)),
        ("joints.csv", joints.read_bytes(), from_file("in.csv", aa.io.load_joints)),
        *(
            (path.name, path.read_bytes(), from_file(f"in{path.suffix}", aa.io.load_joints))
            for path in blocks
        ),
        ("toml", toml.read_bytes(), from_file("in.toml", read_robot)),
    ]


def timed_out(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError(f"no answer in {SECONDS_EACH} s")


def main() -> int:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int(time.time())
    rng = random.Random(seed)
    signal.signal(signal.SIGALRM, timed_out)
    tried: dict[str, int] = {}
    read: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as name:
        every = readers(Path(name))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            kind, text, function = rng.choice(every)
            text = mutate(text, rng)
            tried[kind] = tried.get(kind, 0) + 1
            signal.alarm(SECONDS_EACH)
            try:
                function(text)
                read[kind] = read.get(kind, 0) + 1
            except aa.ArmangleError:
                pass
            except BaseException:
                signal.alarm(0)
                traceback.print_exc()
                print(f"{kind} broke (seed {seed}) on:\n{text!r}")
                return 1
            signal.alarm(0)
    for kind, count in tried.items():
        print(f"{kind}: {count} texts, {read.get(kind, 0)} of them read, the others refused")
    return 0


if __name__ == "__main__":
    sys.exit(main())
