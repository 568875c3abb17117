"""Hints on the keyboard: places, numbers, verdicts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.logs.ros_geometry import pose_to_dict
from localization.types import SECOND, Pose
from teleop.errors import SettingError
from teleop.operator.named_places import pose_of, read_places
from teleop.operator.robot_state.hint_verdicts import SentHint
from teleop.operator.terminal.hint_prompt import HintPrompt

_PLACES = {"hall": Pose.planar(24.2, 3.0, np.pi), "kitchen": Pose.planar(3.2, 14.0, np.pi / 2)}


def _typed(prompt: HintPrompt, text: str, end: str = "enter") -> HintPrompt:
    for key in (*text, end):
        prompt = prompt.after(key)
    return prompt


def test_place_is_chosen_by_its_number() -> None:
    prompt = HintPrompt(_PLACES)
    assert any("1 hall" in line and "2 kitchen" in line for line in prompt.lines)
    prompt = _typed(prompt, "2")
    assert prompt.done
    assert prompt.answer is _PLACES["kitchen"]


@pytest.mark.parametrize("text", ["23.5 3.4 -170", "23.5, 3.4,-170", " +23.5  3.4 -170 "])
def test_pose_is_typed_as_numbers(text: str) -> None:
    prompt = _typed(HintPrompt({}), text)
    assert prompt.answer is not None
    assert prompt.answer.position == pytest.approx([23.5, 3.4, 0.0])
    assert np.rad2deg(prompt.answer.yaw) == pytest.approx(-170.0)


@pytest.mark.parametrize(
    ("places", "text", "problem"),
    [
        ({}, "1 2", "three numbers"),
        ({}, "1 2 -", "three numbers"),
        (_PLACES, "3", "from 1 to 2"),
        (_PLACES, "", "from 1 to 2"),
    ],
)
def test_what_is_no_answer_is_asked_again(places: dict[str, Pose], text: str, problem: str) -> None:
    prompt = _typed(HintPrompt(places), text)
    assert not prompt.done
    assert problem in prompt.lines[-1]
    assert prompt.text == ""


def test_mistyped_characters_go_and_escape_cancels() -> None:
    prompt = _typed(HintPrompt({}), "1x2", "backspace")
    assert prompt.text == "1"
    assert prompt.after("escape").done
    assert prompt.after("escape").answer is None
    assert prompt.after("backspace").after("backspace").done


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("x = [", "no TOML"),
        ("x = 1", r"needs a table \[places\]"),
        ("[places]\nhall = [1, 2]", "place hall must be"),
        ("[places]\nhall = [1, 2, nan]", "place hall must be"),
        ("[places]\nhall = 'here'", "place hall must be"),
    ],
)
def test_other_file_given_for_places_is_refused_with_an_example(
    content: str, problem: str, tmp_path: Path
) -> None:
    file = tmp_path / "places.toml"
    file.write_text(content)
    with pytest.raises(SettingError, match=problem):
        read_places(file)
    with pytest.raises(SettingError, match="cannot read places"):
        read_places(tmp_path / "none.toml")


def _verdict(stamp: int, pose: Pose) -> dict[str, Any]:
    time = {"sec": stamp // SECOND, "nanosec": stamp % SECOND}
    return {"header": {"stamp": time}, "hint": pose_to_dict(pose)}


def test_only_a_later_verdict_on_the_same_pose_answers_a_hint() -> None:
    pose = pose_of([23.5, 3.4, -170.0])
    sent = SentHint(pose, 10 * SECOND)
    assert sent.answered_by(_verdict(11 * SECOND, pose))
    assert not sent.answered_by(_verdict(9 * SECOND, pose))  # latched from an earlier hint
    assert not sent.answered_by(_verdict(11 * SECOND, pose_of([23.5, 3.5, -170.0])))
    assert not sent.answered_by(_verdict(11 * SECOND, pose_of([23.5, 3.4, 170.0])))
