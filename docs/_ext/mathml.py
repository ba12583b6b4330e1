"""Formulas as MathML, which browsers draw themselves: no script, nothing to fetch when built or read."""

import re
from html import escape
from xml.etree import ElementTree

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator


def _spaced(latex: str) -> str:
    """Return the formula with the thin spaces around function names that MathML does not set by itself."""
    latex = latex.replace(r"\operatorname", r"\mathrm")
    latex = re.sub(r"(?<=[\w})])\s*(?=\\(sin|cos|ln)\b)", r"\\,", latex)
    return re.sub(r"(\\(?:sin|cos|ln))\b\s*(?=[\w\\])(?!\\bigl|\\Bigl|\\left)", r"\1\\,", latex)


def _markup(node: nodes.Element, display: str) -> str:
    latex = node.astext()
    markup = convert(_spaced(latex), display=display)
    try:
        ElementTree.fromstring(markup)
    except ElementTree.ParseError as error:
        raise ValueError(f"formula {latex!r} gives no well-formed MathML: {error}") from error
    return f'<span class="math" role="math" aria-label="{escape(latex, quote=True)}">{markup}</span>'


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an inline formula."""
    translator.body.append(_markup(node, "inline"))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula on a line of its own."""
    translator.body.append(f'<div class="math-block">{_markup(node, "block")}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer under the name ``mathml``."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
