"""Scenarios as text: what is written is read again."""

import tomllib
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from teleop.scenario.files.fields import Node, kinds, resolved, schema
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.files.writing import scenario_text, toml_value

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


def values(node: Node) -> st.SearchStrategy[Any]:
    """Return a strategy for what the schema allows."""
    node = resolved(node)
    if found := kinds(node):
        return st.one_of([values(table) for table in found.values()])
    if "anyOf" in node:
        return st.one_of([values(part) for part in node["anyOf"]])
    if "const" in node or "enum" in node:
        return st.sampled_from(node.get("enum", [node.get("const")]))
    if "prefixItems" in node:
        return st.tuples(*map(values, node["prefixItems"])).map(list)
    if "items" in node:
        low, high = node.get("minItems", 0), node.get("maxItems", 3)
        return st.lists(values(node["items"]), min_size=low, max_size=min(high, 3))
    if node["type"] == "object":
        members = {k: values(v) for k, v in node["properties"].items()}
        needed = {k: v for k, v in members.items() if k in {"kind", *node.get("required", ())}}
        return st.fixed_dictionaries(
            needed, optional={k: v for k, v in members.items() if k not in needed}
        )
    if node["type"] == "boolean":
        return st.booleans()
    if node["type"] == "string":
        return (
            st.from_regex(node["pattern"], fullmatch=True).filter(lambda text: len(text) <= 80)
            if "pattern" in node
            else TEXTS
        )
    low, high = node.get("minimum", -1000), node.get("maximum", 1000)
    if node["type"] == "integer":
        return st.integers(low, high)
    low = node.get("exclusiveMinimum", low)
    return st.floats(low, high, exclude_min="exclusiveMinimum" in node)


SCENARIOS = values(schema())


@given(SCENARIOS)
@settings(max_examples=60)
def test_what_is_written_is_the_same_scenario_when_read(data: dict[str, Any]) -> None:
    scenario = scenario_from(data)
    assert scenario_from(tomllib.loads(scenario_text(scenario))) == scenario


def test_only_what_differs_from_the_defaults_is_written() -> None:
    mission = {"goals": [{"at": "library"}, {"at": [1.0, 2.0], "within": 0.4}], "time_limit": 120.0}
    fault = [{"kind": "kidnap", "at": 5}]
    limits = {"violations": 0, "contacts": 0}
    data = {"format": 1, "name": "a", "mission": mission, "fault": fault, "limits": limits}
    assert scenario_text(scenario_from(data)) == (
        'format = 1\nname = "a"\n\n'
        '[mission]\ngoals = [{at = "library"}, {at = [1.0, 2.0], within = 0.4}]\n\n'
        '[[fault]]\nkind = "kidnap"\nat = 5.0\n\n'
        "[limits]\ncontacts = 0\n"
    )


def test_a_long_list_has_a_line_for_each_element() -> None:
    goals = [{"at": "corridor_west", "within": 0.25 + i} for i in range(4)]
    text = scenario_text(scenario_from({"format": 1, "name": "a", "mission": {"goals": goals}}))
    assert text.count("\n  {at = ") == 4


def test_a_value_of_another_type_is_refused() -> None:
    with pytest.raises(TypeError, match="object is no type of a scenario file"):
        toml_value(object())


def test_the_schema_s_own_json_is_the_same_scenario() -> None:
    scenario = Scenario(format=1, name="a")
    assert SCHEMA.validate_json(SCHEMA.dump_json(scenario)) == scenario
