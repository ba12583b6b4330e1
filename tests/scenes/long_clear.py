"""Arcs of scenes against distances, on many arm angles: python tests/scenes/long_clear.py [samples] [seed].

Random arms, bodies, scenes and poses in all branches; an arm angle is judged wrong where the arcs and the
least distance of all pairs, searched along the links of the postures of `inverse`, disagree farther than 1e-9
rad from an end. With coal a tenth as many distances are asked of it too.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from scenes.test_clear import ARMS, BODIES, obstacle, posed
from scenes.test_coal import BODY, placed
from support.touching import distances

import armangle as aa

Floats = NDArray[np.float64]
BESIDE = 1e-9
"""rad: nearer to an end neither side is asked."""
ROUNDING = 1e-14
"""m: of a distance."""
AT_ONCE = 2000


def scene_of(arm: aa.Arm, rng: np.random.Generator, kinds: int) -> list[Any]:
    """One to four shapes."""
    return [obstacle(arm, rng, int(rng.integers(kinds))) for _ in range(rng.integers(1, 5))]


def as_hulls(shapes: list[Any]) -> list[Any]:
    """The same shapes, boxes by their corners."""
    out = []
    for shape in shapes:
        if isinstance(shape, aa.Box):
            frame = np.array(shape.pose)
            corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * shape.size
            shape = aa.Hull(corners @ frame[:3, :3].T + frame[:3, 3], shape.radius)
        out.append(shape)
    return out


def asked_of(arcs: aa.ArcSet, rng: np.random.Generator, many: int) -> tuple[Floats, Floats]:
    """Arm angles all round and beside the ends, and the ends."""
    limits = np.empty(0) if arcs.is_full else arcs.intervals.ravel()
    beside = [limits + sign * 10 ** rng.uniform(-8.9, -2, limits.shape) for sign in (-1, 1) for _ in range(9)]
    return np.concatenate([rng.uniform(-np.pi, np.pi, many), *beside]), limits


def from_ends(psi: Floats, limits: Floats) -> Floats:
    """How far each angle is from the nearest end."""
    if not len(limits):
        return np.full(psi.shape, 9.0)
    return np.abs(np.angle(np.exp(1j * (psi[:, None] - limits)))).min(axis=1)


def own(samples: int, rng: np.random.Generator) -> tuple[int, int]:
    """Compare with distances searched along the links; return how many, and how many wrong."""
    done, wrong = 0, 0
    while done < samples:
        arm = ARMS[rng.integers(len(ARMS))].with_body(list(BODIES.values())[rng.integers(len(BODIES))])
        pose, gc = posed(arm, rng, int(rng.integers(8)))
        kept = float(rng.choice([0.0, 0.015]))
        shapes = scene_of(arm, rng, 4)
        scene = aa.Scene(shapes, clearance=kept)
        asked = as_hulls(shapes) if rng.random() < 0.5 else shapes
        arcs = arm.clear(pose, gc, aa.Scene(asked, clearance=kept))
        psi, limits = asked_of(arcs, rng, AT_ONCE)
        least = distances(arm, arm.inverse(pose, psi, gc), scene)[0].min(axis=-1)
        told = (arcs.contains(psi) != (least >= kept)) & (from_ends(psi, limits) > BESIDE)
        told &= np.abs(least - kept) > ROUNDING
        if told.any():
            short = least[told][:3] - kept
            print(f"{arm.name}, GC {gc}, psi {psi[told][:3]}: {short} m, {shapes}", flush=True)
        done += len(psi)
        wrong += int(told.sum())
    return done, wrong


def coals(samples: int, rng: np.random.Generator, coal: Any) -> tuple[int, int]:
    """Compare with coal's distances; return how many were asked, and how many verdicts are wrong."""
    done, wrong, request = 0, 0, coal.DistanceRequest()
    ignore = [(f"link_{i}", f"link_{j}") for i in range(1, 7) for j in range(i + 1, 7)]
    while done < samples:
        arm = ARMS[rng.integers(4)].with_body(BODY)
        pose, gc = posed(arm, rng, int(rng.integers(8)))
        shapes = [s for s in scene_of(arm, rng, 3) if getattr(s, "radius", 1.0) > 0 or isinstance(s, aa.Box)]
        shapes = [aa.Box(s.pose, s.size) if isinstance(s, aa.Box) else s for s in shapes]
        arcs = arm.clear(pose, gc, aa.Scene(shapes, ignore=ignore))
        psi, limits = asked_of(arcs, rng, 50)
        others = [placed(coal, np.eye(4), shape) for shape in shapes]
        near = from_ends(psi, limits) <= BESIDE
        frames = arm.frames(arm.inverse(pose, psi, gc))
        for angle, at, beside in zip(psi, frames, near, strict=True):
            mine = [placed(coal, at[link], shape) for link, listed in BODY.links for shape in listed]
            pairs = [(*one, *other) for one in mine for other in others]
            found = [coal.distance(*pair, request, coal.DistanceResult()) for pair in pairs]
            done += len(found)
            least = min(found, default=np.inf)
            if bool(arcs.contains(angle)) != (least > 0) and not beside and abs(least) > BESIDE:
                wrong += 1
                print(f"coal: {arm.name}, GC {gc}, psi {angle}: {least} m, {shapes}", flush=True)
    return done, wrong


def main(samples: int, seed: int) -> int:
    """Print what was compared, and return how many verdicts are wrong."""
    rng = np.random.default_rng(seed)
    done, wrong = own(samples, rng)
    print(f"{done} arm angles against distances searched along the links: {wrong} wrong", flush=True)
    try:
        import coal
    except ImportError:
        print("no coal: pip install coal")
        return wrong
    asked, more = coals(samples // 10, rng, coal)
    print(f"{asked} distances of coal: {more} verdicts wrong", flush=True)
    return wrong + more


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 10_000_000, given[1] if len(given) > 1 else 0) else 0)
