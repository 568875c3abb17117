"""The built page in a real browser: where it connects to, and what its security policy has to refuse."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serving.lan_access import lan_access
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.console.conftest import Pages
from tests.teleop.robot.test_security import served
from tests.teleop.support import in_a_loop, soon

pytestmark = [pytest.mark.process, pytest.mark.slow]

HOSTILE = """
addEventListener('load', async () => {
  const inline = document.createElement('script');
  inline.textContent = 'window.inlineRan = true';
  document.body.append(inline);
  await fetch('http://127.0.0.1:1/').catch(() => {});
});
"""
"""What a script from the wire would do: run what it brings along, and send what it sees elsewhere."""


@in_a_loop
async def test_page_opens_and_connects_to_its_robot_only(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        served(office, office_cloud, cache, ServeConfig()) as robot,
        page_of(robot.url.replace("ws", "http", 1)) as visit,
    ):
        await soon(visit.page.wait_for_function("document.body.innerText.trim().length > 0"))
        await visit.page.wait_for_timeout(1000)
        assert visit.hosts == {urlsplit(robot.url).netloc}
        assert visit.violations == []
        assert visit.errors == []


@in_a_loop
async def test_policy_refuses_inline_scripts_and_other_hosts(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        served(office, office_cloud, cache, ServeConfig()) as robot,
        page_of(robot.url.replace("ws", "http", 1), scripts=[HOSTILE]) as visit,
    ):
        await visit.page.wait_for_timeout(1000)
        assert await visit.page.evaluate("window.inlineRan") is None
        refused = {violation.split()[0] for violation in visit.violations}
        assert refused >= {"script-src-elem", "connect-src"}


@in_a_loop
async def test_token_in_the_fragment_is_in_no_request(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    config, access = lan_access(ServeConfig(lan=True), tmp_path / "lan")
    async with served(office, office_cloud, cache, config) as robot:
        address = f"https://127.0.0.1:{robot.port}/#token={access.token}"
        async with page_of(address, ignore_https_errors=True) as visit:
            await soon(visit.page.wait_for_function("document.body.innerText.trim().length > 0"))
            await visit.page.wait_for_timeout(1000)
            assert visit.hosts == {f"127.0.0.1:{robot.port}"}
            sent = [path.partition("#")[0] for path in visit.paths]
            assert len(sent) >= 3
            assert [path for path in sent if access.token in path] == []
            assert await visit.page.evaluate("isSecureContext")
            assert visit.violations == []
