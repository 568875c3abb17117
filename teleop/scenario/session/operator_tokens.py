"""Tokens that are made for a run: of the operators of the library, if a scenario gives them roles, and of a client."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass

from teleop import clock
from teleop.robot.serving.server_setup import ROLES
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import Access, Role
from teleop.scenario.files.scenario import Scenario

WITNESS: Access = Access("", Role.VIEW, ROLES[Role.VIEW])
"""Access of who only looks on for the rules."""


@dataclass(frozen=True, slots=True)
class RunTokens:
    """Tokens of those who drive in one run, and what verifies them."""

    authenticator: Authenticator | None = None
    """Verifies them; None if nobody needs one."""
    tokens: tuple[str, ...] = ()
    """Token of each operator, or of the client under test."""

    def of(self, number: int) -> str | None:
        """Return the token of an operator, from 0; None if nobody needs one."""
        return self.tokens[number] if self.tokens else None


def made_token(access: Access) -> tuple[str, Credential]:
    """Return a new token that grants an access."""
    token = secrets.token_urlsafe(24)
    return token, Credential(access, digest=hashlib.sha256(token.encode()).digest())


def tokens_of(scenario: Scenario) -> RunTokens:
    """Return the tokens of a scenario's operators; one without a role operates."""
    if not scenario.roles:
        return RunTokens()
    roles = [Role(name) for name in (*scenario.roles, "operate")][:2]
    made = [
        made_token(Access(f"operator {number}", role, ROLES[role]))
        for number, role in enumerate(roles, 1)
    ]
    tokens, keys = zip(*made, strict=True)
    return RunTokens(Authenticator(Credentials(keys, rules=ROLES), clock.unix_seconds), tokens)
