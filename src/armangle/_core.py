"""The compiled core for this processor: the best of the built instruction sets.

``ARMANGLE_ISA`` (``sse2``, ``avx2``, ``avx512`` or ``base``) forces a level, for tests.
"""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

LEVELS = ("avx512", "avx2", "sse2", "base")
MENDED_BY = "in armangle's folder: pip install --force-reinstall --no-deps ."


def _load() -> tuple[str, ModuleType]:
    """Return the name and module of the compiled core for the best instruction set of this processor."""
    forced = os.environ.get("ARMANGLE_ISA")
    if forced is not None and forced not in LEVELS:
        raise ImportError(f"ARMANGLE_ISA is {forced!r}, wanted one of {', '.join(LEVELS)}")
    from . import _cpu

    built = [level for level in LEVELS if find_spec(f"._core_{level}", __package__)]
    usable = [level for level in built if _cpu.supports(level)]
    if forced and forced not in usable:
        why = "this processor lacks it" if forced in built else f"built were {', '.join(built)}"
        raise ImportError(f"ARMANGLE_ISA is {forced!r}, but {why}")
    if not usable:
        raise ImportError(
            f"armangle was built for {', '.join(built) or 'no processor'}, and this processor is another; "
            f"build it for this one, {MENDED_BY}"
        )
    level = forced or usable[0]
    return level, import_module(f"._core_{level}", __package__)


ISA, _module = _load()
globals().update({k: v for k, v in vars(_module).items() if not k.startswith("_")})
__version__: str = _module.__version__
