"""Files of arms that contradict themselves are refused by the name of the field."""

from __future__ import annotations

from pathlib import Path

import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.errors import ArmError

FILE = Path(__file__).parents[3] / "assets" / "arms" / "s2.toml"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("d = 0.1334", "d = 0.14", "arm_joint_4: d must be 0.1334 m"),
        ("a = 0.14", "a = 0.15", "arm_joint_2: a must be 0.14 m"),
        ("alpha = -90.0", "alpha = 90.0", "arm_joint_4: alpha must be -90 deg"),
        ("lower = -135.0", "lower = 60.0", "arm_joint_3: lower must be below upper"),
        ("stow = [0.0, 30.0", "stow = [0.0, 140.0", "stow has arm_joint_2 at 140 deg"),
        ("jaw_mass = 0.004", "", "jaw_mass"),
        ('servo = "small"', 'servo = "tiny"', "no servo 'tiny'"),
    ],
)
def test_a_wrong_number_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = FILE.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "other.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ArmError, match=words):
        load_arm(str(path))
