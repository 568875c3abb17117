"""Import-linter contract: every folder is named, imports between folders run one way, and nothing imports in a circle.

The layers of import-linter name modules or leave them out; its ``acyclic_siblings`` names none. This contract wants
each folder of a package named on a floor, so that a new folder has a place before it has imports. Files need no name:
what they import counts for the folders that import them, and no circle may lead through them. Imports inside
functions and for type checking count.
"""

from __future__ import annotations

from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from typing import Final

from grimp import ImportGraph, PackageDependency
from importlinter import Contract, ContractCheck, fields, output

_BESIDE: Final = "|"
"""Between folders on one floor, which do not import each other."""

Floors = dict[str, list[set[str]]]
"""Names of the folders on each floor of a package, from the top, by the name of the package."""


class FloorsField(fields.Field):  # type: ignore[type-arg]
    """A table of packages, each with a list of floors."""

    def parse(self, raw_data: object) -> Floors:
        """Return the floors of each package.

        Raises:
            ValidationError: If it is no such table, or names a folder twice.
        """
        if not isinstance(raw_data, dict):
            raise fields.ValidationError("floors must be a table of lists, one for each package")
        floors = {
            package: [{name.strip() for name in floor.split(_BESIDE)} for floor in lists]
            for package, lists in raw_data.items()
        }
        for package, levels in floors.items():
            if len(set().union(*levels)) < sum(map(len, levels)):
                raise fields.ValidationError(f"{package} has a folder on two floors")
        return floors


class FoldersRunOneWay(Contract):
    """Folders import folders on lower floors only; neither folders nor files import each other in a circle."""

    type_name = "folders"

    packages = fields.SetField(subfield=fields.StringField())
    floors = FloorsField()

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Return whether all folders of the packages are named and import one way."""
        roots: set[str] = self.packages  # type: ignore[assignment]
        floors: Floors = self.floors  # type: ignore[assignment]
        packages = sorted(m for m in graph.modules if m.split(".")[0] in roots)
        problems = [*_wrongly_named(graph, packages, floors)]
        if not problems:
            for package in packages:
                problems += _climbs(graph, package, floors.get(package, []))
                problems += _circle(graph, package)
        return ContractCheck(kept=not problems, metadata={"problems": problems})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print what is wrong, a line each."""
        for problem in check.metadata["problems"]:
            output.print_error(problem, bold=False)


def _wrongly_named(graph: ImportGraph, packages: list[str], floors: Floors) -> Iterator[str]:
    """Yield the folders without a floor, and the names on floors that are neither folder nor file."""
    for package in sorted(floors.keys() - set(packages)):
        yield f"{package} has floors, but there is no such package"
    for package in packages:
        children = {name.rpartition(".")[2]: name for name in graph.find_children(package)}
        named = set().union(*floors.get(package, []))
        for name, child in sorted(children.items()):
            if graph.find_children(child) and name not in named:
                yield f"{child} has no floor: name it among the floors of {package}"
        for name in sorted(named - children.keys()):
            yield f"{package}.{name} has a floor, but does not exist"


def _climbs(graph: ImportGraph, package: str, levels: list[set[str]]) -> Iterator[str]:
    """Yield the imports that lead up or across, one of each pair of folders."""
    found = graph.find_illegal_dependencies_for_layers(layers=levels, containers={package})
    for dependency in sorted(found, key=lambda found: (found.importer, found.imported)):
        way = " -> ".join(_shortest(dependency))
        yield f"{dependency.importer} must not import {dependency.imported}: {way}"


def _shortest(dependency: PackageDependency) -> list[str]:
    """Return the shortest chain of imports from the one folder to the other."""
    route = min(dependency.routes, key=lambda route: (len(route.middle), *route.middle))
    return [min(route.heads), *route.middle, min(route.tails)]


def _circle(graph: ImportGraph, package: str) -> Iterator[str]:
    """Yield a circle of imports between the folders and files of a package, if there is one."""
    imports = _imports_inside(graph, package)
    try:
        TopologicalSorter(
            {importer: {found for found, _ in inside} for importer, inside in imports.items()}
        ).prepare()
    except CycleError as error:
        circle = _from_first(error.args[1])
        ways = [
            min(way for imported, way in imports[importer] if imported == found)
            for importer, found in pairwise(circle)
        ]
        yield f"{' -> '.join(circle)} is a circle: {'; '.join(ways)}"


def _from_first(circle: list[str]) -> list[str]:
    """Return a circle from its first name on; graphlib lists it from the imported one to the importing one."""
    importing = circle[:0:-1]
    first = importing.index(min(importing))
    return [*importing[first:], *importing[: first + 1]]


def _imports_inside(graph: ImportGraph, package: str) -> dict[str, set[tuple[str, str]]]:
    """Return what each child of a package, and its ``__init__``, imports of the others, with the lines that do."""
    child_of = {package: package}
    for child in graph.find_children(package):
        child_of |= dict.fromkeys((child, *graph.find_descendants(child)), child)
    imports: dict[str, set[tuple[str, str]]] = {child: set() for child in child_of.values()}
    for module, child in child_of.items():
        for imported in graph.find_modules_directly_imported_by(module):
            found = child_of.get(imported, child)
            if found != child:
                imports[child].add((found, f"{module} -> {imported}"))
    return imports
