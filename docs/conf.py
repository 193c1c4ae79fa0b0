"""Tell Sphinx how to build the site: ``bash docs/build.sh``.

Its source is the clone: links to any file work.
"""

import os
import re
from hashlib import sha256
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

import vi_contact as vc

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "vi_contact"
project, author, version = "vi_contact", "The vi_contact developers", vc.__version__
copyright = f"{author}. This page describes version {version}."  # at the foot of every page
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
templates_path = [str(ROOT / "docs" / "templates")]
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

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autosummary_imported_members = True
autosummary_ignore_module_all = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # signatures have them
python_maximum_signature_line_length = 88

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

_ROOMS = sorted(path.parent.name for path in PACKAGE.glob("*/__init__.pyi"))
_NAME = re.compile(rf"(vc|{'|'.join(_ROOMS)})\.[\w.]+|[A-Z]\w+")


def link_names(app: Sphinx, document: nodes.document) -> None:
    """Link ``vc.simulate``, ``Condensed()`` or ``fem.build_mesh(…)`` to the entry of that name."""
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


def find_in_room(
    app: Sphinx, env: BuildEnvironment, link: pending_xref, text: nodes.Element
) -> nodes.Element | None:
    """Lead from a short name, such as ``vi_contact.simulate``, to its entry in its room."""
    name = link.get("reftarget", "").removeprefix("vi_contact.")
    if link.get("refdomain") != "py" or name not in vc.__all__:
        return None
    room = ".".join(getattr(vc, name).__module__.split(".")[:2])
    return env.domains["py"].resolve_xref(
        env, link["refdoc"], app.builder, "obj", f"{room}.{name}", link, text
    )


def as_restructured_text(
    app: Sphinx, what: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Keep the bars of absolute values in a docstring, and link the pages that it names."""
    text = re.sub(r"(``[^`]*``)|\|", lambda found: found[1] or r"\|", "\n".join(lines))
    lines[:] = re.sub(r"\b(docs/\w+/\w+|README)\.md\b", r":doc:`/\1`", text).split("\n")


def with_dots(
    app: Sphinx, what: str, name: str, value: object, options: object, call: str, result: str
) -> tuple[str, str]:
    """Write dots for a default that has no text, such as one made anew for every object."""
    return re.sub(r"= ?<.*?>(?=[,)])", "= ...", call or ""), result


def setup(app: Sphinx) -> None:
    """Connect the functions of this file to the events of Sphinx that they answer."""
    app.connect("doctree-read", link_names)
    app.connect("missing-reference", find_in_room)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-process-signature", with_dots)
