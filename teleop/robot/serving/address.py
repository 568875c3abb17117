"""Where clients find a robot that is served."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Address:
    """Where clients find the robot, and how it is guarded."""

    url: str
    """URL for clients on this machine."""
    host: str
    """Address that is listened on."""
    port: int
    """Port that is listened on."""
    encrypted: bool
    """Whether connections are encrypted."""
    tokens: bool
    """Whether clients need a token to drive."""
    lockstep: bool
    """Whether time is simulated."""
    page: bool = False
    """Whether the console page is served, and not only a line that says how to build it."""
    streams: str = ""
    """Address of the list of video streams; empty without a camera."""
