"""Writes the type stub of the compiled core, as nanobind's generator sees it, during the build.

Usage: stub.py FOLDER MODULE OUT; the folder holds the extension module.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HEADER = '''"""The compiled core; written by bindings/stub.py when it is built."""

from typing import Any

ISA: str
LEVELS: tuple[str, ...]
__version__: str

'''


def main(folder: str, module: str, out: str) -> None:
    """Write the stub of `module`, which lies in `folder`, to `out`."""
    generator = [sys.executable, "-m", "nanobind.stubgen", "-q", "-i", folder, "-m", module, "-o", out]
    subprocess.run(generator, check=True)
    text = Path(out).read_text()
    for seen, meant in (("-> object", "-> Any"), ("-> tuple:", "-> tuple[Any, ...]:")):
        text = text.replace(seen, meant)
    Path(out).write_text(HEADER + text)


if __name__ == "__main__":
    main(*sys.argv[1:])
