"""The compiled core for this processor: the best of the instruction sets that were built.

``ARMANGLE_ISA`` (``sse2``, ``avx2``, ``avx512`` or ``base``) forces a level, for tests.
"""

from __future__ import annotations

import importlib
import os
from types import ModuleType

LEVELS = ("avx512", "avx2", "sse2", "base")


def _load() -> tuple[str, ModuleType]:
    """Return the name and module of the level to use, best first."""
    forced = os.environ.get("ARMANGLE_ISA")
    if forced is not None and forced not in LEVELS:
        raise ImportError(f"ARMANGLE_ISA is {forced!r}, wanted one of {', '.join(LEVELS)}")
    from . import _cpu

    for level in (forced,) if forced else LEVELS:
        if not _cpu.supports(level):
            continue
        try:
            return level, importlib.import_module(f"._core_{level}", __package__)
        except ModuleNotFoundError:
            continue
    raise ImportError(f"armangle was not built for {forced or 'this processor'}, or the processor lacks it")


ISA, _module = _load()
globals().update({k: v for k, v in vars(_module).items() if not k.startswith("_")})
__version__: str = _module.__version__
