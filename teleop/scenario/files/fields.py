"""Fields of the scenario's schema: their types, bounds and sentences, for messages and explanations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.files.writing import toml_value

Node = Mapping[str, Any]
"""A part of a JSON Schema."""

_BOUNDS: Final = (
    ("exclusiveMinimum", ">"),
    ("minimum", ">="),
    ("exclusiveMaximum", "<"),
    ("maximum", "<="),
)
_UNIT: Final = re.compile(r"\[([^\[\]]*)\]")


@dataclass(frozen=True, slots=True)
class FieldFacts:
    """What the schema says about one field."""

    name: str
    """Its name, dotted, as ``mission.goals[].within``."""
    type: str
    """What may be written, such as ``number``."""
    bounds: str
    """Bounds of a number or a length, such as ``> 0, <= 100``; empty without."""
    unit: str
    """Its unit; empty without."""
    default: str
    """Its default as TOML writes it; ``required``, or empty if it may be left out and then says nothing."""
    text: str
    """Its sentence."""


@cache
def schema() -> Node:
    """Return the JSON Schema of a scenario."""
    return SCHEMA.json_schema()


def resolved(node: Node) -> Node:
    """Return a part of the schema with its reference followed, and without the null of optional fields."""
    while True:
        if "$ref" in node:
            extra = {k: v for k, v in node.items() if k != "$ref"}
            node = {**schema()["$defs"][node["$ref"].rpartition("/")[2]], **extra}
        elif (parts := _without_null(node)) is not None:
            extra = {k: v for k, v in node.items() if k != "anyOf"}
            node = {**parts[0], **extra} if len(parts) == 1 else {**extra, "anyOf": parts}
            if len(parts) > 1:
                return node
        else:
            return node


def _without_null(node: Node) -> list[Node] | None:
    parts: list[Node] = node.get("anyOf", [])
    kept = [p for p in parts if p.get("type") != "null"]
    return kept if len(kept) < len(parts) else None


def kinds(node: Node) -> dict[str, Node]:
    """Return the tables of a union by their kind; empty for anything else."""
    mapping = resolved(node).get("discriminator", {}).get("mapping", {})
    return {kind: resolved({"$ref": ref}) for kind, ref in mapping.items()}


def node_at(path: Sequence[str | int], data: object) -> Node | None:
    """Return the part of the schema that describes a field of a document, or None if it is unknown.

    Args:
        path: The field.
        data: The document, which says what kind a table of a union is.
    """
    node: Node | None = resolved(schema())
    for part in path:
        if node is None:
            return None
        data = _member(data, part)
        node = _inside(node, part)
        node = None if node is None else _of_kind(resolved(node), data)
    return node


def _inside(node: Node, part: str | int) -> Node | None:
    if isinstance(part, str):
        inner: Node | None = node.get("properties", {}).get(part)
        return inner
    prefix = node.get("prefixItems", ())
    items: Node | None = prefix[part] if part < len(prefix) else node.get("items")
    return items


def _of_kind(node: Node, data: object) -> Node:
    if isinstance(data, Mapping):
        return kinds(node).get(str(data.get("kind")), node)
    return node


def _member(data: object, part: str | int) -> object:
    if isinstance(data, Mapping):
        return data.get(part)
    if isinstance(data, list) and isinstance(part, int) and part < len(data):
        return data[part]
    return None


def facts(node: Node, name: str = "") -> Iterator[FieldFacts]:
    """Yield the fields of a table, and those of tables within it, in their order; a union has each kind's."""
    node = resolved(node)
    if found := kinds(node):
        for kind, table in found.items():
            yield FieldFacts(f'{name}, kind = "{kind}"', "table", "", "", "", _sentence(table))
            for field in _own(table, name):
                if not field.name.endswith(".kind"):
                    yield field
        return
    yield from _own(node, name)


def _own(node: Node, name: str) -> Iterator[FieldFacts]:
    required = node.get("required", ())
    for key, member in node.get("properties", {}).items():
        path = f"{name}.{key}" if name else key
        inner = resolved(member)
        yield _facts(path, inner, required=key in required)
        items = inner.get("items")
        if items is not None and (_is_table(items)):
            yield from facts(items, f"{path}[]")
        elif _is_table(inner):
            yield from facts(inner, path)


def _is_table(node: Node) -> bool:
    return resolved(node).get("type") == "object" or bool(kinds(node))


def _facts(name: str, node: Node, *, required: bool) -> FieldFacts:
    text = _sentence(node)
    unit = _UNIT.search(text)
    is_number = node.get("type") in ("number", "integer")
    return FieldFacts(
        name=name,
        type=type_text(node),
        bounds=bounds_text(node),
        unit=unit[1] if unit and is_number else "",
        default="required" if required else _default(node),
        text=text,
    )


def _default(node: Node) -> str:
    value = node.get("default")
    return "" if value is None or isinstance(value, dict) else toml_value(value)


def _sentence(node: Node) -> str:
    return " ".join(str(node.get("description", "")).replace("``", "`").split())


def bounds_text(node: Node) -> str:
    """Return the bounds of a number, or of the number of elements, as ``> 0, <= 100``."""
    texts = [f"{sign} {_number(node[key])}" for key, sign in _BOUNDS if key in node]
    if "items" in node and "minItems" in node:
        texts.append(f"at least {node['minItems']}")
    if "maxLength" in node:
        texts.append(f"at most {node['maxLength']} characters")
    return ", ".join(texts)


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:g}"


def type_text(node: Node) -> str:
    """Return what may be written in a field, as a noun such as ``number`` or ``"up", "down" or "both"``."""
    node = resolved(node)
    if "const" in node or "enum" in node:
        values = node.get("enum", [node.get("const")])
        return either([f'"{v}"' if isinstance(v, str) else str(v) for v in values])
    if kinds(node) or node.get("type") == "object":
        return "table"
    if "anyOf" in node:
        return either([_alternative(part) for part in node["anyOf"]])
    if "prefixItems" in node:
        return f"list of {len(node['prefixItems'])} numbers"
    if "items" in node:
        return f"list of {_plural(node['items'])}"
    simple = {"string": "text", "integer": "whole number", "boolean": "true or false"}
    return simple.get(node.get("type", ""), "number")


def _alternative(node: Node) -> str:
    """Return a part of a union; the only ones that are not tables are places."""
    length = len(node.get("prefixItems", ()))
    if length:
        return "[x, y]" if length == 2 else "[x, y, heading]"
    if node.get("type") == "string" and "const" not in node:
        return "name of a place"
    return type_text(node)


def _plural(node: Node) -> str:
    return "places" if "anyOf" in resolved(node) else f"{type_text(node)}s"


def either(texts: Sequence[str]) -> str:
    """Return alternatives as ``a, b or c``."""
    return " or ".join(filter(None, [", ".join(texts[:-1]), *texts[-1:]]))
