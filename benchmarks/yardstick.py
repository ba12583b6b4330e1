"""The yardstick of cpp/yard.hpp, to be measured in the process that runs the work.

1 yd = seven scalar ``atan2`` and one ``sincos`` of the C library, on inputs that differ from call to call and
depend on no earlier result: the floor of one scalar inverse. Ratios to it carry from machine to machine
better than ns.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).parent
FLAGS = ("-O3", "-ffp-contract=off")
YARDS = 5000


class Yardstick:
    """Measures yards over directions and arm angles of given postures.

    Parameters
    ----------
    q : ndarray, shape (N, 7)
        Joint values, rad: the seven directions are (sin, cos) of them.
    psi : ndarray, shape (N,)
        Angles for the sincos, rad.
    """

    def __init__(self, q: NDArray[np.float64], psi: NDArray[np.float64]) -> None:
        self._folder = tempfile.TemporaryDirectory()
        library = Path(self._folder.name) / "yard.so"
        compiler = os.environ.get("CXX", "g++")
        command = [compiler, *FLAGS, "-shared", "-fPIC", str(HERE / "cpp" / "yard.cpp"), "-o", str(library)]
        subprocess.run(command, check=True)
        self._walk = ctypes.CDLL(str(library)).armangle_yards
        self._walk.restype = ctypes.c_double
        self._arrays = tuple(np.ascontiguousarray(a[:YARDS]) for a in (np.sin(q), np.cos(q), psi))
        self._arguments = [a.ctypes.data_as(ctypes.c_void_p) for a in self._arrays]
        self._count = ctypes.c_size_t(len(self._arrays[2]))

    def walk(self) -> None:
        """Walk the yards once; the interpreter is free meanwhile."""
        self._walk(*self._arguments, self._count)

    def ns(self) -> float:
        """Return the present length of a yard, ns of CPU time."""
        start = time.thread_time_ns()
        self.walk()
        return (time.thread_time_ns() - start) / self._count.value
