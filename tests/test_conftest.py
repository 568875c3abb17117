from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SKIPPING = """
import pytest

def test_skips():
    pytest.skip("no display")

@pytest.mark.xfail(reason="known")
def test_fails_as_expected():
    raise AssertionError
"""


def run(folder: Path, text: str, ci: str) -> subprocess.CompletedProcess[str]:
    (folder / "conftest.py").write_text(Path(__file__).with_name("conftest.py").read_text())
    (folder / "test_it.py").write_text(text)
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:dash", "-p", "no:cacheprovider", str(folder)],
        cwd=folder,
        env={**os.environ, "CI": ci},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "text", [SKIPPING, 'import pytest\npytest.importorskip("no_such_module")\n']
)
def test_skip_fails_in_ci_and_nowhere_else(tmp_path: Path, text: str) -> None:
    in_ci = run(tmp_path, text, "true")
    assert in_ci.returncode in (1, 2), in_ci.stdout
    assert "must not be skipped in CI" in in_ci.stdout
    at_home = run(tmp_path, text, "")
    assert at_home.returncode in (0, 5), at_home.stdout
