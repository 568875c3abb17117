"""The explanation of the fields of scenario files."""

import pytest

from localization.cli.terminal import WIDTH
from teleop.errors import SettingError
from teleop.scenario.files.explaining import explanation, field_names
from teleop.scenario.files.fields import facts, kinds, schema


def test_every_field_has_a_sentence() -> None:
    for field in facts(schema()):
        assert field.text.endswith("."), field


def test_every_field_that_measures_something_has_a_unit_or_is_a_count() -> None:
    without = {
        f.name.rpartition(".")[2] for f in facts(schema()) if f.type == "number" and not f.unit
    }
    assert without == {
        *("sun", "factor", "share", "rate", "lapses", "mistakes", "oddities"),
        *("load", "load_max"),
    }


def test_no_kind_has_a_field_of_its_own_name() -> None:
    # The reader of files takes the name of a kind within a path for the kind.
    for part in ("operator", "fault"):
        node = schema()["properties"][part]
        for kind, table in kinds(node.get("items", node)).items():
            assert kind not in table["properties"]


def test_a_field_is_explained_with_type_bounds_unit_and_default() -> None:
    assert explanation("mission.goals.within") == [
        "  mission.goals[].within    number > 0, <= 100 [m], default 0.5",
        "      Distance at which it counts as reached, by ground truth [m].",
    ]


def test_a_table_is_explained_with_its_fields() -> None:
    text = "\n".join(explanation("mission"))
    assert "mission.goals[].stay" in text
    assert "limits" not in text


@pytest.mark.parametrize("name", ["kidnap", "fault.kidnap", "fault[].kidnap"])
def test_a_kind_is_explained_with_its_fields_alone(name: str) -> None:
    lines = explanation(name)
    assert lines[0].startswith('fault[], kind = "kidnap": The robot is carried off')
    assert [line.split()[0] for line in lines if "fault[]." in line] == ["fault[].at", "fault[].to"]


def test_a_kind_with_tables_of_its_own_is_explained_to_its_end() -> None:
    lines = explanation("hand")
    assert lines[0].startswith('operator, kind = "hand"')
    names = [line.split()[0] for line in lines if line.startswith("  operator.")]
    assert {"operator.tasks[].above", "operator.planned", "operator.reaction"} <= set(names)
    assert not [line for line in lines if 'kind = "client"' in line]


def test_the_last_part_of_a_name_is_enough() -> None:
    assert explanation("stopping_time")[0].split()[0] == "limits.stopping_time"


def test_everything_is_explained_within_the_width_of_a_terminal() -> None:
    lines = explanation()
    assert max(map(len, lines)) <= WIDTH
    assert len(lines) > 150


def test_an_unknown_field_is_refused_with_a_similar_one() -> None:
    with pytest.raises(SettingError, match=r"did you mean mission\.goals\?"):
        explanation("missions.goals")


@pytest.mark.slow
def test_every_name_that_is_suggested_can_be_explained() -> None:
    for name in field_names():
        assert explanation(name)
