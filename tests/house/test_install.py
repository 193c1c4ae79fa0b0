"""The installation: Debian's interpreter and stack, a form that compiles, any number of ranks."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from vi_contact.practice.studies.cases.library import FOLDER

ROOT = Path(__file__).resolve().parents[2]

MINIMUM = {
    "numpy": (1, 24),
    "scipy": (1, 10),
    "h5py": (3, 7),
    "matplotlib": (3, 6),
    "tqdm": (4, 64),
    "dolfinx": (0, 5),
    "petsc4py": (3, 18),
    "mpi4py": (3, 1),
    "gmsh": (4, 8),
}


@pytest.mark.serial
def test_interpreter_is_recent_enough() -> None:
    assert sys.version_info >= (3, 11)


@pytest.mark.serial
@pytest.mark.parametrize("name", MINIMUM)
def test_stack_is_recent_enough(name: str) -> None:
    version = import_module(name).__version__
    assert tuple(int(part) for part in version.split(".")[:2]) >= MINIMUM[name]


def test_petsc_has_real_numbers() -> None:
    import numpy as np
    from petsc4py import PETSc

    assert not np.issubdtype(PETSc.ScalarType, np.complexfloating)


def test_compiled_form_gives_area_of_unit_square(comm: Any) -> None:
    import ufl
    from dolfinx import fem, mesh
    from mpi4py import MPI

    square = mesh.create_unit_square(comm, 4, 4)
    one = fem.Constant(square, 1.0)
    area = comm.allreduce(fem.assemble_scalar(fem.form(one * ufl.dx)), op=MPI.SUM)
    assert area == pytest.approx(1.0, rel=1e-14)


@pytest.mark.serial
def test_the_cases_that_ship_are_installed() -> None:
    """pip installs files that are no modules only where pyproject.toml names them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["vi_contact.practice.studies.cases"]
    files = sorted(
        path.relative_to(FOLDER.parent).as_posix() for path in FOLDER.rglob("*") if path.is_file()
    )
    assert len(files) == 4 and all(any(fnmatch(file, one) for one in patterns) for file in files)
    others = {
        path
        for path in (ROOT / "vi_contact").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".py", ".pyi")
    }
    data = project["tool"]["setuptools"]["package-data"]
    # checkers of types look for them
    assert data["vi_contact"] == ["py.typed"] and data["*"] == ["*.pyi"]
    assert (ROOT / "vi_contact" / "py.typed").read_bytes() == b""
    homes = {
        ROOT / package.replace(".", "/"): named for package, named in data.items() if package != "*"
    }
    assert others == {
        path for home, named in homes.items() for one in named for path in home.glob(one)
    }


def ran(script: str, **environment: str) -> str:
    """What a script prints in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.serial
def test_finite_elements_without_dolfinx_say_how_to_get_it() -> None:
    """A chain of one's own matrices is computed; each name that needs finite elements says how they
    are had, whichever of their libraries it asks for first."""
    told = ran(f"""
import sys
sys.path.insert(0, {str(ROOT / "tests" / "support")!r})
for name in ("dolfinx", "ufl", "basix", "petsc4py", "mpi4py"):
    sys.modules[name] = None
import vi_contact as vc
from chain import chain_problem
from vi_contact import bem, beam, fem, layer, practice, vi
from vi_contact.practice import studies
for room in (bem, beam, layer):
    for name in room.__all__:
        getattr(room, name)
system = vc.system_from_arrays([1.0], None, [[1.0]], coordinates=[[0.0]])
solution = vc.simulate(chain_problem(3), dt=1e-3, steps=2, progress=False)
print(solution.facts["status"], system.space.dimension)
for room, name in ((fem, "assemble"), (vi, "solve"), (studies, "read_case")):
    try:
        getattr(room, name)
        print(room, name, "is there")
    except ModuleNotFoundError as error:
        print(error)
""").splitlines()
    assert told[0] == "finished 1"
    for line, name in zip(
        told[1:], ("fem.assemble", "vi.solve", "practice.studies.read_case"), strict=True
    ):
        assert line.startswith(f"vi_contact.{name} needs DOLFINx with PETSc, which is missing here")
        assert "pip install 'vi-contact[fenicsx]'" in line


@pytest.mark.serial
def test_runs_without_h5py_need_no_folder(tmp_path: Path) -> None:
    """In a virtual environment of its own pip leaves h5py out on Python 3.11: a run keeps its rows
    in memory then."""
    told = ran(f"""
import sys
sys.path.insert(0, {str(ROOT / "tests" / "support")!r})
sys.modules["h5py"] = None  # as find_spec sees what is missing
from chain import chain_problem
import vi_contact as vc
run = dict(dt=1e-3, steps=2, scheme=vc.Midpoint(), progress=False)
solution = vc.simulate(chain_problem(3), **run)
print(solution.facts["status"], len(solution.plot().axes))
try:
    vc.simulate(chain_problem(3), **run, out={str(tmp_path / "run")!r})
except vc.InputError as error:
    print(error)
""").splitlines()
    assert told[0] == "finished 2" and told[1].endswith(
        "needs h5py, which is missing here: install it, or run without"
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.serial
def test_nothing_is_done_to_conda(tmp_path: Path) -> None:
    """Importing takes nothing from CONDA_PREFIX and leaves nothing there; installing runs no code
    of this project."""
    for name in (
        "bin/python",
        "lib/python3.11/site-packages/numpy/__init__.py",
        "etc/conda/activate.d/a.sh",
    ):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text("raise SystemExit(1)\n")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    script = """
import os, sys
import vi_contact as vc
vc.simulate, vc.Condensed, vc.read_run
from vi_contact import fem
fem.assemble
files = [getattr(m, "__file__", None) or "" for m in list(sys.modules.values())]
used = [*sys.path, *files]
print(os.environ["CONDA_PREFIX"], sum(os.environ["CONDA_PREFIX"] in one for one in used))
"""
    assert ran(script, CONDA_PREFIX=str(tmp_path), CONDA_DEFAULT_ENV="marker") == f"{tmp_path} 0"
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]
    assert build["build-backend"] == "setuptools.build_meta" and "backend-path" not in build
    assert not (ROOT / "setup.py").exists() and not (ROOT / "setup.cfg").exists()


@pytest.mark.slow
@pytest.mark.serial
def test_pip_installs_the_command(tmp_path: Path) -> None:
    """The commands of docs/start/install.md, without a package index: the virtual environment
    beside the system's packages, and in it the command, which runs the case that ships."""
    needed = (
        (ROOT / "pyproject.toml")
        .read_text(encoding="utf-8")
        .partition('"setuptools>=')[2]
        .partition('"')[0]
    )
    setuptools = pytest.importorskip("setuptools")
    if int(setuptools.__version__.split(".")[0]) < int(needed) or not (
        find_spec("packaging") and find_spec("packaging.licenses")
    ):
        pytest.skip(
            f"setuptools {setuptools.__version__} is older than {needed}, or packaging older than "
            "it needs"
        )
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path)
    left = shutil.ignore_patterns("__pycache__", "*.so")
    shutil.copytree(ROOT / "vi_contact", tmp_path / "vi_contact", ignore=left)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    for command in (
        f"{sys.executable} -m venv --system-site-packages venv",
        "venv/bin/pip install --quiet --no-deps --no-build-isolation --no-index .",
        "venv/bin/vi-contact --version",
        "venv/bin/vi-contact run wall --steps 2 --quiet",
    ):
        done = subprocess.run(
            command.split(),
            cwd=tmp_path,
            capture_output=True,
            encoding="utf-8",
            check=False,
            env=environment | {"PIP_DISABLE_PIP_VERSION_CHECK": "1"},
            timeout=600,
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"
    assert (
        done.stdout.startswith("A concrete wall")
        and (tmp_path / "results" / "wall" / "history.csv").is_file()
    )
    (installed,) = (tmp_path / "venv" / "lib").glob("python3.*/site-packages/vi_contact")
    files = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "vi_contact").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    found = {
        f"vi_contact/{path.relative_to(installed).as_posix()}"
        for path in installed.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    compiled = {"vi_contact/kernels/loops.abi3.so"} if shutil.which("cc") else set()
    assert found - compiled == files - compiled and compiled <= found
    if compiled:  # without a compiler, and without a place for what it makes
        shipped = ROOT / "tests" / "kernels" / "shipped_loops.py"
        command = [str(tmp_path / "venv" / "bin" / "python"), str(shipped)]
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, check=True, env=environment
        )
        assert done.stdout.decode() == "the loops are those of loops.abi3.so\n"
