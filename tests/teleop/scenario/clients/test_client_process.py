"""The client's processes: whatever they do, none outlives the run, and nobody waits for them for long."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.scenario.session.client_process import ClientProcess
from tests.teleop.support import ROOT

pytestmark = pytest.mark.process

PATIENCE = 30.0
"""For anything that must come at all [s]; a loaded machine is no failure."""

DAEMON = """
import os, signal, time
if os.fork(): os._exit(0)
os.setsid()
if os.fork(): os._exit(0)
os.closerange(0, 3)
for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT): signal.signal(number, signal.SIG_IGN)
time.sleep(1000)
"""


def ended(process: ClientProcess) -> bool:
    """Return whether the command has ended, and all that it started."""
    process.look()
    return process.empty


def done(process: ClientProcess) -> bool:
    """Return whether nothing of the client is looked after any more."""
    process.look()
    return process.left is not None


def until(true: Callable[[], object], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, f"waited in vain: {what}"
        time.sleep(0.01)


def alive(marker: str) -> list[str]:
    """Return the processes with a text in their command line or environment, but for zombies and wardens."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            line = (folder / "cmdline").read_bytes()
            environment = (folder / "environ").read_bytes()
            if line and b"client_warden" not in line and marker.encode() in line + environment:
                found.append(folder.name)
        except OSError:
            pass
    return found


@contextmanager
def client(command: str, folder: Path, grace: float = 0.3) -> Iterator[tuple[ClientProcess, str]]:
    """Yield a client and a text that is in the environment of all that it starts; end it afterwards."""
    marker = f"marker-{os.urandom(8).hex()}"
    process = ClientProcess(command, {"MARKER": marker}, folder / "client.log")
    try:
        yield process, marker
        process.end(grace)
        until(lambda: done(process), "the end of the client")
        assert process.left == 0
        until(lambda: not alive(marker), "the end of what has been killed")
    finally:
        process.close()


def test_all_children_end_with_the_client(tmp_path: Path) -> None:
    with client("sleep 1000 & sleep 1000 & sleep 1000", tmp_path) as (_, marker):
        until(lambda: len(alive(marker)) == 4, "three children of a shell")


def test_a_client_is_asked_to_end_before_it_is_killed(tmp_path: Path) -> None:
    asked = "trap 'echo asked; exit 0' TERM; echo ready; while :; do sleep 0.05; done"
    log = tmp_path / "client.log"
    with client(asked, tmp_path, grace=20.0) as (process, _):
        until(lambda: "ready" in log.read_text(), "the client")
    assert "asked" in log.read_text()
    assert process.status == 0


def test_a_client_that_ignores_the_request_is_killed(tmp_path: Path) -> None:
    deaf = "trap '' TERM; echo ready; while :; do sleep 0.05; done"
    with client(deaf, tmp_path) as (process, _):
        until(lambda: "ready" in (tmp_path / "client.log").read_text(), "the client")
    assert process.status == -signal.SIGKILL


def test_a_daemon_without_environment_ends_too(tmp_path: Path) -> None:
    script = tmp_path / "daemon.py"
    script.write_text(DAEMON)
    with client(f"env -i {sys.executable} {script}", tmp_path) as (process, _):
        until(lambda: not ended(process) and process.status == 0, "the end of the shell")
        until(lambda: len(alive(str(script))) == 1, "the daemon")
        assert not process.empty
    assert alive(str(script)) == []


def test_a_client_that_multiplies_ends_too(tmp_path: Path) -> None:
    with client("f() { while :; do sleep 1000 & sleep 0.01; done; }; f & f", tmp_path) as (
        _,
        marker,
    ):
        until(lambda: len(alive(marker)) > 20, "many children")


def test_status_is_that_of_the_command(tmp_path: Path) -> None:
    for command, status in (("exit 0", 0), ("exit 7", 7), ("kill -11 $$", -11)):
        with client(command, tmp_path) as (process, _):
            until(lambda: ended(process), "the end of the command")
            assert process.status == status


def test_a_client_that_kills_its_warden_is_ended_all_the_same(tmp_path: Path) -> None:
    with client("kill -9 $PPID; sleep 1000", tmp_path) as (process, _):
        until(lambda: done(process), "the loss of the warden")


def test_a_silent_client_is_stopped_with_all_its_children_and_still_ends(tmp_path: Path) -> None:
    with client("sleep 1000 & exec sleep 1000", tmp_path) as (process, marker):
        until(lambda: len(alive(marker)) == 2, "a shell's child")
        process.kill(silent=True)
        until(lambda: _stopped(marker) == 2, "both stopped")
        assert process.killed
        assert process.status is None


def _stopped(marker: str) -> int:
    stats = [Path("/proc", number, "stat").read_text() for number in alive(marker)]
    return sum(stat.rpartition(")")[2].split()[0] == "T" for stat in stats)


def test_output_is_kept_and_its_last_lines_can_be_shown(tmp_path: Path) -> None:
    shown = r"yes x | head -c 100000; printf 'one\n\n\033[31mtwo\a\n\377\n'"
    with client(shown, tmp_path) as (process, _):
        until(lambda: ended(process), "the end of the command")
    assert process.tail(3) == ["one", "[31mtwo", "\N{REPLACEMENT CHARACTER}"]
    assert (tmp_path / "client.log").stat().st_size > 100_000


def test_a_client_has_no_terminal_and_no_open_files_of_ours(tmp_path: Path) -> None:
    with client("ls -l /proc/self/fd | grep -c '[0-9] -> '; cat", tmp_path) as (process, _):
        until(lambda: ended(process), "the end of the command")
    # The three of every program, and the folder that ls lists; grep's pipe is the second.
    assert process.tail() == ["4"]


def test_an_empty_command_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="the command is empty"):
        ClientProcess("  ", {}, tmp_path / "client.log")


RUN = """
    import sys
    from pathlib import Path
    from teleop.scenario.session.run import RunInterrupted
    from tests.teleop.scenario.clients.support import run, scenario
    try:
        run(Path(sys.argv[1]), sys.argv[2], scenario(patience=600.0))
    except RunInterrupted as interruption:
        print(interruption.outcome.ending)
"""


@pytest.mark.long
@pytest.mark.parametrize(("number", "said"), [(signal.SIGINT, "interrupted"), (signal.SIGKILL, "")])
def test_the_client_ends_with_the_run_however_that_ends(
    tmp_path: Path, number: signal.Signals, said: str
) -> None:
    marker = f"marker-{os.urandom(8).hex()}"
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(RUN), str(tmp_path), f"sleep 1000; : {marker}"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    ) as running:
        until(lambda: len(alive(marker)) >= 2, "the run and its client")
        running.send_signal(number)
        printed, _ = running.communicate(timeout=PATIENCE)
    assert said in printed
    until(lambda: not alive(marker), "the end of the client")
