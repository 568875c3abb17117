"""The page of a run."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from teleop.scenario.files.operator_settings import Replay
from teleop.scenario.referee.outcome import ExitStatus, Outcome, TimeLines
from teleop.scenario.reports.run_page import page
from tests.teleop.scenario.reports.outcomes import EVIL, outcome, passed


class Elements(HTMLParser):
    """Collects elements, their texts, and whether all that is opened is closed again."""

    VOID = ("meta", "img", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] != ["style"]:
            self.texts.append(data)

    def of(self, name: str) -> list[dict[str, str | None]]:
        """Return the attributes of all elements of a name."""
        return [attributes for tag, attributes in self.found if tag == name]

    def classed(self, name: str) -> list[dict[str, str | None]]:
        """Return the attributes of all elements with a class."""
        return [a for _, a in self.found if name in (a.get("class") or "").split()]


ROOM = np.array([[x, y, z] for x in range(3, 24) for y in (2, 14) for z in (0.0, 1.0, 2.5)], float)


def test_there_is_no_script_and_nothing_from_elsewhere() -> None:
    text = page(outcome(), ROOM)
    elements = Elements(text)
    names = {tag for tag, _ in elements.found}
    assert names.isdisjoint({"script", "iframe", "object", "embed", "link", "form", "base"})
    assert not re.search(r"https?:|url\(|@import", text)
    for _, attributes in elements.found:
        assert not any(name.startswith("on") for name in attributes)
        assert (attributes.get("href") or "#").startswith("#")
        assert (attributes.get("src") or "data:image/png;base64,").startswith("data:image/png;")


def test_a_policy_forbids_what_is_not_there() -> None:
    (policy,) = [m["content"] for m in Elements(page(outcome())).of("meta") if "http-equiv" in m]
    assert policy is not None
    assert policy.startswith("default-src 'none';")
    assert "script" not in policy


def test_texts_from_the_wire_are_texts() -> None:
    made = replace(outcome(), ending=EVIL, replay=EVIL, figures={EVIL: 1.0}, pace=EVIL, sha256=EVIL)
    check = replace(made.checks[0], name=EVIL, text=EVIL, limit=EVIL, unit=EVIL)
    lines = replace(made.lines, health=(EVIL,) * 3000, control=(EVIL, "armed") * 1500)
    operator = Replay("replay", EVIL.replace("\0", ""))
    scenario = replace(made.scenario, description=EVIL, operator=operator)
    made = replace(made, checks=(check,), lines=lines, scenario=scenario)
    text = page(made)
    elements = Elements(text)
    assert not elements.of("script")
    assert not elements.of("b") or all(not a for a in elements.of("b"))
    assert "\x1b" not in text
    assert "\x00" not in text
    assert "\u202e" not in text
    assert sum("<script>alert(1)</script>" in t for t in elements.texts) >= 9


def test_every_event_has_a_mark_on_the_time_axis_that_leads_to_its_row() -> None:
    elements = Elements(page(outcome()))
    targets = {a["id"] for _, a in elements.found if "id" in a}
    links = [a["href"] for a in elements.of("a")]
    assert targets == {f"event-{n}" for n in range(1, 12)}
    assert {f"#{t}" for t in targets} == set(links)


def test_events_stand_at_their_time_on_the_axis() -> None:
    marks = [a for a in Elements(page(outcome())).of("a") if a["href"] == "#event-5"]
    assert "left:50.000%" in [a["style"] for a in marks]


def test_states_are_bands_of_the_length_of_their_time() -> None:
    (lost,) = [a for a in Elements(page(outcome())).classed("is-lost") if "style" in a]
    begin, width = (float(x) for x in re.findall(r"[\d.]+", lost["style"] or ""))
    assert begin == pytest.approx(52.5, abs=0.1)
    assert begin + width == pytest.approx(60.0, abs=0.1)
    assert lost["title"] == "lost"


def test_limits_are_said_to_be_met_or_missed_in_words() -> None:
    elements = Elements(page(outcome()))
    assert len(elements.classed("missed")) == 3
    assert len(elements.classed("met")) == 2
    assert "not measured" in elements.texts
    assert len(Elements(page(passed())).classed("missed")) == 0


def test_the_page_of_a_client_that_failed_says_so() -> None:
    failed = replace(outcome(), status=ExitStatus.CLIENT_FAILED, ending="the client left at 3 s")
    texts = Elements(page(failed)).texts
    assert "the client failed" in texts
    assert ": the client left at 3 s" in texts


def _cut(lines: TimeLines, ticks: int) -> TimeLines:
    names = ("stamps", "true", "estimated", "error", "sigma", "nees", "health", "control")
    names += ("command", "speed", "tilt")  # type: ignore[assignment]
    return TimeLines(**{name: getattr(lines, name)[:ticks] for name in names})


@pytest.mark.parametrize("ticks", [0, 1, 2])
def test_a_run_of_hardly_any_ticks_has_a_page(ticks: int) -> None:
    made = outcome()
    ages = made.command_ages[:0]
    short = replace(made, lines=_cut(made.lines, ticks), events=(), command_ages=ages)
    texts = Elements(page(short, ROOM)).texts
    assert "No command carried a time by which its age could be known." in texts


def test_a_run_without_any_estimate_has_a_page() -> None:
    made = outcome()
    nothing = np.full(3000, np.nan)
    lines = replace(
        made.lines, error=nothing, sigma=nothing, nees=nothing, estimated=np.full((3000, 3), np.nan)
    )
    assert "nan" not in re.sub(r"<style>.*?</style>", "", page(replace(made, lines=lines), ROOM))


@pytest.mark.slow
def test_a_run_of_hours_has_a_page_of_a_few_hundred_kilobytes_with_its_shortest_peak() -> None:
    made: Outcome = outcome(seconds=14_400.0)
    made.lines.tilt[333_333] = 1.0
    text = page(made, ROOM)
    assert len(text) < 1_500_000
    # The peak is the highest figure: at its panel's top but for the margin of 5 %.
    assert "L463.0 4.8" in text
