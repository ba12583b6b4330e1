#!/usr/bin/env python3
"""Drag the arm of docs/index.md in headless chromium and print how many frames a second it draws.

python tools/browser_frames.py [frames]      (needs playwright, chromium, a compiler for WebAssembly)
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs" / "browser"))
from playwright.sync_api import sync_playwright

import build

DRAG = """frames => new Promise(done => {
    const {core, show} = window.armangle, began = performance.now();
    let count = 0, busy = 0;
    const frame = () => {
        core.asked[7] = 0.2 * Math.sin(count / 20);
        core.asked[19] = -0.25 + 0.1 * Math.cos(count / 15);
        const start = performance.now();
        show();
        busy += performance.now() - start;
        if (++count < frames) requestAnimationFrame(frame);
        else done({rate: 1000 * frames / (performance.now() - began), busy: busy / frames});
    };
    requestAnimationFrame(frame);
})"""


def main() -> None:
    """Measure and print."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 600
    with sync_playwright() as playwright:
        flags = ["--headless", "--no-sandbox"]
        running = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        page = running.new_page()
        page.set_content(f'<div id="armangle-demo"></div><script>{build.script(build.code())}</script>')
        found = page.evaluate(DRAG, frames)
        print(f"{frames} frames: {found['rate']:.1f} a second, {found['busy']:.2f} ms of work each")
        running.close()


if __name__ == "__main__":
    main()
