"""Run armangle and what else pip can install on the same poses; judge every answer independently.

    python benchmarks/peers.py [--only ours,ssik] [--poses 10000] [--seconds 60] [--venvs DIR] [--write]

Each peer gets a virtual environment of its own under --venvs (made on first use) and a process of its own
with a time limit; a peer that cannot be installed or fails is listed with the reason. All on one thread.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import venv
from dataclasses import dataclass
from pathlib import Path

import machine
import numpy as np
import report
from numpy.typing import NDArray

import armangle as aa

Floats = NDArray[np.float64]

HERE = Path(__file__).parent
SOLVED_POSITION, SOLVED_ANGLE, SLACK = 1e-5, 1e-5, 1e-6  # m, rad, rad
NEAR = 0.1  # rad, standard deviation of the near seed's disturbance
GRACE = 120.0  # s, for start and imports
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Peer:
    """``distribution`` is what is measured, ``needs`` what is installed beside it."""

    distribution: str
    module: str
    needs: tuple[str, ...] = ()


PEERS = {
    "ours": Peer("armangle", "ours"),
    "ssik": Peer("ssik", "peer_ssik"),
    "eaik": Peer("eaik", "peer_eaik"),
    "ik_geo": Peer("ik-geo", "peer_ik_geo"),
    "roboticstoolbox": Peer("roboticstoolbox-python", "peer_roboticstoolbox"),
    "placo": Peer("placo", "peer_placo"),
    "tracik": Peer("pytracik", "peer_tracik"),
    "pinocchio": Peer("pin", "peer_pinocchio"),
    "mink": Peer("mink", "peer_mink", ("daqp",)),
    "pink": Peer("pin-pink", "peer_pink", ("daqp",)),
    "drake": Peer("drake", "peer_drake"),
    "ikpy": Peer("ikpy", "peer_ikpy"),
}
NOT_RUN = {
    "pytorch-kinematics, cuRobo, PyRoki": "need gigabytes of PyTorch or JAX, and are meant for a GPU",
    "IKFast, KDL, KIT rll_sdk, stereo-sew": "not on PyPI as wheels: a generator, ROS or MATLAB is needed",
}


# -- the problems ----------------------------------------------------------------------------------


def make_problems(arm: aa.Arm, count: int) -> dict[str, NDArray[np.generic]]:
    """Return random feasible poses, near and far seeds, arm angles and GCs of the postures behind."""
    random = np.random.default_rng(2018)
    joints = random.uniform(arm.lower, arm.upper, (count, 7))
    near = np.clip(joints + NEAR * random.standard_normal((count, 7)), arm.lower, arm.upper)
    _, psi, gc = arm.forward(joints)
    return {
        "lower": arm.lower, "upper": arm.upper, "poses": forward(joints), "near": near,
        "far": random.uniform(arm.lower, arm.upper, (count, 7)), "psi": np.asarray(psi), "gc": np.asarray(gc),
    }  # fmt: skip


def forward(joints: Floats) -> Floats:
    """Return flange poses (N, 4, 4) by the DH rows of the paper's Table 1 with an iiwa 7's lengths."""
    alpha = np.pi / 2 * np.array([-1, 1, 1, -1, -1, 1, 0])
    lengths = (0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126)
    out = np.broadcast_to(np.eye(4), (len(joints), 4, 4))
    for theta, a, d in zip(joints.T, alpha, lengths, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(a), np.sin(a)
        row = np.zeros((len(joints), 4, 4))
        row[:, 0, 0], row[:, 0, 1], row[:, 0, 2] = c, -s * ca, s * sa
        row[:, 1, 0], row[:, 1, 1], row[:, 1, 2] = s, c * ca, -c * sa
        row[:, 2, 1], row[:, 2, 2], row[:, 2, 3] = sa, ca, d
        row[:, 3, 3] = 1.0
        out = out @ row
    return out


def errors(joints: Floats, poses: Floats) -> tuple[Floats, Floats]:
    """Return position (m) and rotation (rad) errors; NaN where there is no answer."""
    reached = forward(joints)
    position = np.linalg.norm(reached[:, :3, 3] - poses[:, :3, 3], axis=1)
    chord = np.linalg.norm(reached[:, :3, :3] - poses[:, :3, :3], axis=(1, 2)) / np.sqrt(8)
    return position, 2 * np.arcsin(np.minimum(chord, 1.0))


# -- running ---------------------------------------------------------------------------------------


def interpreter(name: str, peer: Peer, venvs: Path) -> Path:
    """Return the Python that has the peer; make its environment where it does not exist.

    Raises
    ------
    RuntimeError
        If pip cannot install the peer.
    """
    if name == "ours":
        return Path(sys.executable)
    python = venvs / name / "bin" / "python"
    if not python.exists():
        venv.create(venvs / name, with_pip=True)
    if version(python, peer.distribution):
        return python
    wanted = ["numpy", peer.distribution, *peer.needs]
    command = [python, "-m", "pip", "install", "--quiet", "--prefer-binary"]
    done = subprocess.run([*command, *wanted], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"does not install: {last_line(done.stderr)}")
    return python


def version(python: Path, distribution: str) -> str:
    """Return the installed version, or nothing."""
    code = f"from importlib.metadata import version; print(version({distribution!r}))"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True)
    return done.stdout.strip()


def last_line(text: str) -> str:
    """Return the line that says most about a failure, short."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1][:120] if lines else "no message"


def run_peer(peer: Peer, python: Path, folder: Path, seconds: float) -> dict[str, Floats]:
    """Return what the worker saved.

    Raises
    ------
    RuntimeError
        If it fails or does not end in time.
    """
    out = folder / f"{peer.module}.npz"
    files = [str(folder / "problems.npz"), str(folder / "arm.urdf"), str(out)]
    command = [str(python), "-m", "adapters.worker", peer.module, *files, str(seconds)]
    try:
        done = subprocess.run(
            command, cwd=HERE, env={**os.environ, **ONE_THREAD}, capture_output=True, text=True,
            timeout=seconds + GRACE,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"did not end within {seconds + GRACE:g} s") from None
    if done.returncode:
        raise RuntimeError(f"fails: {last_line(done.stderr)}")
    with np.load(out) as saved:
        return dict(saved)


# -- judging ---------------------------------------------------------------------------------------


def judge(results: dict[str, Floats], problems: dict[str, Floats]) -> list[list[str]]:
    """Return rows: use, seed, median, mean, p99, share solved within limits, errors, number of poses."""
    rows = []
    for key in dict.fromkeys(key.rpartition("|")[0] for key in results):
        use, _, seed = key.rpartition("|")
        times = results[f"{key}|times"] / 1000
        p99 = "" if seed == "batch" else number(np.quantile(times, 0.99))
        timing = [number(np.median(times)), number(np.mean(times)), p99]
        if seed == "arcs":
            arcs = results[f"{key}|arcs"]
            found = f"{np.mean(arcs):.2f} arcs, {np.mean(results[f'{key}|length']):.6f} rad a pose"
            rows.append([use, "", *timing, found, "", str(len(arcs))])
            continue
        joints = results[f"{key}|joints"]
        position, angle = errors(joints, problems["poses"][: len(joints)])
        inside = np.all((joints >= problems["lower"] - SLACK) & (joints <= problems["upper"] + SLACK), axis=1)
        solved = inside & (position <= SOLVED_POSITION) & (angle <= SOLVED_ANGLE)
        worst = f"{position[solved].max():.0e} m, {angle[solved].max():.0e} rad" if solved.any() else ""
        shown = {"none": "", "batch": ""}.get(seed, seed)
        rows.append([use, shown, *timing, f"{100 * np.mean(solved):.2f} %", worst, str(len(joints))])
    return rows


def number(us: float) -> str:
    """Return a time in µs with three digits."""
    return f"{us:.3g}" if us < 1000 else f"{us:.0f}"


def text(rows: list[list[str]], failures: dict[str, str], count: int, minutes: float) -> str:
    """Return the section of the README."""
    head = [
        "system, use", "seed", "median, µs", "mean", "p99", "solved within limits",
        "largest errors of the solved", "poses",
    ]  # fmt: skip
    lines = [
        f"{machine.describe()}.\n{count} random feasible poses of an iiwa 7, one call from Python a pose "
        f"unless the row says batch; the run took {minutes:.0f} minutes.",
        "",
        report.table(head, rows),
        "",
        "Not in the table:",
        "",
        *(f"- {name}: {reason}" for name, reason in failures.items()),
    ]
    return "\n".join(lines)


def main() -> None:
    """Run the peers one after another."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--only", default=",".join(PEERS))
    parser.add_argument("--poses", type=int, default=10_000)
    parser.add_argument("--seconds", type=float, default=60.0, help="time limit of one peer")
    parser.add_argument("--venvs", type=Path, default=Path.home() / ".cache" / "armangle-benchmarks")
    parser.add_argument("--write", action="store_true", help="put the table into README.md")
    options = parser.parse_args()
    started = time.monotonic()
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    problems = make_problems(arm, options.poses)
    rows: list[list[str]] = []
    failures = dict(NOT_RUN)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        np.savez(folder / "problems.npz", **problems)
        (folder / "arm.urdf").write_text(arm.to_urdf(), encoding="utf-8")
        for key in options.only.split(","):
            peer = PEERS[key]
            print(f"{peer.distribution} ...", file=sys.stderr, flush=True)
            try:
                python = interpreter(key, peer, options.venvs)
                results = run_peer(peer, python, folder, options.seconds)
            except RuntimeError as error:
                failures[peer.distribution] = str(error)
                continue
            number_of = aa.__version__ if key == "ours" else version(python, peer.distribution)
            label = f"{peer.distribution} {number_of}"
            rows += [[f"**{label}**: {row[0]}", *row[1:]] for row in judge(results, problems)]
    result = text(rows, failures, options.poses, (time.monotonic() - started) / 60)
    print(result)
    if options.write:
        report.write("peers", result)


if __name__ == "__main__":
    main()
