from __future__ import annotations

import json
from pathlib import Path

import pytest

from teleop.__main__ import main


@pytest.mark.long
@pytest.mark.slow
def test_the_command_shows_both_futures_side_by_side(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "fork"
    words = ["whatif", str(run), "--at", "1.5", "--blackout", "1.2", "--out", str(out)]
    assert main(words) == 1
    text = capsys.readouterr().out
    assert "The first 75 ticks, up to 1.5 s, are the same in both to the bit" in text
    assert "Closed loop" in text
    page = (out / "whatif.html").read_text()
    for words_of_page in ("as it was: passed", "with the fault: missed stops", "Closed loop"):
        assert words_of_page in page
    assert "<script" not in page
    assert (out / "whatif.rrd").read_bytes()[:4] == b"RRF2"
    assert (out / "whatif.rrd").stat().st_size > 100_000
    assert main(["scenario", "replay", str(out)]) == 0
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.slow
def test_a_clients_run_is_forked_open_loop_and_terminal_page_and_json_say_so(
    client_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["whatif", str(client_run), "--at", "1.5", "--kill"]
    assert main([*words, "--out", str(tmp_path / "text")]) == 1
    assert "OPEN LOOP" in capsys.readouterr().out
    assert "OPEN LOOP" in (tmp_path / "text/whatif.html").read_text()
    assert main([*words, "--out", str(tmp_path / "json"), "--json"]) == 1
    values = json.loads(capsys.readouterr().out)
    assert values["closed_loop"] is False
    assert values["as_it_was"]["status"] == "passed"
    assert values["with_the_fault"]["status"] == "missed"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "what is different?"),
        (("--delay", "-1"), "--delay: must be >= 0"),
        (("--slip", "99"), "--factor: must be <= 10"),
        (("--blackout", "-1"), "--lasting: must be >= 0"),
        (("--kidnap", "atlantis"), "no place 'atlantis'"),
        (("--kidnap", "1,2,3,4"), "give a name, X,Y or X,Y,HEADING"),
        (("--kidnap", "999,999"), "999"),
        (("--kill", "--out", "RUN"), "is the run itself"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    words: tuple[str, ...],
    says: str,
    run: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = [str(run) if word == "RUN" else word for word in words]
    out = [] if "--out" in words else ["--out", str(tmp_path / "fork")]
    assert main(["whatif", str(run), "--at", "1.5", *given, *out]) == 2
    text = capsys.readouterr().err
    assert says in text
    assert "Traceback" not in text


def test_a_folder_that_holds_no_run_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["whatif", str(tmp_path), "--at", "1", "--kill", "--out", str(tmp_path / "x")]) == 2
    assert "is not a run of a scenario" in capsys.readouterr().err
