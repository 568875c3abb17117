"""The pytest plugin, in a pytest of its own."""

import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[3]
RunTests = Callable[[str], pytest.RunResult]
PLUGIN = "teleop.scenario.pytest_plugin"


@pytest.fixture
def run_tests(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> RunTests:
    """Return a function that runs tests with the plugin and returns their result."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))

    def run(text: str) -> pytest.RunResult:
        pytester.makepyfile(text)
        # Of an installed distribution pytest finds the plugin by itself.
        named = () if entry_points(group="pytest11", name="farsteer") else ("-p", PLUGIN)
        return pytester.runpytest_subprocess(*named, "-p", "no:dash", "-q", timeout=300)

    return run


def test_the_distribution_declares_the_plugin() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"farsteer": PLUGIN}


@pytest.mark.process
def test_the_plugin_imports_nothing_until_a_fixture_is_used(run_tests: RunTests) -> None:
    result = run_tests(
        """
        import sys

        def test_nothing_is_loaded(request):
            ours = {m for m in sys.modules if m.split(".")[0] in ("teleop", "localization", "robot_sim")}
            assert ours == {"teleop", "teleop.scenario", "teleop.scenario.pytest_plugin"}
            assert not {"numpy", "scipy", "mujoco", "pydantic", "websockets"} & set(sys.modules)

        def test_a_robot_loads_no_numpy_here(farsteer_robot):
            assert "teleop.scenario.robot_process" not in sys.modules
            import teleop.scenario.robot_process  # as the start of a robot does
            assert not {"numpy", "mujoco", "pydantic"} & set(sys.modules)
        """
    )
    result.assert_outcomes(passed=2)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
@pytest.mark.timeout(400)
def test_a_robot_is_stepped_carried_and_driven_by_a_client_that_blocks(run_tests: RunTests) -> None:
    result = run_tests(
        """
        import json, math, os, socket, time
        import pytest
        from websockets.sync.client import connect

        def test_lockstep(farsteer_robot):
            robot = farsteer_robot(at="library")
            assert robot.truth().stamp == 0
            assert robot.step(50).stamp == 1_000_000_000
            assert robot.truth().health == "tracking"
            twist = {"linear": {"x": 0.4}, "angular": {}}
            with connect(robot.url) as client:
                client.send(json.dumps({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}))
                # A stream of commands begins with a still hand.
                for speed in (0.0, 0.4, 0.4, 0.4, 0.4, 0.4):
                    twist["linear"]["x"] = speed
                    client.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": twist}))
                    state = robot.step(10)
            assert state.speed > 0.2
            there = robot.carry_to([24.2, 3.0, 90.0])
            assert (there.x, there.y) == (24.2, 3.0)
            assert math.degrees(there.heading) == pytest.approx(90.0)
            with pytest.raises(Exception, match="kitchen"):
                robot.carry_to("kitchenette")
            assert any(event.kind == "client" for event in robot.events())

        def test_the_same_seed_gives_the_same_bits(farsteer_robot):
            first, second = farsteer_robot(seed=4), farsteer_robot(seed=4)
            assert first.url != second.url
            assert first.step(30) == second.step(30)

        def call(client, service, args):
            client.send(json.dumps({"op": "call_service", "service": service, "args": args}))
            while True:
                message = json.loads(client.recv(timeout=30))
                if message["op"] == "service_response":
                    return message

        def test_the_referee_s_token_alone_opens_the_standard_s_services(farsteer_robot):
            robot = farsteer_robot(spares=True)
            with connect(robot.url) as client:
                assert not call(client, "/sim/step_simulation", {"steps": 5})["result"]
                assert robot.truth().stamp == 0
                client.send(json.dumps({"op": "auth", "token": robot.token}))
                assert call(client, "/sim/step_simulation", {"steps": 5})["result"]
                assert robot.truth().stamp == 100_000_000
                found = call(client, "/sim/get_spawnables", {})["values"]["spawnables"]
                assert len(found) == 5
            (tried,) = [event.text for event in robot.events() if event.kind == "violation"]
            assert "tried to use /sim/step_simulation" in tried

        def test_a_scene_of_one_s_own(farsteer_robot, tmp_path, monkeypatch):
            import pathlib, shutil, teleop
            office = pathlib.Path(teleop.__file__).parents[1] / "scenes" / "office"
            shutil.copytree(office, tmp_path / "own")
            monkeypatch.chdir(tmp_path)
            assert farsteer_robot("own").step().stamp == 20_000_000

        def test_real_time(farsteer_robot):
            robot = farsteer_robot(pace="real")
            begun = robot.truth().stamp
            time.sleep(1.0)
            assert 0.3e9 < robot.truth().stamp - begun < 3e9
            with pytest.raises(Exception, match="cannot be stepped"):
                robot.step()

        def test_a_robot_that_cannot_be_is_refused(farsteer_robot):
            with pytest.raises(Exception, match="world.alife: unknown field; did you mean alive"):
                farsteer_robot(world={"alife": True})

        def test_the_robot_ends_with_the_test(farsteer_robot, tmp_path_factory):
            (tmp_path_factory.getbasetemp() / "port").write_text(str(farsteer_robot().port))

        def test_it_has_ended(tmp_path_factory):
            port = int((tmp_path_factory.getbasetemp() / "port").read_text())
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", port))
        """
    )
    result.assert_outcomes(passed=8)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
def test_a_robot_ends_when_the_process_of_its_test_is_killed(tmp_path: Path) -> None:
    program = (
        "import os, signal\n"
        "from teleop.scenario.robot_process import RobotProcess\n"
        "s = {'format': 1, 'name': 'a', 'operator': {'kind': 'client'}}\n"
        "r = RobotProcess(s, 'lockstep')\n"
        "print(r._process.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    robot = Path("/proc") / done.stdout.strip()
    for _ in range(100):
        if not robot.exists() or "Z" in (robot / "stat").read_text().rpartition(")")[2].split()[:1]:
            return
        subprocess.run(["/bin/sleep", "0.1"], check=True)
    pytest.fail(f"process {robot.name} goes on")


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.process
@pytest.mark.timeout(200)
def test_scenarios_pass_or_fail_their_test_with_the_table(
    run_tests: RunTests, pytester: pytest.Pytester
) -> None:
    head = 'format = 1\nname = "{0}"\nmission.time_limit = 1.0\nlimits.{1}\n'
    for name, limit in {"passes": "contacts = 0", "misses": "nees = [1000.0, 2000.0]"}.items():
        (pytester.path / f"{name}.toml").write_text(head.format(name, limit))
    (pytester.path / "bad.toml").write_text("format = 1\n")
    result = run_tests(
        """
        import pytest
        from teleop.scenario.operators.operator import Operator

        class Still(Operator):
            def begin(self, wire, briefing):
                self.begun = True

            def act(self, wire, now):
                pass

        def test_passes(farsteer_scenario):
            operator = Still()
            outcome = farsteer_scenario("passes.toml", operator=operator, seed=9)
            assert outcome.status == 0
            assert operator.begun
            assert outcome.scenario.seed == 9

        def test_unchecked(farsteer_scenario):
            assert farsteer_scenario("misses.toml", operator=Still(), check=False).status == 1

        def test_misses(farsteer_scenario):
            farsteer_scenario("misses.toml", operator=Still())

        def test_bad(farsteer_scenario):
            farsteer_scenario("bad.toml")
        """
    )
    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines(
        [
            "misses    MISSED * 1.0 s *",
            "*NEES* limit 1000 to 2000",
            "*see */report.html",
            "*bad.toml:1: name: is missing: *",
        ]
    )
    result.stdout.no_fnmatch_line("*During handling*")


@pytest.mark.slow
@pytest.mark.process
def test_ctrl_c_during_a_scenario_ends_the_tests(
    run_tests: RunTests, pytester: pytest.Pytester
) -> None:
    (pytester.path / "short.toml").write_text('format = 1\nname = "a"\nmission.time_limit = 1.0\n')
    result = run_tests(
        """
        from teleop.scenario.operators.operator import Operator

        class Impatient(Operator):
            def begin(self, wire, briefing):
                pass

            def act(self, wire, now):
                raise KeyboardInterrupt

        def test_interrupted(farsteer_scenario):
            farsteer_scenario("short.toml", operator=Impatient(), check=False)

        def test_next():
            pass
        """
    )
    assert result.ret is pytest.ExitCode.INTERRUPTED
    result.assert_outcomes()
