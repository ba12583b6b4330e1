"""The arm and its queries about a pose: arcs, joint functions, branches, diagnosis."""

from . import offset as offset  # arm kinds that `Arm` creates
from . import offset_chain as offset_chain
