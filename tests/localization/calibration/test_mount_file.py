from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.calibration.mount_file import MountFileError, read_mounts, write_mounts
from localization.types import Pose

MOUNTS = {
    "laser_horizontal": Pose.from_euler([0.2, 0.02, 0.3], yaw=0.026),
    "laser_vertical": Pose.from_euler([-0.1, -0.02, 0.42], roll=0.017, pitch=1.5),
}


def test_mounts_are_restored_from_their_file(tmp_path: Path) -> None:
    write_mounts(tmp_path / "m.toml", MOUNTS, comment="one\ntwo")
    read = read_mounts(tmp_path / "m.toml")
    assert set(read) == set(MOUNTS)
    for name, mount in read.items():
        np.testing.assert_array_equal(mount.position, MOUNTS[name].position)
        np.testing.assert_allclose(mount.rotation, MOUNTS[name].rotation, atol=1e-14)


@pytest.mark.parametrize(
    "name", ['a "quoted" one', "back\\slash", "two\nlines", "ü/läser", "\x7f\x01", "]", ""]
)
def test_any_name_of_a_frame_is_restored(tmp_path: Path, name: str) -> None:
    write_mounts(tmp_path / "m.toml", {name: Pose.identity()})
    assert set(read_mounts(tmp_path / "m.toml")) == {name}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "holds no mounts"),
        ("[a\n", "is not TOML"),
        ("[a]\nposition = [1, 2, 3]\n", "must have position and rotation_xyzw"),
        ("[a]\nposition = [1, 2]\nrotation_xyzw = [0, 0, 0, 1]\n", "position of 3 numbers"),
        ("[a]\nposition = [1, 2, 3]\nrotation_xyzw = [0, 0, 1]\n", "rotation_xyzw of 4"),
        ("[a]\nposition = [1, 2, 3]\nrotation_xyzw = [0, 0, 0, 0]\n", "unit norm"),
    ],
)
def test_file_without_valid_mounts_is_rejected(tmp_path: Path, text: str, why: str) -> None:
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(MountFileError, match=why):
        read_mounts(tmp_path / "m.toml")
    with pytest.raises(MountFileError, match="No such file"):
        read_mounts(tmp_path / "none.toml")
