"""Check what a body is assembled of: material or forms, section, damping, degree, initial values.

``conditions`` checks what holds, ties, damps and loads it.
"""

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx.mesh import Mesh

from ...core.algebra import total
from ...core.checks import (
    check_word,
    flag,
    function,
    instance,
    optional,
    provides,
    quote,
    several,
    whole,
)
from ...core.errors import InputError
from ...laws.materials import (
    BLIND_TO_RATIOS,
    Damping,
    DampingRatio,
    LinearElastic,
    NoDamping,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
    Section,
    Solid,
)
from ...laws.yielding import YieldingMaterial
from .. import compat
from ..mesh.communicators import MpiComm
from ..mesh.group_checks import cells_of, check_field
from ..mesh.numbering import NodeTable
from .form_checks import refuse_complex
from .forms import KINDS
from .initial_strains import InitialStrain
from .own_forms import Forms

log = logging.getLogger(__name__)
OWNER = "assemble"
# Poisson's ratio; CHOSEN: 0.49 is common for wet soil, 0.499 is 10 % to 40 % too stiff
LOCKING = 0.495


def check_body(
    mesh: Any,
    material: Any,
    forms: Any,
    section: Any,
    damping: Any,
    *,
    base_inertia: Any,
    degree: Any,
    quadrature_degree: Any,
    integration: Any,
    initial_stress: Any,
) -> tuple[Section, Damping]:
    """Return (section, damping), the usual for None.

    Args:
        mesh: that of the body.
        material: a material, or (cells, material) pairs.
        forms: the user's own forms, or None.
        section: a section, or None.
        damping: a damping law, or None.
        base_inertia: whether the base counts.
        degree: that of the displacement.
        quadrature_degree: that of integrals, or None.
        integration: "full", "selective" or "bbar".
        initial_stress: a function of points, or None.

    Raises:
        InputError: objects of another kind, cells of another mesh.
    """
    if mesh.topology.dim != mesh.geometry.dim:
        raise InputError(
            f"assemble: the mesh has cells of dimension {mesh.topology.dim} at points of "
            f"{mesh.geometry.dim} coordinates; read it with gdim={mesh.topology.dim}"
        )
    _check_degree(degree)
    optional(whole, OWNER, "quadrature_degree", quadrature_degree)
    refuse_complex("assemble")
    optional(
        instance,
        OWNER,
        "forms",
        forms,
        Forms,
        "give fem.Forms(stiffness=…, mass=…), or leave them out",
    )
    _check_material(mesh, material, forms)

    # the usual for what is left out, then what goes with what
    if section is None:
        section = PlaneStrain() if mesh.geometry.dim == 2 else Solid()
    if damping is None:
        damping = NoDamping()
    _check_section(section, mesh.geometry.dim)
    _check_damping(damping, section, forms)
    flag(OWNER, "base_inertia", base_inertia)
    if material is None or isinstance(material, KINDS):
        materials = [material]
    else:
        materials = [given for _, given in material]
    _check_integration(
        mesh, materials if forms is None else [forms], section, damping, degree, integration
    )
    refuse_initial_stress(initial_stress, materials)
    thick = mesh.geometry.dim > 1 and not isinstance(section, PlaneStress)
    if forms is None and degree == 1 and thick and integration == "full" and mesh.comm.rank == 0:
        _tell_locking([given for given in materials if isinstance(given, LinearElastic)])
    return section, damping


def _check_material(mesh: Any, material: Any, forms: Any) -> None:
    """Raise InputError unless there are forms, a material, or pairs of cells and materials.

    Args:
        mesh: that of the body.
        material: what was given.
        forms: the user's own forms, or None.
    """
    if material is None and forms is None:
        raise InputError("assemble: neither a material nor forms are given; give one of them")
    if material is not None and not isinstance(material, KINDS):
        remedy = "give a LinearElastic, Orthotropic or Heterogeneous, or (cells, material) pairs"
        for pair in several(OWNER, "material", material, remedy):
            cells, given = _read_pair("material", pair, remedy)
            cells_of(OWNER, "the cells of a material", cells, mesh)
            instance(OWNER, "material", given, KINDS, remedy)


def _check_section(section: Any, dimension: int) -> None:
    """Raise InputError unless the section is one of a body of this dimension."""
    provides(
        OWNER,
        "section",
        section,
        ("thickness", "elastic_constants"),
        "give PlaneStrain(), PlaneStress() or None",
    )
    if dimension == 3 and isinstance(section, PlaneStrain | PlaneStress):
        raise InputError(
            f"assemble: {section} is a section of a plane body and this one has three dimensions; "
            "give Solid(), or leave it out"
        )
    if dimension == 2 and isinstance(section, Solid):
        raise InputError(
            "assemble: Solid() is for a body in space and this one is plane; give PlaneStrain() or "
            "PlaneStress(thickness)"
        )


def _check_damping(damping: Any, section: Any, forms: Any) -> None:
    """Raise InputError unless the damping is one, and goes with the forms and the section.

    Args:
        damping: what was given.
        section: the section of the body.
        forms: the user's own forms, or None.
    """
    provides(
        OWNER,
        "damping",
        damping,
        ("coefficients",),
        "give Rayleigh(alpha, beta), MassProportional(c) or None",
    )
    if forms is not None and not (
        isinstance(damping, Rayleigh | NoDamping) or hasattr(damping, "viscosities")
    ):
        raise InputError(
            f"assemble: {damping} needs the density of a material and forms=… have none; give "
            "Rayleigh(alpha, beta), KelvinVoigt(…), or Forms(…, damping=)"
        )
    if isinstance(section, PlaneStress) and any(getattr(damping, "viscosities", ())):
        raise InputError(
            f"assemble: {damping} does not go with PlaneStress, where the strain across the panel "
            "would need its own motion; give Rayleigh(0, beta), or another section"
        )


def check_ratios(
    law: Damping,
    materials: Sequence[Any],
    boundaries: Sequence[Any],
    *,
    ratio: float,
    damps: bool,
) -> None:
    """Raise InputError, on all ranks, for a law that damps nothing, and for ratios no law reads.

    Args:
        law: the damping of the body.
        materials: those of its cells.
        boundaries: its dashpots.
        ratio: the largest damping ratio of the materials, over all ranks [-].
        damps: whether the law makes any C at all.
    """
    has_ratio = any(callable(material.xi) or material.xi for material in materials)
    if isinstance(law, DampingRatio) and not has_ratio:
        raise InputError(
            f"assemble: {law} damps by the ratios xi of the materials, and none of them has one; "
            "give LinearElastic(…, xi=0.05), or another law, such as Rayleigh(alpha, beta)"
        )
    if not isinstance(law, NoDamping | DampingRatio) and not damps:
        raise InputError(
            f"assemble: {law} damps nothing, as its coefficients are zero; give coefficients above "
            "zero, or leave damping out"
        )
    if ratio and isinstance(law, BLIND_TO_RATIOS):
        raise InputError(
            f"assemble: a material has the damping ratio xi = {ratio:g}, which {law} does not "
            "read; give damping=DampingRatio(frequency), or leave xi out"
        )

    # Dashpots have no damping but their own: a ratio that only they have is read by nobody.
    for boundary in boundaries:
        behind = boundary.material
        if behind is not None and behind.xi and behind not in materials:
            raise InputError(
                f"assemble: the material of {type(boundary).__name__} on '{boundary.facets.name}' "
                f"has the damping ratio xi = {behind.xi:g}, and dashpots read none; leave xi out "
                "there"
            )


def _check_degree(degree: Any) -> None:
    """Raise InputError unless the degree is 1 or 2."""
    if isinstance(degree, bool) or degree not in (1, 2):
        raise InputError(
            f"assemble: degree is {quote(degree)}; give 1 for P1 and Q1, 2 for P2 and Q2"
        )


def check_nodes(comm: MpiComm, nodes: NodeTable, degree: int) -> None:
    """Raise InputError, on all ranks, for cells of another order than the degree. Collective.

    So it does where a rank owns nodes of which it has no cell, as parts of meshes may leave them.

    Args:
        comm: the communicator of the mesh.
        nodes: those of the displacement's space.
        degree: that of the displacement, 1 or 2.
    """
    lonely = round(total(comm, nodes.lonely))
    if lonely:
        raise InputError(
            f"assemble: {lonely} nodes of the mesh belong to ranks that have none of their cells, "
            "as create_submesh may leave them; write the part to a file and read it, or use fewer "
            "ranks"
        )
    if nodes.curved and degree == 1:
        raise InputError(
            "assemble: the mesh has cells of second order; give degree=2, or mesh it in first order"
        )
    if nodes.curved and not nodes.complete:
        raise InputError(
            "assemble: the mesh has cells of an order above 2 or without all mid-points; mesh it "
            "with complete cells of first or second order"
        )


def refuse_folded(mesh: Mesh) -> None:
    """Raise InputError, on all ranks, for curved cells that are folded. Collective.

    The Jacobian J of such a cell changes its sign: |∫ sign(det J)| < ∫ 1 over the cell.
    """
    size = ufl.TestFunction(compat.cell_space(mesh))
    det = ufl.JacobianDeterminant(mesh)
    signed, whole = (
        compat.assemble_vector(compat.compile_form(integrand * size * ufl.dx)).array_r
        for integrand in (det / abs(det), 1.0)
    )
    folded = mesh.comm.allreduce(int(np.sum(np.abs(signed) < (1.0 - 1e-9) * whole)))
    if folded:
        raise InputError(
            f"assemble: {folded} curved cells of the mesh are folded, their Jacobian changes its "
            "sign; mesh them finer, or with straight sides"
        )


def _check_integration(
    mesh: Mesh,
    materials: Sequence[Any],
    section: Section,
    damping: Damping,
    degree: int,
    integration: Any,
) -> None:
    """Raise InputError for an unknown word, and where cells cannot or need not be "selective".

    Args:
        mesh: that of the body.
        materials: those of the body, or its forms.
        section: its section.
        damping: its damping law.
        degree: that of the displacement.
        integration: the word.
    """
    check_word("integration of assemble", integration, ("full", "selective", "bbar"))
    if integration == "full":
        return
    if mesh.topology.cell_type.name not in ("quadrilateral", "hexahedron"):
        raise InputError(
            f"assemble: integration='{integration}' needs quadrilaterals or hexahedra, because "
            "other cells lock with it too; take degree=2"
        )
    yields = any(isinstance(material, YieldingMaterial) for material in materials)
    if yields != (integration == "bbar"):
        raise InputError(
            "assemble: integration='bbar' is for materials that yield, and 'selective' for linear "
            f"ones: give integration='{'bbar' if yields else 'selective'}'"
        )
    if yields:
        if degree == 2:
            raise InputError(
                "assemble: integration='bbar' is for degree=1, as degree=2 does not lock; leave it "
                "out"
            )
        return
    if degree == 2 or isinstance(section, PlaneStress):
        raise InputError(
            "assemble: integration='selective' is for degree=1 in plane strain or in space: "
            "neither degree=2 nor plane stress locks; leave it out"
        )
    if any(getattr(damping, "viscosities", ())) or not all(
        isinstance(material, LinearElastic) for material in materials
    ):
        raise InputError(
            "assemble: integration='selective' is for LinearElastic materials without KelvinVoigt "
            "damping; take degree=2 for others"
        )


def refuse_in_yielding(forms: Any, loads: Sequence[Any]) -> None:
    """Raise InputError for forms and loads that do not go with a material that yields.

    Args:
        forms: the user's own forms, or None.
        loads: of the body.
    """
    if forms is not None:
        raise InputError(
            "assemble: forms=… do not go with a material that yields, which states the body by "
            "itself; give one of the two"
        )
    if any(isinstance(load, InitialStrain) for load in loads):
        raise InputError(
            "assemble: InitialStrain does not go with a material that yields, whose strain is not "
            "that of a linear body; leave it out"
        )


def refuse_initial_stress(stress: Any, materials: Sequence[Any]) -> None:
    """Raise InputError for an initial stress of a body that does not yield, and what is none.

    Args:
        stress: what was given, or None.
        materials: those of the body, or its forms.
    """
    optional(function, OWNER, "initial_stress", stress, "give a function of points (k, d)")
    if stress is not None and not any(isinstance(given, YieldingMaterial) for given in materials):
        raise InputError(
            "assemble: initial_stress is for materials that yield; give a linear body an "
            "InitialStrain among its loads"
        )


def _tell_locking(materials: Sequence[LinearElastic]) -> None:
    """Warn of materials that first-order cells cannot deform without changing their volume."""
    stiff = max((material.nu for material in materials), default=0.0)
    if stiff > LOCKING:
        log.warning(
            "Poisson's ratio %.10g locks first-order cells, so displacements are too small: give "
            "at most %g, integration='selective' (quadrilaterals and hexahedra) or degree=2",
            stiff,
            LOCKING,
        )


def check_initial(mesh: Mesh, **values: Any) -> None:
    """Raise InputError unless each is None, a field, or (cells, field) pairs of this mesh."""
    for rate, value in values.items():
        if value is None:
            continue
        name = f"initial_{rate}"
        fields = [value]
        if isinstance(value, Sequence) and value and isinstance(value[0], tuple):
            pairs = [_read_pair(name, pair, "give (cells, value) pairs") for pair in value]
            fields = [field for _, field in pairs]
            for cells, _ in pairs:
                cells_of(OWNER, f"the cells of {name}", cells, mesh)
        for field in fields:
            check_field(OWNER, name, field)


def _read_pair(name: str, pair: Any, remedy: str) -> tuple[Any, Any]:
    """Return both members of a pair.

    Args:
        name: the argument that has it.
        pair: what was given.
        remedy: how messages end.

    Raises:
        InputError: it has not two members.
    """
    members = several(OWNER, f"a pair of {name}", pair, remedy)
    if len(members) != 2:
        raise InputError(f"{OWNER}: a pair of {name} has {len(members)} members; {remedy}")
    return members[0], members[1]


def has_no_mass(material: Any) -> bool:
    """Return whether a material has the density 0, which LinearElastic alone may have."""
    return isinstance(material, LinearElastic) and material.rho == 0.0


def refuse_without_mass(materials: Sequence[Any], forms: Any, dashpots: Sequence[Any]) -> None:
    """Raise InputError for what does not go with a material of density 0.

    Args:
        materials: all of the body.
        forms: the user's own weak forms, or None.
        dashpots: absorbing boundaries, which may have materials of their own.
    """
    own = [boundary.material for boundary in dashpots if hasattr(boundary, "material")]
    if not any(has_no_mass(given) for given in (*materials, *own)):
        return
    if dashpots:
        raise InputError(
            f"{OWNER}: a material has rho = 0, and dashpots absorb nothing without mass: hold its "
            "outer sides and leave dashpots and free fields out, or give a density above zero"
        )
    if forms is not None:
        raise InputError(
            f"{OWNER}: a material has rho = 0 beside forms, which take their density from it: give "
            "a density above zero"
        )
    if all(has_no_mass(given) for given in materials):
        raise InputError(
            f"{OWNER}: all materials have rho = 0, and nothing would move: give one of them a "
            "density above zero"
        )
