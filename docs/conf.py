"""Sphinx configuration. Pictures are made from the library's own data while the pages are built."""

import sys
from importlib import metadata
from pathlib import Path

import armangle

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "_ext")]

project = "armangle"
author = "The armangle authors"
copyright = "the armangle authors"
release = version = armangle.__version__
ADDRESSES = dict(text.split(", ", 1) for text in metadata.metadata("armangle").get_all("Project-URL") or ())
REPOSITORY = ADDRESSES.get("Repository")  # of pyproject.toml; without one the pages have no link to it

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
    "sphinx_copybutton",
    "mathml",
    "made_here",
    "searched",
]

source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "_made", "pictures", "_ext", "gallery/*.ipynb"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_block"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

default_role = "py:obj"
autodoc_mock_imports = ["jax", "torch"]  # the pages need neither
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_custom_sections = ["Source"]
napoleon_use_ivar = True

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 10**6,
    "show_signature": False,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "backreferences_dir": None,
    "plot_gallery": not tags.has("coarse"),  # noqa: F821 - Sphinx puts `tags` here
    "image_srcset": ["2x"],
    "capture_repr": (),
}

html_theme = "furo"
html_title = f"armangle {release}"
html_short_title = "armangle"
html_static_path = ["_static"]
html_css_files = ["armangle.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
if REPOSITORY:
    html_theme_options |= {
        "source_repository": REPOSITORY,
        "source_branch": "main",
        "source_directory": "docs/",
    }

# What a button copies: what was typed, without prompts and without what was printed.
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_only_copy_prompt_lines = True
copybutton_exclude = ".linenos, .gp, .go"
