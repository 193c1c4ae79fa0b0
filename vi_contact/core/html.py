"""Show a few named values in a notebook: plain tables, readable on light and on dark pages."""

from collections.abc import Iterable
from html import escape

# No colour of its own: text and lines are those of the page.
_STYLE = "border-collapse:collapse;color:inherit;background:transparent"
_CELL = "text-align:left;padding:0.1em 0.8em 0.1em 0;border:0;background:transparent"


def make_table(rows: Iterable[tuple[str, str]]) -> str:
    """Return an HTML table of (name, value); a row without a name is a sentence.

    All texts are escaped.
    """
    lines = []
    for name, value in rows:
        if name:
            lines.append(
                f'<tr><th style="{_CELL}">{escape(name)}</th>'
                f'<td style="{_CELL}">{escape(value)}</td></tr>'
            )
        else:
            lines.append(f'<tr><td colspan="2" style="{_CELL}">{escape(value)}</td></tr>')
    return f'<table style="{_STYLE}">{"".join(lines)}</table>'
