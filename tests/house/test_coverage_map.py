"""Every module has its test file, ``tests/<room>/test_<module>.py``, or stands here under one that
covers it."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import vi_contact

pytestmark = pytest.mark.serial
PACKAGE = Path(vi_contact.__file__).parent
TESTS = Path(__file__).parents[1]

# test file -> modules without a test file of their own; tests reach some of them through their
# users
COVERS = {
    "bem/test_boundary_operators.py": "bem.loops",
    "bem/test_compressed_blocks.py": "bem.compressed bem.frequency_circle bem.tails",
    "bem/test_contact.py": "bem.contact_run bem.uzawa_space_time",
    "bem/test_energetic.py": "bem.loads bem.poincare_steklov",
    "bem/test_fundamental_solution.py": "bem.rules",
    "bem/test_thin_bodies.py": "bem.element_pairs bem.quadrature",
    "cli/test_fuzz_cli.py": "cli.errors",
    "cli/test_entry.py": "cli.options studies.cases.library",
    "cli/test_motion.py": "plots.records",
    "core/test_contact_last.py": "core.compiled core.packages",
    "core/test_friction_certificate.py": "core.certificate core.protocols",
    "core/test_identity.py": "run.method",
    "core/test_step.py": "core.errors core.problem",
    "core/test_surfaces.py": "core.obstacles",
    "engineering/test_engineering_checks.py": "engineering.checks.comparison engineering.checks.earth_pressure_static",
    "engineering/test_seismic_checks.py": "engineering.checks.earth_pressure_seismic engineering.checks.shaken_block "
    "engineering.checks.racking_ratio",
    "engineering/test_resultants.py": "engineering.floor_spectra engineering.peak_values engineering.racking plots.maps",
    "fem/test_assembly.py": "fem.assembly_checks",
    "fem/test_bubbles.py": "fem.hierarchical",
    "fem/test_corners.py": "core.corners laws.mass_transfer",
    "fem/test_counting.py": "core.census",
    "fem/test_forces_in_space.py": "fem.output.cut_cells",
    "fem/test_forms.py": "fem.form_checks fem.own_forms",
    "fem/test_curved_contact.py": "fem.contact.curves",
    "fem/test_mortar_in_space.py": "fem.contact.clipping fem.contact.sight",
    "fem/test_pairs.py": "fem.contact.matching",
    "fem/test_second_order.py": "fem.numbering",
    "fem/test_section_forces.py": "fem.contact.frames fem.output.nodal_work fem.output.reactions laws.weight",
    "fem/test_own_matrices.py": "fem.contact.points",
    "fem/test_space.py": "fem.nodal_space",
    "fem/test_surface.py": "fem.contact.faces",
    "fem/test_ties.py": "soil.soil_column",
    "ground_motion/test_columns_of_records.py": "ground_motion.formats.columns ground_motion.formats.gaps ground_motion.formats.headings "
    "ground_motion.formats.statements ground_motion.formats.times",
    "ground_motion/test_formats.py": "ground_motion.formats.at2 ground_motion.formats.writer",
    "ground_motion/test_networks.py": "ground_motion.formats.cwa ground_motion.formats.geonet ground_motion.formats.unam "
    "ground_motion.formats.unread ground_motion.formats.volume1",
    "ground_motion/test_processing.py": "ground_motion.chain",
    "ground_motion/test_readers.py": "ground_motion.formats.afad "
    "ground_motion.formats.cosmos ground_motion.formats.esm ground_motion.formats.knet "
    "ground_motion.formats.reader ground_motion.formats.smc "
    "ground_motion.formats.text",
    "ground_motion/test_spectra.py": "ground_motion.intensity",
    "ground_motion/test_synthetic.py": "ground_motion.ec8 ground_motion.kanai_tajimi",
    "house/test_architecture.py": "core.lazy",
    "laws/test_excitation.py": "ground_motion.excitation",
    "meshes/test_ball.py": "meshes.checks meshes.extract meshes.mesh_file",
    "meshes/test_geo_file.py": "meshes.geo_script",
    "meshes/test_mesh_files.py": "meshes.channel",
    "meshes/test_meshes.py": "meshes.gmsh_session meshes.grid meshes.wall",
    "meshes/test_partition.py": "meshes.rows",
    "meshes/test_two_body_meshes.py": "meshes.block meshes.cut meshes.two_blocks",
    "models/test_channel.py": "studies.cases.short_settings",
    "models/test_wall.py": "core.units",
    "plots/test_faces.py": "plots.bodies",
    "plots/test_report.py": (
        "cli.pictures cli.post plots.charts plots.pages plots.sections run.files.reading "
        "studies.report"
    ),
    "core/test_own_files.py": "core.hdf5",
    "house/test_wrong_types.py": "core.arguments",
    "run/test_folder.py": "core.files run.files.history run.files.stored_rows run.files.table",
    "run/test_fuzz_folders.py": "run.files.writer run.session",
    "run/test_march.py": "core.state_checks",
    "run/test_march_many.py": "run.rows run.together",
    "run/test_proximal.py": "laws.free_motions run.rigid_bodies",
    "run/test_restart_refused.py": "run.files.identity",
    "run/test_simulate.py": "core.version run.files.log",
    "run/test_ranks_fail_together.py": "core.collective",
    "schemes/test_trapezoidal.py": "schemes.base",
    "soil/test_free_field.py": "soil.companion soil.upgoing_wave",
    "solvers/test_condensed_on_finite_elements.py": "core.condensation fem.copied_factor fem.petsc_rows",
    "solvers/test_nothing_stays.py": "fem.communicators",
    "solvers/test_friction_condensed.py": "solvers.certified solvers.friction.newton",
    "solvers/test_friction_methods.py": "solvers.friction.fixed_point solvers.friction.given_forces solvers.friction.linear",
    "solvers/test_friction_on_finite_elements.py": "solvers.friction.problem",
    "solvers/test_iterative.py": "solvers.iterative.contact solvers.iterative.layout solvers.iterative.projected_gradients "
    "solvers.iterative.route solvers.iterative.search",
    "solvers/test_iterative_friction.py": "solvers.iterative.friction solvers.iterative.friction_krylov "
    "solvers.iterative.friction_states",
    "solvers/test_iterative_on_finite_elements.py": "solvers.iterative.conjugate_gradients solvers.iterative.measures "
    "solvers.iterative.operator solvers.iterative.preconditioners",
    "solvers/test_volume.py": "solvers.volume.snes solvers.volume.tao",
    "solvers/test_volume_friction.py": "solvers.friction.nsgs solvers.volume.friction solvers.volume.route",
    "solvers/test_volume_options.py": "solvers.volume.failures solvers.volume.friction_jacobian "
    "solvers.volume.friction_system solvers.volume.options solvers.petsc",
    "solvers/test_volume_system.py": "solvers.volume.bounded_system solvers.volume.scaled_step",
    "studies/test_case.py": "cli.case studies.cases.parsing studies.cases.toml_file studies.cases.vocabulary",
    "studies/test_case_inputs.py": "studies.cases.table_calls",
    "studies/test_description.py": "fem.output.outline plots.sketch",
    "studies/test_case_stages.py": "studies.cases.stage_tables studies.cases.stages",
    "studies/test_strain_compatible_case.py": "studies.cases.strain_compatible",
    "studies/test_ida.py": (
        "cli.batch cli.ida plots.studies studies.ida.measures studies.ida.processes "
        "studies.ida.runs"
    ),
    "vi/test_inequality.py": "vi.judged",
    "vi/test_load_steps.py": "vi.linear_steps vi.newton",
    "vi/test_minimum.py": "vi.model",
    "vi/test_wrong_forms.py": "vi.forms",
    "validation/test_pressed_square.py": "plots.deformed",
}
BY = {module: test for test, modules in COVERS.items() for module in modules.split()}


@cache
def modules() -> dict[str, ast.Module]:
    """Modules as "solvers.normal.lcp", without packages, which hand names on, and ``__main__``,
    which calls cli."""
    paths = {
        p.relative_to(PACKAGE).with_suffix("").as_posix(): p for p in sorted(PACKAGE.rglob("*.py"))
    }
    return {
        name.replace("/", "."): ast.parse(path.read_text(encoding="utf-8"))
        for name, path in paths.items()
        if path.name not in ("__init__.py", "__main__.py")
    }


@cache
def users() -> dict[str, list[str]]:
    """Module -> the modules that import it."""
    found: dict[str, list[str]] = {}
    for user, tree in modules().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                above = user.split(".")[: -node.level] if node.level else []
                base = ".".join([*above, *([node.module] if node.module else [])]).removeprefix(
                    "vi_contact."
                )
                for target in {base, *(f"{base}.{alias.name}".lstrip(".") for alias in node.names)}:
                    found.setdefault(target, []).append(user)
    return found


def own_test(module: str) -> str:
    return f"{module.split('.')[0]}/test_{module.split('.')[-1]}.py"


def names_of(module: str) -> list[str]:
    """The module's path and its public functions and classes."""
    public = [
        one for one in modules()[module].body if not getattr(one, "name", "_").startswith("_")
    ]
    names = [one.name for one in public if isinstance(one, ast.ClassDef | ast.FunctionDef)]
    room, _, name = f"vi_contact.{module}".rpartition(".")
    return [f"{room}.{name}", f"{room} import {name}", *names]


def mentions(test: str, module: str) -> bool:
    """Whether a test file speaks of the module, or of one that uses it, directly or by one more."""
    direct = users().get(module, [])
    near = {module, *direct, *(two for one in direct for two in users().get(one, []))}
    text = (TESTS / test).read_text(encoding="utf-8")
    names = "|".join(re.escape(name) for one in near for name in names_of(one))
    return test in map(own_test, near) or re.search(rf"(?<!\w)({names})\b", text) is not None


def test_every_module_has_a_test():
    missing = [one for one in modules() if not (TESTS / own_test(one)).exists() and one not in BY]
    assert not missing, f"without a test file, and not in COVERS: {', '.join(missing)}"


def test_the_table_is_true():
    wrong = [
        f"{one} stands twice in COVERS"
        for one in BY
        if " ".join(COVERS.values()).split().count(one) > 1
    ]
    for module, test in BY.items():
        if module not in modules():
            wrong.append(f"{module} is no module")
        elif (TESTS / own_test(module)).exists():
            wrong.append(f"{module} has its own test file")
        elif not (TESTS / test).exists() or not mentions(test, module):
            wrong.append(f"{test} does not exist or does not speak of {module}")
    assert not wrong, "\n".join(wrong)


def test_a_false_row_is_found():
    assert not mentions("core/test_algebra.py", "soil.free_field")
    assert mentions("soil/test_free_field.py", "soil.free_field")


def marks(test: ast.FunctionDef) -> set[str]:
    """Names of the marks that a test has for all its parameters."""
    return {one.attr for one in test.decorator_list if isinstance(one, ast.Attribute)}


def test_a_file_with_tests_for_two_ranks_has_one_for_three():
    """What is left out on three ranks stands beside a test of the same feature that is not."""
    lone = []
    for path in TESTS.glob("*/test_*.py"):
        text = path.read_text(encoding="utf-8")
        if "pytest.mark.two_ranks" in text:
            tests = [
                one
                for one in ast.parse(text).body
                if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")
            ]
            if all(marks(one) & {"serial", "slow", "two_ranks"} for one in tests):
                lone.append(path.name)
    assert not lone
