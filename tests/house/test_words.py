"""Words that a stranger understands: docstrings begin with a verb, and nothing is cited by a
private name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import vi_contact

pytestmark = pytest.mark.serial
PACKAGE = Path(vi_contact.__file__).parent
ROOMS = sorted({path.parent.relative_to(PACKAGE).parts[0] for path in PACKAGE.glob("*/**/*.py")})
CIPHERS = re.compile(
    r"\bV\d+\.\d+\b|\bP([3-9]|[12]\d)\b|\bB\d{1,2}\b|(?i:\bseed[ _-]?00\d|\bdesign ideas? "
    r"\d|\bsolver notes\b"
    r"|\bverification (document\b|\d)|\b(design|seismic|verification|found|solver_notes)\.md\b)"
)
VERBS = """
Add Advance Allow Answer Append Apply Approximate Arrange Ask Assemble Assert Assign Average
Balance Begin Bind Bound Bring Build
Calculate Call Carry Change Check Choose Clamp Clean Close Collect Combine Compare Complete Compute Condense Connect
Constrain Continue Convert Copy Correct Count Create Cut
Damp Decide Define Deliver Describe Detect Differentiate Discretise Distribute Divide Do Double Draw Drop
Eliminate Embed End Estimate Evaluate Exchange Expand Expect Explain Extend Extract Extrapolate
Factor Factorise Fill Filter Find Finish Fit Follow Forget Format Free
Gather Generate Give Go Group Guess
Halve Hand Handle Hold
Identify Ignore Integrate Interpolate Interpret Invert Iterate
Join Judge
Keep
Leave Let Limit Linearise List Listen Load Locate Log Look
Make Map March Mark Mask Match Measure Mesh Minimise Mirror Model Move Multiply
Name Normalise Note Number
Obtain Offer Open Order Overwrite
Pad Pair Parse Partition Pass Pick Place Plan Plot Point Pose Post Precondition Predict Prepare Prescribe Press Print
Process Produce Project Propose Prove Provide Pull Push Put
Raise Ramp Read Rebuild Recognise Record Reduce Refer Refine Refuse Register Relax Release Remember Remove Rename Render
Replace Report Represent Resample Resolve Restore Restrict Return Reverse Rotate Round Run
Sample Save Say Scale Scatter Search Select Send Separate Serve Set Shake Share Shift Show Shrink Simulate Skip Slide
Smooth Solve Sort Split Stack Start State Step Stop Store Subtract Sum Support Suppress Swap Sweep
Take Talk Tell Test Tie Transfer Transform Translate Treat Trim Try Turn
Unpack Update Use
Validate Vary Verify
Wait Walk Warn Watch Weigh Weight Widen Work Wrap Write
Yield
Zero
"""  # one that is missing: add it
ELLIPTIC = ("Of ", "Those ", "Its ", "The same ", "This ", "These ")

Definition = ast.ClassDef | ast.FunctionDef
Told = tuple[str, str]  # where, and the first words of the docstring there


def public(node: ast.Module | ast.ClassDef) -> Iterator[Definition]:
    """Functions and classes that others may use, and the public methods of such classes."""
    for inner in node.body:
        if isinstance(inner, ast.ClassDef | ast.FunctionDef) and not inner.name.startswith("_"):
            yield inner
            if isinstance(inner, ast.ClassDef):
                yield from public(inner)


def without_verb(name: str, text: str) -> list[Told]:
    """Docstrings that do not begin with a verb (of public names), or begin with half a sentence (of
    any)."""
    tree, wrong = ast.parse(text), []
    for node in public(tree):
        told = ast.get_docstring(node)
        first, *more = (told or "Say").split()
        if first.rstrip(".,:") not in VERBS.split() or more[:1] == [
            "of"
        ]:  # "Number of steps" is a noun
            wrong.append((f"{name}:{node.lineno}", (told or "")[:60]))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            told = ast.get_docstring(node)
            if told and told.startswith(ELLIPTIC):
                wrong.append((f"{name}:{getattr(node, 'lineno', 1)}", told[:60]))
    return wrong


def ciphers(name: str, text: str) -> list[Told]:
    """Names of papers, notes and checks that only those who wrote them can follow."""
    return [
        (f"{name}:{k}", found[0])
        for k, line in enumerate(text.splitlines(), 1)
        for found in CIPHERS.finditer(line)
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_words_of_a_room(room):
    wrong = []
    for path in sorted((PACKAGE / room).rglob("*.py")):
        name, text = path.relative_to(PACKAGE).as_posix(), path.read_text(encoding="utf-8")
        wrong += ciphers(name, text) + without_verb(name, text)
    assert not wrong, "\n".join(f"{where}  {told}" for where, told in wrong)


def test_bad_words_are_found():
    """The rule has teeth: each of these fails, and the plain sentence below does not."""
    for cited in (
        "seed 003",
        "seed000",
        "V4.1",
        "P12",
        "B13",
        "design idea 3",
        "solver notes",
        "seismic.md 1.5",
    ):
        assert ciphers("one.py", f"# as in {cited}")
    assert not ciphers(
        "one.py", "# P1 elements, seed 11 of the generator, # noqa: B018, P_2, COSMOS V2"
    )
    for told in (
        "Of lines: pressure.",
        "The pressure.",
        "(m,) values.",
        "Values at nodes.",
        "Number of steps.",
        "InputError if x < 0.",
    ):
        assert without_verb("one.py", f'def f():\n    """{told}"""\n')
    assert without_verb("one.py", 'def _f():\n    """Those of one run."""\n')
    assert not without_verb("one.py", 'def f():\n    """Draw pressure along contact lines."""\n')
