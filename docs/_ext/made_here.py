"""What a build makes: pictures from the library's data, the tables of measured times, docstring fields."""

import re
import sys
from contextlib import suppress
from pathlib import Path

from sphinx.application import Sphinx

BLOCK = re.compile(r"^<!-- ([\w ]+) -->\n(.*?)^<!-- /\1 -->$", re.MULTILINE | re.DOTALL)


def make_pictures(app: Sphinx) -> None:
    """Draw every picture of docs/pictures into docs/_made."""
    from pictures import draw_all

    draw_all(Path(app.srcdir) / "_made")


def take_benchmarks(app: Sphinx) -> None:
    """Take what the programs of benchmarks/ wrote into its README, a file for each pair of markers."""
    text = (Path(app.srcdir).parent / "benchmarks" / "README.md").read_text(encoding="utf-8")
    for name, block in BLOCK.findall(text):
        made = Path(app.srcdir) / "_made" / f"benchmark_{name.replace(' ', '_')}.md"
        made.write_text(block, encoding="utf-8")


def take_help(app: Sphinx) -> None:
    """Take the help of every command of the command line whose extra is installed."""
    from armangle import MissingExtraError
    from armangle.cli.main import COMMANDS, command_parser

    sections = []
    for name in COMMANDS:
        with suppress(MissingExtraError):
            sections.append(f"## armangle {name}\n\n```text\n{command_parser(name).format_help()}```\n")
    (Path(app.srcdir) / "_made" / "cli.md").write_text("\n".join(sections), encoding="utf-8")


def compile_demo(app: Sphinx, failed: Exception | None) -> None:
    """Write the script of the arm in the browser; without a compiler for it, one that leaves the picture."""
    if failed or app.builder.format != "html":
        return
    sys.path.insert(0, str(Path(app.srcdir) / "browser"))
    import build

    try:
        script = build.script(build.code())
    except RuntimeError:
        script = ""
    (Path(app.outdir) / "_static" / "armangle_demo.js").write_text(script, encoding="utf-8")


def take_statuses(app: Sphinx) -> None:
    """Take the sentence of every status."""
    import armangle

    rows = [f"| {status.name} | {status.sentence} |" for status in armangle.Status]
    table = "\n".join(["| status | sentence |", "|---|---|", *rows])
    (Path(app.srcdir) / "_made" / "statuses.md").write_text(table + "\n", encoding="utf-8")


def list_the_rest(app: Sphinx) -> None:
    """List the public names that the page of the API does not name itself, and armangle.plots."""
    import armangle
    from armangle import plots

    page = (Path(app.srcdir) / "reference" / "api.md").read_text(encoding="utf-8")
    errors = vars(armangle.errors).values()
    objects = {
        f"{module.__name__}.{name}": getattr(module, name)
        for module in (armangle, armangle.io, armangle.types)
        for name in module.__all__
        if f"{module.__name__}.{name}\n" not in page
    }
    objects |= {f"armangle.plots.{name}": getattr(plots, name) for name in plots.__all__}
    lines = ["```{eval-rst}"]
    for name, value in objects.items():
        if callable(value) and value not in errors:
            kind = "autoclass" if isinstance(value, type) else "autofunction"
            lines += [f".. {kind}:: {name}", "   :members:" if kind == "autoclass" else "", ""]
    (Path(app.srcdir) / "_made" / "more_api.md").write_text(
        "\n".join([*lines, "```"]) + "\n", encoding="utf-8"
    )


def tidy_docstring(
    _app: Sphinx, what: str, _name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Make a docstring plain reStructuredText: its source a section, its bars and stars literal."""
    if what == "property" and lines:
        lines[0] = lines[0].replace(
            ": ", " \N{EN DASH} "
        )  # else what stands before the colon is read as a type
    for at in reversed(range(len(lines))):
        if "``" not in lines[at]:
            lines[at] = lines[at].replace("|", "\\|").replace("(*", "(\\*")
        if lines[at].startswith("Source: "):
            lines[at : at + 1] = ["Source", "------", lines[at].removeprefix("Source: ")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook the functions above into the build."""
    app.connect("builder-inited", make_pictures)
    app.connect("build-finished", compile_demo)
    app.connect("builder-inited", take_benchmarks)
    app.connect("builder-inited", take_help)
    app.connect("builder-inited", list_the_rest)
    app.connect("builder-inited", take_statuses)
    app.connect("autodoc-process-docstring", tidy_docstring, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
