"""Scenario files: what is read, and the line of what is wrong."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from teleop.scenario.files.errors import ScenarioError, ScenarioFileError, located
from teleop.scenario.files.lines import lines_of
from teleop.scenario.files.operator_settings import Replay
from teleop.scenario.files.reading import read_scenario, scenario_from
from teleop.scenario.files.writing import toml_value

HEAD = 'format = 1\nname = "a"\n'


def errors_of(text: str, folder: Path) -> list[str]:
    """Return the errors of a file with the text, without the file's path."""
    file = folder / "a.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioFileError) as caught:
        read_scenario(file)
    lines = str(caught.value).split("\n")
    assert all(line.startswith(f"{file}:") for line in lines)
    return [line.removeprefix(f"{file}:") for line in lines]


def test_a_file_of_two_lines_is_a_scenario(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(HEAD, encoding="utf-8")
    scenario = read_scenario(file)
    assert scenario.name == "a"
    assert scenario.world.scene == "office"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed = 1 2", "3: no TOML: Expected newline or end of document after a statement"),
        ("seed = [1,\n2", "4: no TOML: Unclosed array"),
        ('seed = "3"', "3: seed: must be a whole number, got '3'"),
        ("\nsed = 3", "4: sed: unknown field; did you mean seed?"),
        ("[mission]\ntime_limit = 0", "4: mission.time_limit: must be > 0, got 0"),
        ("[mission]\ntime_limit = inf", "4: mission.time_limit: must be a finite number, got inf"),
        ("mission.goals = 3", "3: mission.goals: must be a list of tables, got 3"),
        ("[mission]\ngoals = [\n{}]", "5: mission.goals[0].at: is missing: Where."),
        (
            "[mission]\ngoals = [\n  {at = [1,\n 2]},\n  {at = 'x', within = -1}]",
            "7: mission.goals[1].within: must be > 0, got -1",
        ),
        (
            "[start]\nat = [1, 2, 'x']",
            "4: start.at: must be a name of a place, [x, y] or [x, y, heading], got [1, 2, 'x']",
        ),
        (
            "[[fault]]\nkind = 'estop'\nat = 1\n[[fault]]\nat = 1\nkind = 'boxx'",
            "6: fault[1]: unknown kind 'boxx'; did you mean box?; there are board_unplugged, box, clock_step, door_closed, estop,"
            " kidnap, link, operator_killed, person, scanner_dead, scanner_dirty, wheel_slip, wrong_hint",
        ),
        (
            "[operator]\nspeed = 1",
            "3: operator: needs a kind: careless, client, follower, hand, places, replay, station, steering or steps",
        ),
        ("[[fault]]\nkind = 'kidnap'", "3: fault[0].at: is missing: When [s]."),
        (
            "[[fault]]\nkind = 'person'\nat = 1\n'path' = [\n[1, 2]]",
            "6: fault[0].path: needs at least 2 elements, got 1",
        ),
        (
            "[[fault]]\nkind = 'box'\nat = 1\nto = 'x'\nsize = [1, 1]",
            "7: fault[0].size: must be a list of 3 numbers, got [1, 1]",
        ),
        (
            "[[fault]]\nkind = 'box'\nat = 1\nto = 'x'\nsize = [1,\n 1, 9]",
            "8: fault[0].size[2]: must be <= 5, got 9",
        ),
        ("[world]\nscene = '../x'", "4: world.scene: '../x' must be a path inside the scenario"),
        ("[world]\nscene = '/etc'", "4: world.scene: '/etc' must be a path inside the scenario"),
        ("[world]\nscene = 'x/y.toml'", "4: world.scene: 'x/y.toml' is not in "),
        ("[world]\nscene = 'x\\u0000/'", "4: world.scene: 'x\\\\u0000/' is not in "),
        ('[world]\nscene = "x\\u0000/"', "4: world.scene: 'x\\x00/' is no name of a file"),
        (
            "[operator]\nkind = 'replay'\nfile = '/etc/passwd'",
            "5: operator.file: '/etc/passwd' must be a path inside",
        ),
        (
            "[second]\nkind = 'replay'\nfile = 'a/../../b'",
            "5: second.file: 'a/../../b' must be a path inside",
        ),
    ],
)
def test_an_error_names_its_line_its_field_and_what_would_be_right(
    text: str, message: str, tmp_path: Path
) -> None:
    (error,) = errors_of(HEAD + text, tmp_path)
    assert error.startswith(message)


def test_all_errors_are_listed_in_the_order_of_their_lines(tmp_path: Path) -> None:
    text = 'format = 1\nbogus = 3\nname = "A B"\n[limits]\ntilt = -1\ngoals = "yes"\n'
    first, second, third, fourth = errors_of(text, tmp_path)
    assert first.startswith("2: bogus: unknown field; known are format, name, ")
    assert second.startswith("3: name: got 'A B': Its name, for reports: small letters, digits")
    assert third == "5: limits.tilt: must be >= 0, got -1"
    assert fourth == "6: limits.goals: must be true or false, got 'yes'"


def test_what_is_missing_is_said_of_an_empty_file(tmp_path: Path) -> None:
    assert [e.split(": is missing")[0] for e in errors_of("", tmp_path)] == ["1: format", "1: name"]


def test_a_file_of_an_editor_on_windows_is_read(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(b"\xef\xbb\xbf" + HEAD.replace("\n", "\r\n").encode())
    assert read_scenario(file).name == "a"
    assert str(located(ScenarioError(("name",), "is odd"), file)) == f"{file}:2: name: is odd"


def test_a_file_that_is_not_utf_8_is_refused_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_bytes(b"format = 1\nname = '\xff'\n")
    with pytest.raises(ScenarioFileError, match=r"a\.toml:2: the file must be UTF-8"):
        read_scenario(file)


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(ScenarioFileError, match="larger than 1 MiB"):
        read_scenario(file)


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("x")
    home = tmp_path / "home"
    home.mkdir()
    (home / "plan.toml").symlink_to(tmp_path / "secret")
    (home / "plan").symlink_to(tmp_path)
    for scene in ("plan.toml", "plan", "plan/secret"):
        (error,) = errors_of(f"{HEAD}[world]\nscene = '{scene}'", home)
        assert f"'{scene}' leads out of the scenario file's folder by a link" in error


def test_files_are_found_beside_the_scenario_file(tmp_path: Path) -> None:
    (tmp_path / "commands.jsonl").touch()
    (tmp_path / "hall").mkdir()
    file = tmp_path / "a.toml"
    text = f"{HEAD}world.scene = 'hall'\noperator = {{kind = 'replay', file = './commands.jsonl'}}"
    file.write_text(text)
    scenario = read_scenario(file)
    assert scenario.world.scene == str((tmp_path / "hall").resolve())
    assert isinstance(scenario.operator, Replay)
    assert scenario.operator.file == str((tmp_path / "commands.jsonl").resolve())


def test_a_scene_of_the_project_is_preferred_to_a_folder_of_that_name(tmp_path: Path) -> None:
    (tmp_path / "office").mkdir()
    file = tmp_path / "a.toml"
    file.write_text(HEAD)
    assert read_scenario(file).world.scene == "office"


def test_an_error_found_later_gets_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(f"{HEAD}[mission]\ngoals = [{{at = 'x'}},\n  {{at = 'y'}}]\n")
    error = located(ScenarioError(("mission", "goals", 1, "at"), "is in a wall"), file)
    assert str(error) == f"{file}:5: mission.goals[1].at: is in a wall"


def test_long_and_odd_values_are_shown_short_and_without_control_characters(tmp_path: Path) -> None:
    text = '[start]\nknown = "\\u001b[2J' + "x" * 500 + '"\n'
    (error,) = errors_of(HEAD + text, tmp_path)
    assert "\x1b" not in error
    assert len(error) < 200


KEYS = st.sampled_from(
    [
        "format",
        "name",
        "seed",
        "world",
        "scene",
        "start",
        "at",
        "mission",
        "goals",
        "within",
        "operator",
    ]
    + ["kind", "fault", "limits", "to", "path", "size", "nees", "client", "x", "a b", '"', "é"]
)
LEAVES = (
    st.sampled_from(
        ["box", "client", "link", "person", "estop", "office", 'a"\\\n\x7f', "'''", "#]"]
    )
    | st.integers(-3, 3)
    | st.floats(-3, 3)
    | st.booleans()
)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4)
)


def _quoted(value: object) -> str:
    if isinstance(value, dict):
        pairs = ", ".join(f"{toml_value(k)} = {_quoted(v)}" for k, v in value.items())
        return f"{{{pairs}}}"
    if isinstance(value, list):
        return "[\n" + ",\n".join(map(_quoted, value)) + "\n]"
    return toml_value(value)


def _paths(value: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    members: list[tuple[str | int, object]] = []
    if isinstance(value, dict | list):
        members = [*(value.items() if isinstance(value, dict) else enumerate(value))]
    return [p for k, v in members for p in ((*path, k), *_paths(v, (*path, k)))]


@pytest.mark.slow
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_every_field_of_any_document_has_the_line_on_which_it_stands(
    data: dict[str, object],
) -> None:
    text = "".join(f"\n{toml_value(k)} = {_quoted(v)}" for k, v in data.items())
    assert tomllib.loads(text) == data
    lines = lines_of(text)
    assert list(lines) == _paths(data)
    written = text.split("\n")
    for path, line in lines.items():
        if isinstance(path[-1], str):
            assert toml_value(path[-1]) in written[line - 1]
    assert list(lines.values()) == sorted(lines.values())


@given(st.text(alphabet="[]{}=\",.#\na1'\\", max_size=30))
def test_lines_of_a_text_that_is_no_document_are_found_as_far_as_possible(text: str) -> None:
    lines_of(text)


@pytest.mark.slow
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_any_document_is_a_scenario_or_has_errors_that_name_fields(data: dict[str, object]) -> None:
    try:
        scenario_from({"format": 1, "name": "a", **data})
    except ExceptionGroup as group:
        for error in group.exceptions:
            assert isinstance(error, ScenarioError)
            assert error.path
            assert error.message
            assert "\n" not in str(error)
