"""The steps for CI in the documentation: what their shells do."""

import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]

SCENARIO = """\
format = 1
name = "{0}"
[mission]
time_limit = 1.0
[limits]
nees = {1}
"""

CLIENT = """\
import json, os, sys
from websockets.sync.client import connect
with connect(os.environ["FARSTEER_URL"]) as robot:
    robot.send(json.dumps({"op": "subscribe", "topic": "/scenario/state"}))
    for text in robot:
        if json.loads(text).get("msg", {}).get("phase") == "over":
            break
print("done")
"""


def documents() -> list[dict[str, Any]]:
    """Return the YAML files of the page: the action, a workflow that uses it, and that of GitLab."""
    page = (ROOT / "docs/ci.md").read_text(encoding="utf-8")
    texts = re.findall(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    return [YAML(typ="safe").load(text) for text in texts]


def action() -> dict[str, Any]:
    return documents()[0]


def job() -> dict[str, Any]:
    found: dict[str, Any] = documents()[2]["farsteer"]
    return found


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT],
        env={**os.environ, "FARSTEER_SKIP_CONSOLE": "1"},
        check=True,
        capture_output=True,
    )
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture
def runner(tmp_path: Path) -> dict[str, str]:
    """The environment of a runner: pip takes no dependencies, which are those of this environment."""
    (tmp_path / "bin").mkdir()
    python = tmp_path / "bin/python3"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    libraries = [sysconfig.get_paths()["purelib"], *(p for p in sys.path if "site-packages" in p)]
    return {
        "PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin",
        "HOME": str(tmp_path),
        "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")),
        "PYTHONPATH": ":".join(dict.fromkeys(libraries)),
        "PIP_NO_DEPS": "1",
        "PIP_NO_INDEX": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }


def bash(
    script: str, folder: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run a step as both services do."""
    return subprocess.run(
        ["/bin/bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_inputs_of_the_action_reach_its_shell_as_variables_only() -> None:
    shells = [step for step in action()["runs"]["steps"] if "run" in step]
    assert len(shells) == 2
    for step in shells:
        assert "${{" not in step["run"]
        for value in step["env"].values():
            assert re.fullmatch(r"\$\{\{ inputs\.(\w+) \}\}", value)[1] in action()["inputs"]  # type: ignore[index]


def test_the_workflow_gives_the_action_inputs_that_it_has() -> None:
    (step,) = [s for s in documents()[1]["jobs"]["drive"]["steps"] if "with" in s]
    assert set(step["with"]) <= set(action()["inputs"])
    assert {k for k, v in action()["inputs"].items() if v.get("required")} <= set(step["with"])


def test_reports_are_kept_whatever_the_verdict() -> None:
    assert action()["runs"]["steps"][-1]["if"] == "always()"
    assert job()["artifacts"]["when"] == "always"


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
@pytest.mark.timeout(300)
def test_the_steps_of_github_run_and_fail_with_the_scenario(
    wheel: Path, runner: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/far.toml").write_text(SCENARIO.format("far", "[1000.0, 2000.0]"))
    install, run, _ = action()["runs"]["steps"]
    runner |= {"RUNNER_TEMP": str(tmp_path / "temp"), "GITHUB_STEP_SUMMARY": str(tmp_path / "sum")}
    done = bash(install["run"], tmp_path, {**runner, "FARSTEER": f"{wheel}[sim]"})
    assert done.returncode == 0, done.stderr
    default = action()["inputs"]["scenarios"]["default"]
    done = bash(run["run"], tmp_path, {**runner, "SCENARIOS": default, "CLIENT": ""})
    assert done.returncode == 1, done.stderr
    assert "far       MISSED" in done.stdout
    summary = (tmp_path / "sum").read_text()
    assert summary.startswith("```\nscenario")
    assert summary.endswith("```\n")
    assert Xml.parse(tmp_path / "farsteer-run/junit.xml").getroot().get("failures") == "1"


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
@pytest.mark.timeout(300)
def test_the_steps_of_gitlab_run_a_client_of_several_words(
    wheel: Path, runner: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/near.toml").write_text(SCENARIO.format("near", "[0.0, 1000.0]"))
    (tmp_path / "client.py").write_text(CLIENT)
    given = {k: str(v) for k, v in job()["variables"].items()}
    assert given["SCENARIOS"] == "scenarios"
    given |= {"FARSTEER": f"{wheel}[sim]", "CLIENT": "python3 client.py --any 'two words'"}
    for line in [*job()["before_script"], *job()["script"]]:
        done = bash(line, tmp_path, {**runner, **given})
        assert done.returncode == 0, f"{line}: {done.stdout}{done.stderr}"
    assert "1 of 1 passed" in done.stdout
    kept = tmp_path / job()["artifacts"]["reports"]["junit"]
    assert Xml.parse(kept).getroot().get("failures") == "0"
    assert (tmp_path / "farsteer-run/client.log").read_text() == "done\n"
