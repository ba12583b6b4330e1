"""What a build makes: pictures from the library's data, the table of measured times, docstring fields."""

from pathlib import Path

from sphinx.application import Sphinx

NO_TABLE = (
    "The table of measured times is written by `python benchmarks/peers.py` into `benchmarks/README.md`, "
    "from which this page takes it. This build found none."
)


def make_pictures(app: Sphinx) -> None:
    """Draw every picture of docs/pictures into docs/_made."""
    from pictures import draw_all

    draw_all(Path(app.srcdir) / "_made")


def take_benchmarks(app: Sphinx) -> None:
    """Take the tables of benchmarks/README.md, below its title, one heading level deeper."""
    source = Path(app.srcdir).parent / "benchmarks" / "README.md"
    text = NO_TABLE
    if source.exists():
        lines = source.read_text(encoding="utf-8").splitlines()
        text = "\n".join(
            f"#{line}" if line.startswith("#") else line for line in lines if not line.startswith("# ")
        )
    made = Path(app.srcdir) / "_made"
    made.mkdir(exist_ok=True)
    (made / "benchmarks.md").write_text(text + "\n", encoding="utf-8")


def name_the_source(
    _app: Sphinx, _what: str, _name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Turn a docstring's ``Source: ...`` line into a section, lest it be read as one more error raised."""
    for at in reversed(range(len(lines))):
        if lines[at].startswith("Source: "):
            lines[at : at + 1] = ["References", "----------", lines[at].removeprefix("Source: ")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook the functions above into the build."""
    app.connect("builder-inited", make_pictures)
    app.connect("builder-inited", take_benchmarks)
    app.connect("autodoc-process-docstring", name_the_source, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
