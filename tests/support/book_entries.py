"""Make small entries of a validation book, and find the records of the real ones."""

from hashlib import sha256
from pathlib import Path

HEADER = """# source: nobody
# version: 1
# licence: free
# how: invented
# uncertainty: none
# unit of x: m
# unit of y: Pa
# unit of place: name
x,y,place
"""
ROWS = "1,10,here\n2,20,there\n3,-,here\n"
TOML = """title = "A line"
kind = "T"
about = "Twice five is ten."
model = ["It multiplies."]
is_not = ["It is no measurement."]

[data]
sha256 = "{checksum}"

[inputs.factor]
value = 10.0
unit = "Pa/m"
kind = "CHOSEN"
source = "as it is"

[[figure]]
name = "y at {{x}} m, {{place}}"
unit = "Pa"
column = "y"
limit = 0.5
reason = "Rounding."

[[mutant]]
name = "twice"
change = {{ factor = 20.0 }}
red = ["y at *"]
"""
RUN = """
from vi_contact.validation import Found

UNITS = {"factor": "Pa/m", "x": "m"}


def figures(inputs, fineness):
    found = Found()
    for row in inputs.rows:
        if row["x"] < 3.0:
            found.figures[f"y at {row['x']:g} m, {row['place']}"] = inputs["factor"] * row["x"]
    return found
"""


def checksum(text: str) -> str:
    """The checksum of data.csv as entry.toml has it."""
    return sha256("\n".join(text.splitlines()).encode()).hexdigest()


def small_entry(
    folder: Path,
    *,
    rows: str = ROWS,
    header: str = HEADER,
    toml: str = TOML,
    run: str = RUN,
    sealed: str | None = None,
) -> Path:
    """Write an entry; ``sealed``: the text of data.csv whose checksum entry.toml has."""
    folder.mkdir()
    data = header + rows
    (folder / "data.csv").write_text(data, encoding="utf-8")
    text = toml.format(checksum=checksum(data if sealed is None else sealed))
    (folder / "entry.toml").write_text(text, encoding="utf-8")
    (folder / "run.py").write_text(run, encoding="utf-8")
    return folder


def shared_records() -> Path:
    """The folder of records beside the checkout, which may not be there."""
    return Path(__file__).resolve().parents[3] / "shared" / "validation_data" / "slammer"
