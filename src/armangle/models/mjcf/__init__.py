"""MJCF: arms and their geoms, read with the ``mujoco`` package (extra ``mujoco``)."""

from .geoms import PlacedGeom, mjcf_geoms
from .reading import MjcfModel, is_mjcf

__all__ = ["MjcfModel", "PlacedGeom", "is_mjcf", "mjcf_geoms"]
