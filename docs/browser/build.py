"""Compile demo.cpp to WebAssembly with clang, and write it with demo.js into one script that needs no server.

python docs/browser/build.py docs/_static/armangle_demo.js
(Debian: apt-get install clang lld wasi-libc libc++-14-dev-wasm32 libclang-rt-14-dev-wasm32)
"""

from __future__ import annotations

import base64
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
INCLUDE = HERE.parents[1] / "include"
EXPORTS = ("asked_numbers", "told_numbers", "sentence_of", "begin", "answer")
FLAGS = ("--target=wasm32-wasi", "-std=c++20", "-Oz", "-flto", "-msimd128", "-mbulk-memory", "-msign-ext",
         "-mnontrapping-fptoint", "-DARMANGLE_SMALL", "-fno-exceptions", "-fno-rtti", "-ffp-contract=off",
         "-mexec-model=reactor", "-Wl,--strip-all", "-Wl,-z,stack-size=1048576")  # fmt: skip


def code() -> bytes:
    """Return the compiled core; a RuntimeError says what the compiler wants."""
    clang = shutil.which("clang++")
    if clang is None:
        raise RuntimeError("no clang++")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "demo.wasm"
        exports = [f"-Wl,--export={name}" for name in EXPORTS]
        command = [clang, *FLAGS, *exports, f"-I{INCLUDE}", str(HERE / "demo.cpp"), "-o", str(out)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            raise RuntimeError(run.stderr)
        return out.read_bytes()


def script(core: bytes) -> str:
    """Return the page's script with the compiled core inside."""
    text = (HERE / "demo.js").read_text(encoding="utf-8")
    return f'const ARMANGLE_CORE = "{base64.b64encode(core).decode()}";\n{text}'


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(script(code()), encoding="utf-8")
