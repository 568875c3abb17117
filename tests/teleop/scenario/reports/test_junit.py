"""Outcomes as JUnit XML."""

from dataclasses import replace
from xml.etree import ElementTree as Xml

from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.reports.junit import junit
from tests.teleop.scenario.reports.outcomes import EVIL, outcome, passed


def test_a_suite_has_a_case_for_the_run_and_one_for_each_limit() -> None:
    root = Xml.fromstring(junit([outcome()]))
    assert root.attrib == {
        "name": "farsteer scenario", "tests": "6", "failures": "3", "errors": "0"
    }  # fmt: skip
    (suite,) = root
    assert suite.attrib["tests"] == "6"
    assert suite.attrib["failures"] == "3"
    assert suite.attrib["time"] == "60.000"
    cases = suite.findall("testcase")
    assert {c.get("classname") for c in cases} == {"kidnapped-in-the-office"}
    names = ["run", "goals", "position_max", "contacts", "nees", "violations"]
    assert [c.get("name") for c in cases] == names


def test_a_missed_limit_fails_with_value_limit_and_how_to_repeat_the_run() -> None:
    (failure,) = Xml.fromstring(junit([outcome()])).findall(".//testcase[@name='position_max']/*")
    assert failure.tag == "failure"
    message = "largest error of the position: 5.66 m, limit <= 0.1 m"
    assert failure.get("message") == message
    assert failure.text is not None
    assert "farsteer scenario replay runs/kidnapped-in-the-office" in failure.text


def test_a_figure_that_was_not_measured_is_said_to_be_so() -> None:
    (failure,) = Xml.fromstring(junit([outcome()])).findall(".//testcase[@name='nees']/failure")
    assert failure.get("message") == "mean NEES: not measured, limit 2 to 12"


def test_texts_from_the_wire_make_neither_elements_nor_controls() -> None:
    made = junit([outcome()])
    assert not any(byte < 32 and byte != 10 for byte in made)
    output = Xml.fromstring(made).findtext(".//system-out")
    assert output is not None
    assert "</script><script>alert(1)</script>" in output
    assert EVIL not in output
    assert "\u202e" not in output


def test_a_passed_scenario_has_no_failure() -> None:
    root = Xml.fromstring(junit([passed(), passed()]))
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("12", "0", "0")
    assert root.find(".//failure") is None


def test_a_client_that_failed_is_an_error_of_the_run() -> None:
    failed = replace(passed(), status=ExitStatus.CLIENT_FAILED, ending="the client \x07 left")
    root = Xml.fromstring(junit([failed]))
    error = root.find(".//testcase[@name='run']/error")
    assert error is not None
    assert error.get("message") == "the client \N{REPLACEMENT CHARACTER} left"
    assert (root.get("failures"), root.get("errors")) == ("0", "1")


def test_a_run_that_broke_off_is_an_error_though_all_limits_hold() -> None:
    broken = replace(passed(), status=ExitStatus.MISSED, ending="interrupted", cut_short=True)
    root = Xml.fromstring(junit([broken]))
    assert [e.get("message") for e in root.iterfind(".//testcase[@name='run']/error")] == [
        "interrupted"
    ]
    assert (root.get("failures"), root.get("errors")) == ("0", "1")


def test_a_file_that_could_not_be_run_is_an_error() -> None:
    root = Xml.fromstring(junit([], [("a.toml", "a.toml:3: no TOML")]))
    (suite,) = root
    assert suite.get("name") == "a.toml"
    assert root.get("errors") == "1"
    error = suite.find("testcase/error")
    assert error is not None
    assert error.get("message") == "a.toml:3: no TOML"


def test_properties_carry_figures_and_the_digest() -> None:
    root = Xml.fromstring(junit([outcome()]))
    properties = {p.get("name"): p.get("value") for p in root.iter("property")}
    assert properties["sha256"] == "5f" * 32
    assert properties["distance"] == "52.3"
    assert properties["seed"] == "7"
