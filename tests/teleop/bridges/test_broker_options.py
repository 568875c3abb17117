"""Options of the brokers: what is passed on to aiokafka, what is warned of, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from teleop.bridges.broker_options import BrokerOptions, is_loopback
from teleop.errors import SettingError
from teleop.secret_files import read_secret, trust


def test_addresses_and_login_are_passed_on(tmp_path: Path) -> None:
    assert BrokerOptions("one:9092, [::1]:9093").settings() == {
        "bootstrap_servers": ["one:9092", "[::1]:9093"],
        "security_protocol": "PLAINTEXT",
    }
    password = tmp_path / "password"
    password.write_text("s3cret\n")
    login: Any = {"sasl": "SCRAM-SHA-512", "sasl_user": "robot", "sasl_password_file": password}
    settings = BrokerOptions("one:9092", tls=True, **login).settings()
    assert settings.pop("ssl_context").check_hostname
    assert settings == {
        "bootstrap_servers": ["one:9092"],
        "security_protocol": "SASL_SSL",
        "sasl_mechanism": "SCRAM-SHA-512",
        "sasl_plain_username": "robot",
        "sasl_plain_password": "s3cret",
    }
    assert BrokerOptions("one:9092", **login).settings()["security_protocol"] == "SASL_PLAINTEXT"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"brokers": "one"}, "brokers must be HOST:PORT, separated by commas, got 'one'"),
        ({"brokers": "one:9092,:9092"}, "got ':9092'"),
        ({"brokers": "one:70000"}, "got 'one:70000'"),
        ({"sasl_user": "robot"}, "needs the mechanism of the login: --sasl PLAIN"),
        ({"sasl": "PLAIN", "sasl_user": "r"}, "needs --sasl-user and --sasl-password-file"),
        ({"broker_ca": Path("ca.pem")}, "add --tls"),
        ({"tls": True, "client_cert": Path("a.pem")}, "belong together"),
    ],
)
def test_options_that_do_not_fit_are_refused_by_name(options: Any, message: str) -> None:
    with pytest.raises(SettingError) as error:
        BrokerOptions(**{"brokers": "one:9092", **options})
    assert message in str(error.value)


def test_a_warning_names_what_is_missing_beyond_this_machine(tmp_path: Path) -> None:
    assert BrokerOptions("localhost:9092,127.0.0.2:9092,[::1]:9092").warning() is None
    assert "without --tls" in str(BrokerOptions("localhost:9092,far:9092").warning())
    assert "without --sasl or --client-cert" in str(BrokerOptions("far:9092", tls=True).warning())
    login: Any = {"sasl": "PLAIN", "sasl_user": "r", "sasl_password_file": tmp_path / "password"}
    assert BrokerOptions("far:9092", tls=True, **login).warning() is None
    assert [is_loopback(h) for h in ("LOCALHOST", "[::1]", "127.9.9.9")] == [True] * 3
    assert not any(is_loopback(h) for h in ("localhost.evil.example", "10.0.0.1", ""))


def test_files_of_secrets_and_certificates_are_refused_by_name(tmp_path: Path) -> None:
    assert read_secret(None, "token") is None
    assert trust(None) is None
    file = tmp_path / "file"
    with pytest.raises(SettingError, match=r"cannot read the token of .*file: No such file"):
        read_secret(file, "token")
    with pytest.raises(SettingError, match=r"cannot read the certificate .*file: No such file"):
        trust(file)
    with pytest.raises(SettingError, match=r"cannot read the certificate .*: Is a directory"):
        trust(tmp_path)
    for content in (b"", b"two\nlines\n", "ä".encode()):
        file.write_bytes(content)
        with pytest.raises(SettingError, match="file must hold a password, in one line of ASCII"):
            read_secret(file, "password")
    file.write_bytes(b"\xff")
    with pytest.raises(SettingError, match="it is no text"):
        read_secret(file, "password")
    with pytest.raises(SettingError, match=r"file holds no certificate \(PEM\)"):
        trust(file)
