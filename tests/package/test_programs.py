"""C++ programs that count: what they must never meet, and what they must meet often enough to show it."""

from __future__ import annotations

from pathlib import Path

import pytest
from support import draw
from support.needs import missing
from support.programs import counts

HERE = Path(__file__).resolve().parent
EIGEN = Path("/usr/include/eigen3")
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror")


CALLED = """make_arm limit_table forward jacobian inverse feasible feasible_all nearest step follow
bounded_step lookahead scene tracker chain_arm near_inverse near_feasible near_follow"""


def test_nothing_that_a_control_loop_calls_allocates() -> None:
    """no_allocation.cpp counts no allocation in any function of CALLED."""
    found = counts("no_allocation")
    assert found["counter"] >= 1, "the counter counts"
    assert {name: found[name] for name in CALLED.split()} == dict.fromkeys(CALLED.split(), 0)


@pytest.mark.parametrize("family", ["offset", "exact"])
@pytest.mark.parametrize(
    ("many", "least", "none"),
    [("proven", 500, "wrong"), ("kept", 300, "missed"), ("broken", 100, "untrue")],
    ids=["samples refute nothing proven", "what keeps clear is proven", "what is said to be broken is"],
)
def test_the_proof_of_a_stretch_of_a_path(family: str, many: str, least: int, none: str) -> None:
    """prove_stretch.cpp finds no false proof, no stretch unproven that keeps all by 0.02, no false break."""
    found = counts("prove_stretch", "-O1", f"-DSAMPLES={2000 if draw.COUNT else 500}")
    assert found[f"{many}_{family}"] > least and found[f"{none}_{family}"] == 0, found


def test_forms_of_limits_of_offset_arms_vanish_at_the_joint_s_own_angle_within_a_small_bound() -> None:
    """limit_forms.cpp: each form is within its error bound at the joint's angle, and the bound is small."""
    found = counts("limit_forms")
    assert all(0 < found[f"form_{joint}"] <= 1 for joint in range(1, 7)), found
    assert 0 < found["vacuous"] < 1e-6


def test_every_root_of_a_form_is_enclosed_and_alone_at_nearly_all_postures() -> None:
    """limit_forms.cpp: an enclosure holds the joint's own angle at each ordinary posture, and at under 1 % of
    them one may hold two roots.
    """
    found = counts("limit_forms")
    assert found["missed"] == 0 and found["ordinary"] > 4000
    assert found["unsettled"] < 0.01 * found["ordinary"]


def test_mean_value_forms_hold_all_samples_and_are_hardly_wider() -> None:
    """mean_value.cpp: ranges hold every sample, and over small boxes exceed theirs by a few per cent."""
    found = counts("mean_value", "-O1")
    assert found["samples"] > 2_000_000 and found["outside"] == 0 and found["unknown"] < 0.01
    assert found["wide"] < 1.1 and found["wide_plain"] > 4


def test_search_is_never_worse_than_a_grid_and_ends_with_a_proof() -> None:
    """search.cpp counts none of its eight faults."""
    found = counts("search", *STRICT)
    wrong = {name: count for name, count in found.items() if name.startswith("wrong_")}
    assert len(wrong) == 8 and not any(wrong.values()), found
    assert found["narrow"] > 30 and found["held"] == found["beyond"] == 60 and found["accepted"] > 20
    assert found["shown"] > 10 * found["refused"]


def test_the_glue_of_moveit_answers_what_moveit_asks() -> None:
    """moveit_plugin.cpp finds no fault of the glue, against headers that stand in for MoveIt's."""
    if not (EIGEN / "Eigen" / "Geometry").is_file():
        missing(f"no Eigen in {EIGEN}")
    found = counts("moveit_plugin", *STRICT, f"-I{HERE / 'moveit_standin'}", f"-isystem{EIGEN}")
    assert found["wrong"] == 0 and found["right"] >= 19, found
