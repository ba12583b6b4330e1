"""``armangle body``: balls and capsules that contain a robot's collision shapes."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...arm.arm import Arm
from ...files.replacing import replacing
from ...files.scenes import body_toml
from ...models.body import Body
from ...models.mjcf import is_mjcf
from ...scenes.ready import LinkPair, link_pairs
from ...scenes.shapes import Capsule
from ..arguments import add_json
from ..messages import note, paragraph
from ..screen import show, show_json
from ..tables import table

HELP = """\
Balls and capsules that provably contain the collision shapes of a URDF or MJCF,
link by link: the body that --scene asks for."""
EXAMPLE = "  armangle body robot.urdf -o body.toml"


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("file", metavar="FILE", help="a URDF or MJCF with collision shapes")
    parser.add_argument("--base", metavar="LINK", help="first link; guessed if left out")
    parser.add_argument("--tip", metavar="LINK", help="last link; guessed if left out")
    parser.add_argument(
        "--shapes", type=int, default=6, metavar="N", help="at most so many for one shape (default 6)"
    )
    parser.add_argument(
        "--hulls", action="store_true", help="meshes that are not closed stand for their convex hulls"
    )
    parser.add_argument(
        "--inexact", action="store_true",
        help="of a file that is only nearly S-R-S, for the arm of --urdf FILE --inexact",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write the body, for --body")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the body."""
    exact, ends = not args.inexact, (args.base, args.tip)
    if is_mjcf(args.file):
        body = Body.from_mjcf(args.file, *ends, shapes=args.shapes, exact=exact)
        arm = Arm.from_mjcf(args.file, *ends, exact=exact)
    else:
        body = Body.from_urdf(args.file, *ends, shapes=args.shapes, hulls=args.hulls, exact=exact)
        arm = Arm.from_urdf(args.file, *ends, exact=exact)
    pairs = link_pairs(arm.with_body(body))
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
        with replacing(args.output) as file:
            file.write(body_toml(body).encode())
        note(f"wrote {args.output}")
    return 0


def _said(pairs: list[LinkPair]) -> Iterator[str]:
    """Return what is known of own links: who never meets, with proof, and who is asked."""
    never = [pair for pair in pairs if pair.apart is not None and not pair.ignored]
    asked = [pair for pair in pairs if pair.apart is None and not pair.ignored]
    yield "links side by side are not asked about each other"
    if never:
        listed = ", ".join(f"{' and '.join(p.links)} ({1e3 * (p.apart or 0.0):.0f} mm)" for p in never)
        yield f"never meet, proven for all joint values, with the distance that is proven: {listed}"
    if asked:
        yield f"asked about each other: {', '.join(' and '.join(pair.links) for pair in asked)}"


def _facts(frame: int, shape: Any) -> dict[str, Any]:
    capsule = isinstance(shape, Capsule)
    length = float(np.linalg.norm(np.subtract(shape.end, shape.begin))) if capsule else 0.0
    volume = np.pi * shape.radius**2 * (length + 4 / 3 * shape.radius)
    return {
        "link": frame, "name": shape.name, "kind": "capsule" if capsule else "ball",
        "radius": shape.radius, "length": length, "volume": float(volume),
    }  # fmt: skip
