"""URDF: arms and their shapes from its text, and arms as its text."""

from .reading import Source, read_urdf, urdf_candidates
from .writing import write_urdf

__all__ = ["Source", "read_urdf", "urdf_candidates", "write_urdf"]
