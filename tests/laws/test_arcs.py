"""ArcSet: the algebra of closed arcs on the circle, its ends, containment and nearest against brute force."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from support.laws import JOINT, circle_gap
from support.strategies import TURN, Array

import armangle as aa

GRID = np.linspace(-np.pi, np.pi, 720, endpoint=False) + 1e-4
FULL, EMPTY = aa.ArcSet([[-np.pi, np.pi]]), aa.ArcSet()
SPECIAL = [
    FULL,
    EMPTY,
    aa.ArcSet([[np.pi - 0.5, np.pi + 0.5]]),  # over the seam
    aa.ArcSet([[-np.pi, 0.0]]),
    aa.ArcSet([[0.0, np.pi]]),
    aa.ArcSet([[-1.0, 0.0], [1.0, 2.0]]),
    aa.ArcSet([[0.0, 1.0], [2.0, 3.0]]),  # touches the one before at 0, 1 and 2
    aa.ArcSet([[0.0, TURN - 1e-3]]),
    aa.ArcSet([[0.3, 0.3 + 2e-9]]),
]


def any_set(rng: np.random.Generator) -> aa.ArcSet:
    """A random set of up to six arcs, sometimes with ends shared with others, or a special one."""
    if rng.random() < 0.2:
        return SPECIAL[rng.integers(len(SPECIAL))]
    lower = (
        rng.choice([rng.uniform(-10, 10), rng.integers(-6, 6) / 2], size=rng.integers(1, 7))
        + rng.integers(0, 12, 1) / 2
    )
    return aa.ArcSet(
        np.stack([lower, lower + rng.choice([0.5, 1.0, rng.uniform(0, 3)], lower.shape)], axis=1)
    )


def pairs(count: int) -> list[tuple[aa.ArcSet, aa.ArcSet, aa.ArcSet]]:
    """Triples of sets: all pairs of special ones with a random third, then `count` random ones."""
    rng = np.random.default_rng(1)
    special = [(a, b, any_set(rng)) for a in SPECIAL for b in SPECIAL]
    return special + [(any_set(rng), any_set(rng), any_set(rng)) for _ in range(count)]


TRIPLES = pairs(300)


def same(a: aa.ArcSet, b: aa.ArcSet) -> bool:
    """Whether two sets differ by at most 1e-8 rad in all: touching points and rounding."""
    return float((a & ~b).measure + (b & ~a).measure) <= 1e-8


def brute(arcs: aa.ArcSet, psi: Array) -> Array:
    """Whether psi (n,) lie in a set, by its intervals alone."""
    return np.array([any((x - low) % TURN <= high - low for low, high in arcs) for x in psi]) | bool(
        arcs.is_full
    )


def distance(arcs: aa.ArcSet, psi: float) -> float:
    """Distance on the circle to a set that does not hold psi, rad."""
    return min(float(circle_gap(psi, end)) for interval in arcs for end in interval)


def is_well_formed(arcs: aa.ArcSet) -> bool:
    """Whether arcs rise, are disjoint, have lower in [-π, π) and upper within 2π of it; full is [-π, π]
    without ends.
    """
    intervals = arcs.intervals
    if arcs.is_full:
        return intervals.tolist() == [[-np.pi, np.pi]] and arcs.ends == [()]
    lower, upper = intervals.T
    ordered = bool((np.diff(lower) > 0).all() and (upper[:-1] < lower[1:]).all())
    apart = len(lower) == 0 or upper[-1] < lower[0] + TURN
    ranged = bool(((lower >= -np.pi) & (lower < np.pi) & (upper >= lower)).all())
    return ordered and apart and ranged and len(arcs.ends) == len(intervals) == arcs.count


@pytest.mark.slow
def test_the_algebra_of_sets() -> None:
    """The operators &, | and ~ of ArcSet obey the laws of sets, but for points and rounding."""
    for a, b, c in TRIPLES:
        alike = [
            (~(a & b), ~a | ~b), (~(a | b), ~a & ~b), (~~a, a), (a & a, a), (a | a, a), (a & b, b & a),
            (a | b, b | a),
            (a & (b | c), (a & b) | (a & c)), (a | (b & c), (a | b) & (a | c)), (a & (b & c), (a & b) & c),
        ]  # fmt: skip
        assert [k for k, pair in enumerate(alike) if not same(*pair)] == []
        assert (a & ~a).measure <= 1e-8 and (a | ~a).measure >= TURN - 1e-8
    assert ~FULL == EMPTY and ~EMPTY == FULL


def test_full_and_empty_are_neutral_measures_add_up_and_a_set_is_well_formed() -> None:
    """Full and empty sets are neutral, measures add up, and results are well formed and have a repr that
    evaluates.
    """
    for a, b, _ in TRIPLES:
        assert a & FULL == a == a | EMPTY and a | FULL == FULL and a & EMPTY == EMPTY
        assert abs(a.measure + (~a).measure - TURN) <= 1e-8
        assert abs((a & b).measure + (a | b).measure - a.measure - b.measure) <= 1e-8
        for arcs in (a, ~a, a & b, a | b):
            assert is_well_formed(arcs), arcs
            again = eval(repr(arcs), {"ArcSet": aa.ArcSet})
            assert again == arcs and hash(again) == hash(arcs)


@pytest.mark.slow
def test_operations_are_those_of_membership() -> None:
    """&, | and ~ of ArcSet agree with membership on a grid."""
    for a, b, _ in TRIPLES[:200]:
        in_a, in_b = brute(a, GRID), brute(b, GRID)
        clear = np.array(
            [
                min(distance(s, x) if s.count and not s.is_full else 1 for s in (a, b)) > 1e-8
                for x in GRID[::9]
            ]
        )
        for arcs, wanted in ((a & b, in_a & in_b), (a | b, in_a | in_b), (~a, ~in_a)):
            assert np.array_equal(brute(arcs, GRID[::9])[clear], wanted[::9][clear])


def test_contains_and_nearest_are_brute_force() -> None:
    """`contains` and `in` agree with the intervals; `nearest` is the nearest end, psi itself inside, NaN if
    empty.
    """
    rng = np.random.default_rng(2)
    for a, _, _ in TRIPLES[:150]:
        psi = rng.uniform(-20, 20, 30)
        inside = brute(a, psi)
        near = a.nearest(psi)
        assert np.array_equal(a.contains(psi), inside)
        assert [x in a for x in psi] == inside.tolist()
        if a.is_empty:
            assert np.isnan(near).all()
            continue
        assert circle_gap(near, psi)[inside].max(initial=0) <= 1e-14
        for x, n in zip(psi[~inside], near[~inside], strict=True):
            assert abs(circle_gap(n, x) - distance(a, x)) <= 1e-12
            assert a.contains(n)
        assert ((near > -np.pi) & (near <= np.pi)).all()


def test_nearest_on_a_tie_is_an_end() -> None:
    """`ArcSet.nearest` of an angle as far from two ends is one of them; of pi to [-1, 1] it is -1."""
    arcs = aa.ArcSet([[1.0, 2.0]])
    assert aa.ArcSet([[-2.0, -1.0], [1.0, 2.0]]).nearest(0.0) in (-1.0, 1.0)
    assert arcs.nearest(1.5 - np.pi) in (1.0, 2.0)
    assert aa.ArcSet([[-1.0, 1.0]]).nearest(np.pi) == -1.0


def test_membership_has_a_slack_of_a_nanoradian() -> None:
    arcs = aa.ArcSet([[0.0, 1.0]])
    assert -0.9e-9 in arcs
    assert 1 + 0.9e-9 in arcs
    assert -2e-9 not in arcs
    assert -2e-9 + TURN not in arcs


def test_overlapping_arcs_join() -> None:
    assert aa.ArcSet([[0, 1], [0.5, 2]]).intervals.tolist() == [[0, 2]]
    assert aa.ArcSet([[0, 1], [1, 2]]).count == 1
    assert aa.ArcSet([[0, 7]]).is_full
    assert aa.ArcSet([[0, 4], [3, TURN]]).is_full
    assert aa.ArcSet([[5, 6]]).intervals[0, 0] == pytest.approx(5 - TURN, abs=1e-15)


def test_an_isolated_angle_is_an_arc_of_no_width() -> None:
    """An ArcSet may hold a single angle, which operations keep; two arcs that touch have no intersection."""
    point = aa.ArcSet([[0.5, 0.5]])
    assert (point.count, point.measure, point.is_empty) == (1, 0.0, False)
    assert 0.5 in point and 0.5 + TURN in point and 0.6 not in point
    assert point.nearest(2.0) == 0.5
    assert eval(repr(point), {"ArcSet": aa.ArcSet}) == point
    wide, beside = aa.ArcSet([[0.0, 1.0]]), aa.ArcSet([[1.0, 2.0]])
    assert (point & wide) == (wide & point) == (point & point) == (point & ~aa.ArcSet()) == point
    assert (point & beside).is_empty
    assert (point | beside).intervals.tolist() == [[0.5, 0.5], [1.0, 2.0]]
    assert (point | wide) == wide
    assert (~point).is_full and (~(point | beside) == ~beside)
    assert (wide & beside).is_empty  # where wide arcs only touch there is none
    over_the_seam = aa.ArcSet([[np.pi, np.pi]])
    assert over_the_seam.intervals.tolist() == [[-np.pi, -np.pi]]
    assert over_the_seam & aa.ArcSet([[3.0, 4.0]]) == over_the_seam


def test_the_ends_are_carried_through() -> None:
    """&, | and ~ keep the names of ends, with "user" for those of an ArcSet that a user made."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, psi, gc = arm.forward(np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1]))
    arcs = arm.feasible(pose, gc)
    first = arcs.intervals[0]
    own = aa.ArcSet([[first[0] - 1e-3, first[0] + 0.1]])
    assert (arcs & own).ends == [(arcs.ends[0][0], aa.types.ArcEnd(None, "user", np.nan))] or (
        (arcs & own).ends[0][0] == arcs.ends[0][0] and (arcs & own).ends[0][1].side == "user"
    )
    turned = [end for pair in (~arcs).ends for end in pair]
    assert sorted(turned, key=repr) == sorted((end for pair in arcs.ends for end in pair), key=repr)
    assert (arcs | aa.ArcSet()).ends == arcs.ends == (arcs & FULL).ends
    assert psi in arcs


def test_a_batch_is_its_elements() -> None:
    """Operators and methods of a batch of sets equal those of its elements."""
    rng = np.random.default_rng(3)
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, _, gc = arm.forward(rng.uniform(arm.lower, arm.upper, (4, 3, 7)))
    arcs, own = arm.feasible(pose, gc), aa.ArcSet([[-1, 2.5]])
    psi = rng.uniform(-4, 4, (4, 3))
    both, either, other = arcs & own, arcs | own, ~arcs
    assert arcs.intervals.shape == (4, 3, arcs.count.max(), 2)
    for i in np.ndindex(4, 3):
        assert both[i] == arcs[i] & own
        assert either[i] == arcs[i] | own
        assert other[i] == ~arcs[i]
        assert arcs.contains(psi)[i] == arcs[i].contains(psi[i])
        assert np.array_equal(arcs.nearest(psi)[i], arcs[i].nearest(psi[i]), equal_nan=True)
        assert arcs.measure[i] == arcs[i].measure
        count = arcs[i].count
        assert np.array_equal(arcs.intervals[i][:count], arcs[i].intervals)
        assert np.isnan(arcs.intervals[i][count:]).all()
    assert arcs[1:3, ::2].shape == (2, 2)
    assert arcs[2].shape == (3,)
    assert arcs[arcs.count > 0].shape == ((arcs.count > 0).sum(),)
    assert len(arcs) == 4
    assert len(arcs[0, 0]) == arcs[0, 0].count


def test_a_pickled_set_is_equal() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, _, gc = arm.forward(np.array([0.3, 0.6, -0.2, 1.3, 0.4, 0.9, 0.1]))
    arcs = arm.feasible(pose, gc)
    again = pickle.loads(pickle.dumps(arcs))
    assert again == arcs
    assert again.ends == arcs.ends
    assert again.status is arcs.status


def test_a_set_is_frozen() -> None:
    arcs = aa.ArcSet([[0, 1]])
    with pytest.raises(AttributeError, match="ArcSet is frozen: shape cannot be set"):
        arcs.shape = (2,)
    with pytest.raises(ValueError, match="read-only"):
        arcs.intervals[0, 0] = 3.0
    assert EMPTY.is_empty
    assert JOINT == 1e-9


def test_what_is_picked_is_what_lies_there() -> None:
    """Indexing a batch of sets picks counts, intervals, status and ends as numpy would."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.random.default_rng(5).uniform(-1.6, 1.6, (24, 7))
    sets = arm.feasible(arm.forward(q)[0].reshape(4, 6, 4, 4), 0)
    keys = (1, -1, (2, 3), slice(None, None, 2), (slice(None), slice(5, None, -2)), [3, 0, 3], np.s_[:0],
            (np.array([[0, 1]]), np.array([[5, 5]])), np.asarray(sets.count) == 2)  # fmt: skip
    assert len(set(np.ravel(sets.count).tolist())) > 2
    whole = sets.intervals
    for key in keys:
        picked = sets[key]
        wanted = np.asarray(sets.count)[key]
        assert picked.shape == wanted.shape and np.array_equal(picked.count, wanted)
        most = picked.intervals.shape[-2]
        assert np.array_equal(picked.intervals, whole[key][..., :most, :], equal_nan=True)
        assert np.array_equal(picked.status, np.asarray(sets.status)[key])
    assert sets[2, 3].ends == sets.ends[2][3] and sets[1:3].ends == sets.ends[1:3]
