"""``armangle view``: the arm in the browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..._arrays import Floats
from ...arm.arm import Arm
from ...errors import InputError, ModelError
from ...files.tables import load_joints, load_poses
from ...models.mjcf import is_mjcf
from ...motion.following import follow
from ...motion.joint_path import JointPath
from ...reach.voxels import ORIENTATIONS, voxels_of
from .. import paper_example
from ..arguments import ARM, SCENE, add, add_arm, add_scene, given, number, start_joints
from ..loading import is_description, links_of, with_scene
from ..messages import note
from ..motions import motion_of, motions_along
from ..screen import progress, show, show_json

HELP = """\
Show the arm in the browser: drag the tool, turn the elbow, see which joint
blocks which arm angle, play a motion of a FILE. Without --robot: a line that
begins near the joint limits, five ways. Serves this machine alone, unless
--address says otherwise, until Ctrl+C."""
EXAMPLE = """\
  armangle view
  armangle view joints.csv --robot kuka_iiwa7_r800"""

_HOST = "127.0.0.1"


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle view` to its parser."""
    parser.add_argument(
        "path", nargs="?", metavar="FILE", help="a motion to play: joints, or poses to step along"
    )
    add(parser, "start")
    parser.add_argument(
        "--voxels", type=number, metavar="M", help="show the reachable positions, on a grid of this width"
    )
    parser.add_argument(
        "--address", default="", metavar="HOST:PORT",
        help=f"address to serve at (default {_HOST}: the first free port from 8080 on; port 0: any)",
    )  # fmt: skip
    add_arm(parser, required=False)
    add_scene(parser)
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Serve the viewer until interrupted."""
    host, port = _address(args.address)
    if args.robot is None:
        for option in ("path", *given(args, ("start", *ARM, *SCENE))):
            if option != "path" or args.path is not None:
                raise InputError(
                    f"--{option} needs --robot: without it view shows the demo".replace("--path", "a FILE")
                )
    from ... import viewer

    arm = paper_example.example()[0] if args.robot is None else with_scene(args)
    start = None if args.start is None else start_joints(args.start, arm)
    runs = _demo() if args.robot is None else _runs(arm, args.path, start)
    described = args.robot is not None and is_description(args.robot)
    base, tip = links_of(args)
    shown = viewer.Viewer(
        viewer.ViewerState(arm, start), runs, port=port, host=host, base=base, tip=tip,
        urdf=Path(args.robot) if described and not is_mjcf(args.robot) else None,
    )  # fmt: skip
    if args.voxels is not None:
        with progress("finding reachable positions"):
            shown.show_voxels(voxels_of(arm, args.voxels, ORIENTATIONS))
    if shown.note:
        note(f"armangle: {shown.note}")
    if args.json:
        show_json({"robot": arm.name, "url": shown.url})
    else:
        show(f"{arm.name}: {shown.url} (Ctrl+C ends)")
    sys.stdout.flush()  # a script waits for the address
    try:
        shown.wait()
    except KeyboardInterrupt:
        pass
    finally:
        shown.stop()
    return 0


def _address(text: str) -> tuple[str, int | None]:
    """Return host and port of HOST:PORT, HOST (then port None) or :PORT (then the default host)."""
    host, colon, port = text.rpartition(":") if ":" in text else (text, "", "")
    if colon and not port.isdecimal():
        raise InputError(f"--address is {text!r}, wanted HOST:PORT")
    return host or _HOST, int(port) if colon else None


def _demo() -> dict[str, JointPath]:
    """Return the motions of the paper's example, one for each policy, by the policy's name."""
    arm, start, poses = paper_example.example()
    return {
        f"α = {policy.alpha:g}, K = {policy.K:g}": follow(
            arm, poses, start=start, policy=policy, max_joint_step=float("inf")
        )
        for policy in paper_example.POLICIES
    }


def _runs(arm: Arm, file: str | None, start: Floats | None) -> dict[str, JointPath]:
    """Return the motions of a file of joints or poses, by name."""
    if file is None:
        return {}
    with progress(f"reading {file}"):
        try:
            return {Path(file).name: motion_of(arm, load_joints(file))}
        except ModelError as no_joints:
            try:
                return motions_along(arm, load_poses(file), start)
            except ModelError as no_poses:
                message = f"neither joints ({no_joints}) nor poses ({no_poses})"
                raise ModelError(message, source=file) from None
