from __future__ import annotations

import asyncio
import gc
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed.client import AllExit

from teleop.errors import SettingError
from teleop.scenario.session.run import run_scenario
from teleop.scenario.sweeps import dask_runs
from teleop.scenario.sweeps.cells import runs_of
from teleop.scenario.sweeps.dask_runs import results_of
from teleop.scenario.sweeps.dask_workers import Workers, client_of
from teleop.scenario.sweeps.sweep import sweep
from teleop.scenario.sweeps.sweep_folder import TABLE, SweepFolder
from tests.teleop.scenario.sweeps.support import cells, scenario

PEM = (Path("ca.pem"), Path("cert.pem"), Path("key.pem"))
FIELDS = ["link.delay"]


@pytest.mark.parametrize(
    "address",
    ["tls://cluster.example:8786", "tcp://127.0.0.1:8786", "tcp://localhost:8786", "tcp://[::1]:1"],
)
def test_addresses_on_this_machine_or_encrypted_are_taken(address: str) -> None:
    assert Workers(address=address).address == address


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"address": "tcp://192.168.0.7:8786"}, "only tls://"),
        ({"address": "tcp://cluster.example:8786"}, "only tls://"),
        ({"address": "tcp://127.0.0.1.example.org:8786"}, "only tls://"),
        ({"address": "cluster:8786"}, "give tls://HOST:PORT"),
        ({"address": "ws://127.0.0.1:8786"}, "give tls://HOST:PORT"),
        ({"address": "tls://host"}, "give tls://HOST:PORT"),
        ({"address": "tls://host:x"}, "give tls://HOST:PORT"),
        ({"count": 0}, "--workers must be >= 1"),
        ({"count": 2, "address": "tls://host:1"}, "has workers already"),
        ({"tls": PEM}, "are for --dask tls://"),
        ({"tls": PEM, "address": "tcp://127.0.0.1:1"}, "are for --dask tls://"),
    ],
)
def test_addresses_that_anybody_could_read_or_nobody_answers_are_refused(
    settings: dict[str, object], says: str
) -> None:
    with pytest.raises(SettingError, match=says):
        Workers(**settings)  # type: ignore[arg-type]


def test_a_scheduler_with_encryption_needs_certificates() -> None:
    runs = runs_of(cells("link.delay=0"), 1)
    with pytest.raises(SettingError, match="--tls-ca-file"):
        next(results_of(runs, Workers(address="tls://127.0.0.1:1"), beside=None))


@pytest.mark.process
@pytest.mark.parametrize(("error", "said"), [("AllExit", 0), ("OSError", 1)])
def test_a_result_that_nobody_waits_for_any_more_is_not_printed_and_a_defect_is(
    error: str, said: int, caplog: pytest.LogCaptureFixture
) -> None:
    async def end() -> None:
        raise {"AllExit": AllExit, "OSError": OSError}[error]

    async def leave() -> None:
        task = asyncio.ensure_future(end())
        await asyncio.sleep(0.1)
        del task
        gc.collect()

    with client_of(Workers(1), 1) as client:
        client.sync(leave)
    printed = [record for record in caplog.records if record.name == "asyncio"]
    assert len([record for record in printed if "never retrieved" in record.message]) == said


@pytest.mark.long
@pytest.mark.process
def test_two_workers_one_of_which_is_killed_write_the_same_table_as_one(tmp_path: Path) -> None:
    made = cells("link.delay=0,0.2", mission={"time_limit": 2.0})
    base = scenario(mission={"time_limit": 2.0})
    tables = []
    for count in (1, 2):
        folder = SweepFolder(tmp_path / str(count), base, FIELDS)
        killed: list[int] = []

        def kill_a_worker(share: float, text: str, killed: list[int] = killed) -> None:
            if text.startswith("run 2 of") and len(workers := _workers()) == 2:
                os.kill(workers[-1], signal.SIGKILL)
                killed.append(workers[-1])

        compute = lambda runs, count=count: results_of(runs, Workers(count), beside=None)  # noqa: E731
        done = sweep(made, 3, folder, compute, kill_a_worker)
        folder.close()
        assert len(killed) == count - 1
        assert len(done.rows) == 6
        assert done.costs.robot == pytest.approx(12.0)
        tables.append((tmp_path / str(count) / TABLE).read_bytes())
    assert tables[0] == tables[1]


@pytest.mark.process
def test_a_cluster_with_certificates_computes_the_same_as_this_machine(tmp_path: Path) -> None:
    from distributed import LocalCluster, Security

    security = Security.temporary()
    files = []
    for name in ("tls_ca_file", "tls_client_cert", "tls_client_key"):
        files.append(tmp_path / f"{name}.pem")
        files[-1].write_text(getattr(security, name))
    runs = runs_of(cells("link.delay=0,0.2"), 1)
    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        host="127.0.0.1",
        protocol="tls://",
        security=security,
        dashboard_address="127.0.0.1:0",
        processes=False,
    ) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        workers = Workers(address=address, tls=(files[0], files[1], files[2]))
        done = {run: result.sha256 for run, result in results_of(runs, workers, beside=None)}
    here = {run: run_scenario(run.scenario).sha256 for run in runs}
    assert done == here


def _workers() -> list[int]:
    """Return the processes of workers that this one has started."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes()
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        if parent == os.getpid() and b"spawn_main" in words:
            found.append(int(entry.name))
    return sorted(found)


def _ends(group: int) -> bool:
    """Return whether all processes of a group end within some seconds."""
    for _ in range(200):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.long
@pytest.mark.process
def test_ctrl_c_ends_all_workers_and_the_same_command_goes_on(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text(
        'format = 1\nname = "short"\nworld = {scene = "corridor"}\nmission = {time_limit = 2.0}\n'
    )
    words = ["sweep", str(file), "--over", "link.delay=0,0.1", "--stale", "on", "--workers", "1"]
    words += ["--seeds", "3", "--out", str(tmp_path / "out")]
    begun = subprocess.Popen(
        [sys.executable, "-m", "teleop", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    watchdog = threading.Timer(200.0, begun.kill)
    watchdog.start()
    journal = tmp_path / "out/runs.jsonl"
    while begun.poll() is None and not (journal.exists() and journal.stat().st_size):
        time.sleep(0.05)
    os.killpg(begun.pid, signal.SIGINT)
    text, _ = begun.communicate()
    watchdog.cancel()
    assert begun.returncode == 130, text
    assert "the same command goes on" in text
    assert "Traceback" not in text
    assert _ends(begun.pid)
    known = journal.read_text().count("\n")
    assert 1 <= known < 6
    second = subprocess.run(
        [sys.executable, "-m", "teleop", *words], capture_output=True, text=True, check=True
    )
    assert f"{known} of 6 runs were known before" in second.stdout
    assert journal.read_text().count("\n") == 6


@pytest.fixture
def cluster(
    tmp_path: Path,
) -> Iterator[tuple[str, subprocess.Popen[bytes], subprocess.Popen[bytes]]]:
    """Return the address of a scheduler that runs by itself, its process, and that of its worker."""
    file, own = tmp_path / "scheduler.json", [sys.executable, "-m"]
    words = ["--port", "0", "--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]
    scheduler = subprocess.Popen([*own, "distributed.cli.dask_scheduler", *words])
    words = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--scheduler-file", str(file)]
    words += ["--host", "127.0.0.1", "--local-directory", str(tmp_path)]
    worker = subprocess.Popen([*own, "distributed.cli.dask_worker", *words])
    try:
        for _ in range(600):
            if file.is_file() and file.read_text().rstrip().endswith("}"):
                break
            time.sleep(0.1)
        yield json.loads(file.read_text())["address"], scheduler, worker
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.wait()


@pytest.mark.long
@pytest.mark.process
@pytest.mark.parametrize("lost", ["scheduler", "worker"])
def test_a_sweep_whose_cluster_goes_away_ends_in_one_line(
    cluster: tuple[str, subprocess.Popen[bytes], subprocess.Popen[bytes]],
    lost: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    address, scheduler, worker = cluster
    monkeypatch.setattr(dask_runs, "_LOOK", 0.5)
    monkeypatch.setattr(dask_runs, "_PATIENCE_MIDWAY", 2.0)
    made = cells("link.delay=0,0.2", mission={"time_limit": 2.0})
    done = results_of(runs_of(made, 3), Workers(address=address), beside=None)
    first, result = next(done)
    assert result.sha256 == run_scenario(first.scenario).sha256
    (scheduler if lost == "scheduler" else worker).kill()
    says = {"scheduler": "the scheduler has gone", "worker": "all workers have gone, for 2 s"}
    with pytest.raises(SettingError, match=f"{says[lost]}; what is done is kept"):
        for _ in done:
            pass
