"""The audit log's file, on disks that are full, gone or stuck."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from teleop.robot.audit.audit_file import AuditError, AuditFile

BEGIN = {"what": "begin"}


def lines(path: Path) -> list[object]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_lines_are_appended_in_order_to_a_private_file(
    tmp_path: Path,
) -> None:
    path = tmp_path / "audit.jsonl"
    for run in range(2):
        file = AuditFile(path, {"run": run})
        for number in range(100):
            file.add({"n": number, "who": "é\n"})
        file.close()
        assert file.lost == 0
    one = [{"n": number, "who": "é\n"} for number in range(100)]
    assert lines(path) == [{"run": 0}, *one, {"run": 1}, *one]
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("/dev/full", "No space left on device"),
        ("/nowhere/audit.jsonl", "No such file or directory"),
        ("/", "Is a directory"),
    ],
)
def test_unwritable_file_is_reported_at_the_start(path: str, why: str) -> None:
    with pytest.raises(AuditError, match=f"cannot write the audit log {path}: {why}"):
        AuditFile(Path(path), BEGIN)


def test_hung_disk_blocks_nothing_and_lost_lines_are_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    file = AuditFile(path, BEGIN, max_waiting=50)
    for number in range(2000):  # 200 kB: more than a pipe takes, and nobody reads
        file.add({"n": number, "fill": "x" * 100})
    assert 0 < file.lost < 2000
    assert caplog.text.count("are lost: the disk is too slow; the robot continues") == 1
    read: list[bytes] = []

    def drain() -> None:
        os.set_blocking(reader, True)
        while piece := os.read(reader, 65536):
            read.append(piece)

    thread = threading.Thread(target=drain)
    thread.start()
    file.close()
    thread.join()
    os.close(reader)
    written = [json.loads(line) for line in b"".join(read).splitlines()]
    assert sum(line["lines"] for line in written if line.get("what") == "lost") == file.lost
    assert sum("n" in line for line in written) == 2000 - file.lost


def test_lost_disk_is_reported_once_and_the_robot_continues(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    file = AuditFile(path, BEGIN)
    os.close(reader)
    for _ in range(5):
        file.add({"n": 0})
    file.close()
    assert file.lost == 5
    assert caplog.text.count("are lost: Broken pipe; the robot continues") == 1


FILLING = """
import resource, sys
from pathlib import Path
from teleop.robot.audit.audit_file import AuditFile
path = Path(sys.argv[1])
hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
file = AuditFile(path, {"what": "begin"})
for number in range(4):
    file.add({"n": number, "fill": "x" * 50})
while file.lost < 3:
    pass
resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
file.add({"n": "after"})
file.close()
"""


def test_lines_after_a_full_disk_are_whole_and_count_the_lost_ones(
    tmp_path: Path,
) -> None:
    path = tmp_path / "audit.jsonl"
    done = subprocess.run(
        [sys.executable, "-c", FILLING, str(path)],
        cwd=Path(__file__).parents[4],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert "the robot continues" in done.stderr
    begin, first, torn, lost, after = path.read_text().splitlines()
    assert json.loads(begin) == BEGIN
    assert json.loads(first)["n"] == 0
    with pytest.raises(json.JSONDecodeError):
        json.loads(torn)
    assert json.loads(lost) == {"what": "lost", "lines": 3}
    assert json.loads(after) == {"n": "after"}
