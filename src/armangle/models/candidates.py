"""Chains of seven rotating joints in a robot's tree, classified: S-R-S, with an offset, or near.

A reader passes its file as rigid bodies and the joints between them. A search walks *up* from every joint.
Parts below an arm (a waist, a lift, a free base) and above it (a gripper) do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from typing import NoReturn

from .._arrays import JOINTS, millimetres
from ..errors import ModelError
from .axes import Axes
from .chain import Chain
from .detect import Nearness, fitted_arm, nearness, residual
from .offset import offset_end

_MOST_NAMES = 20
_MOST_TIPS = 4
_OTHER = 3  # rank of a chain that is neither S-R-S nor near it, nor one with an offset
_MOST_JOINTS = 300  # of a tree in which every run of seven joints is measured; robots have fewer


@dataclass
class RigidBody:
    """Links that do not move against each other, by name.

    `links`, the topmost first; `ends`, those without a further link of this body; `parting`, the lowest link
    above all ends, or the end itself if there is only one.
    """

    links: list[str] = field(default_factory=list)
    ends: list[str] = field(default_factory=list)
    parting: str = ""
    parted: bool = False

    def add(self, link: str, carried: int) -> None:
        """Append a link; `carried` is how many links of this body are fixed to it."""
        self.links.append(link)
        if carried == 0:
            self.ends.append(link)
        if not self.parted:
            self.parting = link
        self.parted = self.parted or carried > 1


@dataclass(frozen=True)
class TreeJoint:
    """A joint between two rigid bodies, given by their numbers.

    `bound` is a verb with its object: the reason why a rotating joint cannot move on its own.
    """

    name: str
    rotates: bool
    above: int
    below: int
    bound: str = ""


@dataclass(eq=False)
class Tree:
    """Rigid bodies and the joints between them, in file order."""

    bodies: list[RigidBody] = field(default_factory=list)
    joints: list[TreeJoint] = field(default_factory=list)

    @cached_property
    def over(self) -> dict[int, int]:
        """The number of the joint that carries each body, for those that have one."""
        return {joint.below: number for number, joint in enumerate(self.joints)}

    @cached_property
    def under(self) -> list[list[int]]:
        """The numbers of the joints attached to each body."""
        carried: list[list[int]] = [[] for _ in self.bodies]
        for number, joint in enumerate(self.joints):
            carried[joint.above].append(number)
        return carried

    def body_of(self, link: str) -> int:
        """Return the number of the body that a link of the tree belongs to."""
        return next(number for number, body in enumerate(self.bodies) if link in body.links)

    @cached_property
    def depth(self) -> list[int]:
        """Largest number of consecutive joints of any kind below each body."""
        depth = [0] * len(self.bodies)
        order = [body for body in range(len(self.bodies)) if body not in self.over]
        for body in order:
            order += [self.joints[number].below for number in self.under[body]]
        for body in reversed(order):
            depth[body] = max(
                (1 + depth[self.joints[number].below] for number in self.under[body]), default=0
            )
        return depth

    def run_up(self, body: int, *, bound: bool = False) -> list[int]:
        """Return all consecutive rotating joints from a body upwards, in order from base to tip.

        With ``bound`` including those that would rotate if they were not bound.
        """
        over, run = self.over, list[int]()
        while body in over and (self.joints[over[body]].rotates or (bound and self.joints[over[body]].bound)):
            run.append(over[body])
            body = self.joints[over[body]].above
        return run[::-1]

    def may_begin(self, body: int) -> bool:
        """Return whether an arm may begin at a body: the root, a branching, or the top of a lift."""
        root = body not in self.over
        return root or len(self.under[body]) > 1 or not self.joints[self.over[body]].rotates

    def goes_on(self, joint: int) -> bool:
        """Return whether an arm continues with a joint: no sibling has as many consecutive joints.

        A head beside an arm has fewer; no finger of a hand is the next axis of the arm.
        """
        depth = self.depth[self.joints[joint].below]
        beside = [
            self.joints[other].below for other in self.under[self.joints[joint].above] if other != joint
        ]
        return all(self.depth[body] < depth for body in beside)

    def may_end(self, body: int) -> bool:
        """Return whether an arm may end at a body: a leaf, a branching, or before a sliding joint."""
        under = self.under[body]
        return len(under) != 1 or not self.joints[under[0]].rotates

    def base_above(self, tip: str) -> str:
        """Return the base of the seven rotating joints above a link; the root link if there are none such."""
        body = self.body_of(tip)
        way = self.run_up(body)[-JOINTS:]
        if len(way) == JOINTS and self.bodies[self.joints[way[0]].above].links:
            return self.bodies[self.joints[way[0]].above].links[0]
        while body in self.over:
            body = self.joints[self.over[body]].above
        return self.bodies[body].links[0]

    def instead_of(self, base: str, tip: str) -> str:
        """Return advice, after "; ", on the base of the seven rotating joints above `tip`; "" if there are
        none such, or `base` is theirs.
        """
        near = self.base_above(tip)
        if near == base or len(self.run_up(self.body_of(tip))) < JOINTS:
            return ""
        return (
            f"; base={near!r} leaves the last {JOINTS}: then arm.with_(base=T @ arm.base) puts the arm into "
            f"the frame of {base!r}, T being the pose of {near!r} in it"
        )


@dataclass(frozen=True)
class Candidate:
    """Seven rotating joints between two links of a file, and their deviation from S-R-S.

    `base` is the topmost link of the body with the first joint, `tip` the lowest link above all ends of the
    body after the last. Each of `ends` may be the tip instead. `joints` are from base to tip. `nearness` and
    `chain`, as the file has it, are None if the joints cannot be read. `offset` is "wrist" or "shoulder" if
    the chain is S-R-S except for one offset there, or nearly, otherwise empty; `offset_residual` is the
    largest distance found between the arm with that offset and the file, m, 0 within rounding.
    """

    base: str
    tip: str
    ends: tuple[str, ...]
    joints: tuple[str, ...]
    nearness: Nearness | None
    chain: Chain | None
    offset: str = ""
    offset_residual: float = math.nan

    @cached_property
    def residual(self) -> float:
        """Largest distance between the nearest S-R-S arm and the file, m; NaN if S-R-S or not near."""
        if self.chain is None or self.nearness is None or not self.nearness.near:
            return math.nan
        return residual(self.chain, fitted_arm(self.chain))[0]

    def verdict(self) -> str:
        """Return in words how near to S-R-S the chain is."""
        if self.nearness is None:
            return "cannot be read"
        if self.nearness.srs:
            return "S-R-S"
        special = ""
        if self.offset:
            nearly = f"near an offset {self.offset}: within {millimetres(self.offset_residual)}"
            special = nearly if self.offset_residual else f"offset {self.offset}"
        if not self.nearness.near:
            return special or "not S-R-S"
        off = f"off by {millimetres(self.nearness.miss)}, {round(math.degrees(self.nearness.tilt), 4):g} deg"
        near = f"near S-R-S: {off}; nearest arm within {millimetres(self.residual)}"
        return f"{near}; or {special}" if special else near

    def rank(self) -> int:
        """Return 0 for S-R-S, 1 for an offset wrist or shoulder, 2 for near one of these, 3 for others."""
        if self.nearness is not None and self.nearness.srs:
            return 0
        if self.offset:
            return 2 if self.offset_residual else 1
        return 2 if self.nearness is not None and self.nearness.near else _OTHER

    def __str__(self) -> str:
        """Both ends, other possible tips, and the verdict, on one line."""
        return f"{self.base!r} to {self.tip!r} ({self.verdict()}{self.other_tips()})"

    def other_tips(self) -> str:
        """Return in words the other tip links that the file offers; "" if there are none."""
        others = [end for end in self.ends if end != self.tip]
        return f"; or tip {listed(others, _MOST_TIPS)}" if others else ""


def moved_base(joint: str, base: str) -> str:
    """Return a note that a joint (of a lift or mobile base) moves the base and is not in the arm."""
    return f"joint {joint!r} moves the base {base!r}: no part of the arm"


def listed(names: Sequence[str], most: int = _MOST_NAMES) -> str:
    """Return names on one line; only the first of many."""
    more = f", and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def unknown(what: str, name: str, role: str, names: Sequence[str]) -> str:
    """Return the message for a "link" or "body" (`what`) that is not in a file; `role`: "base" or "tip"."""
    near = get_close_matches(name, names, n=3)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    plural = {"link": "links", "body": "bodies"}[what]
    return f"no {what} {name!r} ({role}); {hint}the {plural} are: {listed(names)}"


def find_candidates(
    tree: Tree, chain: Callable[[str, str], Chain], base: str | None = None
) -> list[Candidate]:
    """Return every chain of seven rotating joints: S-R-S, with an offset, near, others in file order.

    A chain begins at the root, where the tree branches, after a joint that does not rotate, or at the link
    `base`: then only chains from its body are returned. It ends at a leaf, where the tree branches, or before
    a joint that does not rotate. At a branching between, it continues with the deepest branch
    (`Tree.goes_on`). A chain that is S-R-S, or has an offset wrist or shoulder, may be anywhere. A near one
    may begin or end anywhere, and so may all if there is no other. `chain` reads the chain between two links.
    """
    wanted = None if base is None else tree.body_of(base)
    anywhere = len(tree.joints) <= _MOST_JOINTS
    found, rest = [], []
    for joint in tree.joints:
        way = tree.run_up(joint.below)[-JOINTS:]
        if len(way) < JOINTS:
            continue
        start = tree.joints[way[0]].above
        begins, stops = wanted == start or tree.may_begin(start), tree.may_end(joint.below)
        straight = all(tree.goes_on(number) for number in way[1:])
        whole = begins and stops and straight
        named = tree.bodies[start].links and tree.bodies[joint.below].links
        finger = not tree.goes_on(way[-1])
        if not named or finger or wanted not in (None, start) or not (whole or anywhere):
            continue
        one = _candidate(tree, chain, way, base)
        exact = one.rank() == 0 or (one.offset != "" and one.offset_residual == 0)
        if whole or exact or (one.rank() < _OTHER and (begins or stops)):
            found.append(one)
        elif straight and (begins or stops):
            rest.append(one)
    return sorted(found or rest, key=Candidate.rank)


def _candidate(
    tree: Tree, chain: Callable[[str, str], Chain], way: Sequence[int], base: str | None = None
) -> Candidate:
    """Return a candidate of seven joints of a tree, by number, with its deviation from an S-R-S arm."""
    first, last = tree.bodies[tree.joints[way[0]].above], tree.bodies[tree.joints[way[-1]].below]
    ends = (base or first.links[0], last.parting)
    read, how = _readable(chain, ends)
    offset, off_by = ("", math.nan) if read is None or how is None or how.srs else offset_end(read)
    names = tuple(tree.joints[number].name for number in way)
    return Candidate(*ends, tuple(last.ends), names, how, read, offset, off_by)


def _readable(
    chain: Callable[[str, str], Chain], ends: tuple[str, str]
) -> tuple[Chain | None, Nearness | None]:
    """Return a chain and its deviation from S-R-S, None if it cannot be read."""
    try:
        read = chain(*ends)
        return read, nearness(Axes(*read.lines()))
    except ModelError:
        return None, None


def guess(
    tree: Tree,
    chain: Callable[[str, str], Chain],
    base: str | None,
    tip: str | None,
    fail: Callable[[str], NoReturn],
    *,
    offset: bool = False,
) -> tuple[str, str, tuple[str, ...]]:
    """Return base and tip, missing ones guessed, and notes of other possible choices.

    `tree` and `chain` are as in `find_candidates`; at most one of `base` and `tip`, links of the tree, is
    given. `fail` receives the reason if no guess is possible, and raises the error of the file's format. With
    `offset`, the only one of several chains with an offset wrist or shoulder is used, not the only S-R-S one.
    """
    if tip is not None:
        return _base_of(tree, chain, tip, fail), tip, ()
    found = find_candidates(tree, chain, base)
    if not found:
        where = f" begins at {base!r}" if base else " is found"
        others = find_candidates(tree, chain) if base else []
        choices = f"; the file has {_lines(others)}" if others else _why_none(tree)
        fail(f"no chain of {JOINTS} rotating joints{where}, walking up from every joint{choices}")
    one = chosen(found, int(offset))
    if one is None:
        fail(f"base and tip are not unique, name them; candidates: {_lines(found)}")
    return one.base, one.tip, _taken(one, found)


def chosen(found: Sequence[Candidate], rank: int) -> Candidate | None:
    """Return the only candidate of a rank, else the only one of all ranks; None if there is neither."""
    best = [one for one in found if one.rank() == rank]
    alone = best if len(best) == 1 else found
    return alone[0] if len(alone) == 1 else None


def _taken(one: Candidate, found: Sequence[Candidate]) -> tuple[str, ...]:
    """Return notes on the tips and chains that were not chosen."""
    others = [other for other in found if other is not one]
    notes = []
    if len(one.ends) > 1:
        ends = listed(list(map(repr, one.ends)), _MOST_TIPS)
        notes.append(f"the tip is {one.tip!r}, the lowest link above {ends}: tip= names another")
    if others:
        notes.append(f"of {len(found)} chains that to {one.tip!r} is taken, not {_lines(others)}")
    return tuple(notes)


def _base_of(
    tree: Tree, chain: Callable[[str, str], Chain], tip: str, fail: Callable[[str], NoReturn]
) -> str:
    """Return the base of the seven rotating joints that lead to a tip.

    If more lead to it, the nearest ones need not be the arm: the last may be a finger's.
    """
    run = tree.run_up(tree.body_of(tip))
    if len(run) <= JOINTS:
        return tree.base_above(tip)
    ways = [run[at : at + JOINTS] for at in range(len(run) - JOINTS + 1)]
    ways = [way for way in ways if tree.bodies[tree.joints[way[0]].above].links]
    measured = [_candidate(tree, chain, way) for way in ways]
    last, best = measured[-1], min(one.rank() for one in measured)
    if last.rank() == best and (best < _OTHER or tree.may_begin(tree.joints[ways[-1][0]].above)):
        return last.base
    better = [one for one in measured if one.rank() == best]
    leads = f"{len(run)} rotating joints lead to {tip!r}, wanted {JOINTS}"
    fail(f"{leads}: name base and tip; candidates: {_lines(better)}")


def _why_none(tree: Tree) -> str:
    """Return, after ": ", why the longest run of rotating joints is no arm; "" if no joint rotates."""
    runs = [tree.run_up(joint.below, bound=True) for joint in tree.joints]
    run = max(runs, key=len, default=[])
    if not run:
        return ""
    first, last = tree.bodies[tree.joints[run[0]].above], tree.bodies[tree.joints[run[-1]].below]
    ends = f"from {first.parting!r} to {last.parting!r}"
    bound = [f"joint {tree.joints[number].name!r} {tree.joints[number].bound}"
             for number in run if tree.joints[number].bound]  # fmt: skip
    if bound and len(run) >= JOINTS:
        return f": of the {len(run)} {ends} {listed(bound, _MOST_TIPS)}"
    names = listed([tree.joints[number].name for number in run], JOINTS)
    return f": the longest run has {len(run)}, {ends}: {names}"


def _lines(candidates: Sequence[Candidate]) -> str:
    """Return candidates as text, separated by semicolons."""
    return "; ".join(map(str, candidates))
