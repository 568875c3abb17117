from __future__ import annotations

from pathlib import Path

import pytest

from teleop.__main__ import main

FILE = """\
format = 1
name = "short"
world = {scene = "corridor"}
mission = {time_limit = 1.0}
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "short.toml"
    path.write_text(FILE)
    return str(path)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "give --over FIELD=VALUES"),
        (("--over", "link.delay=0,1"), "say --stale on or --stale off"),
        (("--over", "link.jitter=0,1"), "say --stale on or --stale off"),
        (("--over", "link.dely=0,1", "--stale", "on"), "did you mean link.delay"),
        (("--over", "world.stale_limits=true", "--stale", "on"), "give one of them"),
        (("--over", "operator.speed=1", "--seeds", "0"), "--seeds must be >= 1"),
        (("--over", "operator.speed=1", "--workers", "0"), "--workers must be >= 1"),
        (("--over", "operator.speed=1", "--dask", "tcp://10.0.0.1:1"), "only tls://"),
        (("--over", "operator.speed=1", "--tls-cert", "x"), "are given together"),
    ],
)
def test_bad_input_is_refused_before_a_run_in_one_line(
    words: tuple[str, ...], says: str, file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", file, *words, "--out", str(tmp_path / "out")]) == 2
    text = capsys.readouterr().err
    assert says in text
    assert "Traceback" not in text
    assert not list(tmp_path.glob("out/*.parquet"))


def test_a_scenario_that_a_client_drives_is_not_swept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "client.toml"
    path.write_text(FILE + '[operator]\nkind = "client"\n')
    words = ["sweep", str(path), "--over", "world.alive=true,false", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    assert "operator of the library" in capsys.readouterr().err
