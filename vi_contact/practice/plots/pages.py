"""Print sections about a run on pages of a PDF."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import Any

from ...core.files import write_output
from ...core.own_files import read_bytes
from .charts import Chart, draw_chart
from .histories import STYLE, require_matplotlib
from .maps import Drawing
from .sections import Section, Table

PAGE = (8.27, 11.69)  # inches, A4
SIDE, WIDE, FOOT = 0.6, 7.1, 0.6  # inches: margins, what is between them, and what is left below
LINE, LETTER = 0.135, 0.058  # inches: between lines of a table, and the mean width of its letters
CURVES = 6  # of a printed chart
HEIGHT = 1.75  # inches, of a chart


class _Pages:
    """Fill pages from the top; ``y`` [inches] is where the next thing goes."""

    def __init__(self, file: Any, foot: str) -> None:
        self.file, self.foot, self.count = file, foot, 0
        self.begin()

    def begin(self) -> None:
        """Begin a page."""
        from matplotlib.figure import Figure

        self.figure, self.y, self.count = Figure(figsize=PAGE), SIDE, self.count + 1
        self._text(SIDE, PAGE[1] - 0.4, f"{self.foot}, page {self.count}", 6.5, color="0.45")

    def make_room(self, height: float) -> None:
        """Turn the page where so much [inches] no longer fits."""
        if self.y + height > PAGE[1] - FOOT:
            self.file.savefig(self.figure)
            self.begin()

    def _text(self, x: float, y: float, text: str, size: float, **look: Any) -> None:
        self.figure.text(x / PAGE[0], 1.0 - y / PAGE[1], text, fontsize=size, va="top", **look)

    def write_words(self, text: str, size: float = 8.0, keep: float = 0.0, **look: Any) -> None:
        """Write a paragraph, on one page with ``keep`` [inches] of what follows."""
        lines, step = wrap(text, int(WIDE * 72.0 / (0.53 * size))) or [""], 1.35 * size / 72.0
        self.make_room(step * len(lines) + keep)
        self._text(SIDE, self.y, "\n".join(lines), size, linespacing=1.2, **look)
        self.y += step * len(lines) + 0.05

    def write_table(self, table: Table) -> None:
        """Write a table as wide as its texts; those of a cell that is too wide on several lines."""
        from matplotlib.lines import Line2D

        if table.title:
            self.write_words(table.title, 7.5, keep=0.5, style="italic")
        rows = [[str(cell) for cell in row] for row in (table.header, *table.rows)]
        widths = [min(70, max(len(row[k]) for row in rows) + 2) for k in range(len(table.header))]
        while sum(widths) * LETTER > WIDE:
            widths[widths.index(max(widths))] -= 1
        for number, row in enumerate(rows):
            cells = [wrap(cell, max(width - 1, 1)) for cell, width in zip(row, widths, strict=True)]
            height, x = LINE * max(1, *map(len, cells)) + 0.03, SIDE
            self.make_room(height)
            for cell, width in zip(cells, widths, strict=True):
                self._text(
                    x,
                    self.y,
                    "\n".join(cell),
                    6.8,
                    weight="normal" if number else "bold",
                    linespacing=1.1,
                )
                x += LETTER * width
            self.y += height
            across, level = (
                [SIDE / PAGE[0], min(x, SIDE + WIDE) / PAGE[0]],
                1.0 - (self.y - 0.025) / PAGE[1],
            )
            self.figure.add_artist(
                Line2D(across, [level, level], lw=0.3 if number else 0.8, color="0.6")
            )
        self.y += 0.12

    def draw_panels(self, panels: Sequence[Chart | Drawing], height: float, beside: int) -> None:
        """Draw so many axes beside each other, the rows of them so high [inches]."""
        for first in range(0, len(panels), beside):
            self.make_room(height + 0.75)
            for place, panel in enumerate(panels[first : first + beside]):
                wide = WIDE / beside
                box = (
                    SIDE + place * wide + 0.5,
                    PAGE[1] - self.y - height - 0.25,
                    wide - 0.65,
                    height,
                )
                axis = self.figure.add_axes([one / PAGE[k % 2] for k, one in enumerate(box)])
                draw_chart(axis, panel.shorten(CURVES)) if isinstance(panel, Chart) else panel(axis)
            self.y += height + 0.75

    def place_picture(self, path: Path) -> None:
        """Place a PNG as wide as the page, or as high as half of it."""
        from matplotlib.image import imread

        image = imread(BytesIO(read_bytes(path)), format="png")
        wide = min(WIDE, 0.5 * PAGE[1] * image.shape[1] / image.shape[0])
        high = wide * image.shape[0] / image.shape[1]
        self.make_room(high)
        axis = self.figure.add_axes(
            (SIDE / PAGE[0], 1.0 - (self.y + high) / PAGE[1], wide / PAGE[0], high / PAGE[1])
        )
        axis.set_axis_off()
        axis.imshow(image)
        self.y += high + 0.15


def write_pages(
    path: Path, title: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section], foot: str
) -> Path:
    """Write a PDF.

    It has the title, (name, value) of facts, the sections, and a line at the foot of every page.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfPages

    fonts = {"font.size": 7, "axes.titlesize": 8, "axes.labelsize": 7, "text.parse_math": False}
    written, about = BytesIO(), {"Title": title, "CreationDate": None}
    with matplotlib.rc_context(STYLE | fonts), PdfPages(written, metadata=about) as file:
        pages = _Pages(file, foot)
        pages.write_words(title, 15.0, weight="bold")
        pages.write_table(Table(("", ""), facts))
        for section in sections:
            pages.y += 0.12
            pages.write_words(
                section.title,
                11.0,
                keep=1.2 if section.sentences or section.tables else 4.0,
                weight="bold",
            )
            for sentence in section.sentences:
                pages.write_words(sentence)
            for table in section.tables:
                pages.write_table(table)
            pages.draw_panels(section.charts, HEIGHT, 2)
            pages.draw_panels(section.drawings, 1.6 * HEIGHT, 1)
            for picture in section.pictures:
                pages.place_picture(picture)
        file.savefig(pages.figure)
    write_output(path, written.getvalue())
    return path
