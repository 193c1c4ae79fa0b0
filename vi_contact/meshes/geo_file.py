"""Mesh a Gmsh script (.geo) that holds nothing but geometry, sizes, groups and arithmetic.

``geo_script`` writes the script anew in words that can do no harm. A process of its own meshes it,
for a limited time and in half of the machine's memory.
"""

import ctypes
import logging
import os
import re
import resource
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import number, quote
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Between, Positive, Unit
from vi_contact.meshes.geo_script import PREFIX, rewrite_script
from vi_contact.meshes.gmsh_session import options, session
from vi_contact.meshes.mesh_file import safe_copy

MOST = 8  # how often a mesh may be refined
PR_SET_PDEATHSIG = 1  # of prctl.h: the signal that a process gets when its parent ends
MESH = "made.msh"  # the file in which the process that meshes leaves the mesh
log = logging.getLogger(__name__)
_NOT_TRANSFINITE = re.compile(
    r"(?:Error|Warning)\s*: ((?:Surface|Volume) \d+) cannot be meshed using the transfinite "
    r"algo\w* \((.*)\)"
)


@dataclass(frozen=True, kw_only=True)
class GeoFile:
    """Describe the mesh of a Gmsh script.

    It has its physical groups, and cells of the highest dimension that they have.

    Statements that change no mesh, such as ``Printf``, ``Save``, ``Mesh 2`` and options of Gmsh's
    window, are left out, and a warning in the log lists them.

    Args:
        path: the script.
        refine: how often Gmsh divides all cells into 2^d; new nodes lie on the curves of the
            geometry.
        time_limit: what the meshing may take.
        numbers: values of names that the script uses and does not set, or sets by DefineConstant
            alone; as Gmsh's option -setnumber.

    Raises:
        InputError: words that are not allowed, all with their lines; numbers without effect; when
            Gmsh fails, or time or memory is over.
    """

    path: Path
    refine: Annotated[int, Between(0, MOST)] = 0
    time_limit: Annotated[float, Positive, Unit("s")] = 300.0
    numbers: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        if not isinstance(self.numbers, Mapping):
            raise InputError(
                f"GeoFile: numbers is {quote(self.numbers)}; give names and their values"
            )
        for name, value in self.numbers.items():
            if not (isinstance(name, str) and name.isascii() and name.isidentifier()):
                raise InputError(
                    f"GeoFile: numbers has the name {quote(name)}; give a name of the script"
                )
            number("GeoFile", f"numbers of '{name}'", value)
        check_fields(self)

    def build(self, gmsh: Any) -> None:
        """Mesh the script beside this process and read the mesh into Gmsh's current model."""
        script = rewrite_script(self.path, self.numbers)
        if script.left_out:
            places = ", ".join(f"line {line} {words}" for line, words in script.left_out)
            log.warning("%s: left out, as it changes no mesh: %s", self.path, places)
        with TemporaryDirectory(prefix="vi_contact-") as name:
            folder = Path(name)
            Path(folder, "script.geo").write_text(script.text, encoding="utf-8")
            ended = self._run_gmsh(folder)
            if ended.returncode:
                fault = _describe_fault(ended).replace(PREFIX, "")
                raise InputError(f"{self.path}: Gmsh cannot mesh it: {fault}")
            for note in ended.stdout.splitlines():
                log.warning("%s: %s", self.path, note)
            gmsh.merge(str(safe_copy(folder / MESH, folder)))

    def _run_gmsh(self, folder: Path) -> subprocess.CompletedProcess[str]:
        """Mesh the script of this folder in a process of its own, and wait for its end."""
        code = (
            "import sys; sys.path = sys.argv[1:]; from vi_contact.meshes.geo_file import "
            f"mesh_here; mesh_here({self.refine}, {self.time_limit})"
        )
        command = [sys.executable, "-c", code, *map(os.path.abspath, sys.path)]
        try:
            return subprocess.run(
                command,
                cwd=folder,
                text=True,
                errors="replace",
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=self.time_limit,
            )
        except subprocess.TimeoutExpired:
            raise InputError(
                f"{self.path}: Gmsh did not end within {self.time_limit:g} s: ask for larger "
                "cells, or give a longer time_limit"
            ) from None


def _describe_fault(ended: subprocess.CompletedProcess[str]) -> str:
    """Return in words why the process that meshed did not succeed: the last line it printed."""
    lines = ended.stderr.strip().splitlines()
    if not lines:
        status = ended.returncode
        how = f"signal {-status}" if status < 0 else f"status {status}"
        return f"it ended without a word, with {how}"
    fault = lines[-1]
    # Gmsh throws a text where it cannot evaluate a formula, and C++ then prints one of these.
    if fault.strip().startswith(("terminate called", "what()")):
        return (
            "it stopped at a formula or size: check Field[…].F, and that Mesh.MeshSize… is positive"
        )
    return fault


def mesh_here(refine: int, time_limit: float) -> None:
    """Mesh script.geo of this folder as made.msh.

    This is for a process of its own, which ends with its parent or its time.
    """
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.setitimer(signal.ITIMER_REAL, time_limit + 1.0)
    half_of_memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    for limit in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE):
        resource.setrlimit(limit, (half_of_memory, half_of_memory))
    # Gmsh goes on after an error; its log says at the end which ones there were.
    with session() as gmsh, options(gmsh, {"General.AbortOnError": 0}):
        gmsh.logger.start()
        try:
            gmsh.merge("script.geo")
            groups = gmsh.model.getPhysicalGroups()
            if not groups:
                sys.exit(
                    "it has no cells in a group: name the body by a Physical Surface or Physical "
                    "Volume"
                )
            gmsh.model.mesh.generate(max(d for d, _ in groups))
            for _ in range(refine):
                gmsh.model.mesh.refine()
            if refine:  # which leaves cells of first order
                gmsh.model.mesh.setOrder(int(gmsh.option.getNumber("Mesh.ElementOrder")))
            gmsh.write(MESH)
        finally:
            _end_at_errors(gmsh.logger.get())


def _end_at_errors(lines: Sequence[str]) -> None:
    """End the process at the first error in Gmsh's log.

    Where Gmsh only left a transfinite mesh out, a note is printed instead.
    """
    before = ""
    for line in lines:
        # Gmsh itself goes on with a free mesh; from 4.14 on it only warns.
        not_transfinite = _NOT_TRANSFINITE.match(line)
        if not_transfinite:
            print(f"{not_transfinite[1]} is meshed freely, not transfinite: {not_transfinite[2]}")
        elif line.startswith("Error"):
            # The script prints the name of a group before Gmsh looks for its members.
            where = before.partition(": in")[2]
            named = ": in the group" in before
            sys.exit(f"{line} {'in' if named else ''}{where}".rstrip())
        before = line
