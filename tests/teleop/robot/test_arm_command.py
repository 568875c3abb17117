"""The command ``farsteer arm``."""

from __future__ import annotations

import json
from xml.etree import ElementTree as ET

import pytest

from teleop.__main__ import main


def printed(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["arm", *words]) == 0
    text = capsys.readouterr().out
    assert text.isascii()
    return text


def test_torque_prints_the_papers_table_beside_ours(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(["torque"], capsys).splitlines()
    assert max(map(len, lines)) <= 80
    (first,) = [line.split() for line in lines if line.startswith("  link 1")]
    assert first[2:6] == ["6.236", "6.2355", "-0.01", "%"]
    assert lines.count("Misprints") == 1
    (weak,) = [line for line in lines if "4.8 V, 50%" in line]
    assert weak.endswith("-1 (2)")


def test_torques_as_json_are_in_the_units_that_are_said(capsys: pytest.CaptureFixture[str]) -> None:
    found = json.loads(printed(["torque", "--json", "--payload", "100"], capsys))
    assert [row["link"] for row in found["paper"]["table 4"]] == [1, 2, 3, 4, 5]
    assert len(found["paper"]["misprints"]) == 8
    shoulder = found["servos"][1]
    # 100 g at 41.19 cm beside the arm's own 4.7505 kgf cm.
    assert shoulder["torque"] == pytest.approx(4.7505 + 4.119, abs=1e-4)
    assert shoulder["share"] == pytest.approx(shoulder["torque"] / 11.0)
    assert [len(row["payload"]) for row in found["payload"]] == [6, 6, 6]


def test_a_servo_that_bears_more_than_it_stands_is_marked(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert "not for long" not in printed(["torque"], capsys)
    lines = printed(["torque", "--payload", "100"], capsys).splitlines()
    (shoulder,) = [line for line in lines if "arm_joint_2" in line]
    assert shoulder.endswith("not for long")


def test_urdf_is_xml_with_the_arm_on_its_mount(capsys: pytest.CaptureFixture[str]) -> None:
    root = ET.fromstring(printed(["urdf", "--mount", "plate"], capsys))
    (mount,) = [j for j in root.iter("joint") if j.get("name") == "arm_base_joint"]
    origin = mount.find("origin")
    assert origin is not None
    assert origin.get("xyz") == "0.19 0.0 0.312"


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["torque", "--pose", "up"], "there are: stow, ready, floor, straight"),
        (["torque", "--payload", "-5"], "payload must be 0 to 1000 g"),
        (["torque", "--payload", "nan"], "payload must be 0 to 1000 g"),
        (["torque", "--arm", "s9"], "no arm 's9'"),
        (["urdf", "--mount", "roof"], "there are: bracket, plate"),
    ],
)
def test_what_there_is_not_is_answered_with_what_there_is(
    words: list[str], answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["arm", *words]) == 2
    assert answer in capsys.readouterr().err
