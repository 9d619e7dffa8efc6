"""How the documentation is built; `make docs` does it."""

import atexit
import gc
import os
import sys
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import fringeforce  # noqa: E402 - its numbers are small; threads are settled first

# nearly all that a build makes it keeps to its end: looking through it again and again finds little
gc.set_threshold(100_000, 50, 100)
atexit.register(gc.freeze)  # nor is there anything else at the end, where all of it goes

project = "fringeforce"
author = "The fringeforce developers"
project_copyright = f"{author}, MIT licence"
version = release = fringeforce.__version__
language = "en-GB"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "mathml",
    "measured",
    "tried",
    "python_names",
    "generated",
]
exclude_patterns = ["generated/gallery/**/*.py", "generated/parts/**"]
# a type in a docstring, such as Limits, that several modules define
suppress_warnings = ["ref.python"]

# Docstrings: single backticks are names; those of this package must lead somewhere.
default_role = "py:obj"
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!fringeforce\.).*|.*\._.*")]
toc_object_entries = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings state types, with shapes and units
autodoc_use_type_comments = False  # there are none, and looking for them parses every function
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_maximum_signature_line_length = 88

# Pages
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
math_number_all = False

# Nothing that a page shows comes from another host: system fonts, MathML instead of scripts.
html_theme = "furo"
html_title = "fringeforce"
html_static_path = ["static"]
html_css_files = ["fringeforce.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b5fa5", "color-brand-content": "#0b5fa5"},
    "dark_css_variables": {"color-brand-primary": "#7ab8f0", "color-brand-content": "#7ab8f0"},
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

GALLERY = HERE.parent / "examples" / "gallery"
if GALLERY.is_dir():
    extensions.append("sphinx_gallery.gen_gallery")
    sphinx_gallery_conf = {
        "examples_dirs": [str(GALLERY)],
        "gallery_dirs": ["generated/gallery"],
        "filename_pattern": r"\.py$",
        "ignore_pattern": r"__init__|conftest",
        "download_all_examples": False,
        "show_memory": False,
        "show_signature": False,
        "abort_on_example_error": True,
        "remove_config_comments": True,
        "write_computation_times": False,
    }


def setup(app: Sphinx) -> None:
    """Add pages of the modules' sources, but not with `-t without_sources`."""
    if "without_sources" not in app.tags:
        app.setup_extension("sphinx.ext.viewcode")
