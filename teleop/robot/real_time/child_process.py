"""A process of the robot, started and watched by control."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from teleop.clock import wall_seconds
from teleop.robot.real_time.channel import Channel, ChannelClosedError
from teleop.robot.real_time.process_messages import OTHER, Ready, pack, unpack


def stand_back(niceness: int) -> None:
    """Run behind the control process where processors are few, and never wait for a terminal.

    Args:
        niceness: How far, see ``nice``.
    """
    os.nice(niceness)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # a terminal may stop what is in the background


@contextmanager
def failing_to(channel: Channel, *expected: type[Exception]) -> Iterator[None]:
    """Send to control what ends this process; without a trace of its own if that is expected, or control has gone."""
    try:
        yield
    except ChannelClosedError:
        pass
    except expected as error:
        channel.send(pack(OTHER, error))
    except Exception as error:
        channel.send(pack(OTHER, error))
        raise


class ChildProcess:
    """A Python module that runs in a process of its own, joined by a channel."""

    def __init__(self, module: str, bound: int, inherited: int | None = None) -> None:
        """Start the process, which loads its libraries and waits for ``begin``.

        Args:
            module: The module; it gets the descriptor of its channel as its argument.
            bound: Bytes that may wait for it.
            inherited: Another descriptor that the process gets, as its second argument.
        """
        ours, theirs = socket.socketpair()
        with theirs:
            descriptors = [theirs.fileno(), *([] if inherited is None else [inherited])]
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, *map(str, descriptors)],
                pass_fds=descriptors,
                stdin=subprocess.DEVNULL,
                # Ctrl-C is for the parent, which ends its children in order. A session of its own would
                # do as well, but be a group of its own for Linux' scheduler (sched(7), autogroup),
                # between which nice values mean nothing.
                process_group=0,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )
        self.channel = Channel(ours, bound)

    def begin(self, setup: object) -> ChildProcess:
        """Send the first message, and return this.

        What has begun to be sent is never dropped, so it arrives, however large it is.
        """
        self.channel.send(pack(OTHER, setup))
        return self

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def ready(self) -> Ready:
        """Wait until the process has begun.

        Raises:
            Exception: What the process could not begin for.
            ChannelClosedError: If it died.
        """
        while True:
            for payload in self.channel.wait():
                value = unpack(payload)
                if isinstance(value, Exception):
                    raise value
                if isinstance(value, Ready):
                    return value

    def end(self, farewell: bytes, timeout: float = 5.0) -> bool:
        """Ask the process to end behind what waits for it; kill it if it does not within ``timeout`` [s].

        Returns:
            Whether it ended by itself.
        """
        end = wall_seconds() + timeout
        with contextlib.suppress(ChannelClosedError):
            self.channel.send(farewell)
            while (left := end - wall_seconds()) > 0.0:
                self.channel.wait(left)  # the kernel may take what waits only piece by piece
        try:
            self._process.wait(max(end - wall_seconds(), 0.0))
        except subprocess.TimeoutExpired:
            self.kill()
            return False
        self.channel.close()
        return True

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.wait()
        self.channel.close()
