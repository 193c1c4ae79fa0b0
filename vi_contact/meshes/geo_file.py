"""Mesh a Gmsh script (.geo) that holds nothing but geometry, sizes, groups and arithmetic.

Gmsh runs commands of the shell and opens files from scripts, so none is given to it as it stands. The script is cut
into words, and written anew from those that geo_words.toml lists; names of its own get a prefix, so that none can be a
command, and texts stand only where groups are named. A process of its own meshes it, for a limited time and in half of
the machine's memory."""

import ctypes
import os
import re
import resource
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from stat import S_ISREG
from tempfile import TemporaryDirectory
from typing import Any

from vi_contact.core.checks import number, shown, whole
from vi_contact.core.errors import InputError
from vi_contact.meshes.gmsh_session import session
from vi_contact.meshes.mesh_file import safe_copy

LARGEST, MOST = 2_000_000, 8  # bytes of a script; how often it may be refined
_LISTS = tomllib.loads(files(__package__).joinpath("geo_words.toml").read_text(encoding="utf-8"))
_WORDS, _OPTIONS, _OF_FIELDS = (frozenset(_LISTS[name].split()) for name in ("words", "options", "fields"))
_TOKEN = re.compile(
    r"(?P<blank>[ \t]+|//[^\n]*|/\*.*?\*/|\n)|(?P<open>/\*[^\n]*)|"
    r"(?P<text>\"[^\"\\\x00-\x1f]*\")|(?P<name>[A-Za-z_]\w*)|"
    r"(?P<sign>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[-+*/<>=!]=|&&|\|\||\+\+|--|[-+*/%^<>!?:=,;.#(){}\[\]])",
    re.ASCII | re.DOTALL)
_SET = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\s*(?:=(?!=)|\[\s*\]\s*=|\(\s*\)\s*=|In\b)", re.ASCII)  # names that are set
_GROUP = re.compile(r'( Physical\s+(Line|Curve|Surface|Volume)\s+\(\s*(?:"([^"%]*)[^"]*")?[^"()]*\)\s+\+?=)'
                    r"(?!\s*\{\s*:)((?:[^;{}]|\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*+\})*+\})*+\})*+);")
_CHECKED = (r' told [ ] =\4; If (#told[] == 0) Error("it is empty, the group \3"); EndIf Printf("in the group \3");'
            r" told_[] = Boundary{ \2{ told[] }; };\1 told [ ] ;")  # Gmsh leaves out of groups what is not there
_ARITHMETIC = re.compile(r'"[\w\s.,+*/^()-]*"', re.ASCII)


@dataclass(frozen=True, kw_only=True)
class GeoFile:
    """Describe the mesh of a Gmsh script at ``path``: its physical groups, cells of the highest dimension they have.

    refine: how often Gmsh divides all cells into 2^d, new nodes on the curves of the geometry; time_limit: of the
    meshing [s]. InputError for words that are not allowed, with their line; when Gmsh fails, or time or memory is over.
    """

    path: Path
    refine: int = 0
    time_limit: float = 300.0

    def __post_init__(self) -> None:
        whole("GeoFile", "refine", self.refine, most=MOST)
        number("GeoFile", "time_limit", self.time_limit, positive=True, unit="seconds")

    def build(self, gmsh: Any) -> None:
        """Mesh the script beside this process and read the mesh into Gmsh's current model."""
        with TemporaryDirectory(prefix="vi_contact-") as folder:
            Path(folder, "script.geo").write_text(allowed(self.path), encoding="utf-8")
            code = ("import sys; sys.path = sys.argv[1:]; from vi_contact.meshes.geo_file import mesh_here; "
                    f"mesh_here({self.refine}, {self.time_limit})")
            command = [sys.executable, "-c", code, *map(os.path.abspath, sys.path)]
            try:
                done = subprocess.run(command, cwd=folder, text=True, errors="replace", stdin=subprocess.DEVNULL,
                                      capture_output=True, timeout=self.time_limit)
            except subprocess.TimeoutExpired:
                raise InputError(f"{self.path}: Gmsh did not end within {self.time_limit:g} s: ask for larger cells, "
                                 "or give a longer time_limit") from None
            if done.returncode:
                how = f"signal {-done.returncode}" if done.returncode < 0 else f"status {done.returncode}"
                said = (done.stderr.strip().splitlines() or [f"it ended without a word, with {how}"])[-1]
                if said.strip().startswith(("terminate called", "what()")):  # for a text that Gmsh throws
                    said = "it stopped at a formula or size: check Field[…].F, and that Mesh.MeshSize… is positive"
                raise InputError(f"{self.path}: Gmsh cannot mesh it: {said.replace('own_', '')}")
            gmsh.merge(str(safe_copy(Path(folder, "made.msh"), Path(folder))))


def mesh_here(refine: int, time_limit: float) -> None:
    """Mesh script.geo of this folder as made.msh: for a process of its own, which ends with its parent or its time."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    signal.setitimer(signal.ITIMER_REAL, time_limit + 1.0)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    for limit in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE):
        resource.setrlimit(limit, (memory, memory))
    with session() as gmsh:
        gmsh.logger.start()
        try:
            gmsh.merge("script.geo")
            groups = gmsh.model.getPhysicalGroups()
            if not groups:
                sys.exit("it has no cells in a group: name the body by a Physical Surface or Physical Volume")
            gmsh.model.mesh.generate(max(d for d, _ in groups))
            for _ in range(refine):
                gmsh.model.mesh.refine()
            if refine:  # which leaves cells of first order
                gmsh.model.mesh.setOrder(int(gmsh.option.getNumber("Mesh.ElementOrder")))
            gmsh.write("made.msh")
        finally:
            for before, line in pairwise(["", *gmsh.logger.get()]):
                if line.startswith("Error"):
                    sys.exit(f"{line} {'in' * (': in the group' in before)}{before.partition(': in')[2]}".rstrip())


def allowed(path: Path) -> str:
    """Return the script in listed words alone, each in its line. InputError like ``GeoFile``."""
    try:
        if not S_ISREG(os.stat(path).st_mode):
            raise OSError("it is no file")
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
        text = re.sub("\r\n?", "\n", data.decode("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise InputError(f"Gmsh script {shown(str(path))} cannot be read ({error}): check the path") from None
    if len(data) > LARGEST:
        raise InputError(f"{path}: the script has more than {LARGEST} bytes: mesh it yourself")
    return _GROUP.sub(_CHECKED, "".join(_written(path, text, set(_SET.findall(text)) - _WORDS))) + "\n"


def _written(path: Path, text: str, own: set[str]) -> Iterator[str]:
    """Yield the words that Gmsh gets; ``own``: names of the script."""
    words, place, line, level = ["", "", ""], 0, 1, 0  # level: brackets that are open since the last For
    begins = ends = False  # Gmsh repeats whole lines, from the one below For {…} to that of EndFor: they end there
    while place < len(text):
        found = _TOKEN.match(text, place)
        kind, word = (str(found.lastgroup), found[0]) if found else ("", text[place])
        place += len(word)
        line += word.count("\n")
        attributes = _OPTIONS if words[-2] == "Mesh" else _OF_FIELDS if words[-2] == "]" else ()
        if kind == "blank":
            ends = ends and "\n" not in word
            yield "\n" * word.count("\n")
            continue
        if kind == "text":
            named = words[-1] == "(" and (words[-2] == "SetFactory" or words[-3] == "Physical")
            fits = named or (words[-3:] == [".", "F", "="] and bool(_ARITHMETIC.fullmatch(word)))
        elif kind == "name":
            fits = word in attributes if words[-1] == "." else word in _WORDS or word in own
        else:
            fits = kind == "sign" and (word != "." or words[-1] in ("Mesh", "]"))
        if not fits:
            raise InputError(f"{path}: line {line} has {shown(word)}, and only words of geometry, sizes, groups and "
                             "arithmetic are meshed here: leave it out, or mesh the script yourself and give the .msh")
        yield "\n" * ends
        yield f" {'own_' if word in own and words[-1] != '.' else ''}{word}"
        words.append(word)
        level = 0 if word == "For" else level + (word in "([{") - (word in ")]}")
        ends = word == "EndFor" or (begins and level == 0 and word in ")]}")
        begins = (begins or word == "For") and not ends
