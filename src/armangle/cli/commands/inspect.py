"""``armangle inspect``: an arm, the pose of its joints, and its collision model."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ... import kuka
from ..._arrays import Floats, Ints
from ...arm.arm import Arm
from ...arm.deviation import LOOKED_AT
from ...errors import InputError, ModelError
from ...files.replacing import replacing
from ...files.scenes import body_toml
from ...files.sheets import ending
from ...files.tables import load_joints
from ...models.axes import exceeds
from ...models.catalogue import robot_toml
from ...models.cover import Rod
from ...models.detect import ANGLE_TOLERANCE, LENGTH_TOLERANCE
from ...poses import COLUMNS, rows_from_poses
from ...scenes.ready import LinkPair, link_pairs
from ...scenes.shapes import Capsule
from ..arguments import add, is_file, joints, refuse, some_joints
from ..loading import any_arm, body_of_file, is_description, links_of, srs
from ..messages import note, paragraph
from ..motions import motion_of
from ..pictures import draw
from ..screen import (
    degrees,
    fixed,
    head_and_tail,
    progress,
    redundancy_name,
    show,
    show_json,
    signs_text,
    violations,
    write,
)
from ..solving import forward
from ..tables import paint, table

HELP = """\
Show an arm of the catalogue or of a file (URDF, MJCF, TOML): its kind, its
numbers, and how exactly they describe the file. --joints shows the pose, the
arm angle and the branch of joints. --body shows balls and capsules that contain
the collision shapes of a file."""
EXAMPLE = """\
  armangle inspect robot.urdf --links link_0,link_ee -o robot.toml
  armangle inspect kuka_iiwa7_r800 --joints 10,20,30,-40,50,60,70"""

_LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")
_DEVIATION = ("position_rms", "position_max", "rotation_rms", "rotation_max", "bands")
_SAME = 1e-12  # m, and of a rotation's entries


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle inspect` to its parser."""
    parser.add_argument("robot", metavar="ARM", help="a name of the catalogue, or a URDF, MJCF or TOML")
    add(parser, "links", "tool", "joints")
    parser.add_argument(
        "--fit", metavar="KIND[,MM,DEG]",
        help="read a file with its own kinematics (own, the default) or as the S-R-S arm fitted to it (srs); "
        "axes off by less than MM and DEG count as exact",
    )  # fmt: skip
    parser.add_argument(
        "--continuous-limits",
        choices=("ignore", "use"),
        help="limits of continuous joints of a URDF (default ignore)",
    )
    parser.add_argument(
        "--kuka",
        action="store_true",
        help="with --joints, also the KUKA frame: X..C (mm, deg), E1, Status, Turn",
    )
    parser.add_argument(
        "--body", nargs="?", const="6", metavar="N[,hulls]",
        help="collision model of the file, at most N shapes for each of its own; hulls: an open "
        "mesh stands for its convex hull",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="FILE",
        help="write the arm (.urdf, or .toml if S-R-S), the poses of --joints, or the --body (.toml)",
    )  # fmt: skip
    add(parser, "plot", help="with a joint FILE, draw the arm angle and the joints: .png, .svg or .pdf")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print the requested data of the arm; status 1 if its kind is unsupported or joints violate limits."""
    if args.joints is None:
        refuse(args, ("kuka", "plot"), "the arm alone: give --joints")
    if args.body is not None:
        refuse(args, ("joints", "tool", "fit"), "--body")
        return _body(args)
    try:
        arm = any_arm(args, quiet=args.joints is None)
    except ModelError as error:
        if not error.reasons:  # a file that cannot be read
            raise
        if args.json:
            show_json({"kind": None, "near": error.near, "reasons": error.reasons})
        note(f"armangle: {error}")
        return 1
    return _describe(arm, args) if args.joints is None else _place(arm, args)


# -- the arm ---------------------------------------------------------------------------------------------


def _describe(arm: Arm, args: argparse.Namespace) -> int:
    """Print the numbers of the arm, and write it to --output if given; return 0."""
    kind, report = _kind(arm), arm.report
    offset = "a_1" if arm.geometry.a_1 else "a_6" if arm.geometry.a_6 else "d_4"
    text = _toml(arm) if kind in ("srs", "srs_fitted") else None
    if args.output is not None:
        _write_arm(arm, text, args.output)
    if args.json:
        numbers = {
            name: arm._number(name)
            for name in (*_LENGTHS, offset, "lower", "upper", "signs", "offsets", "reach")
        }
        facts = {"kind": kind, "redundancy": arm.redundancy, **({} if report is None else asdict(report))}
        deviation: dict[str, Any] = {}
        if kind == "srs_chain":
            deviation["deviation"] = {name: getattr(arm.deviation, name) for name in _DEVIATION}
        if arm.geometry.chain is not None:
            deviation["proven_share"] = arm.deviation.proven_share
        show_json(facts | numbers | deviation | {"toml": text})
        return 0
    show(paint(f"{arm.name}: {_KINDS[kind]}", "bold"))
    for line in () if report is None else str(report).splitlines():
        show(paint(paragraph(line), "bold") if line.startswith("note: ") else paragraph(line))
    show()
    lengths = ", ".join(f"{name} {arm._number(name) * 1e3:.6g}" for name in (*_LENGTHS, offset))
    show(paragraph(f"lengths mm: {lengths}"))
    show(f"reach mm, shoulder to wrist: {arm.geometry.reach * 1e3:.6g}")
    for name, frame in (("base", arm.base), ("tool", arm.tool)):
        row = ",".join(f"{value:.6g}" for value in rows_from_poses(frame[None])[0].round(6) + 0.0)
        same = np.allclose(frame, np.eye(4), rtol=0, atol=_SAME)
        show(paragraph(f"{name} {','.join(COLUMNS)}: {'identity' if same else row}"))
    show()
    rows = [
        [str(i + 1), name, degrees(arm.lower[i], 2), degrees(arm.upper[i], 2), f"{arm.geometry.signs[i]:+d}",
         degrees(arm.geometry.offsets[i], 2)]
        for i, name in enumerate(arm.geometry.joint_names)
    ]  # fmt: skip
    show(table(["joint", "name", "lower deg", "upper deg", "sign", "zero deg"], rows, left=(1,)))
    if arm.redundancy != "arm_angle":
        show(paragraph(f"\n{redundancy_name(arm)} is the redundancy: psi is its value."))
    if kind == "srs_chain":
        show(paragraph(f"the chain of the file, from that arm: {arm.deviation}"))
    if arm.geometry.chain is not None:
        with progress("proving intervals"):
            share = arm.deviation.proven_share
        show(
            paragraph(f"all feasible intervals are proven at {100 * share:.3g} % of {LOOKED_AT} random poses")
        )
    elif kind in ("srs", "srs_fitted") and args.output is None and is_description(args.robot):
        show(f"\n{paint('As a file for --robot FILE.toml:', 'bold')}\n\n{(text or '').rstrip()}")
    return 0


_KINDS = {
    "srs": "S-R-S",
    "srs_fitted": "the S-R-S arm fitted to it",
    "srs_chain": "its own chain, near the S-R-S arm fitted to it",
    "offset_wrist": "S-R-S but for an offset wrist",
    "offset_shoulder": "S-R-S but for an offset shoulder",
    "offset_wrist_chain": "its own chain, near an arm that is S-R-S but for an offset wrist",
    "offset_shoulder_chain": "its own chain, near an arm that is S-R-S but for an offset shoulder",
}


def _kind(arm: Arm) -> str:
    """Return the kind of an arm, a key of `_KINDS`."""
    report = arm.report
    if arm.kind != "srs" or report is None:
        return arm.kind
    miss = max(report.shoulder_miss, report.wrist_miss)
    fitted = exceeds(miss, LENGTH_TOLERANCE) or exceeds(report.angle_miss, ANGLE_TOLERANCE)
    return "srs_fitted" if fitted else "srs"


def _toml(arm: Arm) -> str:
    """Return the numbers of an S-R-S arm as TOML."""
    report = arm.report
    source = "" if report is None else f"{report.source}, {report.base} to {report.tip}"
    tip = "" if report is None else report.tip
    return robot_toml(srs(arm, "TOML")._description(), title=arm.name, source=source, tip=tip)


def _write_arm(arm: Arm, text: str | None, file: str) -> None:
    """Write the arm in the format of the file's ending."""
    suffix = Path(file).suffix.lower()
    if suffix not in (".toml", ".urdf"):
        raise InputError(f"{file}: unknown ending, wanted .toml or .urdf for an arm")
    if suffix == ".toml" and text is None:
        raise InputError(
            f"-o {file}: TOML holds exact S-R-S arms, and this is {_KINDS[_kind(arm)]}: write .urdf"
        )
    _write(arm.to_urdf() if suffix == ".urdf" else text or "", file)


def _write(text: str, file: str) -> None:
    """Write text to a file and print its name to stderr."""
    with replacing(file) as out:
        out.write(text.encode())
    note(f"wrote {file}")


# -- the pose of joints ----------------------------------------------------------------------------------


def _place(arm: Arm, args: argparse.Namespace) -> int:
    """Print and write the pose of joints, status 1 if they violate limits; with --plot draw instead."""
    many = is_file(args.joints)
    if args.plot is not None and not many:
        raise InputError("--plot draws a motion: give --joints FILE")
    if args.output is not None:
        ending(args.output)
    if args.plot is not None:
        return _draw(arm, args)
    q = some_joints(args.joints) if many else joints("--joints", args.joints)
    with progress("placing the tool"):
        pose, psi, gc = forward(arm, q)
    within = np.atleast_1d(arm.within_limits(q))
    frames = [kuka.to_frame(srs(arm, "--kuka"), row) for row in np.atleast_2d(q)] if args.kuka else []
    if args.output is not None:
        write(pose, args.output)
    if args.json:
        seven = rows_from_poses(pose.reshape(-1, 4, 4)).reshape(*np.shape(psi), len(COLUMNS))
        facts = {"pose": seven, "matrix": pose, "psi": psi, "gc": gc, "redundancy": arm.redundancy}
        codes = [{"e1": f.e1, "status": f.status, "turn": f.turn, "abc": kuka.abc(f.pose)} for f in frames]
        facts |= {"within_limits": within if many else bool(within[0])}
        show_json(facts | ({"kuka": codes if many else codes[0]} if codes else {}))
    elif many:
        _show_many(arm, pose, psi, gc, np.asarray(arm.limit_margin(q)))
    else:
        _show_one(arm, q, pose, float(psi), int(gc))
    for frame in frames if not args.json else ():
        show(f"{paint('KUKA', 'bold')}    {kuka.text(frame)}")
    if not within.all():
        first = int(np.argmin(within))
        where = f"row {first}: " if many else ""
        note(f"armangle: outside its limits: {where}{violations(arm, np.atleast_2d(q)[first])}")
    return 0 if within.all() else 1


def _draw(arm: Arm, args: argparse.Namespace) -> int:
    """Draw the motion of a joint file, which may have rows without joints."""
    refuse(args, ("output", "kuka"), "--plot")
    path = motion_of(arm, load_joints(args.joints))
    draw("path", args.plot, path)
    if args.json:
        show_json({"plot": args.plot})
    if not path.ok:
        note(f"armangle: {args.joints}: {path.explain()}")
    return 0


def _show_one(arm: Arm, q: Floats, pose: Floats, psi: float, gc: int) -> None:
    """Print pose (m), arm angle, branch and limit margin (deg) of one row of joints."""
    show(paint("pose (m)", "bold"))
    for line in pose:
        show(" ".join(f"{fixed(value, 6):>10}" for value in line))
    show(f"\n{paint(','.join(COLUMNS), 'bold')}")
    show(",".join(fixed(value, 7) for value in rows_from_poses(pose[None])[0]))
    angle = "not defined: the wrist lies on the shoulder" if np.isnan(psi) else f"{degrees(psi)} deg"
    signs = "" if arm.redundancy != "arm_angle" else f" ({signs_text(gc)})"
    show(f"\n{paint(f'{redundancy_name(arm):7}', 'bold')} {angle}")
    show(f"{paint('gc', 'bold')}      {gc}{signs}")
    show(f"{paint('margin', 'bold')}  {degrees(float(arm.limit_margin(q)))} deg to the nearest limit")


def _show_many(arm: Arm, pose: Floats, psi: Floats, gc: Ints, margin: Floats) -> None:
    """Print a table of positions (m), arm angles, branches and limit margins (deg), one row for each pose."""
    rows = [
        [str(i), *(fixed(v, 4) for v in pose[i, :3, 3]), degrees(psi[i]), str(gc[i]), degrees(margin[i])]
        for i in range(len(psi))
    ]
    headings = ["row", "x m", "y m", "z m", f"{redundancy_name(arm)} deg", "gc", "margin deg"]
    show(table(headings, head_and_tail(rows)))


# -- the collision model ---------------------------------------------------------------------------------


def _body(args: argparse.Namespace) -> int:
    """Print the collision model of a file and write it to --output; return 0."""
    if not is_description(args.robot):
        raise InputError(f"--body reads the collision shapes of a URDF or MJCF, and {args.robot} is none")
    shapes, _, hulls = args.body.partition(",")
    if not shapes.isdecimal() or hulls not in ("", "hulls"):
        raise InputError(f"--body is {args.body!r}, wanted N or N,hulls")
    arm = srs(any_arm(args), "--body")
    options: dict[str, Any] = {"shapes": int(shapes)} | ({"hulls": True} if hulls else {})
    body = body_of_file(args.robot, links_of(args), **options)
    pairs = link_pairs(arm.with_(body=body))
    facts = [_facts(frame, shape) for frame, shapes in body.links for shape in shapes]
    if args.json:
        own = [{"links": pair.links, "apart": pair.apart, "ignored": pair.ignored} for pair in pairs]
        show_json({"shapes": facts, "pairs": own, "ignore": body.ignore, "notes": body.notes})
    else:
        rows = [
            [str(row["link"]), row["name"], row["kind"], f"{1e3 * row['radius']:.1f}",
             f"{1e3 * row['length']:.1f}", f"{1e3 * row['volume']:.2f}"]
            for row in facts
        ]  # fmt: skip
        show(table(["frame", "link", "shape", "radius mm", "length mm", "litres"], rows, left=(1, 2)))
        show(f"\n{len(facts)} shapes, {1e3 * sum(row['volume'] for row in facts):.1f} litres")
        for line in [*_said(pairs), *body.notes]:
            show(paragraph(line))
    if args.output is not None:
        _write(body_toml(body), args.output)
    return 0


def _said(pairs: list[LinkPair]) -> Iterator[str]:
    """Yield sentences: which pairs of links provably never collide, and which are checked."""
    never = [pair for pair in pairs if pair.apart is not None and not pair.ignored]
    checked = [pair for pair in pairs if pair.apart is None and not pair.ignored]
    yield "Neighbouring links are not checked against each other."
    if never:
        listed = ", ".join(f"{' and '.join(p.links)} ({1e3 * (p.apart or 0.0):.0f} mm)" for p in never)
        yield f"Never collide, proven for all joint values, with the proven distance: {listed}"
    if checked:
        yield f"Checked against each other: {', '.join(' and '.join(pair.links) for pair in checked)}"


def _facts(frame: int, shape: Any) -> dict[str, Any]:
    """Return kind, frame, radius, length (m) and volume (m³) of a shape of the collision model."""
    capsule = isinstance(shape, Capsule)
    ends = (shape.begin, shape.end) if capsule else (shape.center, shape.center)
    begin, end = map(np.array, ends)
    rod = Rod(begin, end, shape.radius)
    return {
        "link": frame, "name": shape.name, "kind": "capsule" if capsule else "ball",
        "radius": shape.radius, "length": rod.length, "volume": rod.volume,
    }  # fmt: skip
