"""The ``farsteer`` command: its process, streams, errors and exit status.

At its top it imports nothing that takes time, so that Ctrl-C and closed streams find it ready.
"""

from __future__ import annotations

import gc
import os

# One thread per process keeps sums in one order, and so the bits; numpy reads this when imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# rerun warns of each file that it writes on request; it reads this when imported.
os.environ.setdefault("RUST_LOG", "error")
# MuJoCo would load a window library that asks another Python for its version; no command draws with it.
os.environ.setdefault("MUJOCO_GL", "disable")

import sys

from teleop.ctrl_c import CtrlCHandler


def main(arguments: list[str] | None = None) -> int:
    """Parse the command line, run the command and return the exit status."""
    ctrl_c = CtrlCHandler()
    try:
        if arguments is None:
            ctrl_c.handle()
        _open_streams()
        words = sys.argv[1:] if arguments is None else arguments
        return _version() if words == ["--version"] else _run(words)
    except KeyboardInterrupt:
        return _interrupted(leave=arguments is None)
    except BrokenPipeError:
        return 0
    except Exception as error:
        if ctrl_c.raised or _is_interruption(error):
            return _interrupted(leave=arguments is None)
        message = _user_error(error)
        if message is None:
            raise
        sys.stderr.write(f"\nfarsteer: {message}\n")
        return 2
    finally:
        _flush()
        if arguments is None:
            # The process ends: Python would look through all that was imported, for a third of a second, to free it.
            gc.freeze()


def _interrupted(leave: bool) -> int:
    """Say that the user ended the command; leave the process at once if it is the command's own."""
    sys.stderr.write("\nfarsteer: interrupted\n")
    if leave:
        # Python kills itself by the signal, at exit, if it interrupted the text of a dataclass or a named tuple.
        _flush()
        os._exit(130)
    return 130


def _is_interruption(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: modules of pybind11 turn it into an ``ImportError``."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _version() -> int:
    from importlib.metadata import version

    sys.stdout.write(f"farsteer {version('farsteer')}\n")
    return 0


def _run(words: list[str]) -> int:
    from collections.abc import Callable

    import tyro

    from teleop.command_line import CommandLine, help_text

    if words[:1] in (["--help"], ["-h"]):
        sys.stdout.write(f"{help_text()}\n")
        return 0
    line = tyro.cli(CommandLine, prog="farsteer", args=words)
    run: Callable[[], int] = line.command
    return run()


def _open_streams() -> None:
    """Open what was closed on nothing, and write to a terminal of few characters what it can show."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The lowest free number is taken: no file of a run shall be opened as standard output.
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = sys.stdout or os.fdopen(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = sys.stderr or os.fdopen(2, "w", encoding="utf-8", closefd=False)
    import codecs

    codecs.register_error("farsteer", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="farsteer")


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """Return a replacement for characters that a stream cannot encode, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    known = {"°": " deg", "²": "2", "±": "+-", "\u00d7": "x", "µ": "u", "…": "...", "•": "*"}
    text = "".join(known.get(c, "?") for c in error.object[error.start : error.end])
    return text, error.end


def _flush() -> None:
    """Write what the streams still hold; what nobody reads is dropped, without a word at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)


def _user_error(error: Exception) -> str | None:
    """Return the message of an error that the user can correct; None for a defect of the program."""
    if isinstance(error, tuple(_loaded_errors())):
        return str(error)
    if isinstance(error, OSError):
        return _system_error(error)
    if isinstance(error, ImportError) and error.name is None:
        return str(error)  # raised by a package that explains what to install
    if isinstance(error, ModuleNotFoundError):
        from localization.extras import EXTRAS, missing

        library = (error.name or "").partition(".")[0]
        return missing(library) if library in EXTRAS else None
    return None


def _system_error(error: OSError) -> str | None:
    """Return what the system refused, and of which file; None if it names no file and no full disk."""
    import errno

    if error.filename:
        return f"{error.filename}: {error.strerror or error}"
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
    return f"{error.strerror}" if full else None


def _loaded_errors() -> list[type[Exception]]:
    """Return the base errors of packages that are imported only when a command needs them."""
    families = (
        ("localization.errors", "LocalizationError"),
        ("robot_sim.errors", "SimulationError"),
        ("teleop.errors", "TeleopError"),
        ("teleop.rosbridge.errors", "RosbridgeError"),
    )
    # An error whose module was never imported cannot have been raised.
    return [getattr(sys.modules[m], name) for m, name in families if m in sys.modules]


if __name__ == "__main__":
    sys.exit(main())
