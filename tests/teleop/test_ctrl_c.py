"""Ctrl-C while a command begins."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = str(Path(__file__).parents[2])


def run(folder: Path, code: str) -> str:
    """Run a program in a folder whose modules it can import; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.append({ROOT!r})\n{code}"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


WAIT = """
from teleop.ctrl_c import CtrlCHandler
import time
ctrl_c = CtrlCHandler()
ctrl_c.handle()
try:
    import interrupted
    time.sleep(60)
except KeyboardInterrupt:
    print(interrupted.complete, ctrl_c.raised)
"""


@pytest.mark.process
def test_ctrl_c_waits_for_the_end_of_an_import(tmp_path: Path) -> None:
    """Raised at once it would be lost here: Python drops what the callback of a weak reference raises."""
    (tmp_path / "interrupted.py").write_text(
        "import signal, weakref\n"
        "class Thing: pass\n"
        "thing = Thing()\n"
        "reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))\n"
        "del thing\n"
        "complete = True\n"
    )
    assert run(tmp_path, WAIT) == "True True\n"


@pytest.mark.process
def test_ctrl_c_that_was_dropped_is_raised_again_without_a_word(tmp_path: Path) -> None:
    (tmp_path / "interrupted.py").write_text("complete = True\n")
    drop = (
        "import signal, weakref\n"
        "    class Thing: pass\n"
        "    thing = Thing()\n"
        "    reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))\n"
        "    del thing\n"
        "    time.sleep(60)"
    )
    assert run(tmp_path, WAIT.replace("time.sleep(60)", drop)) == "True True\n"


@pytest.mark.process
def test_ctrl_c_ends_a_task_between_two_callbacks(tmp_path: Path) -> None:
    code = """
import asyncio, signal
from teleop.ctrl_c import CtrlCHandler, left_to_event_loops
CtrlCHandler().handle()
async def main():
    try:
        signal.raise_signal(signal.SIGINT)
        print("whole")
        await asyncio.sleep(60)
    finally:
        await asyncio.sleep(0)
        print("ended")
try:
    with left_to_event_loops(), asyncio.Runner() as runner:
        runner.run(main())
except KeyboardInterrupt:
    print("interrupted", type(signal.getsignal(signal.SIGINT).__self__).__name__)
"""
    assert run(tmp_path, code) == "whole\nended\ninterrupted CtrlCHandler\n"


@pytest.mark.process
def test_ctrl_c_outside_of_imports_is_raised_at_once(tmp_path: Path) -> None:
    (tmp_path / "interrupted.py").write_text("complete = True\n")
    code = WAIT.replace("time.sleep(60)", "__import__('signal').raise_signal(2); print('lost')")
    assert run(tmp_path, code) == "True True\n"


@pytest.mark.process
def test_error_into_which_compiled_code_turned_ctrl_c_is_reported_as_an_interruption(
    tmp_path: Path,
) -> None:
    code = """
import signal, sys
import teleop.__main__ as command
def converted(words):
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        pass
    raise TypeError("incompatible function arguments")
command._run = converted
sys.argv = ["farsteer", "sim"]
command.main()
"""
    assert run(tmp_path, code) == "\nfarsteer: interrupted\n"


@pytest.mark.process
def test_ctrl_c_that_is_ignored_stays_ignored(tmp_path: Path) -> None:
    """A shell starts its background commands so."""
    code = """
import signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
from teleop.ctrl_c import CtrlCHandler
ctrl_c = CtrlCHandler()
ctrl_c.handle()
signal.raise_signal(signal.SIGINT)
print(ctrl_c.raised)
"""
    assert run(tmp_path, code) == "False\n"
