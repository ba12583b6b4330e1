"""Arcs and solutions among obstacles against distances: python tests/scenes/long_clear.py [samples] [seed].

Random arms, bodies, scenes and poses in all eight branches. An arm angle is judged wrong where what `clear`,
`feasible` or `feasible_all` say of it, and the joint limits with the least distance of all pairs, searched
along the links of the postures of `inverse`, disagree farther than 1e-9 rad from an end. Each pose is given
to `solve`, `best` and `solutions` too: what they find keeps the limits and the clearance, and no clear arm
angle that was tried is nearer, or farther from its limits, or in a branch that they say has none.
Of arms with an offset wrist or shoulder a value is wrong where `feasible` says that it is clear and it is
not, or leaves it out uncounted though it is clear by more than 3e-9 m.
With coal a tenth as many distances are asked of it too.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from scenes.test_chain_scenes import obstacles
from scenes.test_clear import ARMS, BODIES, obstacle, posed
from scenes.test_coal import BODY, exact_request, placed
from scenes.test_proven_scenes import BODIES as OFFSET_BODIES
from scenes.test_proven_scenes import FREE
from support.touching import distances

import armangle as aa

Floats = NDArray[np.float64]
BESIDE = 1e-9
"""rad: nearer to an end neither side is asked."""
ROUNDING = 1e-14
"""m: of a distance."""
TURNING = 1e-12
"""rad, and m at the end of an arc: of the joints of `inverse`, and of what is computed from them."""
BACK = 1e-9
"""m, and of a rotation's numbers: of a posture's pose."""
LEFT_OUT = 3e-9
"""m: by how much a value that is said to touch may be clear, of what is proven in cells."""
FAR = 0.05
"""m: pairs that are farther apart than that are not searched any further."""
COST = 1e-10
"""rad: by how much a posture may be better than that of `solve`, as in laws/long_nearest.py."""
AT_ONCE = 100
SAID = 30.0
"""s between two lines that tell how far it is."""


class Progress:
    """Prints every half a minute how much was done."""

    def __init__(self, what: str, of: int) -> None:
        """`what` is compared, `of` of them."""
        self.what, self.of, self.next = what, of, time.monotonic() + SAID

    def __call__(self, done: int, wrong: int) -> None:
        """Print the progress if half a minute has passed since the last time."""
        if time.monotonic() > self.next:
            self.next = time.monotonic() + SAID
            print(f"{done} of {self.of} {self.what}: {wrong} wrong so far", flush=True)


def scene_of(arm: aa.Arm, rng: np.random.Generator, kinds: int) -> list[Any]:
    """One to four random shapes of the first `kinds` kinds of `obstacle`."""
    return [obstacle(arm, rng, int(rng.integers(kinds))) for _ in range(rng.integers(1, 5))]


def as_hulls(shapes: list[Any]) -> list[Any]:
    """The shapes with boxes replaced by hulls of their corners."""
    out = []
    for shape in shapes:
        if isinstance(shape, aa.Box):
            frame = np.array(shape.pose)
            corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * shape.size
            shape = aa.Hull(corners @ frame[:3, :3].T + frame[:3, 3], shape.radius)
        out.append(shape)
    return out


def ends_of(arcs: aa.ArcSet) -> Floats:
    """The ends (n,) of one set; none if it is the full circle."""
    return np.empty(0) if arcs.is_full else arcs.intervals.ravel()


def asked_of(limits: Floats, rng: np.random.Generator, many: int) -> Floats:
    """`many` random arm angles, and eight near each of the ends `limits`."""
    beside = [limits + sign * 10 ** rng.uniform(-8.9, -2, limits.shape) for sign in (-1, 1) for _ in range(4)]
    return np.concatenate([rng.uniform(-np.pi, np.pi, many), *beside])


def from_ends(psi: Floats, limits: Floats) -> Floats:
    """The distance (rad) of each angle from the nearest of the ends; 9 if there is none."""
    if not len(limits):
        return np.full(psi.shape, 9.0)
    return np.abs(np.angle(np.exp(1j * (psi[:, None] - limits)))).min(axis=1)


def beyond(arm: aa.Arm, q: Floats) -> Floats:
    """The largest violation (...), rad, of a limit by joints (..., 7); negative within all of them."""
    return np.maximum(arm.lower - q, q - arm.upper).max(axis=-1)


def unwound(arm: aa.Arm, q: Floats, cost: Any) -> Floats:
    """Joints (..., 7) with each turned by the multiple of 2π, within its limits, that `cost` finds least."""
    turns = q[..., None] + 2 * np.pi * np.arange(-2, 3)
    within = (turns >= arm.lower[:, None]) & (turns <= arm.upper[:, None])
    costs = np.where(within, cost(turns), np.inf)
    return np.take_along_axis(turns, costs.argmin(axis=-1)[..., None], axis=-1)[..., 0]


class Question:
    """One arm with a body, a pose and a scene, asked in all branches."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Draw arm, collision model, pose and scene."""
        self.arm = ARMS[rng.integers(len(ARMS))].with_(body=list(BODIES.values())[rng.integers(len(BODIES))])
        self.pose = posed(self.arm, rng, 0)[0]
        self.kept = float(rng.choice([0.0, 0.015]))
        shapes = scene_of(self.arm, rng, 4)
        self.scene = aa.Scene(shapes, clearance=self.kept)
        self.asked = aa.Scene(as_hulls(shapes) if rng.random() < 0.5 else shapes, clearance=self.kept)
        self.clear_q = np.empty((0, 7))
        self.clear_gc = np.empty(0, dtype=int)

    def __str__(self) -> str:
        return f"{self.arm.name}, pose {self.pose.tolist()}, {self.asked}"

    def least(self, q: Floats) -> Floats:
        """Return the least distance of links to obstacles and one another at joints (..., 7), m.

        The clearance is subtracted. Beyond FAR it is a lower bound.
        """
        return distances(self.arm, q, self.scene, FAR)[0].min(axis=-1) - self.kept

    def arcs(self, rng: np.random.Generator) -> tuple[int, int]:
        """Compare the arcs of all branches with distances; return how many psi were asked, and how many are
        wrong.
        """
        every = self.arm.with_(scene=self.asked).feasible(self.pose)
        clear = [self.arm._clear(self.pose, gc, self.asked) for gc in range(8)]
        ones = [self.arm.with_(scene=self.asked).feasible(self.pose, gc) for gc in range(8)]
        angles = [asked_of(np.append(ends_of(clear[k]), ends_of(every[k])), rng, AT_ONCE) for k in range(8)]
        gcs, wrong = np.repeat(range(8), [len(psi) for psi in angles]), 0
        q = self.arm.inverse(self.pose, np.concatenate(angles), gcs, limits=False)
        left, out = self.least(q), beyond(self.arm, unwound(self.arm, q, np.abs))
        unsure = np.abs(left) <= ROUNDING
        sides = unsure | (np.abs(out) <= TURNING)
        both, free = (left >= 0) & (out <= 0), np.zeros(len(q), dtype=bool)
        for gc, psi in enumerate(angles):
            of = gcs == gc
            for what, arcs, truth, skip in (
                ("clear", clear[gc], left >= 0, unsure),
                ("feasible_all", every[gc], both, sides),
                ("feasible", ones[gc], both, sides),
            ):
                asked = (from_ends(psi, ends_of(arcs)) > BESIDE) & ~skip[of]
                told = (arcs.contains(psi) != truth[of]) & asked
                wrong += int(told.sum())
                if told.any():
                    short = f"{left[of][told][:3]} m left, {out[of][told][:3]} rad beyond"
                    print(f"{what}: GC {gc}, psi {psi[told][:3]}: {short}; {self}", flush=True)
            free[of] = both[of] & asked
        self.clear_q, self.clear_gc = q[free], gcs[free]
        return len(q), wrong

    def faults(self, found: aa.Solution, better: Any) -> list[str]:
        """Return words for what is wrong with a solution; `better` says which tried joints cost less."""
        if found.status is not aa.Status.OK:
            return ["says none"] if len(self.clear_q) else []
        back = np.abs(self.arm.forward(found.q)[0] - self.pose).max()
        said = {
            "off the pose": back > BACK,
            "touches": self.least(found.q) < -TURNING,
            "beyond a limit": beyond(self.arm, found.q) > TURNING,
            "not the best": np.any(better),
        }
        return [fault for fault, true in said.items() if true]

    def solutions(self, rng: np.random.Generator) -> Counter[str]:
        """Ask for solutions in all ways; return how many were asked, found and wrong."""
        arm, tried, counts = self.arm, self.clear_q, Counter[str]()
        near = rng.uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0))
        nearest = unwound(arm, tried, lambda turns: np.abs(turns - near[:, None]))
        inmost = unwound(arm, tried, lambda t: -np.minimum(t - arm.lower[:, None], arm.upper[:, None] - t))
        metrics: list[tuple[Literal["l2", "max"], float]] = [("l2", 2), ("max", np.inf)]
        for metric, order in metrics:
            found = arm.with_(scene=self.asked).solve(self.pose, near, metric=metric)
            far = np.linalg.norm(nearest - near, ord=order, axis=-1)
            self._counted(counts, f"solve {metric} near {near.tolist()}", found, far < found.distance - COST)
        found = arm.with_(scene=self.asked).solve(self.pose, prefer="margin")
        self._counted(counts, "best", found, arm.limit_margin(inmost) > found.margin + COST)
        several = list(arm.with_(scene=self.asked).solutions(self.pose, near))
        for found in several:
            self._counted(counts, "solutions", found, False)
        if set(self.clear_gc) - {int(found.gc) for found in several}:
            counts["wrong"] += 1
            print(f"solutions: a branch of {set(self.clear_gc)} is missing; {self}", flush=True)
        return counts

    def _counted(self, counts: Counter[str], what: str, found: aa.Solution, better: Any) -> None:
        """Count a solution in `counts`, and print what is wrong with it."""
        counts["asked"] += 1
        counts["found"] += found.status is aa.Status.OK
        faults = self.faults(found, better)
        if faults:
            counts["wrong"] += 1
            print(f"{what}: {faults}, {found}; {self}", flush=True)


def own(samples: int, rng: np.random.Generator) -> int:
    """Compare arcs and solutions of S-R-S arms with plain distances; return how many are wrong."""
    said = "arm angles against distances searched along the links"
    progress, done, wrong, solved = Progress(said, samples), 0, 0, Counter[str]()
    while done < samples:
        question = Question(rng)
        more, bad = question.arcs(rng)
        done, wrong = done + more, wrong + bad
        solved += question.solutions(rng)
        progress(done, wrong + solved["wrong"])
    print(f"{done} {said}: {wrong} wrong", flush=True)
    asked, found = solved["asked"], solved["found"]
    print(f"{asked} postures asked for, {found} found: {solved['wrong']} wrong", flush=True)
    return wrong + solved["wrong"]


def offsets(samples: int, rng: np.random.Generator) -> int:
    """Compare values of the free joint of offset arms with plain distances; return how many are wrong."""
    said = "values of a free joint against distances searched along the links"
    progress, done, wrong, counted = Progress(said, samples), 0, 0, 0
    arms, bodies = list(FREE.values()), list(OFFSET_BODIES.values())
    while done < samples:
        bare = arms[rng.integers(len(arms))].with_(body=bodies[rng.integers(len(bodies))])
        scene = aa.Scene(
            obstacles(bare, rng, int(rng.integers(1, 5))), clearance=float(rng.choice([0.0, 0.015]))
        )
        pose = posed(bare, rng, 0)[0]
        owns, sets = bare.feasible(pose), bare.with_(scene=scene).feasible(pose)
        for gc in range(8):
            own, arcs = owns[gc], sets[gc]
            if own.is_empty:
                continue
            inside = own.intervals[rng.integers(len(own.intervals), size=AT_ONCE)]
            psi = rng.uniform(inside[:, 0], inside[:, 1])
            psi = np.concatenate([psi, asked_of(ends_of(arcs), rng, 0)])
            psi = psi[np.asarray(own.contains(psi)) & (from_ends(psi, ends_of(own)) > BESIDE)]
            q = bare.inverse(np.broadcast_to(pose, (len(psi), 4, 4)), psi, gc, on_error="nan", limits=False)
            psi, q = psi[np.isfinite(q[:, 0])], q[np.isfinite(q[:, 0])]
            left = distances(bare, q, scene, FAR)[0].min(axis=-1) - scene.clearance
            told, beside = np.asarray(arcs.contains(psi)), from_ends(psi, ends_of(arcs)) <= BESIDE
            bad = (told & (left < -TURNING) & ~beside) | (~told & (left > LEFT_OUT) & (arcs.unproven == 0))
            done, wrong = done + len(psi), wrong + int(bad.sum())
            counted += int(arcs.unproven > 0)
            if bad.any():
                print(f"{bare.name}, GC {gc}, {psi[bad][:3]}: {left[bad][:3]} m left; {scene}", flush=True)
        progress(done, wrong)
    print(f"{done} {said}: {wrong} wrong; {counted} sets not proven throughout", flush=True)
    return wrong


def coals(samples: int, rng: np.random.Generator, coal: Any) -> int:
    """Compare arcs with coal's distances; return how many verdicts are wrong."""
    progress, done, wrong = Progress("distances of coal", samples), 0, 0
    request = exact_request(coal)
    ignore = [(f"link_{i}", f"link_{j}") for i in range(1, 7) for j in range(i + 1, 7)]
    while done < samples:
        arm = ARMS[rng.integers(4)].with_(body=BODY)
        pose, gc = posed(arm, rng, int(rng.integers(8)))
        shapes = [s for s in scene_of(arm, rng, 3) if getattr(s, "radius", 1.0) > 0 or isinstance(s, aa.Box)]
        shapes = [aa.Box(s.pose, s.size) if isinstance(s, aa.Box) else s for s in shapes]
        arcs = arm._clear(pose, gc, aa.Scene(shapes, ignore=ignore))
        limits = ends_of(arcs)
        psi = asked_of(limits, rng, 50)
        others = [placed(coal, np.eye(4), shape) for shape in shapes]
        near = from_ends(psi, limits) <= BESIDE
        frames = arm.frames(arm.inverse(pose, psi, gc, limits=False))
        for angle, at, beside in zip(psi, frames, near, strict=True):
            mine = [placed(coal, at[link], shape) for link, listed in BODY.links for shape in listed]
            pairs = [(*one, *other) for one in mine for other in others]
            found = [coal.distance(*pair, request, coal.DistanceResult()) for pair in pairs]
            done += len(found)
            least = min(found, default=np.inf)
            if bool(arcs.contains(angle)) != (least > 0) and not beside and abs(least) > BESIDE:
                wrong += 1
                print(f"coal: {arm.name}, GC {gc}, psi {angle}: {least} m, {shapes}", flush=True)
        progress(done, wrong)
    print(f"{done} distances of coal: {wrong} verdicts wrong", flush=True)
    return wrong


def main(samples: int, seed: int) -> int:
    """Run all comparisons, print their results, and return how many are wrong."""
    rng = np.random.default_rng(seed)
    wrong = own(samples, rng) + offsets(samples // 10, rng)
    try:
        import coal
    except ImportError:
        print("no coal: pip install coal")
        return wrong
    return wrong + coals(samples // 10, rng, coal)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(1 if main(given[0] if given else 10_000_000, given[1] if len(given) > 1 else 0) else 0)
