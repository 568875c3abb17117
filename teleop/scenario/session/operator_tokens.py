"""Tokens of the operators of the library, for a scenario that gives them roles."""

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
class OperatorTokens:
    """Tokens that are made for one run, and what verifies them."""

    authenticator: Authenticator | None = None
    """Verifies them; None if nobody needs one."""
    tokens: tuple[str, ...] = ()
    """Token of each operator."""

    def of(self, number: int) -> str | None:
        """Return the token of an operator, from 0; None if nobody needs one."""
        return self.tokens[number] if self.tokens else None


def tokens_of(scenario: Scenario) -> OperatorTokens:
    """Return the tokens of a scenario's operators; one without a role operates."""
    if not scenario.roles:
        return OperatorTokens()
    roles = [Role(name) for name in (*scenario.roles, "operate")][:2]
    tokens = tuple(secrets.token_urlsafe(24) for _ in roles)
    keys = tuple(
        Credential(
            Access(f"operator {number}", role, ROLES[role]),
            digest=hashlib.sha256(token.encode()).digest(),
        )
        for number, (role, token) in enumerate(zip(roles, tokens, strict=True), 1)
    )
    authenticator = Authenticator(Credentials(keys, rules=ROLES), clock.unix_seconds)
    return OperatorTokens(authenticator, tokens)
