"""The arm in the browser: the core as WebAssembly has the numbers of Python, and a hand can drag it."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.needs import missing, need, need_tool

import armangle as aa

ROOT = Path(__file__).resolve().parents[2]
MOST_CODE = 100_000
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
NUMBERS = """() => {
    const now = window.armangle.core.answer();
    return {asked: Array.from(window.armangle.core.asked), q: Array.from(now.q), psi: now.psi,
        status: now.status, within: now.within, clear: now.clear, arm: now.arm.map(p => Array.from(p)),
        sentence: now.sentence, where: window.armangle.seen(window.armangle.tool())};
}"""


def build() -> Any:
    """Return docs/browser/build.py as a module."""
    spec = importlib.util.spec_from_file_location("browser_build", ROOT / "docs" / "browser" / "build.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def code() -> bytes:
    """The core as WebAssembly."""
    try:
        return build().code()
    except RuntimeError as error:
        missing(f"no compiler for WebAssembly: {str(error)[-200:]}")


@pytest.fixture
def page(code: bytes) -> Iterator[Any]:
    """A page of headless Chromium with the demo, of this WebAssembly, in it."""
    chromium = need_tool("chromium")
    with need("playwright.sync_api").sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--headless", "--no-sandbox"])
        page = running.new_page()
        page.set_content(f'<div id="armangle-demo"></div><script>{build().script(code)}</script>')
        yield page
        running.close()


def same_arcs(found: list[list[float]], wanted: aa.ArcSet) -> bool:
    """Whether the arcs are those of a set, to rounding."""
    return len(found) == wanted.count and np.allclose(found, wanted.intervals, rtol=0, atol=1e-9)


def check(now: dict[str, Any]) -> None:
    """Compare an answer of the page (see NUMBERS) with what Python says of the same arm, pose and ball."""
    asked = np.array(now["asked"])
    pose, gc = asked[:16].reshape(4, 4), int(asked[17])
    assert same_arcs(now["within"], ARM.feasible(pose, gc))
    body, ball = aa.Body.bones(upper_arm=0.06, forearm=0.06), aa.Ball(asked[18:21], asked[21])
    free = ARM.with_(body=body).with_(scene=aa.Scene([ball])).feasible(pose, gc)
    assert same_arcs(now["clear"], free)
    assert np.allclose(now["q"], ARM.inverse(pose, now["psi"], gc, limits=False), rtol=0, atol=1e-12)
    assert np.allclose(now["arm"][2], ARM.elbow(np.array(now["q"])), rtol=0, atol=1e-12)
    assert np.allclose(now["arm"][4], pose[:3, 3], rtol=0, atol=0)


def test_the_code_is_small(code: bytes) -> None:
    """The WebAssembly has less than MOST_CODE bytes."""
    assert 10_000 < len(code) < MOST_CODE


def test_the_page_has_the_numbers_of_python_and_follows_a_hand(page: Any) -> None:
    """The demo has Python's numbers before and after a drag and in another branch, and out of reach it shows
    the sentence of the status.
    """
    first = page.evaluate(NUMBERS)
    assert first["status"] == 0
    check(first)
    canvas = page.locator("canvas").first
    before = canvas.screenshot()
    box = canvas.bounding_box()
    x, y = box["x"] + first["where"][0], box["y"] + first["where"][1]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y - 25, steps=8)
    page.mouse.up()
    page.wait_for_timeout(100)
    after = page.evaluate(NUMBERS)
    moved = np.array(after["asked"])[[3, 7, 11]] - np.array(first["asked"])[[3, 7, 11]]
    assert 0.1 < np.linalg.norm(moved) < 0.2
    assert after["where"] == pytest.approx([x + 40 - box["x"], y - 25 - box["y"]], abs=2)
    check(after)
    assert canvas.screenshot() != before
    # another branch, then a pose out of reach: the sentence of the core
    page.select_option("select", "5")
    page.wait_for_timeout(100)
    check(page.evaluate(NUMBERS))
    page.evaluate("() => { window.armangle.core.asked[3] = 3; window.armangle.show(); }")
    assert page.evaluate(NUMBERS)["status"] == aa.Status.UNREACHABLE
    assert page.locator("output").inner_text() == aa.Status.UNREACHABLE.sentence
