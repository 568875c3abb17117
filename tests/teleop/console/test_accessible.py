"""The page without a mouse and with assistive technology: axe-core's rules, and the keyboard alone."""

from __future__ import annotations

from typing import Any, Final

import pytest
from playwright.async_api import Page

from tests.teleop.console.conftest import Meets
from tests.teleop.console.hands import press, says
from tests.teleop.support import ROOT, in_a_loop

pytestmark = [
    pytest.mark.process,
    pytest.mark.slow,
    pytest.mark.usefixtures("page_tools"),
]

AXE: Final = ROOT / "teleop/console/page/node_modules/axe-core/axe.min.js"
SIZE: Final = {"width": 1280, "height": 720}
CONTROLS: Final = (
    "a[href], button, input, select, summary, textarea, [tabindex]:not([tabindex='-1'])"
)
LOOK: Final = """() => {
  const here = document.activeElement;
  if (here === null || here === document.body) return true;
  window.visited ??= new Set();
  window.unseen ??= [];
  const again = window.visited.has(here);
  window.visited.add(here);
  // A styled radio button or check box shows it by its label.
  const shown = [here, here.nextElementSibling, here.closest('label')].some((element) => {
    const { outlineStyle, outlineWidth } = element ? getComputedStyle(element) : { outlineStyle: 'none' };
    return outlineStyle !== 'none' && parseFloat(outlineWidth) >= 1;
  });
  if (!again && !shown) {
    window.unseen.push(here.outerHTML.slice(0, 120));
  }
  return !again;
}"""
"""Notes the element with the focus, and whether it shows that it has it; false once all have had it."""
MISSED: Final = """controls => [...document.querySelectorAll(controls)]
  .filter(element => element.checkVisibility() && !element.disabled && !window.visited.has(element))
  .filter(({ type, name }) => type !== 'radio' || ![...window.visited].some(other => other.name === name))
  .map(element => element.outerHTML.slice(0, 120))"""


async def findings(page: Page) -> list[str]:
    """Return what axe-core has to say, with the elements."""
    devtools = await page.context.new_cdp_session(page)
    # The page's policy does not concern the browser's own tools.
    await devtools.send("Runtime.evaluate", {"expression": AXE.read_text(encoding="utf-8")})
    answer = await devtools.send(
        "Runtime.evaluate",
        {"expression": "axe.run()", "awaitPromise": True, "returnByValue": True},
    )
    await devtools.detach()
    found: list[dict[str, Any]] = answer["result"]["value"]["violations"]
    return [
        f"{v['id']}: {n['html'][:150]} {n['failureSummary']}" for v in found for n in v["nodes"]
    ]


@pytest.mark.long
@in_a_loop
async def test_axe_finds_nothing_in_any_situation(meets: Meets) -> None:
    found: dict[str, list[str]] = {}
    async with meets(viewport=SIZE) as (_robot, page, _visit):
        await page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
        found["normal"] = await findings(page)
        await press(page, "Show where it is")
        found["hint"] = await findings(page)
        await page.keyboard.press("Escape")
        await press(page, "About")
        found["dialog"] = await findings(page)
        await page.keyboard.press("Escape")
        await press(page, "Gamepads")
        found["gamepads"] = await findings(page)
        await page.keyboard.press("Escape")
        await page.get_by_role("button", name="Emergency stop").click()
        await press(page, "Release e-stop")
        await says(page, "Are people and things clear")
        found["e-stop"] = await findings(page)
        await page.get_by_label("Night").or_(page.get_by_text("Night", exact=True)).first.click()
        found["e-stop at night"] = await findings(page)
        await press(page, "Release it")
        await says(page, "Ready", within=".driving-status")
        found["night"] = await findings(page)
        await page.set_viewport_size({"width": 390, "height": 780})
        found["narrow"] = await findings(page)
    lines = [f"{where}: {what}" for where, wrongs in found.items() for what in wrongs]
    assert not lines, "\n".join(lines)


@pytest.mark.long
@in_a_loop
async def test_every_control_is_reached_by_tab_and_shows_the_focus(meets: Meets) -> None:
    async with meets(viewport=SIZE) as (_robot, page, _visit):
        # A robot without a pose would offer a button for each place it may be at, whenever it finds one.
        await page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
        for _ in range(200):
            await page.keyboard.press("Tab")
            if not await page.evaluate(LOOK):
                break
        assert await page.evaluate(MISSED, CONTROLS) == []
        assert await page.evaluate("window.unseen") == []
        assert await page.evaluate("window.visited.size") > 20
