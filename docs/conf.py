"""Sphinx settings. Pages in `_generated` are generated from the code in every build."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import api  # noqa: E402
import codes  # noqa: E402
import commands  # noqa: E402
import figures  # noqa: E402
import live  # noqa: E402
import raycam  # noqa: E402
import worldfile  # noqa: E402

project = "raycam"
version = release = raycam.__version__
copyright = "The raycam contributors"
extensions = ["myst_parser", "mathml"]
html_math_renderer = "mathml"
exclude_patterns = ["_build", "_generated", "images", "meshes", "worlds", "lab-notes"]
# Pages link to the lab notes, which are not built. tests/docs checks every link.
suppress_warnings = ["myst.xref_missing"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
default_role = "code"  # in docstrings, `name` is code, as in Markdown
pygments_style = "friendly"

html_theme = "furo"
html_title = "raycam"
html_static_path = ["_static"]
html_css_files = ["raycam.css"]
html_copy_source = True
html_show_sphinx = False
html_extra_path = ["_generated/extra"]  # copied next to the pages without changes
(HERE / "_generated" / "extra").mkdir(parents=True, exist_ok=True)


def generate(app: object) -> None:
    """Writes the generated parts of pages, such as figures, tables of keys and help texts."""
    folder = HERE / "_generated"
    folder.mkdir(exist_ok=True)
    for maker in (api, worldfile, commands, codes, figures, live):
        maker.write(folder)


def setup(app: object) -> None:
    """Entry point that Sphinx calls: connects `generate` to the start of a build."""
    app.connect("builder-inited", generate)  # type: ignore[attr-defined]
