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
from ...scenes.scene import Scene
from .. import paper_example
from ..arguments import add_arm, add_json, add_scene, joints, number, the_arm, with_body
from ..messages import note
from ..motions import motion_of, motions_along
from ..screen import progress, show, show_json, violations

HELP = """\
Show the arm in the browser: drag the tool, turn the elbow, see which joint
blocks which arm angle, play a motion. Serves this machine alone, unless --host
says otherwise, until Ctrl+C."""
EXAMPLE = "  armangle view --demo"


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("--path", metavar="FILE", help="a motion to play: joints, or poses to step along")
    parser.add_argument(
        "--demo", action="store_true", help="play a line that begins near the limits, five ways"
    )
    parser.add_argument("--start", metavar="Q", help="first joints q1,..,q7 in degrees")
    parser.add_argument(
        "--voxels", type=number, metavar="M", help="show where the tool can be, on a grid so far apart"
    )
    parser.add_argument("--port", type=int, help="default: the first free one from 8080 on; 0: any")
    parser.add_argument("--host", default="127.0.0.1", help="address to serve at (default 127.0.0.1)")
    add_arm(parser, required=False)
    add_scene(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Serve until interrupted."""
    _check(args)
    from ... import viewer

    arm, scene = (paper_example.example()[0], None) if args.demo else with_body(the_arm(args), args)
    start = _start(arm, args.start)
    runs = _demo() if args.demo else _runs(arm, args.path, start, scene)
    meshes = None if args.urdf is None or is_mjcf(args.urdf) else Path(args.urdf)
    shown = viewer.Viewer(
        viewer.ViewerState(arm, start, scene=scene), runs, port=args.port, host=args.host,
        urdf=meshes, base=args.base, tip=args.tip,
    )  # fmt: skip
    if args.voxels is not None:
        with progress("asking where the tool can be"):
            shown.show_voxels(voxels_of(arm, args.voxels, ORIENTATIONS, 0.0, 0))
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


def _start(arm: Arm, text: str | None) -> Floats | None:
    """Return the first joints, which must be within the limits."""
    if text is None:
        return None
    start = joints("--start", text)
    if not arm.within_limits(start):
        raise InputError(f"--start is outside the limits: {violations(arm, start)}")
    return start


def _check(args: argparse.Namespace) -> None:
    named = args.robot is not None or args.urdf is not None
    if args.demo and (
        named or not all(value is None for value in (args.path, args.start, args.scene, args.body))
    ):
        raise InputError(
            "--demo brings its own arm, start and path: leave out --robot, --urdf, --path, --start, --scene"
        )
    if not args.demo and not named:
        raise InputError("view needs --robot NAME, --urdf FILE or --demo")


def _demo() -> dict[str, JointPath]:
    """Return the motions of the paper's arm, by name."""
    arm, start, poses = paper_example.example()
    return {
        f"α = {policy.alpha:g}, K = {policy.K:g}": follow(
            arm, poses, start=start, policy=policy, max_joint_step=float("inf")
        )
        for policy in paper_example.POLICIES
    }


def _runs(arm: Arm, file: str | None, start: Floats | None, scene: Scene | None) -> dict[str, JointPath]:
    """Return the motions of a file of joints or poses, by name."""
    if file is None:
        return {}
    with progress(f"reading {file}"):
        try:
            return {Path(file).name: motion_of(arm, load_joints(file))}
        except ModelError as no_joints:
            try:
                return motions_along(arm, load_poses(file), start, scene)
            except ModelError as no_poses:
                message = f"neither joints ({no_joints}) nor poses ({no_poses})"
                raise ModelError(message, source=file) from None
