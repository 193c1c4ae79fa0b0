"""Tell Sphinx how to build the site: ``bash docs/build.sh``. Its source is the clone: links to any
file work."""

import os
import re
import sys
from hashlib import sha256
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))
from api_source import PACKAGE, ROOT
from make_api import ROOMS
from site_names import write_site_pages

from vi_contact import __version__

project, author, version = "vi_contact", "The vi_contact developers", __version__
copyright = f"{author}. This page describes version {version}."  # at the foot of every page
extensions = [
    "myst_nb",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
    "sphinx_reredirects",
]
source_suffix = {".md": "myst-nb", ".myst": "myst-nb"}
root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SUPPORT.md",
    "SECURITY.md",
]
exclude_patterns = [
    ".*",
    *(path.name for path in ROOT.iterdir() if path.is_dir() and path.name != "docs"),
]
add_module_names = False
highlight_language = "none"

myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath", "colon_fence"]
nb_execution_mode = "cache"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True
# vi_contact warns by logging, which readers must see; what libraries warn of is for authors:
nb_output_stderr = "show"
os.environ["PYTHONWARNINGS"] = (
    "ignore::DeprecationWarning,ignore::FutureWarning,ignore::UserWarning"
)
_sources = sorted(file for folder in (PACKAGE, ROOT / "demos") for file in folder.rglob("*.py"))
nb_execution_cache_path = str(
    ROOT
    / "build"
    / "notebooks"
    / sha256(b"".join(file.read_bytes() for file in _sources)).hexdigest()[:12]
)

html_theme = "furo"
html_title = f"vi_contact {version}"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
copybutton_prompt_text, copybutton_prompt_is_regexp = r">>> |\.\.\. |\$ ", True
_moved = (ROOT / "docs" / "redirects.txt").read_text(encoding="utf-8").splitlines()
redirects = dict(line.split() for line in _moved if not line.startswith("#"))

write_site_pages()
_NAME = re.compile(rf"(vc|{'|'.join(re.escape(room) for room in ROOMS)})\.[\w.]+|[A-Z]\w+")


def link_names(app: Sphinx, document: nodes.document) -> None:
    """Link what is written as `vc.simulate`, `Condensed()` or `fem.build_mesh(…)` to the page of
    that name."""
    for node in list(document.findall(nodes.literal)):
        found = _NAME.match(node.astext())
        if found and not isinstance(node.parent, nodes.reference | pending_xref | nodes.title):
            target = "vi_contact." + found[0].removeprefix("vc.")
            link = pending_xref(
                refdomain="py",
                reftype="obj",
                reftarget=target,
                refdoc=app.env.docname,
                refwarn=False,
            )
            node.replace_self(link)
            link += node


def setup(app: Sphinx) -> None:
    """Connect it."""
    app.connect("doctree-read", link_names)
