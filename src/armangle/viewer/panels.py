"""The viewer's panels as HTML: status, arcs under the slider, reasons, the feasible map of a motion."""

from __future__ import annotations

import base64
import struct
import zlib
from html import escape

import numpy as np
from numpy.typing import NDArray

from .._arrays import JOINTS, Floats
from .._core import Wanted
from ..arm.skeleton import blocker_of, unsolved
from ..colours import (
    BLACK,
    FREE,
    JOINT_COLOURS,
    MID,
    OBSTACLE,
    PALE,
    pieces,
    unjoined,
    wrapped_degrees,
)
from ..motion.joint_path import JointPath
from ..scenes.scene import Scene
from ..status import Status
from .state import ViewerState, degrees_text

_FRAME = "padding:0 0.9em 0.5em;font:12px/1.35 system-ui,sans-serif"
_REFUSED = "color:#B04A00"
_MAP_WIDTH, _MAP_HEIGHT = 200, 180
_BUTTON = 76  # px: the name of a branch, with its margins
_PALETTE = (FREE, *JOINT_COLOURS, OBSTACLE, PALE, MID)  # in the order of `blocker_of`, and of no solution
_LOST = len(_PALETTE) - 1


def status_panel(state: ViewerState) -> str:
    """Return the state of the arm in words, as HTML."""
    margin = np.degrees(float(state.arm.limit_margin(state.q)))
    near = f"{margin:.1f}° to the nearest limit" if np.isfinite(margin) else "no limits"
    facts = f"GC {state.gc}, ψ = {degrees_text(state.psi)}, {near}"
    words = state.message or state.touching
    said = f'<div style="{_REFUSED}">{escape(words)}</div>' if words else _nearest(state)
    return (
        f'<div style="{_FRAME}" data-panel="status"><b>{escape(state.arm.name)}</b><br>{facts}'
        f'<div style="min-height:2.7em">{said}</div></div>'
    )


def _nearest(state: ViewerState) -> str:
    """Return HTML that says how near which link is to which obstacle; "" without a scene."""
    near = state.nearest
    if near is None or near.obstacle is None:
        return ""
    words = f"{1e3 * float(near.distance):.0f} mm from {near.link} to {near.obstacle}"
    return f"<div>{escape(words)}</div>"


def arcs_panel(state: ViewerState) -> str:
    """Return the arm angle's circle as a strip: feasible light, blocked in the colour of the joint.

    Dark is blocked by an obstacle. For an arm that is not S-R-S, pale is unproven and grey has no solution.
    """
    each = state.arm.feasible(state.pose, state.gc, per_joint=True)
    left_out = state.arm._left_out(state.pose, state.gc, Wanted.JOINTS)
    unproven_bars = pieces(state.arm._left_out(state.pose, state.gc).intervals)
    bars, obstacles = _obstacles(state)
    blocking = []
    bars += [_bar(low, high, PALE) for low, high in unproven_bars]
    none = unsolved(state.arm, state.pose, state.gc)
    lost_bars = pieces(none.intervals)
    for joint in range(JOINTS, 0, -1):
        blocked = pieces((~each[joint - 1])._less(left_out[joint - 1])._less(none).intervals)
        if blocked:
            blocking.append(joint)
        bars += [_bar(low, high, JOINT_COLOURS[joint - 1]) for low, high in blocked]
    bars += [_bar(low, high, MID) for low, high in lost_bars]
    at = (np.degrees(state.psi) + 180) / 3.6
    listed = [(f"joint {joint}", JOINT_COLOURS[joint - 1]) for joint in sorted(blocking)]
    listed += [(name, OBSTACLE) for name in obstacles]
    open_key = f"; {_key('not proven', PALE)}" if unproven_bars else ""
    open_key += f"; {_key('no solution', MID)}" if lost_bars else ""
    keys = " ".join(_key(name, colour) for name, colour in listed)
    said = f"blocked by {keys}" if keys else "nothing blocks"
    return (
        f'<div style="{_FRAME}" data-panel="arcs">'
        f'<div style="position:relative;height:14px;background:{FREE};border:1px solid {MID}">'
        f"{''.join(bars)}{_marker(at)}</div>"
        f'<div style="display:flex;justify-content:space-between"><span>−180°</span><span>0°</span>'
        f"<span>180°</span></div>{_key('feasible', FREE)}; {said}{open_key}</div>"
    )


def _key(name: str, colour: str) -> str:
    """Return HTML with a coloured square and the name that it stands for."""
    square = f'<span style="color:{colour}">■</span>'
    return f'<span style="white-space:nowrap">{square} {escape(name)}</span>'


def _obstacles(state: ViewerState) -> tuple[list[str], list[str]]:
    """Return the bars of arm angles that the scene blocks, and the names of the obstacles, or own links, at
    which arcs end, or that block all arm angles.
    """
    if state.scene is None:
        return [], []
    clear = state.arm._clear(state.pose, state.gc, state.scene)
    blocked = (~clear)._less(unsolved(state.arm, state.pose, state.gc))
    bars = [_bar(low, high, OBSTACLE) for low, high in pieces(blocked.intervals)]
    names = [end.obstacle for pair in clear.ends for end in pair if end.obstacle is not None]
    return bars, list(dict.fromkeys(names or (clear.blocking or ())[:1]))


def _bar(low: float, high: float, colour: str) -> str:
    """Return HTML of a bar of the strip from one angle to another, deg."""
    left, width = (low + 180) / 3.6, (high - low) / 3.6
    return (
        f'<div style="position:absolute;top:0;bottom:0;left:{left:.3f}%;width:{width:.3f}%;'
        f'background:{colour}"></div>'
    )


def _marker(percent: float) -> str:
    """Return HTML of the mark on the strip at the present arm angle."""
    return (
        f'<div style="position:absolute;top:-3px;bottom:-3px;left:calc({percent:.3f}% - 1px);width:3px;'
        f'background:{BLACK};outline:1px solid white"></div>'
    )


def reasons_panel(state: ViewerState) -> str:
    """Return why configurations have no solution, one line for each reason."""
    reasons: dict[str, list[str]] = {}
    for gc, reason in enumerate(state.reasons()):
        if reason is not None:
            reasons.setdefault(reason, []).append(str(gc))
    lines = [
        f'<div data-gc="{" ".join(who)}"><b>GC {", ".join(who)}</b>: {escape(reason)}</div>'
        for reason, who in reasons.items()
    ]
    return (
        f'<div style="{_FRAME}" data-panel="reasons">{"".join(lines) or "All eight have a solution."}</div>'
    )


def note_panel(text: str) -> str:
    """Return why the typed numbers were rejected, or nothing."""
    return f'<div style="{_FRAME};{_REFUSED}" data-panel="note">{escape(text)}</div>' if text else ""


def row_style(name: str, count: int, gap: int) -> str:
    """Return HTML that puts the following buttons side by side, at most `count` in a row; viser stacks them.

    `gap` is the margin on each side of a button, px.
    """
    beside = f'div:has(> [data-row="{name}"]) ~ div:has(> button)'
    width = f"max({100 / count}%,{_BUTTON}px)"  # on a phone fewer fit in a row, and their names stay whole
    return (
        f'<style data-row="{name}">{beside}{{display:inline-block;box-sizing:border-box;width:{width};'
        f"margin:0!important;padding:0 {gap}px 6px!important}}"
        f"{beside} button{{padding:0;font-size:12px}}</style>"
    )


def map_image(motion: JointPath, scene: Scene | None = None) -> str:
    """Return the feasible map of a motion's own configuration as the data URL of a small PNG.

    With a scene, arm angles blocked by obstacles alone are dark; unproven ones are pale.
    """
    rows = np.unique(np.linspace(0, len(motion) - 1, min(_MAP_WIDTH, len(motion))).round().astype(int))
    known = motion.gc[rows] >= 0
    gc = np.where(known, motion.gc[rows], motion.gc[rows][known][:1] if known.any() else 0)
    psi = np.radians(180 - (np.arange(_MAP_HEIGHT) + 0.5) * 360 / _MAP_HEIGHT)
    cells = np.full((len(rows), _MAP_HEIGHT), _LOST)
    posed = np.isfinite(motion.poses[rows]).all(axis=(1, 2))  # failed rows of a joint file have no pose
    poses, gc = motion.poses[rows[posed]], gc[posed]
    blocked = blocker_of(motion.arm, poses[:, None], gc[:, None], psi[None, :], scene)
    lost = np.isin(motion.arm.feasible(poses, gc).status, (Status.UNREACHABLE, Status.FOLDED))
    none = unsolved(motion.arm, poses[:, None], gc[:, None]).contains(psi[None, :])
    cells[posed] = np.where(lost[:, None] | none, _LOST, blocked)
    return "data:image/png;base64," + base64.b64encode(png(cells.T.astype(np.uint8), _PALETTE)).decode()


def png(cells: NDArray[np.uint8], palette: tuple[str, ...]) -> bytes:
    """Return cells (rows, columns), indices into a palette of "#RRGGBB", as a PNG file."""
    height, width = cells.shape
    lines = np.hstack([np.zeros((height, 1), dtype=np.uint8), cells]).tobytes()
    colours = b"".join(bytes.fromhex(colour[1:]) for colour in palette)
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = ((b"IHDR", header), (b"PLTE", colours), (b"IDAT", zlib.compress(lines)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in parts
    )


def map_panel(motion: JointPath, image: str, row: int) -> str:
    """Return a motion's `map_image` with its curve and a line at a row, as HTML."""
    s, psi = unjoined(motion.s, wrapped_degrees(motion.psi))
    span = max(float(motion.s[-1] - motion.s[0]), np.finfo(float).tiny)
    points = _polylines((s - motion.s[0]) / span, psi)
    at = 100 * float((motion.s[row] - motion.s[0]) / span)
    dot = wrapped_degrees(motion.psi[row : row + 1])[0]
    place = f'<circle cx="{at:.2f}" cy="{(180 - dot) / 3.6:.2f}" r="1.6"/>' if np.isfinite(dot) else ""
    return (
        f'<div style="{_FRAME}" data-panel="map">ψ over the path: {_key("feasible", FREE)}, the rest blocked'
        f'<div style="position:relative;height:150px;border:1px solid {MID}">'
        f'<img src="{image}" alt="feasible map" style="position:absolute;width:100%;height:100%;'
        f'image-rendering:pixelated"><svg viewBox="0 0 100 100" preserveAspectRatio="none" '
        f'style="position:absolute;width:100%;height:100%">{points}'
        f'<line x1="{at:.2f}" x2="{at:.2f}" y1="0" y2="100" stroke="{BLACK}" stroke-width="1" '
        f'vector-effect="non-scaling-stroke" stroke-dasharray="3 2"/>{place}</svg></div>'
        f"s = {motion.s[row]:.3f}, pose {row + 1} of {len(motion)}</div>"
    )


def _polylines(share: Floats, psi: Floats) -> str:
    """Return a curve as polylines, one between gaps; s in 0..1, psi in degrees."""
    known = np.isfinite(share) & np.isfinite(psi)
    breaks = np.flatnonzero(~known)
    out = []
    for part in np.split(np.arange(len(share)), breaks):
        part = part[known[part]]
        points = " ".join(f"{100 * share[k]:.2f},{(180 - psi[k]) / 3.6:.2f}" for k in part)
        if points:
            out += [
                f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}" '
                f'vector-effect="non-scaling-stroke"/>'
                for colour, width in (("white", 4), (BLACK, 2))
            ]
    return "".join(out)
