"""Pictures of the theory pages: what the formulas look like, drawn from what the library computes."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

import armangle as aa

from .conventions import BENT
from .space import (
    ARM,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    START,
    VERMILION,
    Array,
    box_axes,
    draw_arm,
    draw_polygon,
    turned,
)

PSI = np.linspace(-np.pi, np.pi, 721)
FREE = ARM.with_(lower=None, upper=None)


def _arrow(ax: Any, start: Array, vector: Array, colour: str, name: str) -> None:
    ax.quiver(*start, *vector, color=colour, lw=2.0, arrow_length_ratio=0.25, zorder=6)
    ax.text(*(start + 1.2 * vector), name, color=colour, fontsize=11, zorder=7)


def elbow_triangle() -> Figure:
    """The triangle shoulder-elbow-wrist of an arm with an offset elbow, in the plane of frame 3."""
    figure = Figure(figsize=(8.2, 3.4))
    arm = aa.Arm(d_bs=0.3, d_se=0.5, d_ew=0.4, d_wf=0.1, a_3=0.12, a_4=-0.10)
    for place, a in ((121, ARM), (122, arm)):
        _triangle(figure.add_subplot(place), a, a.geometry.delta - 1.15)
    figure.axes[0].set_title("no offset: δ = 0", fontsize=9)
    figure.axes[1].set_title(
        f"a_3 = 0.12 m, a_4 = −0.10 m: δ = {np.degrees(arm.geometry.delta):.0f}°".replace("-", "−"),
        fontsize=9,
    )
    return figure


def _triangle(ax: Any, arm: aa.Arm, theta_4: float) -> None:
    shoulder = np.zeros(2)
    elbow = np.array([arm.geometry.a_3, arm.geometry.d_se])
    cosine, sine = np.cos(theta_4), np.sin(theta_4)
    wrist = elbow + np.array(
        [
            arm.geometry.a_4 * cosine - arm.geometry.d_ew * sine,
            arm.geometry.a_4 * sine + arm.geometry.d_ew * cosine,
        ]
    )
    forearm = wrist - elbow
    links = np.array(
        [shoulder, [0, arm.geometry.d_se], elbow, elbow + arm.geometry.a_4 * np.array([cosine, sine]), wrist]
    )
    ax.plot(*links.T, color=GREY, lw=4, solid_joinstyle="round", zorder=2)
    ax.plot(*np.stack([shoulder, elbow, wrist, shoulder]).T, color=BLUE, lw=1.3, zorder=3)
    ax.plot(*np.stack([elbow, elbow + 0.7 * elbow]).T, color=BLUE, lw=0.8, ls=":", zorder=1)
    for point, name, shift in (
        (shoulder, "S", (-0.03, 0.0)),
        (elbow, "E", (-0.03, 0.03)),
        (wrist, "W", (0.04, 0.0)),
    ):
        ax.plot(*point, "o", color=BLACK, ms=6, mfc="white", zorder=4)
        ax.text(*(point + shift), name, ha="center", va="center")
    straight, bent, target = (np.degrees(np.arctan2(v[1], v[0])) for v in (elbow, forearm, wrist))
    ax.add_patch(Wedge(elbow, 0.16, bent, straight, color=VERMILION, alpha=0.35, zorder=1))
    middle = np.radians((straight + bent) / 2)
    ax.text(
        *(elbow + 0.2 * np.array([np.cos(middle), np.sin(middle)])),
        "η",
        color=VERMILION,
        ha="center",
        va="center",
    )
    ax.add_patch(Wedge(shoulder, 0.17, target, straight, color=GREEN, alpha=0.35, zorder=1))
    middle = np.radians((straight + target) / 2)
    ax.text(*(0.21 * np.array([np.cos(middle), np.sin(middle)])), "κ", color=GREEN, ha="center", va="center")
    for start, end, name in ((shoulder, elbow, "La"), (elbow, wrist, "Lb"), (shoulder, wrist, "n")):
        across = np.array([end[1] - start[1], start[0] - end[0]]) / np.linalg.norm(end - start)
        offset = 0.04 if name != "La" else -0.04
        ax.text(*((start + end) / 2 + offset * across), name, color=BLUE, ha="center", va="center")
    ax.set(aspect="equal", xlim=(-0.2, 0.75), ylim=(-0.06, 0.98))
    ax.axis("off")


def triad() -> Figure:
    """The triad (w, e, z) at the shoulder, and the elbow axis turned by psi."""
    figure = Figure(figsize=(5.0, 4.4))
    figure.subplots_adjust(left=-0.15, right=1.1, top=1.3, bottom=0.06)
    ax = box_axes(figure, 111, np.array([-0.3, -0.35, 0.15]), np.array([0.65, 0.45, 0.95]), (22, -112))
    pose, _, _ = ARM.forward(BENT)
    psi = np.radians(50.0)
    real, virtual = (ARM.frames(ARM.inverse(pose, angle, 2, limits=False)) for angle in (psi, 0.0))
    points = draw_arm(ax, ARM.inverse(pose, psi, 2, limits=False), colour=GREY, width=4)
    shoulder, wrist = points[1], points[3]
    w, z = (wrist - shoulder) / np.linalg.norm(wrist - shoulder), virtual[3][:3, 2]
    e = np.cross(w, z)
    draw_polygon(ax, np.stack([shoulder, virtual[3][:3, 3], wrist]), SKY, 0.35)
    centre = shoulder + w * (w @ (points[2] - shoulder))
    ax.plot(*(centre + turned(points[2] - centre, w, PSI)).T, color=GREY, lw=0.8, zorder=2)
    for start in (shoulder,):
        _arrow(ax, start, 0.22 * w, GREEN, "w")
        _arrow(ax, start, 0.22 * e, BLUE, "e")
        _arrow(ax, start, 0.22 * z, VERMILION, "z")
        _arrow(ax, start, 0.22 * real[3][:3, 2], PURPLE, "z₃(ψ)")
    arc = shoulder + 0.15 * turned(z, w, np.linspace(0, psi, 30))
    ax.plot(*arc.T, color=BLACK, lw=1.5, zorder=6)
    ax.text(*(shoulder + 0.19 * turned(z, w, psi / 2)), "ψ", fontsize=11, zorder=7)
    for name, point in (("E", points[2]), ("W", wrist)):
        ax.text(*(point + np.array([0.02, 0.0, 0.04])), name)
    return figure


def _direction(pose: Array, gc: int) -> tuple[Array, Array]:
    """Direction (V, U) of joint 1 on the circle of a pose: the horizontal part of the upper arm's axis."""
    q = ARM.inverse(pose, PSI, gc, limits=False)
    size = np.abs(np.sin(q[:, 1]))
    return size * np.cos(q[:, 0]), size * np.sin(q[:, 0])


def three_cases() -> Figure:
    """The ellipse of joint 1's direction in the three cases of section 5.1, and the joint below it."""
    figure = Figure(figsize=(8.2, 5.2))
    names = ("origin outside: two stationary ψ", "origin inside: monotonic", "origin on it: singular")
    for column, (pose, name) in enumerate(zip(_case_poses(), names, strict=True)):
        top, below = figure.add_subplot(2, 3, column + 1), figure.add_subplot(2, 3, column + 4)
        v, u = _direction(pose, 2)
        top.plot(v, u, color=BLUE, lw=1.6)
        top.plot(0, 0, "+", color=VERMILION, ms=12, mew=2)
        top.set(aspect="equal", title=name, xlabel="V", ylabel="U" if column == 0 else "")
        top.title.set_fontsize(9)
        function = aa.gradients.joint_function(ARM, pose, 2, 1)
        value = np.unwrap(np.arctan2(u, v)) if column == 1 else np.arctan2(u, v)
        value[1:][np.abs(np.diff(value)) > 1.0] = np.nan
        below.plot(np.degrees(PSI), np.degrees(value), color=BLUE, lw=1.6)
        for psi in function.stationary:
            below.plot(np.degrees(psi), np.degrees(function.value(psi)), "o", color=ORANGE, ms=6)
            top.plot(*(np.interp(psi, PSI, x) for x in (v, u)), "o", color=ORANGE, ms=6)
        below.set(xlabel="ψ (°)", ylabel="θ₁ (°)" if column == 0 else "", xticks=[-180, -90, 0, 90, 180])
    figure.tight_layout()
    return figure


def _case_poses() -> tuple[Array, Array, Array]:
    """Poses for whose joint 1 the origin lies outside, inside and on the ellipse."""
    plain = ARM.forward(START)[0]
    around = ARM.forward(np.array([0.3, 0.35, 0.4, -1.3, 0.2, 0.8, 0.1]))[0]
    singular = ARM.forward(np.array([0.3, 0.0, 0.9, -1.3, 0.2, 0.8, 0.1]))[0]
    return around, plain, singular


def cone() -> Figure:
    """A pivot's limits as a cone: less, and more, than half a turn."""
    figure = Figure(figsize=(8.2, 3.7))
    q = START.copy()
    pose, _, _ = ARM.forward(q)
    for place, (low, high) in ((121, (-20.0, 75.0)), (122, (-130.0, 75.0))):
        ax = figure.add_subplot(place)
        lower, upper = ARM.lower.copy(), ARM.upper.copy()
        lower[0], upper[0] = np.radians([low, high])
        arm = ARM.with_(lower=lower, upper=upper)
        v, u = _direction(pose, 2)
        size = 1.05
        ax.add_patch(Wedge((0, 0), 2 * size, low, high, color=SKY, alpha=0.35, lw=0))
        arcs = arm.feasible(pose, 2, per_joint=True)[0]
        inside = arcs.contains(PSI)
        ax.plot(v, u, color=VERMILION, lw=1.2)
        ax.plot(np.where(inside, v, np.nan), np.where(inside, u, np.nan), color=BLUE, lw=3.0)
        for limit, name in ((low, "l"), (high, "u")):
            ray = 2.4 * np.array([np.cos(np.radians(limit)), np.sin(np.radians(limit))])
            ax.plot([0, ray[0]], [0, ray[1]], color=BLACK, lw=0.9)
            ax.text(*(0.36 * ray), f"{name} = {limit:.0f}°".replace("-", "−"), fontsize=8, ha="center")
        ax.plot(0, 0, "+", color=VERMILION, ms=10, mew=2)
        wide = "complement of two" if high - low > 180 else "intersection of two"
        ax.set(aspect="equal", xlim=(-size, 1.3), ylim=(-size, size), xlabel="V", ylabel="U")
        ax.set_title(f"{high - low:.0f}° of range: {wide} half-planes", fontsize=9)
    figure.tight_layout()
    return figure


def boundary() -> Figure:
    """Boundary functions of one joint over psi, each not negative on one arc, and their intersection."""
    figure = Figure(figsize=(8.2, 3.6))
    ax = figure.add_subplot()
    pose, _, _ = ARM.forward(START)
    v, u = _direction(pose, 2)
    degrees = np.degrees(PSI)
    rows = (("B of the lower limit", -20.0, 1.0, BLUE), ("B of the upper limit", 75.0, -1.0, ORANGE))
    both = np.ones(len(PSI), dtype=bool)
    for at, (name, limit, sign, colour) in enumerate(rows):
        value = sign * (u * np.cos(np.radians(limit)) - v * np.sin(np.radians(limit)))
        ax.plot(degrees, value, color=colour, lw=1.8, label=name)
        both &= value >= 0
        ax.fill_between(
            degrees, -1.25 - 0.22 * at, -1.08 - 0.22 * at, where=value >= 0, color=colour, alpha=0.8, lw=0
        )
    ax.fill_between(degrees, -1.69, -1.52, where=both, color=BLACK, alpha=0.8, lw=0)
    for at, name in enumerate(("B ≥ 0, lower", "B ≥ 0, upper", "Ψ of the joint")):
        ax.text(-186, -1.16 - 0.22 * at, name, ha="right", va="center", fontsize=8)
    ax.axhline(0, color=GREY, lw=0.8)
    ax.set(xlim=(-180, 180), xticks=[-180, -90, 0, 90, 180], xlabel="ψ (°)", yticks=[-1, -0.5, 0, 0.5, 1])
    ax.legend(frameon=False, loc="upper right", fontsize=8)
    return figure


def near_the_axis() -> Figure:
    """Joints along a straight line that passes 0.1 mm beside the base axis, carried in both ways."""
    figure = Figure(figsize=(8.2, 3.3))
    poses, start = passing_the_axis()
    offset = 1e3 * poses[:, 0, 3]
    for place, carry in ((121, "psi"), (122, "elbow")):
        ax = figure.add_subplot(place)
        path = aa.follow(FREE, poses, start=start, policy=aa.Hold(), carry=carry, max_joint_step=10.0)
        for joint, colour in ((1, BLUE), (2, GREEN), (3, ORANGE)):
            ax.plot(offset, np.degrees(path.q[:, joint - 1]), color=colour, lw=1.6, label=f"q{joint}")
        ax.plot(offset, np.degrees(path.psi), color=VERMILION, lw=1.2, ls="--", label="ψ")
        largest = np.degrees(np.abs(np.diff(path.q, axis=0)).max())
        ax.set_title(f'carry="{carry}": largest move of a joint {largest:.2f}° in 0.5 mm', fontsize=9)
        ax.set(xlabel="wrist beside the base axis, along the line (mm)", ylabel="degrees")
        ax.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    return figure


def passing_the_axis() -> tuple[Array, Array]:
    """Poses (81, 4, 4) of a line that passes the base axis by 0.1 mm, and joints at its start."""
    poses = np.tile(np.eye(4), (81, 1, 1))
    poses[:, 0, 3] = np.linspace(-0.02, 0.02, 81)
    poses[:, 1, 3] = 1e-4
    poses[:, 2, 3] = 1.05
    return poses, FREE.inverse(poses[0], np.radians(30.0), 2, limits=False)


def repulsion() -> Figure:
    """Eq. (36): how far the arm angle moves in one step, over its place on the arc."""
    figure = Figure(figsize=(8.2, 3.0))
    share = np.linspace(0.0, 1.0, 401)
    settings = (
        ("K = 0.1", [(0.1, 5.0), (0.1, 20.0), (0.1, 100.0)]),
        ("α = 20", [(0.02, 20.0), (0.1, 20.0), (0.5, 20.0)]),
    )
    for place, (title, pairs) in zip((121, 122), settings, strict=True):
        ax = figure.add_subplot(place)
        for (gain, alpha), colour in zip(pairs, (GREEN, BLUE, VERMILION), strict=True):
            move = 0.5 * gain * (np.exp(-alpha * share) - np.exp(-alpha * (1 - share)))
            ax.plot(share, move, color=colour, lw=1.6, label=f"K = {gain:g}, α = {alpha:g}")
        ax.axhline(0, color=GREY, lw=0.7)
        ax.set(
            xlabel="place on the arc: 0 lower end, 1 upper end",
            ylabel="Δψ / width" if place == 121 else "",
            title=title,
        )
        ax.title.set_fontsize(9)
        ax.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    return figure


PICTURES = {
    "elbow_triangle": elbow_triangle,
    "triad": triad,
    "three_cases": three_cases,
    "cone": cone,
    "boundary": boundary,
    "near_the_axis": near_the_axis,
    "repulsion": repulsion,
}
