"""The built page in a real browser: where it connects to, and what its security policy has to refuse."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from localization.maps.cloud import Cloud
from teleop.robot.serving.lan_access import lan_access
from teleop.robot.serving.serve_config import ServeConfig
from tests.teleop.console.conftest import Meets, Pages, Served, page_address
from tests.teleop.console.hands import until
from tests.teleop.console.plain_robots import console_for
from tests.teleop.robot.served_robots import DRIVER, tokens
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
async def test_page_opens_and_connects_to_its_robot_only(page_of: Pages, served: Served) -> None:
    async with (
        served() as robot,
        page_of(page_address(robot)) as visit,
    ):
        await soon(visit.page.get_by_text(re.compile(r"\S")).first.wait_for())
        await visit.page.wait_for_timeout(1000)
        assert visit.hosts == {urlsplit(robot.url).netloc}
        assert visit.violations == []
        assert visit.errors == []


@in_a_loop
async def test_policy_refuses_inline_scripts_and_other_hosts(
    page_of: Pages, served: Served
) -> None:
    async with (
        served() as robot,
        page_of(page_address(robot), scripts=[HOSTILE]) as visit,
    ):

        def refused() -> bool:
            return {"script-src-elem", "connect-src"} <= {v.split()[0] for v in visit.violations}

        await until(refused, "that the policy refuses both")
        assert await visit.page.evaluate("window.inlineRan") is None


@in_a_loop
async def test_token_in_the_fragment_is_in_no_request(
    page_of: Pages, served: Served, tmp_path: Path
) -> None:
    config, access = lan_access(ServeConfig(lan=True), tmp_path / "lan")
    async with served(config) as robot:
        address = f"{page_address(robot)}#token={access.link}"
        async with page_of(address, ignore_https_errors=True) as visit:
            await soon(visit.page.get_by_text(re.compile(r"\S")).first.wait_for())
            await visit.page.wait_for_timeout(1000)
            assert visit.hosts == {f"127.0.0.1:{robot.port}"}
            sent = [path.partition("#")[0] for path in visit.paths]
            assert len(sent) >= 3
            assert [path for path in sent if access.link in path] == []
            assert await visit.page.evaluate("isSecureContext")
            assert visit.violations == []


BAR = """() => {
  const parts = [...document.querySelector('.page-bar').children];
  return parts.slice(parts.findIndex((part) => part.className === 'page-space') + 1).map((part) => {
    const { x, width } = part.getBoundingClientRect();
    return [x, width];
  });
}"""
"""Where what stands on the right of the bar begins, and how wide it is [CSS pixels]."""


@in_a_loop
async def test_nothing_in_the_bar_moves_when_the_first_key_unlocks_the_sound(
    page_of: Pages, served: Served
) -> None:
    async with (
        served() as robot,
        page_of(page_address(robot), viewport={"width": 1280, "height": 800}) as visit,
    ):
        page = visit.page
        await soon(page.get_by_text("Sound: any key").wait_for())
        await soon(page.get_by_role("button", name="First drive").wait_for())
        before = await page.evaluate(BAR)
        await page.keyboard.press("Shift")
        await soon(page.get_by_text("Sound on").wait_for())
        assert len(before) > 3
        assert await page.evaluate(BAR) == before


OVERLAPS = """() => {
  const names = ['.driving-stick', '.driving-speed', '.driving-gears', '.driving-estop-button'];
  const boxes = names.map((name) => [name, document.querySelector(name).getBoundingClientRect()]);
  const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
  return boxes.flatMap(([a, box], i) => boxes.slice(i + 1).filter(([, other]) => !apart(box, other)).map(([b]) => [a, b]));
}"""
"""Which two of the controls over the picture lie over one another."""


@in_a_loop
async def test_no_control_lies_over_another_in_any_window(meets: Meets) -> None:
    async with meets(placed=False) as (robot, page, _visit):
        robot.place()
        await soon(page.locator(".driving-speed-near:not(:empty)").wait_for())
        for width, height in ((1280, 800), (1000, 640), (820, 1180), (844, 390), (390, 844)):
            await page.set_viewport_size({"width": width, "height": height})
            await page.wait_for_timeout(200)
            assert await page.evaluate(OVERLAPS) == [], (width, height)


REACH = """async ([socket, map, token]) => {
  const opened = await new Promise(done => {
    const trial = new WebSocket(socket);
    trial.onopen = () => { trial.close(); done(true); };
    trial.onerror = () => done(false);
  });
  const headers = { Authorization: `Bearer ${token}` };
  const answer = await fetch(map, { headers }).catch(() => null);
  return [opened, answer && answer.status, answer && answer.headers.get("ETag")];
}"""
"""Opens a WebSocket, and fetches a map with a token, as the page's scripts may."""


@in_a_loop
async def test_page_of_another_server_reaches_its_robot_and_no_other(
    page_of: Pages, served: Served, office_cloud: Cloud, tmp_path: Path
) -> None:
    config = ServeConfig(tokens=tokens(tmp_path))
    async with served(config) as robot, served(config) as other:
        with console_for(robot.url) as console:
            async with page_of(console) as visit:
                reached = []
                for address in (robot.url, other.url):
                    file = f"{address.replace('ws', 'http', 1)}/map.ply"
                    reached.append(await visit.page.evaluate(REACH, [address, file, DRIVER]))
                assert reached == [[True, 200, f'"{office_cloud.sha256}"'], [False, None, None]]
                assert {v.split()[0] for v in visit.violations} == {"connect-src"}
