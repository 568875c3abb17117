"""What the client under test learns, and the token that it is given where tokens are required."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Final

from teleop import clock
from teleop.errors import SettingError
from teleop.robot.serving.server_setup import ROLES
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import read_credentials
from teleop.rosbridge.auth.permissions import Access, Role
from teleop.scenario.session.operator_tokens import RunTokens, made_token
from teleop.scenario.session.session import Session

TOKEN: Final = "FARSTEER_TOKEN"
"""Environment variable of the client's token."""
_HOLDER: Final = "client"
"""Holder of the token that a run makes."""


def access_with(tokens: Path | None) -> RunTokens:
    """Return the access to a robot whose clients need a token of a file.

    The client under test gets the token that ``FARSTEER_TOKEN`` holds already, so that it can be tried in any
    role. Without that it gets one of the role ``operate`` that is made for this run: those of the file stay out of
    logs and reports, and of those of which the file has the digest only nobody knows the text.

    Args:
        tokens: The file of tokens; None if none are required.

    Raises:
        ServerError: If the file cannot be read.
        SettingError: If ``FARSTEER_TOKEN`` holds a token that is not in the file.
    """
    if tokens is None:
        return RunTokens()
    credentials = read_credentials(tokens, ROLES).valid_at(clock.unix_seconds())
    token = os.environ.get(TOKEN, "")
    if not token:
        token, key = made_token(Access(_HOLDER, Role.OPERATE, credentials.rules[Role.OPERATE]))
        credentials = replace(credentials, keys=(*credentials.keys, key))
    elif credentials.find(token) is None:
        raise SettingError(
            f"{TOKEN} holds a token that is not in {tokens}; unset it, and the run makes one"
        )
    return RunTokens(Authenticator(credentials, clock.unix_seconds), (token,))


def environment_of(session: Session, pace: str, token: str) -> dict[str, str]:
    """Return what a client gets to know, as environment variables.

    Args:
        session: The session, whose server listens.
        pace: ``lockstep`` or ``real``.
        token: Its token; empty if none is required.
    """
    scenario, server = session.scenario, session.server
    return {
        "FARSTEER_URL": server.url,
        "FARSTEER_HOST": server.host,
        "FARSTEER_PORT": str(server.port),
        "FARSTEER_PAGE": f"http{server.url.removeprefix('ws')}/",
        TOKEN: token,
        "FARSTEER_SCENARIO": scenario.name,
        "FARSTEER_SEED": str(scenario.seed),
        "FARSTEER_PACE": pace,
        "FARSTEER_TIME_LIMIT": f"{scenario.mission.time_limit:g}",
        "FARSTEER_GOALS": json.dumps([[g.x, g.y, g.within] for g in session.referee.goals]),
        "FARSTEER_MAP": str(session.scene.map_file.resolve()),
    }
