"""The reports of a run in its folder."""

from pathlib import Path

from teleop.scenario.reports.run_reports import write_reports
from tests.teleop.scenario.reports.outcomes import EVIL, outcome


def test_all_reports_are_written(tmp_path: Path) -> None:
    write_reports(outcome(), tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"report.html", "outcome.json", "junit.xml"}
    assert "What the client printed" not in (tmp_path / "report.html").read_text()


def test_the_page_shows_the_end_of_what_the_client_printed(tmp_path: Path) -> None:
    lines = [*(f"line {i}" for i in range(100_000)), EVIL]
    (tmp_path / "client.log").write_bytes(b"\xff" + "\n".join(lines).encode())
    write_reports(outcome(), tmp_path)
    text = (tmp_path / "report.html").read_text()
    assert "What the client printed at last" in text
    assert "line 99999" in text
    assert "line 99900" not in text
    assert "<script>" not in text
    assert "\x1b" not in text
