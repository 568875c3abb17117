"""Processes that work side by side: they end with the command, and Ctrl-C ends what they do and nothing of their kin."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from teleop.errors import TeleopError
from teleop.scenario.worker_pool import worker_pool

ROOT = Path(__file__).parents[3]


def note_and_wait(file: Path) -> None:
    """Write down who runs, wait, and write down if that is ended."""
    file.write_text(str(os.getpid()))
    try:
        time.sleep(100)
    except KeyboardInterrupt:
        os.kill(os.getpid(), signal.SIGTERM)  # a second one does nothing
        file.write_text("interrupted")
        raise


def end_at_once() -> None:
    os._exit(1)


def written(file: Path) -> str:
    """Wait until somebody has written a file, and return its text."""
    for _ in range(600):
        if file.exists() and (text := file.read_text()):
            return text
        time.sleep(0.1)
    pytest.fail(f"{file} was never written")


@pytest.mark.slow
@pytest.mark.process
def test_ctrl_c_for_the_command_alone_ends_the_task_and_none_is_begun_after_it(
    tmp_path: Path,
) -> None:
    files = [tmp_path / name for name in "abcd"]
    with pytest.raises(KeyboardInterrupt), worker_pool(1) as pool:  # noqa: PT012 (as Ctrl-C comes)
        tasks = [pool.submit(note_and_wait, file) for file in files]
        os.kill(
            int(written(files[0])), signal.SIGINT
        )  # a terminal sends it to all: it does nothing
        raise KeyboardInterrupt
    assert files[0].read_text() == "interrupted"
    assert not any(file.exists() for file in files[1:])
    assert all(
        task.cancelled() or isinstance(task.exception(), KeyboardInterrupt) for task in tasks
    )


@pytest.mark.slow
@pytest.mark.process
def test_processes_end_with_a_command_that_is_killed(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from teleop.scenario.worker_pool import worker_pool\n"
        "from tests.teleop.scenario.test_worker_pool import note_and_wait\n"
        "with worker_pool(1) as pool: pool.submit(note_and_wait, Path(sys.argv[1])).result()\n"
    )
    (tmp_path / "program.py").write_text(
        f"if __name__ == '__main__':\n{''.join(f'    {line}' for line in program.splitlines(True))}"
    )
    with subprocess.Popen(
        [sys.executable, tmp_path / "program.py", tmp_path / "worker"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as command:
        written(tmp_path / "worker")
        command.kill()
        # The pipe is at its end when none is left who could write.
        assert command.communicate(timeout=20)[0] == b""


@pytest.mark.slow
@pytest.mark.process
def test_a_process_that_was_killed_is_said_in_a_line() -> None:
    with (
        pytest.raises(TeleopError, match="was killed, perhaps for want of memory"),
        worker_pool(1) as pool,
    ):
        pool.submit(end_at_once).result()
