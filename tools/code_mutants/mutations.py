"""Small changes of source code that a programmer could have made by mistake: where they are possible, and how to make one.

A change replaces the text of one node of the syntax tree and leaves the rest of the file as it is. It is named by file,
function, statement and what is changed, so that it is found again after lines above it have moved.
"""

from __future__ import annotations

import ast
import random
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from pathlib import PurePosixPath

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
}
"""Without ``|``, which mostly joins types."""

_NOT_RUN = ("annotation", "returns", "decorator_list")
"""Fields of nodes that are declarations."""
_BODIES = ("body", "orelse", "finalbody", "handlers", "cases", "decorator_list")
_NEVER_TRUE = ("TYPE_CHECKING", "__name__ == '__main__'")
"""Conditions that no test gets past."""
_SHOWN = 90
"""Characters of a node or statement that a name shows."""
_MODULE = "<module>"

_Node = ast.expr | ast.stmt


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file."""

    path: str
    """The file, from the root of the repository."""
    scope: str
    """Qualified name of the function or class, or ``<module>``."""
    change: str
    """What is changed and in which statement; unique within the scope."""
    begin: int
    """Where the replaced text begins [bytes]."""
    end: int
    """Where it ends [bytes]."""
    text: str
    """What takes its place."""
    lines: frozenset[int]
    """Lines of the replaced text, and the first of its statement."""
    imported: bool
    """Whether it runs while its file is imported."""

    @property
    def case(self) -> str:
        """File and scope."""
        return f"{self.path}::{self.scope}"

    def applied_to(self, source: str) -> str:
        """Return the source of the file with the change made."""
        data = source.encode()
        return (data[: self.begin] + self.text.encode() + data[self.end :]).decode()


def mutants_of(sources: Mapping[str, str]) -> Iterator[Mutant]:
    """Yield all changes that are possible in files, of which the sources are given by path."""
    for path, source in sources.items():
        starts = [0]
        for line in source.encode().splitlines(keepends=True):
            starts.append(starts[-1] + len(line))
        seen: Counter[tuple[str, str]] = Counter()
        for scope, statement, node, new, imported in _visit(
            ast.parse(source), _MODULE, ast.Pass(), imported=True
        ):
            change = f"{_short(node)} -> {_short(new)}"
            if node is not statement:
                change += f" in: {_short(statement)}"
            seen[scope, change] += 1
            if seen[scope, change] > 1:
                change += f" (number {seen[scope, change]})"
            text = ast.unparse(new)
            last = node.end_lineno or node.lineno
            yield Mutant(
                path,
                scope,
                change,
                begin=starts[node.lineno - 1] + node.col_offset,
                end=starts[last - 1] + (node.end_col_offset or 0),
                text=text if isinstance(new, ast.stmt) else f"({text})",
                lines=frozenset((statement.lineno, *range(node.lineno, last + 1))),
                imported=imported,
            )


def _visit(
    node: ast.AST, scope: str, statement: ast.stmt, *, imported: bool
) -> Iterator[tuple[str, ast.stmt, _Node, _Node, bool]]:
    """Yield for all nodes below one: scope, statement, node, what could take its place, and whether an import runs it."""
    is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    for name, value in ast.iter_fields(node):
        runs = imported and not (is_function and name == "body")
        for child in value if isinstance(value, list) else [value]:
            # Python 3.11 does not know where the parts of an f-string are.
            if (
                name in _NOT_RUN
                or not isinstance(child, ast.AST)
                or isinstance(child, ast.JoinedStr)
            ):
                continue
            if isinstance(child, ast.If) and ast.unparse(child.test) in _NEVER_TRUE:
                continue
            within = child if isinstance(child, ast.stmt) else statement
            for old, new in _changes(child):
                yield scope, within, old, new, runs
            inner = scope
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                inner = child.name if scope == _MODULE else f"{scope}.{child.name}"
            yield from _visit(child, inner, within, imported=runs)


def _changes(node: ast.AST) -> Iterator[tuple[_Node, _Node]]:
    """Yield nodes at or directly below a node, each with one that could take its place."""
    match node:
        case ast.Compare(left, ops, comparators):
            for at, op in enumerate(ops):
                swapped = [*ops[:at], _COMPARISONS[type(op)](), *ops[at + 1 :]]
                yield node, ast.Compare(left, swapped, comparators)
        case ast.BinOp(ast.JoinedStr() | ast.Constant(str() | bytes())):
            pass
        case ast.BinOp(left, op, right) if type(op) in _ARITHMETIC:
            yield node, ast.BinOp(left, _ARITHMETIC[type(op)](), right)
        case ast.BoolOp(op, values):
            yield node, ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(ast.Not() | ast.USub(), operand):
            yield node, operand
        case ast.Constant(bool(value)):
            yield node, ast.Constant(not value)
        case ast.Constant(int(value)):
            yield node, ast.Constant(value + 1)
        case ast.Constant(float(value)):
            yield node, ast.Constant(2.0 * value or 1.0)
        case ast.If(test) | ast.While(test) | ast.IfExp(test):
            if not isinstance(test, ast.UnaryOp):
                yield test, ast.UnaryOp(ast.Not(), test)
        case ast.Call(function, [first, second, *others], keywords):
            if not isinstance(first, ast.Starred) and not isinstance(second, ast.Starred):
                yield node, ast.Call(function, [second, first, *others], keywords)
        case ast.Expr(ast.Call() | ast.Await()) | ast.AugAssign() | ast.Raise() | ast.Delete():
            yield node, ast.Pass()
        case ast.Assign([ast.Attribute() | ast.Subscript()]):
            yield node, ast.Pass()
        case ast.Return(ast.expr() as value) if ast.unparse(value) != "None":
            yield node, ast.Return(ast.Constant(None))


def _short(node: _Node) -> str:
    """Return the text of a node on one line, without the statements within it."""
    bare = copy(node)
    if isinstance(bare, ast.stmt):
        for name in _BODIES:
            if hasattr(bare, name):
                setattr(bare, name, [])
    line = " ".join(ast.unparse(bare).split())
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."


def draw(sources: Mapping[str, str], count: int, seed: int) -> list[Mutant]:
    """Draw mutants, from each folder in proportion to its lines and at least one, and no two from one function.

    Folders are those directly within a package; within them the draw is even over the lines that can be changed.

    Args:
        sources: by path.
        count: how many to draw.
        seed: of the random numbers.

    Raises:
        ValueError: if there are more folders than mutants to draw.
    """
    lengths: Counter[str] = Counter()
    for path, source in sources.items():
        lengths[_folder(path)] += source.count("\n")
    places: dict[str, dict[tuple[str, int], list[Mutant]]] = defaultdict(lambda: defaultdict(list))
    for mutant in mutants_of(sources):
        places[_folder(mutant.path)][mutant.path, min(mutant.lines)].append(mutant)
    if count < len(places):
        raise ValueError(f"--count {count} is too small for {len(places)} folders")
    shares = Counter(dict.fromkeys(sorted(places), 1))
    while shares.total() < count:
        shares[max(shares, key=lambda folder: lengths[folder] / (shares[folder] + 1))] += 1
    chance, drawn = random.Random(seed), dict[str, Mutant]()
    for folder, share in shares.items():
        wanted = len(drawn) + share
        for place in chance.sample(sorted(places[folder]), len(places[folder])):
            if len(drawn) < wanted:
                mutant = chance.choice(places[folder][place])
                drawn.setdefault(mutant.case, mutant)
    return list(drawn.values())


def _folder(path: str) -> str:
    return "/".join(PurePosixPath(path).parent.parts[:2])


def find(named: Iterable[tuple[str, str]], sources: Mapping[str, str]) -> list[Mutant | None]:
    """Find mutants by case and change, also in another file if the function has moved to one; None for one that has gone."""
    there: dict[tuple[str, str], list[Mutant]] = defaultdict(list)
    for mutant in mutants_of(sources):
        there[mutant.case, mutant.change].append(mutant)
        there[mutant.scope, mutant.change].append(mutant)
    found = []
    for case, change in named:
        path, _, scope = case.partition("::")
        moved = there[scope, change] if scope != _MODULE else []
        candidates = there[case, change] or [mutant for mutant in moved if mutant.path != path]
        found.append(candidates[0] if len(candidates) == 1 else None)
    return found
