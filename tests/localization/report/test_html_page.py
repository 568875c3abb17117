"""The page of a localised log: texts are texts, and a log of hardly anything has one too."""

from __future__ import annotations

import re

import numpy as np
import pytest

from localization.evaluation.localization_history import History
from localization.report.html_page import page
from localization.report.report_summary import Report
from localization.types import Estimate, Health, Hint, HintVerdict, Pose, Twist, Verdict

EVIL = "</style><script>alert(1)</script>\x1b[2J\u202e\"'&<b>"
"""A name that somebody gave."""


def history(*healths: Health, known: bool = True) -> History:
    made = History()
    for stamp, health in enumerate(healths, 1):
        pose = Pose.planar(0.1 * stamp, 0.0, 0.0) if known else None
        covariance = np.diag([4e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])
        still = Twist.planar(0.0, 0.0)
        made.add(Estimate(stamp, pose, Pose.identity(), covariance, still, health, (EVIL,), None))
    return made


def report(made: History, **values: object) -> Report:
    hint = HintVerdict(1, Hint(1, Pose.identity(), np.eye(6)), Verdict.REJECTED, EVIL)
    fields = {"log": EVIL, "map": EVIL, "cloud": None, "facts": {EVIL: EVIL}, "notes": [EVIL]}
    return Report(history=made, verdicts=[hint], **{**fields, **values})  # type: ignore[arg-type]


def test_texts_of_a_log_are_texts() -> None:
    text = page(report(history(Health.TRACKING, Health.LOST)))
    assert "<script" not in text
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert text.count("&lt;script&gt;") >= 6
    assert "default-src 'none'" in text


def test_each_stretch_of_one_health_is_a_line_of_its_colour_that_begins_where_the_last_one_ended() -> (
    None
):
    states = [Health.TRACKING] * 3 + [Health.LOST] * 2 + [Health.TRACKING] * 3
    text = page(report(history(*states)))
    lines = re.findall(
        r'd="M([\d.]+) [^"]*?(?:L([\d.]+) [\d.]+)?" class="path state is-(\w+)"', text
    )
    assert [line[2] for line in lines] == ["tracking", "lost", "tracking"]
    assert [line[0] for line in lines[1:]] == [line[1] for line in lines[:-1]]


@pytest.mark.parametrize(("known", "maps"), [(True, 1), (False, 0)])
def test_a_log_without_a_map_has_a_page_and_one_without_a_pose_has_no_map_view(
    known: bool, maps: int
) -> None:
    text = page(report(history(Health.WAITING, Health.WAITING, known=known)))
    assert text.count("x, y in odom [m]") == maps
    assert "nan" not in re.sub(r"<style>.*?</style>", "", text, flags=re.DOTALL)


def test_a_log_without_estimates_has_a_page() -> None:
    assert "0 s: the log holds no reading" in page(report(history()))


def test_an_ellipse_is_as_wide_as_its_bounds() -> None:
    """A sigma of 2 cm along x makes 2 * 2.45 * 2 cm, here enlarged by the factor that the legend names."""
    text = page(report(history(*[Health.TRACKING] * 50)))
    (factor,) = (
        map(int, re.findall(r"95 %, enlarged (\d+) times", text)) if "enlarged" in text else (1,)
    )
    drawn = re.findall(r'd="([^"]*)" class="path ellipse"', text)[0]
    across = [float(x) for x in re.findall(r"([\d.]+) [\d.]+", drawn)]
    assert max(across) - min(across) == pytest.approx(factor * 2 * 2.4477 * 0.02, rel=0.01)
