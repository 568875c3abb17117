"""Outcomes as JUnit XML, as pytest writes it and the CI of GitLab, Jenkins and others read it.

A scenario is a suite, with a case for the run itself and one for each limit. There is no time of day in it: the same
outcomes give the same file.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as Xml

from localization.report.plain_text import plain_text
from teleop.scenario.referee.outcome import LimitCheck, Outcome
from teleop.scenario.reports.limit_text import figure_text, limit_sentence


def junit(outcomes: Sequence[Outcome], failures: Sequence[tuple[str, str]] = ()) -> bytes:
    """Return the XML file.

    Args:
        outcomes: The outcomes.
        failures: Files that could not be run, each with the reason.
    """
    suites = Xml.Element("testsuites", name="farsteer scenario")
    for outcome in outcomes:
        suites.append(_suite(outcome))
    for file, reason in failures:
        suites.append(_unrun(file, reason))
    totals = {k: sum(int(s.get(k, "0")) for s in suites) for k in ("tests", "failures", "errors")}
    suites.attrib.update({name: str(count) for name, count in totals.items()})
    Xml.indent(suites)
    written: bytes = Xml.tostring(suites, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _suite(outcome: Outcome) -> Xml.Element:
    name = outcome.scenario.name
    seconds = f"{outcome.robot_seconds:.3f}"
    errors = int(bool(outcome.failure))
    suite = _new_suite(name, len(outcome.checks) + 1, errors=errors, time=seconds)
    suite.set("failures", str(sum(not c.met for c in outcome.checks)))
    properties = Xml.SubElement(suite, "properties")
    for key, value in _properties(outcome).items():
        Xml.SubElement(properties, "property", name=key, value=plain_text(value))
    run = _case(suite, name, "run", time=seconds)
    if outcome.failure:
        _problem(run, "error", outcome.failure)
    for check in outcome.checks:
        case = _case(suite, name, check.name)
        if not check.met:
            _problem(case, "failure", limit_sentence(check), _details(outcome, check))
    output = Xml.SubElement(suite, "system-out")
    output.text = "\n".join(
        f"{event.stamp / 1e9:9.2f} s  {event.kind:9}  {plain_text(event.text)}"
        for event in outcome.events
    )
    return suite


def _unrun(file: str, reason: str) -> Xml.Element:
    suite = _new_suite(plain_text(file), 1, errors=1, time="0")
    _problem(_case(suite, plain_text(file), "run"), "error", reason)
    return suite


def _new_suite(name: str, tests: int, *, errors: int, time: str) -> Xml.Element:
    counts = {"tests": str(tests), "failures": "0", "errors": str(errors), "skipped": "0"}
    return Xml.Element("testsuite", {"name": name, **counts, "time": time})


def _case(suite: Xml.Element, scenario: str, name: str, time: str = "0") -> Xml.Element:
    return Xml.SubElement(suite, "testcase", classname=scenario, name=name, time=time)


def _problem(case: Xml.Element, kind: str, message: str, details: str = "") -> None:
    text = plain_text(message)
    Xml.SubElement(case, kind, message=text, type=kind).text = details or text


def _details(outcome: Outcome, check: LimitCheck) -> str:
    return f"{limit_sentence(check)}\nrepeat the run: {plain_text(outcome.replay)}"


def _properties(outcome: Outcome) -> dict[str, str]:
    fixed = {
        "seed": str(outcome.scenario.seed),
        "ending": outcome.ending,
        "pace": outcome.pace,
        "factor": f"{outcome.factor:.2f}",
        "sha256": outcome.sha256,
        "replay": outcome.replay,
    }
    return fixed | {name: figure_text(value) for name, value in outcome.figures.items()}
