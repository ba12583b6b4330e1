"""Chains and candidates of robot files in one call."""

from __future__ import annotations

from typing import Any

from armangle.models.candidates import Candidate
from armangle.models.chain import Chain
from armangle.models.mjcf import MjcfModel
from armangle.models.urdf import UrdfModel


def read_urdf(source: Any, base: str | None = None, tip: str | None = None, **options: Any) -> Chain:
    """The chain of seven joints of a URDF."""
    return UrdfModel(source).chain(base, tip, **options)


def urdf_candidates(source: Any, base: str | None = None) -> list[Candidate]:
    """The chains of a URDF that may be arms."""
    return UrdfModel(source).candidates(base)


def read_mjcf(source: Any, base: str | None = None, tip: str | None = None, **options: Any) -> Chain:
    """The chain of seven hinges of an MJCF."""
    return MjcfModel(source).chain(base, tip, **options)


def mjcf_candidates(source: Any, base: str | None = None) -> list[Candidate]:
    """The chains of an MJCF that may be arms."""
    return MjcfModel(source).candidates(base)
