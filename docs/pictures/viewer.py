"""The picture of the viewer, taken in a browser and kept as a file, because drawing it takes a browser.

Written by ``python docs/pictures/viewer.py``, which needs the extras view and test, and chromium.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

SERVE = (sys.executable, "-u", "-m", "armangle", "view", "--address", ":0")
TARGET = Path(__file__).parents[1] / "_static" / "viewer.png"
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
WIDTH, HEIGHT = 1280, 800
DRAWN = 8000  # ms that the first picture takes without a GPU


def take(url: str) -> None:
    """Keep a picture of the viewer that is served at an address."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(url)
        page.wait_for_selector("canvas")
        page.locator("[data-panel=reasons]").wait_for()
        page.get_by_role("alert").get_by_role("button").click()  # the remark that no GPU draws
        page.wait_for_timeout(DRAWN)
        page.screenshot(path=TARGET)
        browser.close()


if __name__ == "__main__":
    with subprocess.Popen(SERVE, stdout=subprocess.PIPE, text=True) as served:
        assert served.stdout is not None
        found = re.search(r"http://\S+", served.stdout.readline())
        assert found, "the viewer names its address in its first line"
        take(found[0])
        served.terminate()
