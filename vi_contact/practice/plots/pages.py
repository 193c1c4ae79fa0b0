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

# Lengths are in inches.
PAGE = (8.27, 11.69)  # A4
SIDE = 0.6  # margins
WIDE = 7.1  # between the margins
FOOT = 0.6  # left below
LINE = 0.135  # between lines of a table
LETTER = 0.058  # mean width of a letter of a table
HEIGHT = 1.75  # of a chart
CURVES = 6  # of a printed chart


class _Pages:
    """Fill pages from the top.

    Attributes:
        foot: text at the foot of every page, before its number.
        figures: all pages so far.
        figure: the page.
        y: where the next thing goes, from the top [inches].
    """

    def __init__(self, foot: str) -> None:
        self.foot = foot
        self.figures: list[Any] = []
        self.begin()

    def begin(self) -> None:
        """Begin a page."""
        from matplotlib.figure import Figure

        self.figure = Figure(figsize=PAGE)
        self.figures.append(self.figure)
        self.y = SIDE

    def end(self, file: Any) -> None:
        """Write the feet of all pages, and the pages into a PDF."""
        for number, figure in enumerate(self.figures, start=1):
            self.figure = figure
            foot = f"{self.foot}, page {number} of {len(self.figures)}"
            self._write(SIDE, PAGE[1] - 0.4, foot, 6.5, color="0.45")
            file.savefig(figure)

    def make_room(self, height: float) -> None:
        """Turn the page where so much [inches] no longer fits."""
        if self.y + height > PAGE[1] - FOOT:
            self.begin()

    def _write(self, x: float, y: float, text: str, size: float, **look: Any) -> None:
        """Write a text; x from the left and y from the top [inches] are of its upper left."""
        self.figure.text(x / PAGE[0], 1.0 - y / PAGE[1], text, fontsize=size, va="top", **look)

    def write_words(self, text: str, size: float = 8.0, keep: float = 0.0, **look: Any) -> None:
        """Write a paragraph.

        Args:
            text: broken into lines here.
            size: of the letters [points].
            keep: height of what follows that has to be on the same page [inches].
            **look: arguments of matplotlib's ``text``.
        """
        letters = int(WIDE * 72.0 / (0.53 * size))  # of a line: a letter is about half as wide
        lines = wrap(text, letters) or [""]
        step = 1.35 * size / 72.0
        self.make_room(step * len(lines) + keep)
        self._write(SIDE, self.y, "\n".join(lines), size, linespacing=1.2, **look)
        self.y += step * len(lines) + 0.05

    def write_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Write (name, value) of a title block, two beside each other."""
        pairs = [*facts, *[("", "")] * (len(facts) % 2)]
        rows = [(*left, *right) for left, right in zip(pairs[::2], pairs[1::2], strict=True)]
        width = int(0.5 * WIDE / LETTER)
        names = 2 + max((len(name) for name, _ in pairs), default=0)
        for row in rows:
            self._write_row(row, [names, width - names] * 2, head=False)
        self.y += 0.12

    def write_table(self, table: Table) -> None:
        """Write a table as wide as its texts; those of a cell that is too wide on several lines."""
        if table.title:
            self.write_words(table.title, 7.5, keep=0.5, style="italic")
        rows = [[str(cell) for cell in table.header]]
        for row in table.rows:
            rows.append([str(cell) for cell in row])
        widths = _choose_widths(rows)
        # the head stands on the page of the first row
        self.make_room(sum(_find_height(_wrap_cells(row, widths)) for row in rows[:2]))
        for number, row in enumerate(rows):
            self._write_row(row, widths, head=number == 0)
        self.y += 0.12

    def _write_row(self, row: Sequence[str], widths: Sequence[int], *, head: bool) -> None:
        """Write a row with a line below; the columns are so many letters wide."""
        from matplotlib.lines import Line2D

        cells = _wrap_cells(row, widths)
        height = _find_height(cells)
        self.make_room(height)
        x = SIDE
        for cell, width in zip(cells, widths, strict=True):
            weight = "bold" if head else "normal"
            self._write(x, self.y, "\n".join(cell), 6.8, weight=weight, linespacing=1.1)
            x += LETTER * width
        self.y += height
        ends = [SIDE / PAGE[0], min(x, SIDE + WIDE) / PAGE[0]]
        level = 1.0 - (self.y - 0.025) / PAGE[1]
        line = Line2D(ends, [level, level], lw=0.8 if head else 0.3, color="0.6")
        self.figure.add_artist(line)

    def draw_panels(self, panels: Sequence[Chart | Drawing], height: float, beside: int) -> None:
        """Draw charts and maps in rows.

        Args:
            panels: each has an axis of its own.
            height: of each axis [inches].
            beside: how many stand beside each other.
        """
        width = WIDE / beside
        for first in range(0, len(panels), beside):
            self.make_room(height + 0.75)
            bottom = PAGE[1] - self.y - height - 0.25
            for place, panel in enumerate(panels[first : first + beside]):
                left = SIDE + place * width + 0.5
                box = (
                    left / PAGE[0],
                    bottom / PAGE[1],
                    (width - 0.65) / PAGE[0],
                    height / PAGE[1],
                )
                axis = self.figure.add_axes(box)
                if isinstance(panel, Chart):
                    draw_chart(axis, panel.shorten(CURVES))
                else:
                    panel(axis)
            self.y += height + 0.75

    def place_picture(self, path: Path) -> None:
        """Place a PNG as wide as the page, or as high as half of it or what is left of it."""
        from matplotlib.image import imread

        image = imread(BytesIO(read_bytes(path)), format="png")
        left = PAGE[1] - FOOT - self.y
        most = left if 0.25 * PAGE[1] < left < 0.5 * PAGE[1] else 0.5 * PAGE[1]
        width = min(WIDE, most * image.shape[1] / image.shape[0])
        height = width * image.shape[0] / image.shape[1]
        self.make_room(height)
        axis = self.figure.add_axes(
            (SIDE / PAGE[0], 1.0 - (self.y + height) / PAGE[1], width / PAGE[0], height / PAGE[1])
        )
        axis.set_axis_off()
        axis.imshow(image)
        self.y += height + 0.15


def _wrap_cells(row: Sequence[str], widths: Sequence[int]) -> list[list[str]]:
    """Return the lines of each cell of a row; the columns are so many letters wide."""
    return [wrap(cell, max(width - 1, 1)) for cell, width in zip(row, widths, strict=True)]


def _find_height(cells: Sequence[Sequence[str]]) -> float:
    """Return the height [inches] of a row of cells of so many lines."""
    return LINE * max(1, *map(len, cells)) + 0.03


def _choose_widths(rows: Sequence[Sequence[str]]) -> list[int]:
    """Choose how many letters wide the columns are, so that the table fits on the page."""
    widths = []
    for column in zip(*rows, strict=True):
        widths.append(min(70, max(map(len, column)) + 2))
    while sum(widths) * LETTER > WIDE:
        widths[widths.index(max(widths))] -= 1
    return widths


def write_pages(
    path: Path, title: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section], foot: str
) -> Path:
    """Write sections as a PDF.

    Args:
        path: the file.
        title: stands first.
        facts: (name, value) of what the report says next.
        sections: the rest.
        foot: text at the foot of every page, before its number.

    Returns:
        the path.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfPages

    fonts = {"font.size": 7, "axes.titlesize": 8, "axes.labelsize": 7, "text.parse_math": False}
    pdf = BytesIO()
    metadata = {"Title": title, "CreationDate": None}
    with matplotlib.rc_context(STYLE | fonts), PdfPages(pdf, metadata=metadata) as file:
        pages = _Pages(foot)
        pages.write_words(title, 15.0, weight="bold")
        pages.write_facts(facts)
        for section in sections:
            if section.begins_page:
                pages.begin()
            pages.y += 0.12
            # A heading stays with what follows: a sentence or, which is higher, a chart.
            keep = 1.2 if section.sentences or section.tables else 4.0
            pages.write_words(section.title, 11.0, keep=keep, weight="bold")
            for sentence in section.sentences:
                pages.write_words(sentence)
            for table in section.tables:
                pages.write_table(table)
            for note in section.notes:
                pages.write_words(note, 7.5)
            pages.draw_panels(section.charts, HEIGHT, 2)
            pages.draw_panels(section.drawings, 1.6 * HEIGHT, 1)
            for picture in section.pictures:
                pages.place_picture(picture)
        pages.end(file)
    write_output(path, pdf.getvalue())
    return path
