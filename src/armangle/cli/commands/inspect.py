"""``armangle inspect``: what a robot description holds, as an S-R-S arm, or one with an offset."""

from __future__ import annotations

import argparse
from dataclasses import asdict

import numpy as np

from ...arm.arm import Arm
from ...arm.deviation import LOOKED_AT
from ...arm.offset import OffsetArm
from ...errors import FileFormatError, InputError, NotSRSError
from ...files.replacing import replacing
from ...models.candidates import chosen
from ...models.catalogue import robot_toml
from ...models.description import ImportReport
from ...models.detect import ANGLE_TOLERANCE, LENGTH_TOLERANCE
from ...models.mjcf import is_mjcf, mjcf_candidates
from ...models.offset import COMMANDS
from ...models.urdf import urdf_candidates
from ...poses import COLUMNS, rows_from_poses
from ..arguments import add_import, add_json, arm_of_file, offset_arm_of_file
from ..messages import note, paragraph
from ..screen import degrees, progress, show, show_json
from ..tables import paint, table

HELP = """\
Read a URDF, or an MJCF (needs the package mujoco), between two links: is the
arm S-R-S, or but for an offset wrist or shoulder, how exactly, and which
numbers describe it. Base and tip are guessed, or their choices listed, S-R-S
ones first, where left out."""
EXAMPLE = "  armangle inspect robot.urdf --base link_0 --tip link_ee -o robot.toml"

_LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")
_SAME = 1e-12  # m, and of a rotation's entries


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("file", metavar="FILE", help="a URDF or MJCF")
    parser.add_argument("--base", metavar="LINK", help="first link")
    parser.add_argument("--tip", metavar="LINK", help="last link")
    add_import(parser)
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write the numbers, for --robot")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the import report and the numbers; status 1 where the arm is neither S-R-S nor an OffsetArm."""
    base, tip = _links(args)
    try:
        arm = arm_of_file(args.file, base, tip, args, show_notes=False)
    except NotSRSError as error:
        offset = None if error.near else _offset_arm(args, base, tip)
        if offset is not None:
            return _inspect_offset(offset, args)
        if args.json:
            show_json({"srs": False, "base": base, "tip": tip, "near": error.near, "reasons": error.reasons})
        note(f"armangle: {error}")
        return 1
    report = arm.import_report
    assert report is not None  # every import reports
    source = f"{report.source}, {report.base} to {report.tip}"
    if arm.chain is not None:
        return _inspect_chain(arm, report, args)
    text = robot_toml(arm._description(), title=arm.name, source=source, tip=report.tip)
    if args.json:
        show_json({"srs": True, **asdict(report), "reach": arm.reach, "toml": text})
    else:
        _show(arm, report, _kind(report), (*_LENGTHS, "d_4"))
        if args.output is None:
            show(f"\n{paint('As a file for --robot FILE.toml:', 'bold')}\n\n{text.rstrip()}")
    if args.output is not None:
        with replacing(args.output) as file:
            file.write(text.encode())
        note(f"wrote {args.output}")
    return 0


def _offset_arm(args: argparse.Namespace, base: str | None, tip: str | None) -> OffsetArm | None:
    """Return the arm with an offset wrist or shoulder, None where it is no such arm."""
    try:
        return offset_arm_of_file(args.file, base, tip, args, show_notes=False)
    except NotSRSError:
        return None


def _inspect_offset(arm: OffsetArm, args: argparse.Namespace) -> int:
    """Show an arm with an offset wrist or shoulder; a robot file holds S-R-S arms alone."""
    if args.output is not None:
        raise InputError("-o writes S-R-S arms, and this one has an offset wrist or shoulder: use its file")
    report = arm.import_report
    assert report is not None  # every import reports
    end, name = ("shoulder", "a_1") if arm.a_1 else ("wrist", "a_6")
    if args.json:
        values = {key: getattr(arm, key) for key in (*_LENGTHS, name, "lower", "upper", "signs", "offsets")}
        show_json({"srs": False, "offset": end, **asdict(report), "reach": arm.reach, **values, "toml": None})
    else:
        _show(arm, report, f"S-R-S but for an offset {end}", (*_LENGTHS, name))
        show()
        show(
            paragraph(
                f"for armangle.OffsetArm, and for {COMMANDS}: joint {arm.free_joint} takes the place of psi"
            )
        )
    return 0


def _inspect_chain(arm: Arm, report: ImportReport, args: argparse.Namespace) -> int:
    """Show an arm that keeps the chain of its file; a robot file holds exact arms alone."""
    if args.output is not None:
        raise InputError(
            "-o writes exact S-R-S arms, and --inexact keeps the chain of the file: use the file"
        )
    with progress("proving intervals"):
        share = arm.proven_share
    if args.json:
        near = {**asdict(report), "deviation": asdict(arm.deviation), "reach": arm.reach, "toml": None}
        show_json({"srs": False, "near": True, "proven_share": share, **near})
    else:
        _show(arm, report, _kind(report), (*_LENGTHS, "d_4"))
        show(paragraph(f"the chain of the file, from that arm: {arm.deviation}"))
        show(
            paragraph(
                f"at {100 * share:.3g} % of {LOOKED_AT} random poses all feasible intervals are proven; "
                "at the others what is not proven is left out"
            )
        )
    return 0


def _links(args: argparse.Namespace) -> tuple[str | None, str | None]:
    """Return base and tip, the missing ones left to the reader where it finds an arm; else the choices."""
    if args.tip is not None:
        return args.base, args.tip
    find = mjcf_candidates if is_mjcf(args.file) else urdf_candidates
    found = find(args.file, args.base)
    best = found[0].rank() if found else 0
    if not found or chosen(found, 0) is not None:
        return args.base, None
    one = chosen(found, best) if best == 1 else None  # with an offset, of which an Arm knows nothing
    if one is None:
        lines = [f"  --base {one.base} --tip {one.tip}  {one.verdict()}{one.other_tips()}" for one in found]
        message = "name base and tip; chains of seven rotating joints:\n" + "\n".join(lines)
        raise FileFormatError(message, source=args.file)
    return one.base, one.tip


def _kind(report: ImportReport) -> str:
    """Return what an arm is beside its file."""
    miss = max(report.shoulder_miss, report.wrist_miss)
    exact = miss <= LENGTH_TOLERANCE and report.angle_miss <= ANGLE_TOLERANCE
    return "S-R-S" if exact else "the S-R-S arm fitted to it"


def _show(arm: Arm | OffsetArm, report: ImportReport, kind: str, lengths: tuple[str, ...]) -> None:
    show(paint(f"{arm.name}: {kind}", "bold"))
    for line in str(report).splitlines():
        show(paint(paragraph(line), "bold") if line.startswith("note: ") else paragraph(line))
    show()
    show(paragraph(f"lengths mm: {', '.join(f'{name} {getattr(arm, name) * 1e3:.6g}' for name in lengths)}"))
    show(f"reach mm, shoulder to wrist: {arm.reach * 1e3:.6g}")
    for name, frame in (("base", arm.base), ("tool", arm.tool)):
        row = ",".join(f"{value:.6g}" for value in rows_from_poses(frame[None])[0].round(6) + 0.0)
        same = np.allclose(frame, np.eye(4), rtol=0, atol=_SAME)
        show(paragraph(f"{name} {','.join(COLUMNS)}: {'identity' if same else row}"))
    show()
    joints = [
        [str(i + 1), name, degrees(arm.lower[i], 2), degrees(arm.upper[i], 2), f"{arm.signs[i]:+d}",
         degrees(arm.offsets[i], 2)]
        for i, name in enumerate(report.joint_names)
    ]  # fmt: skip
    show(table(["joint", "name", "lower deg", "upper deg", "sign", "zero deg"], joints, left=(1,)))
