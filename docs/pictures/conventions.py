"""Pictures of the conventions page: frames, arm angle, the eight configurations, windings."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

import armangle as aa

from .space import (
    ARM,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    Array,
    box_axes,
    draw_arm,
    draw_frame,
    draw_polygon,
    turned,
)  # fmt: skip

BENT = np.radians([20.0, 35.0, 30.0, -80.0, 20.0, 50.0, 10.0])


def frames() -> Figure:
    """The zero posture with the four lengths, and a bent posture with the frames of the DH rows."""
    figure = Figure(figsize=(8.2, 3.9))
    figure.subplots_adjust(left=0.02, right=1.0, top=0.96, bottom=0.0, wspace=0.0)
    _zero_posture(figure.add_subplot(1, 2, 1))
    ax = box_axes(figure, 122, np.array([-0.2, -0.25, 0.0]), np.array([0.75, 0.45, 1.1]), (18, -60))
    draw_arm(ax, BENT, colour=GREY, width=5)
    placed = ARM.frames(BENT)
    for names in ("0", "2", "3", "6", "7"):
        draw_frame(ax, placed[int(names)], 0.13, names)
    ax.set_title("q = (20, 35, 30, −80, 20, 50, 10)°", y=0.98, fontsize=9)
    return figure


def _zero_posture(ax: Any) -> None:
    heights = ARM.frames(np.zeros(7))[[0, 1, 3, 5, 7], 2, 3]
    ax.plot(np.zeros(5), heights, color=GREY, lw=5, solid_capstyle="round")
    ax.plot(np.zeros(3), heights[1:4], "o", color=GREY, ms=9, mfc="white", mew=2)
    for height, name in zip(heights, ("base", "shoulder S", "elbow E", "wrist W", "flange"), strict=True):
        ax.text(-0.05, height, name, ha="right", va="center")
    for low, high, name in zip(heights, heights[1:], ("d_bs", "d_se", "d_ew", "d_wf"), strict=False):
        ax.annotate(
            "",
            (0.07, low),
            (0.07, high),
            arrowprops={"arrowstyle": "<->", "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
        )
        ax.text(0.085, (low + high) / 2, f"{name} = {high - low:.3g} m", va="center")
    for joint, height in ((2, heights[1]), (4, heights[2]), (6, heights[3])):
        side = 1.0 if joint != 4 else -1.0
        arc = np.linspace(0.0, 1.0, 30)
        ax.plot(0.86 + side * 0.11 * np.sin(arc), height + 0.11 * np.cos(arc), color=VERMILION, lw=1.2)
        end = 0.86 + side * 0.11 * np.sin(1.0), height + 0.11 * np.cos(1.0)
        ax.annotate(
            "",
            (end[0] + side * 0.012, end[1] - 0.02),
            end,
            arrowprops={"arrowstyle": "-|>", "color": VERMILION, "lw": 1.2},
        )
        ax.text(
            0.86 - side * 0.03,
            height + 0.05,
            f"+θ$_{joint}$",
            color=VERMILION,
            va="center",
            ha="right" if side > 0 else "left",
        )
    for name, (x, y), colour in (("x", (0.16, 0), VERMILION), ("z", (0, 0.16), BLUE)):
        ax.annotate(
            "", (-0.55 + x, y), (-0.55, 0.0), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.6}
        )
        ax.text(-0.55 + 1.25 * x, 1.2 * y, f"{name}$_0$", color=colour, ha="center", va="center")
    ax.set(
        xlim=(-0.62, 1.02),
        ylim=(-0.05, 1.34),
        aspect="equal",
        title="q = 0: the arm points up, θ₁, θ₃, θ₅, θ₇ turn about it",
    )
    ax.title.set_fontsize(9)
    ax.axis("off")


def arm_angle() -> Figure:
    """The elbow on its circle, with the reference half-plane, for both signs of the elbow."""
    figure = Figure(figsize=(8.2, 3.9))
    figure.subplots_adjust(left=-0.04, right=0.96, top=1.1, bottom=-0.12, wspace=0.0)
    pose, _, _ = ARM.forward(BENT)
    for place, gc in ((121, 0), (122, 2)):
        ax = box_axes(figure, place, np.array([-0.2, -0.25, 0.0]), np.array([0.68, 0.45, 1.0]), (24, -42))
        _elbow_circle(ax, pose, gc, np.radians(60.0))
        ax.set_title(f"GC₄ = {'−' if gc else '+'}1 (gc = {gc})", y=0.97, fontsize=9)
    return figure


def _elbow_circle(ax: Any, pose: Array, gc: int, psi: float) -> None:
    real, virtual = ARM.inverse(pose, psi, gc, limits=False), ARM.inverse(pose, 0.0, gc, limits=False)
    points = draw_arm(ax, real, width=4.5)
    elbow_0 = ARM.frames(virtual)[3, :3, 3]
    shoulder, wrist = points[1], points[3]
    w = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    centre = shoulder + w * (w @ (elbow_0 - shoulder))
    circle = centre + turned(elbow_0 - centre, w, np.linspace(-np.pi, np.pi, 181))
    ax.plot(*circle.T, color=GREY, lw=1.0, zorder=2)
    draw_polygon(ax, np.stack([shoulder, elbow_0, wrist]), SKY, 0.45)
    draw_polygon(ax, points[1:4], ORANGE, 0.35)
    ax.plot(*np.stack([shoulder, elbow_0, wrist]).T, color=BLUE, lw=1.6, ls="--", zorder=3)
    arc = centre + 0.55 * turned(elbow_0 - centre, w, np.linspace(0.0, psi, 40))
    ax.plot(*arc.T, color=VERMILION, lw=2.0, zorder=5)
    ax.plot(*arc[-1:].T, "o", color=VERMILION, ms=6, zorder=7)
    ax.text(
        *(centre + 0.8 * turned(elbow_0 - centre, w, psi / 2)), "ψ", color=VERMILION, fontsize=12, zorder=7
    )
    ax.plot(*np.stack([shoulder, wrist + 0.06 * w]).T, color=GREEN, lw=1.0, zorder=2)
    ax.quiver(*(wrist + 0.05 * w), *(0.09 * w), color=GREEN, lw=1.4, arrow_length_ratio=0.4, zorder=5)
    ax.text(*(wrist + 0.09 * w + np.array([0.0, 0.0, 0.04])), "w", color=GREEN, fontsize=11)
    ax.plot(*np.array([[0, 0, 0.0], [0, 0, 0.85]]).T, color=GREY, lw=0.8, ls=":", zorder=1)
    ax.text(0, 0, 0.88, "base axis", color=GREY, ha="center", fontsize=8)
    for name, point in (("S", shoulder), ("W", wrist), ("E", points[2])):
        ax.text(*(point + np.array([0.0, 0.0, 0.06])), name, fontsize=10, ha="center", zorder=8)
    ax.text(*(elbow_0 + np.array([0.02, 0.0, 0.03])), "E at ψ = 0", color=BLUE, fontsize=8, zorder=8)


def configurations() -> Figure:
    """The eight postures of one pose and one arm angle."""
    figure = Figure(figsize=(8.2, 5.0))
    figure.subplots_adjust(left=0, right=1, top=0.95, bottom=0.04, wspace=0.0, hspace=0.12)
    pose, psi, _ = ARM.forward(BENT)
    for gc, q in enumerate(ARM.inverse(pose, psi, limits=False)):
        ax = box_axes(figure, 241 + gc, np.array([-0.1, -0.25, 0.0]), np.array([0.6, 0.35, 1.0]), (18, -70))
        draw_arm(ax, q, width=3.2, colour=BLACK if ARM.within_limits(q) else VERMILION)
        draw_frame(ax, pose, 0.14)
        signs = "".join("+" if sign > 0 else "−" for sign in aa.gc_signs(gc))
        ax.set_title(f"gc = {gc}  ({signs})", y=0.95, fontsize=9)
        values = ", ".join(f"{value:.0f}" for value in np.degrees(q)).replace("-", "−")
        ax.text2D(
            0.5,
            -0.07,
            values,
            transform=ax.transAxes,
            ha="center",
            fontsize=6.2,
            color=BLACK if ARM.within_limits(q) else VERMILION,
        )
    return figure


def windings() -> Figure:
    """One joint angle, its windings, and the ones that a range holds."""
    figure = Figure(figsize=(8.2, 2.6))
    ax = figure.add_subplot()
    ranges = (
        ("iiwa A7, ±175°", -175, 175),
        ("WAM joint 5, −260.7…71.6°", -260.7, 71.6),
        ("xMate ER7 joint 7, ±360°", -360, 360),
    )
    theta = 130.0
    for row, (name, low, high) in enumerate(reversed(ranges)):
        ax.plot([low, high], [row, row], color=SKY, lw=9, solid_capstyle="butt", alpha=0.7)
        ax.text(-455, row, name, ha="right", va="center")
        inside = [theta + 360 * k for k in (-1, 0, 1) if low <= theta + 360 * k <= high]
        for turn in (-1, 0, 1):
            q = theta + 360 * turn
            ax.plot(
                q,
                row,
                "o",
                ms=7,
                color=BLUE if q in inside else "white",
                mec=BLUE if q in inside else GREY,
                zorder=3,
            )
    ax.axvline(0, color=GREY, lw=0.7, zorder=0)
    for edge in (-180, 180):
        ax.axvline(edge, color=GREY, lw=0.7, ls=":", zorder=0)
    ax.set(
        xlim=(-450, 520),
        ylim=(-0.6, 2.6),
        yticks=[],
        xlabel="q in degrees: the three dots of a row are one direction, 130° + 360° k",
    )
    ax.set_xticks(np.arange(-360, 541, 180))
    ax.spines["left"].set_visible(False)
    return figure


def base_tool() -> Figure:
    """Where a pose lives: base frame, DH chain, tool frame."""
    figure = Figure(figsize=(8.2, 1.5))
    ax = figure.add_subplot()
    ax.axis("off")
    names = ("frame of\nthe poses", "DH frame 0", "DH frame 7\n(flange)", "tool frame")
    for i, name in enumerate(names):
        ax.text(
            3 * i,
            0,
            name,
            ha="center",
            va="center",
            bbox={"boxstyle": "round,pad=0.5", "fc": "#f2f2f2", "ec": GREY},
        )
    for i, name in enumerate(("arm.base", "DH chain at θ = s q + o", "arm.tool")):
        ax.annotate("", (3 * i + 2.1, 0), (3 * i + 0.9, 0), arrowprops={"arrowstyle": "-|>", "color": BLACK})
        ax.text(3 * i + 1.5, 0.46, name, ha="center", fontsize=8.5)
    ax.annotate("", (8.3, -0.75), (0.7, -0.75), arrowprops={"arrowstyle": "-|>", "color": BLUE})
    ax.text(4.5, -0.62, "pose = arm.base @ 0T7 @ arm.tool", ha="center", color=BLUE)
    ax.set(xlim=(-1.3, 10.3), ylim=(-1.0, 0.7))
    return figure


PICTURES = {
    "frames": frames,
    "arm_angle": arm_angle,
    "configurations": configurations,
    "windings": windings,
    "base_tool": base_tool,
}
