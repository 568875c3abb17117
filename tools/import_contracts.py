"""Import-linter contract that forbids circles of imports between modules.

``acyclic_siblings`` of import-linter compares whole folders and so forbids two folders that use modules of
each other; this contract compares files. Imports inside functions and for type checking count.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class AcyclicModules(Contract):
    """No module imports itself by way of others."""

    type_name = "acyclic_modules"

    packages = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Return whether the modules of all packages can be put in an order of imports."""
        packages: set[str] = self.packages  # type: ignore[assignment]
        inside = [m for m in graph.modules if m.split(".")[0] in packages]
        imports = {m: graph.find_modules_directly_imported_by(m) for m in inside}
        try:
            TopologicalSorter(imports).prepare()
        except CycleError as error:
            # graphlib lists a circle from the imported module to the importing one.
            return ContractCheck(kept=False, metadata={"circle": error.args[1][::-1]})
        return ContractCheck(kept=True)

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print one circle."""
        output.print_error(" -> ".join(check.metadata["circle"]), bold=False)
