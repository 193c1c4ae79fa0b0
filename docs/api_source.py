"""Read modules of the package: what is public, where it is defined, how it is called, what its
docstring says.

The source is parsed, never imported: signatures stand as they are written, and neither DOLFINx nor
PETSc is needed.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "vi_contact"
Def = ast.FunctionDef | ast.ClassDef


@dataclass(frozen=True)
class Module:
    """The text and the syntax tree of one module; ``path`` is dotted and begins below the
    package."""

    path: str
    text: str
    tree: ast.Module

    @property
    def folder(self) -> str:
        """The dotted path of the package that relative imports begin from."""
        return (
            self.path if file_of(self.path).name == "__init__.py" else self.path.rpartition(".")[0]
        )

    @cached_property
    def lines(self) -> list[bytes]:
        """The lines of the text; positions in a syntax tree count bytes."""
        return self.text.encode().splitlines(keepends=True)

    def source(self, node: ast.expr) -> str:
        """Return an expression as it is written, on one line."""
        assert node.end_lineno is not None
        given = self.lines[node.lineno - 1 : node.end_lineno]
        given[-1] = given[-1][: node.end_col_offset]
        given[0] = given[0][node.col_offset :]
        return re.sub(r"\s+", " ", b"".join(given).decode()).replace("( ", "(").replace(", )", ")")

    def annotation(self, node: ast.expr) -> str:
        """Return an annotation as it is written, without the quotes around names that come
        later."""
        return self.source(node).strip('"')


def file_of(path: str) -> Path:
    """Return the file of a dotted module path below the package."""
    plain = PACKAGE.joinpath(*path.split(".")) if path else PACKAGE
    return plain / "__init__.py" if plain.is_dir() else plain.with_suffix(".py")


@cache
def module(path: str) -> Module:
    """Return a parsed module."""
    text = file_of(path).read_text(encoding="utf-8")
    return Module(path, text, ast.parse(text))


def targets(node: ast.stmt) -> list[str]:
    """Return the names that an assignment binds."""
    given = (
        node.targets
        if isinstance(node, ast.Assign)
        else [node.target]
        if isinstance(node, ast.AnnAssign)
        else []
    )
    return [one.id for one in given if isinstance(one, ast.Name)]


def assigned(where: Module, name: str) -> ast.expr | None:
    """Return the value that a module gives to a name at its top level."""
    return next((node.value for node in where.tree.body if name in targets(node)), None)  # type: ignore[attr-defined]


def homes(where: Module) -> dict[str, str]:
    """Return name -> module of what a package hands on: by its stub, and what it imports from the
    package."""
    found = {}
    for node in where.tree.body:
        if isinstance(node, ast.ImportFrom) and node.level:
            above = where.folder.split(".") if where.folder else []
            base = above[: len(above) - node.level + 1] + (
                node.module.split(".") if node.module else []
            )
            found.update({one.asname or one.name: ".".join(base) for one in node.names})
    for part, names in contents(where).items():
        found.update(dict.fromkeys(names, f"{where.path}.{part}".lstrip(".")))
    return found


def stub_of(where: Module) -> Path:
    """Return the stub beside a module, the list of a package's public names; other modules have
    none."""
    return file_of(where.path).with_suffix(".pyi")


@cache
def contents(where: Module) -> dict[str, list[str]]:
    """Return module -> names of the imports in the stub of a package; ``*`` stands for all public
    names of the part."""
    stub = stub_of(where)
    found: dict[str, list[str]] = {}
    for node in ast.parse(stub.read_text(encoding="utf-8")).body if stub.is_file() else ():
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [one.name for one in node.names]
            part = (
                public(module(f"{where.path}.{node.module}".lstrip(".")))
                if names == ["*"]
                else names
            )
            found.setdefault(node.module, []).extend(part)
    return found


def public(where: Module) -> list[str]:
    """Return the public names of a package, or of a module without ``__all__``: what it defines and
    documents."""
    if handed_on := contents(where):
        names = {name for part in handed_on.values() for name in part}
    elif (listed := assigned(where, "__all__")) is not None:
        names = set(ast.literal_eval(listed))
    else:
        made = [
            node for node in where.tree.body if isinstance(node, Def) and ast.get_docstring(node)
        ]
        names = {node.name for node in made if not node.name.startswith("_")}
    return sorted(names, key=lambda name: (name.lower(), name))


def definition(where: Module, name: str) -> tuple[Module, ast.stmt]:
    """Return the module and the statement that define a name, through the packages that hand it
    on."""
    for node in where.tree.body:
        if (isinstance(node, Def) and node.name == name) or name in targets(node):
            return where, node
    home = homes(where).get(name)
    if home is None:
        raise SystemExit(
            f"docs/make_api.py does not find {name} in vi_contact.{where.path}: is it spelt as "
            "there?"
        )
    return definition(module(home), name)


def parameters(where: Module, given: ast.arguments, skip: int) -> list[str]:
    """Return the parameters of a function as they are written, without the first ``skip``."""

    def written(arg: ast.arg, default: ast.expr | None = None, stars: str = "") -> str:
        kind = f": {where.annotation(arg.annotation)}" if arg.annotation else ""
        equals = " = " if kind else "="
        return stars + arg.arg + kind + (f"{equals}{where.source(default)}" if default else "")

    plain = [*given.posonlyargs, *given.args]
    defaults = [None] * (len(plain) - len(given.defaults)) + list(given.defaults)
    found = [written(arg, default) for arg, default in zip(plain, defaults, strict=True)][skip:]
    if given.vararg or given.kwonlyargs:
        found.append(written(given.vararg, stars="*") if given.vararg else "*")
    found += [
        written(arg, default)
        for arg, default in zip(given.kwonlyargs, given.kw_defaults, strict=True)
    ]
    return found + ([written(given.kwarg, stars="**")] if given.kwarg else [])


def function(where: Module, node: ast.FunctionDef, skip: int = 0) -> str:
    """Return ``name(parameters) -> result``; a property has no parentheses and a colon."""
    decorators = [where.source(one) for one in node.decorator_list]
    result = where.annotation(node.returns) if node.returns else ""
    if skip and any(one in ("property", "cached_property") for one in decorators):
        return f"{node.name}: {result}"
    given = ", ".join(parameters(where, node.args, 0 if "staticmethod" in decorators else skip))
    return f"{node.name}({given})" + (f" -> {result}" if result else "")


def default(where: Module, value: ast.expr | None) -> str | None:
    """Return the default of a dataclass field as written; None when it must be given, '' when it is
    no argument."""
    if not (isinstance(value, ast.Call) and where.source(value.func) == "field"):
        return where.source(value) if value else None
    options = {one.arg: where.source(one.value) for one in value.keywords}
    if options.get("init") == "False":
        return ""
    return "…" if "default_factory" in options else options.get("default")


def fields(where: Module, node: ast.ClassDef) -> dict[str, str]:
    """Return the arguments of a dataclass, those of its base classes first."""
    found = {}
    for base in node.bases:
        if isinstance(base, ast.Name) and (base.id in homes(where) or base.id in public(where)):
            there, above = definition(where, base.id)
            if isinstance(above, ast.ClassDef):
                found.update(fields(there, above))
    for one in node.body:
        if (
            isinstance(one, ast.AnnAssign)
            and isinstance(one.target, ast.Name)
            and not one.target.id.startswith("_")
        ):
            kind, given = where.annotation(one.annotation), default(where, one.value)
            if given == "" or kind.startswith("ClassVar"):
                found.pop(one.target.id, None)
            else:
                found[one.target.id] = f"{one.target.id}: {kind}" + (f" = {given}" if given else "")
    return found


def constructor(where: Module, node: ast.ClassDef) -> str:
    """Return ``Name(arguments)`` of a class; of a protocol, an error or a class without arguments
    the name alone."""
    for one in node.body:
        if isinstance(one, ast.FunctionDef) and one.name == "__init__":
            return f"{node.name}({', '.join(parameters(where, one.args, 1))})"
    decorator = next(
        (where.source(one) for one in node.decorator_list if "dataclass" in where.source(one)), ""
    )
    given = (
        list(fields(where, node).values())
        if decorator or "NamedTuple" in map(where.source, node.bases)
        else []
    )
    if given and "kw_only=True" in decorator:
        given.insert(0, "*")
    return f"{node.name}({', '.join(given)})" if given else node.name


def methods(node: ast.ClassDef) -> Iterator[ast.FunctionDef]:
    """Yield the public methods and properties of a class; a call counts as one."""
    for one in node.body:
        if isinstance(one, ast.FunctionDef) and (
            not one.name.startswith("_") or one.name == "__call__"
        ):
            yield one


def documentation(node: Def | ast.Module) -> str:
    """Return the docstring without its indentation."""
    return inspect.cleandoc(ast.get_docstring(node, clean=False) or "")
