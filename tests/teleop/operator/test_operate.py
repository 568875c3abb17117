"""The set-up of ``farsteer operate``."""

from __future__ import annotations

import pytest

from teleop.operator.operate import page_address


@pytest.mark.parametrize(
    ("url", "page"),
    [
        ("ws://127.0.0.1:9090", "http://127.0.0.1:9090/"),
        ("wss://robot:9443/?token=secret", "https://robot:9443/"),
        ("ws://[::1]:9090/", "http://[::1]:9090/"),
    ],
)
def test_page_is_at_the_robots_address_without_its_token(url: str, page: str) -> None:
    assert page_address(url) == page
