"""The pages: every listing runs and prints what it shows, they build without a warning, and they stay few.

The arm on the start page, the core as WebAssembly, has the numbers of Python, and a hand can drag it.
"""

import base64
import doctest
import inspect
import json
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from email.message import Message
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support import draw
from support.needs import missing, need, need_tool

import armangle
from armangle.cli.main import _NEGATIVE, COMMANDS, _top_parser, command_parser

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MADE = {"_made", "_build", "gallery"}
SITE = sorted(page for page in DOCS.rglob("*.md") if not MADE & set(page.parts))
PAGES = sorted(page.relative_to(ROOT).as_posix() for page in [ROOT / "README.md", *SITE])
MOST_PAGES, MOST_WORDS = 30, 30_000
TOOLS = (
    "sphinx", "furo", "myst_parser", "sphinx_gallery", "sphinxcontrib.bibtex", "sphinx_copybutton",
    "latex2mathml", "matplotlib",
)  # fmt: skip
PEER = re.compile(r"^>>> (?:import|from) (\w+)", re.MULTILINE)
FENCE = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def examples_of(page: Path) -> list[doctest.Example]:
    """The prompts of a page with what they print, in order; lines keep their number on the page."""
    text = page.read_text(encoding="utf-8")
    found: list[doctest.Example] = []
    for fence in FENCE.finditer(text):
        first = text.count("\n", 0, fence.start(1))
        for example in doctest.DocTestParser().get_examples(fence[1]):
            example.lineno += first
            found.append(example)
    return found


SPOKEN = [
    path.relative_to(ROOT)
    for place in ("README.md", "CONTRIBUTING.md", "architecture.toml", "docs", "benchmarks", "examples")
    for path in ([ROOT / place] if (ROOT / place).is_file() else sorted((ROOT / place).rglob("*")))
    if path.suffix in {".md", ".svg", ".toml", ".rst"} and "_build" not in path.parts
]


def missing_headers(text: str) -> list[str]:
    """The headers that a text names and that stand nowhere; `room/x.hpp` must lie in its room."""
    headers = [
        "/" + h.as_posix()
        for place in ("include", "bindings", "examples", "benchmarks", "fuzz")
        for h in (ROOT / place).rglob("*.hpp")
    ]
    named = set(re.findall(r"(?<![\w./])(?:\w+/)*\w+\.hpp\b", text))
    return sorted(
        n
        for n in named
        if not any(h.endswith("/" + n) for h in headers) and not n.startswith(("kdl/", "rclcpp/"))
    )


OF_THE_PAPER = re.compile(r"\b[Ee]qs?\. ?\(|\b[Ff]ig(s?\.|ure) ?\d|\b[Ss]ection \d|\bTable \d")


@pytest.mark.parametrize("name", [page for page in PAGES if "background" not in page.split("/")])
def test_numbers_of_the_paper_are_on_background_pages(name: str) -> None:
    """Only background pages name equations, figures and sections of the paper."""
    assert not OF_THE_PAPER.search((ROOT / name).read_text(encoding="utf-8"))


def test_there_are_few_pages_and_words() -> None:
    """The site has at most MOST_PAGES pages and MOST_WORDS words."""
    texts = [page.read_text(encoding="utf-8") for page in SITE]
    assert len(SITE) <= MOST_PAGES and sum(len(text.split()) for text in texts) <= MOST_WORDS


SEARCH_WORDS = {
    "end effector", "TCP", "null space", "redundancy resolution", "self-motion", "swivel", "SEW", "workspace",
    "reachability", "self-collision", "IKFast", "MoveIt", "ROS 2", "teleoperation", "LeRobot",
}  # fmt: skip
"""What people of the field type to find such a library."""


def test_the_readme_has_the_words_of_the_field_and_is_short() -> None:
    """The README holds all SEARCH_WORDS in at most 120 lines."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert not {word for word in SEARCH_WORDS if word.lower() not in text.lower()}
    assert len(text.splitlines()) <= 120


LINK = re.compile(r"\]\((?!\w+:)([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "benchmarks/README.md"])
def test_links_outside_the_site_lead_to_files(name: str) -> None:
    """Links of pages outside the site lead to files; Sphinx looks at those of its own pages."""
    page = ROOT / name
    targets = LINK.findall(page.read_text(encoding="utf-8"))
    assert not [target for target in targets if not (page.parent / target).exists()]


ANY_FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHELLS = {"", "sh", "bash", "console"}
LEAST_CALLS = 20


def calls_of(text: str) -> Iterator[list[str]]:
    """Words of each line that calls the command line, without prompt, comments and pipes."""
    for language, block in ANY_FENCE.findall(text):
        for line in block.replace("\\\n", " ").splitlines() if language in SHELLS else ():
            call = re.match(r"(?:\$ )?(?:\.venv/bin/)?armangle (.*)", line)
            if call:
                words = shlex.split(re.sub(r"\$\w+", "1", call[1]), comments=True)
                ends = [words.index(end) for end in ("|", ">", "&&") if end in words]
                yield words[: min(ends, default=None)]


CALLS = [(name, words) for name in PAGES for words in calls_of((ROOT / name).read_text(encoding="utf-8"))]


@pytest.mark.parametrize(("name", "words"), CALLS, ids=[f"{n}-{' '.join(w)}" for n, w in CALLS])
def test_a_command_on_a_page_is_one_that_the_command_line_takes(name: str, words: list[str]) -> None:
    """The parser takes every command on the pages; nothing is run."""
    asked = _top_parser().parse_args(words)
    assert asked.command in COMMANDS, name
    values = [f" {word}" if _NEGATIVE.match(word) else word for word in asked.words]
    command_parser(asked.command).parse_intermixed_args(values)


def test_pages_show_the_command_line() -> None:
    """The pages have at least LEAST_CALLS commands, and `calls_of` cuts prompts, comments and pipes."""
    assert len(CALLS) >= LEAST_CALLS
    assert list(calls_of("```sh\n$ armangle ik --pose -1,2 | less  # two\nmake\n```\n")) == [
        ["ik", "--pose", "-1,2"]
    ]


def test_the_pages_link_to_the_repository_that_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    """docs/conf.py takes the repository that pages link to from the package's metadata."""
    stated = Message()
    stated["Project-URL"] = "Repository, https://example.org/armangle"
    monkeypatch.setattr(metadata, "metadata", lambda _: stated)
    tags = SimpleNamespace(has=lambda _: False)
    options = runpy.run_path(str(DOCS / "conf.py"), {"tags": tags})["html_theme_options"]
    assert options["source_repository"] == "https://example.org/armangle"


@pytest.mark.parametrize("path", SPOKEN, ids=str)
def test_headers_that_are_named_exist(path: Path) -> None:
    """Headers that a page or picture names exist in that room."""
    assert not missing_headers((ROOT / path).read_text(encoding="utf-8"))


def test_a_header_that_moved_is_seen() -> None:
    """`missing_headers` finds names of headers that lie elsewhere."""
    assert missing_headers("`circle/posture.hpp: joints`, `inverse.hpp`, `arm/inverse.hpp`") == [
        "arm/inverse.hpp",
        "circle/posture.hpp",
    ]


@pytest.mark.parametrize("name", PAGES)
def test_examples_of_a_page_print_what_they_show(name: str) -> None:
    """The pycon listings of a page print what they show."""
    page = ROOT / name
    for imported in PEER.findall(page.read_text(encoding="utf-8")):
        need(imported)
    case = doctest.DocTest(examples_of(page), {}, name, str(page), 0, None)
    report: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(case, out=report.append)
    assert not result.failed, "".join(report)


def test_python_of_the_readme_runs() -> None:
    """The README's first Python listing solves, steps and plans."""
    fence = re.search(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.M | re.S
    )
    assert fence
    names: dict[str, object] = {}
    exec(fence[1], names)
    assert names["best"].status == names["now"].status == armangle.Status.OK and names["path"].certified


@pytest.mark.parametrize("name", PAGES)
def test_functions_named_beside_formulas_are_in_their_headers(name: str) -> None:
    """Functions named as `x.hpp: f, g` are in that header."""
    text = (ROOT / name).read_text(encoding="utf-8")
    for header, functions in re.findall(r"`(\w+\.hpp): ([\w, ]+)`", text):
        places = sorted((ROOT / "include/armangle").rglob(header))  # two rooms may have one of a name
        source = "\n".join(path.read_text(encoding="utf-8") for path in places)
        missing = [word for word in functions.split(", ") if not re.search(rf"\b{word}\b", source)]
        assert not missing, f"{header} has no {missing}"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages built in a folder of their own, warnings as errors, as HTML.

    `make thorough` runs the gallery too.
    """
    for name in TOOLS:
        need(name)
    work = tmp_path_factory.mktemp("pages")
    made_by_builds = shutil.ignore_patterns("_build", "_made", "gallery", "__pycache__")
    for folder in ("docs", "examples", "tests/reference", "include"):
        shutil.copytree(ROOT / folder, work / folder, ignore=made_by_builds)
    for file in ("CHANGELOG.md", "README.md", "architecture.toml"):
        shutil.copy(ROOT / file, work / file)
    (work / "benchmarks").mkdir()
    for path in [*(ROOT / "benchmarks").glob("*.md"), *(ROOT / "benchmarks").glob("*.png")]:
        shutil.copy(path, work / "benchmarks" / path.name)
    words = ["-q", "-W", "--keep-going", "-b", "html", "-d", "trees", "docs", "html"]
    command = [sys.executable, "-m", "sphinx", *words, *([] if draw.COUNT else ["-t", "coarse"])]
    built = subprocess.run(command, cwd=work, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return work / "html"


def test_pages_build_without_a_warning(site: Path) -> None:
    """Sphinx builds the pages with warnings as errors."""
    assert (site / "index.html").stat().st_size > 1000


def public_members() -> Iterator[str]:
    """Every public name, and every public method and property of the public classes, by its full name."""
    for module in (armangle, armangle.io, armangle.types, armangle.gradients):
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isclass(value) and issubclass(value, Exception):
                yield f"armangle.errors.{name}"
                continue
            yield f"{module.__name__}.{name}"
            own = [c for c in getattr(value, "__mro__", ()) if c is value or c.__name__.startswith("_")]
            for key, member in (pair for cls in own for pair in vars(cls).items()):
                public = inspect.isroutine(member) or isinstance(member, property | classmethod)
                if public and not key.startswith("_"):
                    yield f"{module.__name__}.{name}.{key}"


def test_the_api_page_has_every_public_member_and_no_other(site: Path) -> None:
    """The API page lists every public member and no other."""
    listed = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode().splitlines()
    names = {line.split()[0] for line in listed if " py:" in line and " reference/api.html" in line}
    wanted = set(public_members())
    assert len(wanted) > 100 and wanted <= names
    last = {name.rpartition(".")[2] for name in wanted}
    homes = {name for name in names if name.rpartition(".")[2] in last}  # where it is written
    drawn = vars(armangle.plots)
    plots = {f"armangle.plots.{name}" for name in armangle.plots.__all__ if callable(drawn[name])}
    kuka = {"armangle.kuka", *(f"armangle.kuka.{name}" for name in armangle.kuka.__all__)}
    fields = {f"armangle.kuka.KukaFrame.{name}" for name in armangle.kuka.KukaFrame._fields}
    functions = ("forward", "inverse", "solve", "freedom", "limit_margin")
    bridges = {
        f"armangle.{library}{name}"
        for library in ("torch", "jax")
        for name in ("", ".Kinematics", *(f".Kinematics.{function}" for function in functions))
    }
    assert names == wanted | homes | plots | kuka | fields | bridges | {
        "armangle.errors",
        "armangle.gradients",
    }


def test_the_api_page_shows_the_arguments_of_an_arm(site: Path) -> None:
    """The API page shows the arguments of `Arm`."""
    page = re.sub(r"<[^>]+>", "", (site / "reference" / "api.html").read_text(encoding="utf-8"))
    assert "Arm(*, d_bs, d_se, d_ew, d_wf, a_3=0.0" in page


def test_pages_fetch_nothing_when_read(site: Path) -> None:
    """No page loads scripts, pictures or styles from elsewhere."""
    loads = re.compile(
        r"""<(?:script|img|iframe)[^>]+src="(https?:)?//|<link[^>]+rel="stylesheet"[^>]+href="(https?:)?//"""
    )
    assert [
        page.name for page in site.rglob("*.html") if loads.search(page.read_text(encoding="utf-8"))
    ] == []


def test_every_picture_drawn_is_shown(site: Path) -> None:
    """Every picture drawn for the pages is on one."""
    drawn = {path.name for path in (site.parent / "docs" / "_made").glob("*.svg")}
    pages = "".join(page.read_text(encoding="utf-8") for page in (site.parent / "docs").rglob("*.md"))
    assert {name for name in drawn if f"_made/{name}" not in pages} == set()


SEARCHED = {
    words: page
    for page, all_words in runpy.run_path(str(DOCS / "_ext" / "searched.py"))["PAGES"].items()
    for words in all_words
}


def test_what_a_newcomer_searches_finds_its_page_first(site: Path) -> None:
    """Each phrase of searched.py is a main entry of the index for its page alone."""
    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text.removeprefix("Search.setIndex(").removesuffix(")"))
    for words, page in SEARCHED.items():
        found = index["indexentries"][words.lower()]
        assert [index["docnames"][number] for number, _, is_main in found if is_main] == [page], words


def test_the_words_of_a_newcomer_are_among_those_searched() -> None:
    """SEARCH_WORDS and other common words are in searched.py."""
    wanted = {"closest", "elbow up", "joint limits", "singularity", "gripper", "URDF"}
    wanted |= {"ikpy", "pinocchio", "KDL"}
    assert SEARCH_WORDS | wanted <= set(SEARCHED)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A Chromium without a window."""
    chromium = need_tool("chromium")
    with need("playwright.sync_api").sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--headless", "--no-sandbox"])
        yield running
        running.close()


# Right edges (px) of what is cut off by nothing that scrolls, where they lie beyond the window.
BEYOND = """() => [...document.querySelectorAll('article *')].filter(element => {
    const box = element.getBoundingClientRect();
    if (box.width === 0 || box.right <= innerWidth + 1) return false;
    for (let at = element.parentElement; at && at !== document.body; at = at.parentElement)
        if (getComputedStyle(at).overflowX !== 'visible') return false;
    return true;
}).map(element => `${element.tagName} ends at ${Math.round(element.getBoundingClientRect().right)}`)"""
CUT = """() => [...document.querySelectorAll('article pre')]
    .filter(element => element.scrollWidth > element.clientWidth + 1).map(element => element.innerText)"""
RESIZE = """width => {
    const frame = document.querySelector('iframe');
    frame.width = width;
    return frame.clientWidth;
}"""
DESKTOP, PHONE = 1280, 390


def test_nothing_runs_off_a_page(site: Path, browser: Any) -> None:
    """On a desktop and a phone nothing runs off a page; on a desktop no code is cut."""
    window = browser.new_page()
    pages = sorted(path for path in site.rglob("*.html") if "_static" not in path.parts)
    # A frame that is out of sight is laid out and not drawn, in a file since it is to show files.
    frame = site.parent / "frame.html"
    frame.write_text('<iframe style="position: absolute; top: 9999px; height: 900px">', encoding="utf-8")
    window.goto(frame.as_uri())
    (view,) = window.main_frame.child_frames
    wrong = []
    for path in pages:
        view.goto(path.as_uri())
        for width in (DESKTOP, PHONE):
            assert window.evaluate(RESIZE, width) == width
            if view.evaluate("document.documentElement.scrollWidth > innerWidth") or view.evaluate(BEYOND):
                wrong.append(f"{path.relative_to(site)} at {width}: {view.evaluate(BEYOND)[:3]}")
            if width == DESKTOP and view.evaluate(CUT):  # a phone scrolls long lines within their box
                wrong.append(f"{path.relative_to(site)}: longer than its box:\n{view.evaluate(CUT)[0]}")
    window.close()
    assert len(pages) > 30 and not wrong, "\n".join(wrong)


# Right edges (px) of the first code, and of the calls of the table.
FIRST_CODE = """() => [...document.querySelectorAll('article pre')].slice(0, 2)
    .map(code => code.getBoundingClientRect().left + code.scrollWidth)"""


CALLS_OF_TABLE = """() => [...document.querySelectorAll('#find-your-function code')]
    .map(call => call.getBoundingClientRect().right)"""


@pytest.mark.parametrize(("edges", "least"), [(FIRST_CODE, 2), (CALLS_OF_TABLE, 20)])
def test_on_a_phone_what_to_call_is_seen_whole(site: Path, browser: Any, edges: str, least: int) -> None:
    """On a phone the start page's first code and the calls of its table are seen whole."""
    view = browser.new_page(viewport={"width": PHONE, "height": 900})
    view.goto((site / "index.html").as_uri())
    found = view.evaluate(edges)
    assert len(found) >= least and max(found) <= PHONE
    view.close()


def test_code_can_be_copied_without_prompts(site: Path, browser: Any) -> None:
    """Every listing of the page guides/solve has a button that copies it."""
    view = browser.new_page()
    view.goto((site / "guides" / "solve.html").as_uri())
    buttons = view.locator("button.copybtn")
    assert buttons.count() == view.locator("article pre").count() > 3
    view.close()


def test_every_page_leads_on_and_says_the_version(site: Path) -> None:
    """Four pages of different chapters have links to the next and previous one, and the version."""
    for name in ("tutorial", "guides/paths", "guides/control_loop", "background/paths"):
        page = (site / f"{name}.html").read_text(encoding="utf-8")
        assert 'class="next-page"' in page and 'class="prev-page"' in page
        assert f"armangle {armangle.__version__}" in page


MOST_CODE = 100_000
ARM = armangle.Arm.from_catalogue("kuka_iiwa7_r800")
NUMBERS = """() => {
    const now = window.armangle.core.answer();
    return {asked: Array.from(window.armangle.core.asked), q: Array.from(now.q), psi: now.psi,
        status: now.status, within: now.within, clear: now.clear, arm: now.arm.map(p => Array.from(p)),
        sentence: now.sentence, where: window.armangle.seen(window.armangle.tool())};
}"""


def same_arcs(found: list[list[float]], wanted: armangle.ArcSet) -> bool:
    """Whether the arcs are those of a set, to rounding."""
    return len(found) == wanted.count and np.allclose(found, wanted.intervals, rtol=0, atol=1e-9)


def check(now: dict[str, Any]) -> None:
    """Compare an answer of the start page (see NUMBERS) with what Python says of that arm, pose and ball."""
    asked = np.array(now["asked"])
    pose, gc = asked[:16].reshape(4, 4), int(asked[17])
    assert same_arcs(now["within"], ARM.feasible(pose, gc))
    body = armangle.Body.bones(upper_arm=0.06, forearm=0.06)
    scene = armangle.Scene([armangle.Ball(asked[18:21], asked[21])])
    assert same_arcs(now["clear"], ARM.with_(body=body).with_(scene=scene).feasible(pose, gc))
    assert np.allclose(now["q"], ARM.inverse(pose, now["psi"], gc, limits=False), rtol=0, atol=1e-12)
    assert np.allclose(now["arm"][2], ARM.elbow(np.array(now["q"])), rtol=0, atol=1e-12)
    assert np.allclose(now["arm"][4], pose[:3, 3], rtol=0, atol=0)


@pytest.fixture(scope="module")
def code(site: Path) -> bytes:
    """The core as WebAssembly in the script of the start page, which is empty without a compiler for it."""
    script = (site / "_static" / "armangle_demo.js").read_text(encoding="utf-8")
    return base64.b64decode(script.split('"')[1] if script else missing("no compiler for WebAssembly"))


def test_the_code_is_small(code: bytes) -> None:
    """The WebAssembly has less than MOST_CODE bytes."""
    assert 10_000 < len(code) < MOST_CODE


@pytest.mark.usefixtures("code")
def test_the_start_page_has_the_numbers_of_python_and_follows_a_hand(site: Path, browser: Any) -> None:
    """The arm has Python's numbers before and after a drag and in another branch, and out of reach it shows
    the sentence of the status.
    """
    page = browser.new_page()
    page.goto((site / "index.html").as_uri())
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
    page.select_option("#armangle-demo select", "5")
    page.wait_for_timeout(100)
    check(page.evaluate(NUMBERS))
    page.evaluate("() => { window.armangle.core.asked[3] = 3; window.armangle.show(); }")
    assert page.evaluate(NUMBERS)["status"] == armangle.Status.UNREACHABLE
    assert page.locator("#armangle-demo output").inner_text() == armangle.Status.UNREACHABLE.sentence
    page.close()
