"""URDF: arms and their shapes from its text, and arms as its text."""

from .reading import Source, UrdfModel
from .writing import write_urdf

__all__ = ["Source", "UrdfModel", "write_urdf"]
