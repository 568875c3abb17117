"""Previews of hints: requests to the estimator, and its answers."""

from __future__ import annotations

from dataclasses import dataclass

from localization.types import Pose, Preview


@dataclass(frozen=True, slots=True, eq=False)
class PreviewRequest:
    """A client asks what the last sweep says of a pose."""

    number: int
    """Number of the request, unique among all."""
    client: int
    """Id of the client."""
    pose: Pose
    """The proposed ``map_from_base``."""


@dataclass(frozen=True, slots=True, eq=False)
class PreviewAnswer:
    """The answer to a request."""

    number: int
    """Number of the request."""
    preview: Preview | None = None
    """What was found; None if the pose could not be scored."""
    problem: str = ""
    """Why it could not, for people."""
