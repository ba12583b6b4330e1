"""MJCF: arms and their geoms, read with the ``mujoco`` package (extra ``mujoco``)."""

from .geoms import PlacedGeom, mjcf_geoms
from .reading import is_mjcf, mjcf_candidates, read_mjcf

__all__ = ["PlacedGeom", "is_mjcf", "mjcf_candidates", "mjcf_geoms", "read_mjcf"]
