"""``armangle inspect``: what a robot description holds, as an S-R-S arm."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from .._catalogue import robot_toml
from .._replace import replacing
from .._tables import paint, paragraph, table
from ..arm import Arm
from ..description import ImportReport
from ..errors import NotSRSError, UrdfError
from ..urdf import urdf_candidates
from ._arguments import add_json
from ._screen import degrees, note, show, show_json

HELP = """\
Read a URDF between two links: is the arm S-R-S, how exactly, and which numbers
describe it. Base and tip are guessed, or their choices listed, where left out."""
EXAMPLE = "  armangle inspect robot.urdf --base link_0 --tip link_ee -o robot.toml"


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("file", metavar="FILE", help="a URDF")
    parser.add_argument("--base", metavar="LINK", help="first link")
    parser.add_argument("--tip", metavar="LINK", help="last link")
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write the numbers, for --robot")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the import report and the numbers; status 1 where the arm is not S-R-S."""
    base, tip = _links(args)
    try:
        arm = Arm.from_urdf(args.file, base=base, tip=tip)
    except NotSRSError as error:
        if args.json:
            show_json({"srs": False, "base": base, "tip": tip, "near": error.near, "reasons": error.reasons})
        note(f"armangle: {error}")
        return 1
    report = arm.import_report
    assert report is not None  # from_urdf always reports
    source = f"{report.source}, {report.base} to {report.tip}"
    text = robot_toml(arm._description(), title=arm.name, source=source, tip=report.tip)
    if args.json:
        show_json({"srs": True, **asdict(report), "reach": arm.reach, "toml": text})
    else:
        _show(arm, report)
        if args.output is None:
            show(f"\n{paint('As a file for --robot FILE.toml:', 'bold')}\n\n{text.rstrip()}")
    if args.output is not None:
        with replacing(args.output) as file:
            file.write(text.encode())
        note(f"wrote {args.output}")
    return 0


def _links(args: argparse.Namespace) -> tuple[str, str]:
    """Return base and tip, the missing ones guessed; all choices are listed where there are several."""
    if args.base is not None and args.tip is not None:
        return args.base, args.tip
    pairs = [
        (base, tip)
        for base, tip in urdf_candidates(args.file)
        if args.base in (None, base) and args.tip in (None, tip)
    ]
    if len(pairs) > 1:
        listed = "\n".join(f"  --base {base} --tip {tip}" for base, tip in pairs)
        raise UrdfError(f"several chains have seven rotating joints; name one of\n{listed}", source=args.file)
    return pairs[0] if pairs else (args.base, args.tip)


def _show(arm: Arm, report: ImportReport) -> None:
    show(paint(f"{arm.name}: S-R-S", "bold"))
    show(paragraph(f"{report.source}: {report.base} to {report.tip}") + "\n")
    rows = [
        ["three shoulder axes miss a point by", f"{report.shoulder_miss * 1e3:.6f}", "mm"],
        ["axes 3 and 5 meet axis 4 apart by", f"{report.elbow_miss * 1e3:.6f}", "mm"],
        ["three wrist axes miss a point by", f"{report.wrist_miss * 1e3:.6f}", "mm"],
        ["neighbouring axes are square within", degrees(report.angle_miss, 6), "deg"],
        ["position agrees with the file within", f"{report.residual_position * 1e3:.6f}", "mm"],
        ["orientation agrees with the file within", degrees(report.residual_rotation, 6), "deg"],
    ]
    show(table(["how exactly", "", ""], rows, left=(0, 2)))
    show()
    lengths = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4")
    show(f"lengths mm: {', '.join(f'{name} {getattr(arm, name) * 1e3:.6g}' for name in lengths)}")
    show(f"reach mm: {arm.reach * 1e3:.6g}")
    for line in report.notes:
        show(paragraph(f"note: {line}"))
    show()
    joints = [
        [str(i + 1), name, degrees(arm.lower[i], 2), degrees(arm.upper[i], 2)]
        for i, name in enumerate(report.joint_names)
    ]
    show(table(["joint", "name", "lower deg", "upper deg"], joints, left=(1,)))
