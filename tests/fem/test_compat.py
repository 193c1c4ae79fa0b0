"""What the rest of fem takes from DOLFINx, in one wording for all its versions."""

import numpy as np
import pytest
from mpi4py import MPI

from vi_contact.meshes.block import BlockMesh

pytest.importorskip("gmsh")
dolfinx = pytest.importorskip("dolfinx")
ufl = pytest.importorskip("ufl")

from vi_contact import fem  # noqa: E402
from vi_contact.core.errors import InputError  # noqa: E402
from vi_contact.fem import compat  # noqa: E402


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_unknowns_of_first_order_spaces_sit_on_geometry_nodes(d, simplices, comm):
    block = BlockMesh(
        lengths=(1.0, 2.0, 3.0)[:d],
        divisions=(3, 2, 2)[:d],
        simplices=simplices,
        angle=0.4 * (d > 1),
    )
    mesh, _ = fem.build_mesh(block, comm)
    functions = compat.vector_space(mesh)
    nodes = compat.dof_to_node(functions)
    assert np.array_equal(np.sort(nodes), np.arange(len(mesh.geometry.x)))
    field = dolfinx.fem.Function(functions)
    bs = functions.dofmap.index_map_bs
    assert bs == d
    field.interpolate(lambda x: x[:bs])
    assert np.allclose(
        field.x.array.reshape(-1, bs), mesh.geometry.x[nodes, :bs], rtol=0.0, atol=1e-14
    )


def test_assembled_mass_is_symmetric_and_weighs_the_block(comm):
    """1'M1 = d volume, v'1 = d volume, for P1 on tetrahedra; contributions of all ranks are in."""
    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=(1.0, 2.0, 3.0), divisions=(2, 2, 2), simplices=True), comm
    )
    functions = compat.vector_space(mesh)
    u, v = ufl.TrialFunction(functions), ufl.TestFunction(functions)
    M = compat.assemble_matrix(compat.compile_form(ufl.inner(u, v) * ufl.dx))
    b = compat.assemble_vector(
        compat.compile_form(dolfinx.fem.Constant(mesh, 1.0) * sum(v) * ufl.dx)
    )
    one, product = M.createVecs()
    one.set(1.0)
    M.mult(one, product)
    assert one.dot(product) == pytest.approx(3.0 * 6.0, rel=1e-13)
    assert b.sum() == pytest.approx(3.0 * 6.0, rel=1e-13)
    product.axpy(-1.0, b)
    assert product.norm() < 1e-14 * b.norm() * 10
    assert M.isSymmetric(1e-15)


@pytest.mark.long
def test_without_a_compiler_a_form_is_one_sentence_on_all_ranks(monkeypatch, shared_tmp, comm):
    """And the remedy works: a compiler that CC names. The cache is empty."""
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(1.0,), divisions=(4,)), comm)
    functions = compat.vector_space(mesh)
    u, v = ufl.TrialFunction(functions), ufl.TestFunction(functions)
    number = 1234567.5
    form = number * ufl.inner(u, v) * ufl.dx
    monkeypatch.setitem(compat._defaults, "cache_dir", (str(shared_tmp), "of the test"))
    monkeypatch.setenv("CC", "/nowhere/cc")
    said_of_it = (
        r"cannot compile a finite element form \(.*/nowhere/cc.*name the compiler by the "
        r"environment variable"
    )
    with pytest.raises(InputError, match=said_of_it) as said:
        compat.compile_form(form)
    assert len(str(said.value).splitlines()) == 1
    monkeypatch.setenv("CC", "gcc")
    matrix = compat.assemble_matrix(compat.compile_form(form))
    one, product = matrix.createVecs()
    one.set(1.0)
    matrix.mult(one, product)
    assert one.dot(product) == pytest.approx(number, rel=1e-13)


def test_other_errors_of_forms_stay_what_they_are():
    """A form that is wrong is not told as a missing compiler."""
    with pytest.raises(RuntimeError, match="^of something else$"):
        compat._compile_by(MPI.COMM_WORLD, lambda: _raise(RuntimeError("of something else")))


def _raise(error):
    raise error


def test_waiting_for_another_process_that_compiles_has_patience():
    """A form takes seconds to compile, on a machine with eight other processes five times as
    many."""
    options = getattr(dolfinx.jit, "get_options", None) or dolfinx.jit.get_parameters
    assert options()["timeout"] >= 100
