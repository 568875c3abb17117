"""Scripts of others on real logs: how they are called, and what is read from them."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.real.yardstick import YardstickError, run_yardstick

SCRIPT = """
import json, sys
given = dict(zip(sys.argv[1::2], sys.argv[2::2]))
with open(given["--tum"] + "_est.tum", "w") as file:
    for i in range(int(given["--limit"])):
        file.write(f"{i}.5 {i} 2 0 0 0 0 1\\n")
print(json.dumps({"icp_ms": 1.5, "given": given}))
"""


def script(folder: Path, text: str) -> Path:
    path = folder / "theirs.py"
    path.write_text(text, encoding="utf-8")
    return path


def test_script_is_given_the_number_of_scans_and_its_poses_are_read(tmp_path: Path) -> None:
    found, ms = run_yardstick(script(tmp_path, SCRIPT), tmp_path, "room", 3)
    assert ms == 1.5
    assert found.times.tolist() == [0.5, 1.5, 2.5]
    assert [pose.position[0] for pose in found.poses] == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("raise SystemExit('no such log')", "failed on room: no such log"),
        ("print('{}')", "must print JSON with a number icp_ms"),
        ("print('{\"icp_ms\": 1}')", r"room_est\.tum: No such file"),
    ],
)
def test_script_that_fails_or_prints_no_result_is_named(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        run_yardstick(script(tmp_path, text), tmp_path, "room", 3)


def test_error_names_what_was_called(tmp_path: Path) -> None:
    with pytest.raises(YardstickError, match=r"theirs\.py"):
        run_yardstick(tmp_path / "theirs.py", tmp_path, "room", 3)
