"""Mesh files are data: no script runs, whatever the file is called, and wrong ones are refused in
one sentence."""

from pathlib import Path

import numpy as np
import pytest

from meshes.disk import DiskMesh
from vi_contact.core.errors import InputError
from vi_contact.meshes.ball import BallMesh
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.meshes.extract import arrays_from_file
from vi_contact.meshes.gmsh_session import session, write
from vi_contact.meshes.wall import WallMesh

pytest.importorskip("gmsh")
pytestmark = pytest.mark.serial


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """One mesh in all variants of Gmsh's own format."""
    folder = tmp_path_factory.mktemp("meshes")
    with session() as gmsh:
        BlockMesh(lengths=(2.0, 1.0), divisions=(4, 3)).build(gmsh)
        for version, binary in ((4.1, 0), (4.1, 1), (4.0, 0), (2.2, 0), (2.2, 1)):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / f"{version} {'binary' if binary else 'text'}.msh"))
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.msh"))}


def test_every_variant_of_the_format_is_read_under_any_name(
    meshes: dict[str, bytes], tmp_path: Path
) -> None:
    assert len(meshes) == 5
    for name in ("mesh.msh", "mesh.geo", "mesh", "mesh.gz", "a$(touch PWNED) ;'\".msh"):
        for data in meshes.values() if name == "mesh.msh" else [meshes["4.1 text"]]:
            (tmp_path / name).write_bytes(data)
            arrays = arrays_from_file(tmp_path / name)
            assert (len(arrays.cells), arrays.cell_groups.keys()) == (12, {"block"})
            assert set(arrays.facet_groups) == {"left", "right", "bottom", "top"}


SCRIPT = 'SystemCall "touch {mark}";\nPrintf("x") > "{mark}";\nPoint(1) = {{0, 0, 0, 1}};\n'


@pytest.mark.parametrize(
    "name", ["mesh.msh", "mesh.geo", "mesh.pos", "mesh", "mesh.vtk", "mesh.opt"]
)
def test_scripts_are_not_run(name: str, meshes: dict[str, bytes], tmp_path: Path) -> None:
    """Neither as the file itself, nor after a mesh, nor as the options beside one."""
    mark = tmp_path / "PWNED"
    script = SCRIPT.format(mark=mark).encode()
    (tmp_path / name).write_bytes(script)
    with pytest.raises(InputError, match="MeshFormat, .* may be a script"):
        arrays_from_file(tmp_path / name)
    for data in (
        meshes["4.1 text"] + script,
        meshes["2.2 text"] + b"$View\n" + script,
        meshes["4.1 text"],
    ):
        (tmp_path / name).write_bytes(data)
        (tmp_path / f"{name}.opt").write_bytes(script)
        try:
            arrays_from_file(tmp_path / name)
        except InputError as error:
            assert "\n" not in str(error)
    assert not mark.exists()


def test_a_geo_file_is_refused_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "dam.geo").write_text("Point(1) = {0, 0, 0, 1};\n")
    with pytest.raises(InputError, match="give a .geo of geometry alone as meshes.GeoFile"):
        arrays_from_file(tmp_path / "dam.geo")


def test_counts_are_bounded_by_the_file_and_sections_are_whole(
    meshes: dict[str, bytes], tmp_path: Path
) -> None:
    """A count of 10^12 nodes takes no memory; a file cut anywhere before its last section ends is
    refused."""
    path = tmp_path / "wrong.msh"
    for name, data in meshes.items():
        path.write_bytes(data[: data.index(b"$EndElements")])
        with pytest.raises(InputError, match="cut short or damaged near Elements"):
            arrays_from_file(path)
        path.write_bytes(data[: data.index(b"$Elements")] + data[data.index(b"$EndElements") :])
        with pytest.raises(InputError, match="cut short or damaged"):
            arrays_from_file(path)
        for section in (b"Nodes", b"Elements"):
            at = data.index(b"$" + section + b"\n") + len(section) + 2
            end = data.index(b"\n", at)
            if name == "4.1 binary":
                path.write_bytes(
                    data[:at] + np.array([1, 10**12], dtype=np.uint64).tobytes() + data[at + 16 :]
                )
            else:
                path.write_bytes(
                    data[:at] + b"1 " * name.startswith("4") + b"1000000000000" + data[end:]
                )
            with pytest.raises(
                InputError, match=f"announces more {section.decode().lower()} than it can hold"
            ):
                arrays_from_file(path)


def test_cells_are_counted_before_they_are_made() -> None:
    for mesh in (
        lambda: BlockMesh(divisions=(10**6, 10**6)),
        lambda: WallMesh(divisions=(10**9, 10**400)),
        lambda: WallMesh(size=1e-9),
        lambda: DiskMesh(radius=1.0, size=1e-7, foot=1.0),
        lambda: BallMesh(radius=1.0, size=1e-9, foot=0.5),
        lambda: ChannelMesh(size=1e-7),
        lambda: ChannelMesh(size=1e-8, far=1.0),
    ):
        with pytest.raises(InputError, match="cells, and 2e\\+07 are the most; ask for fewer"):
            mesh()
    with pytest.raises(InputError, match="does not exist"):
        write(BlockMesh(), "/nowhere/at/all.msh")


def test_a_name_that_is_too_long():
    with pytest.raises(
        InputError, match="cannot be read .*: check the path|does not exist: check the path"
    ):
        arrays_from_file("a" * 300 + ".msh")
