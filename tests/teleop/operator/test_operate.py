"""The set-up of ``farsteer operate``."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.operator.operate import client_for, page_address
from teleop.operator.operate_config import OperateConfig


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


def test_a_token_that_another_program_has_saved_as_utf_16_is_refused_by_name(
    tmp_path: Path,
) -> None:
    file = tmp_path / "token"
    file.write_text("secret", encoding="utf-16")
    with pytest.raises(SettingError, match=r"cannot read the token of .*token: it is no text"):
        client_for(OperateConfig(token=file))
