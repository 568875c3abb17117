"""The page's own tests and its lock file."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "teleop/console/page"


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
def test_unit_tests_of_the_page_pass() -> None:
    tool = [sys.executable, str(ROOT / "tools/build-console"), "--fetch-node", "--dev", "test"]
    done = subprocess.run(tool, cwd=ROOT, capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]


def test_lock_file_names_no_address() -> None:
    lock = json.loads((PAGE / "package-lock.json").read_text(encoding="utf-8"))
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert len(packages) > 10
    assert [name for name, entry in packages.items() if "resolved" in entry] == []
    assert [name for name, entry in packages.items() if "integrity" not in entry] == []
    options = (PAGE / ".npmrc").read_text(encoding="utf-8").splitlines()
    assert "omit-lockfile-registry-resolved=true" in options


def test_what_the_page_is_made_of_is_named_by_exact_versions() -> None:
    package = json.loads((PAGE / "package.json").read_text(encoding="utf-8"))
    versions = {**package["dependencies"], **package["devDependencies"]}
    assert all(version[0].isdigit() for version in versions.values())
