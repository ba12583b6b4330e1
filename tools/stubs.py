"""Writes the type stub of the compiled core, src/armangle/_core.pyi; with --check only compares it."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import armangle

STUB = Path(__file__).resolve().parents[1] / "src" / "armangle" / "_core.pyi"
HEADER = '''"""The compiled core; written by tools/stubs.py."""

from typing import Any

ISA: str
LEVELS: tuple[str, ...]
__version__: str

'''


def stub() -> str:
    """Return the stub's text, as nanobind's generator sees the core that is loaded."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "core.pyi"
        module = f"armangle._core_{armangle.ISA}"
        command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", module, "-o", str(out)]
        subprocess.run(command, check=True)
        text = out.read_text()
    return HEADER + text.replace("-> object", "-> Any").replace(": list = ...", ": list[str] = ...").replace(
        "-> tuple:", "-> tuple[Any, ...]:"
    )


def main() -> int:
    """Write or check the stub; 1 where it differs."""
    text = stub()
    if "--check" not in sys.argv:
        STUB.write_text(text)
        return 0
    if STUB.read_text() == text:
        return 0
    print(f"{STUB.name} is not that of the core: run python tools/stubs.py", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
