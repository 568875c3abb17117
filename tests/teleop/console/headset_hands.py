"""A person who wears a headset: iwer's, which speaks WebXR to the page in Debian's Chromium without a window."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, Final

import pytest
from playwright.async_api import Page

from tests.teleop.support import PATIENCE, ROOT

IWER: Final = ROOT / "teleop/console/page/node_modules/iwer/build/iwer.min.js"
DEVICE: Final = """
(() => {
  const model = IWER[NAME];
  const given = CONTROLLERS;
  for (const one of given ? Object.values(model.controllerConfig.layout) : []) one.gamepad = given.gamepad;
  Object.assign(model.controllerConfig, given?.names);
  const device = new IWER.XRDevice(model, { stereoEnabled: true, ipd: 0.063 });
  device.installRuntime({ polyfillLayers: false, forceInstall: true });
  // What a real runtime does to a page, and iwer does not by itself: frames that do not come, spaces whose origin moves.
  const held = [];
  let frames = true;
  let count = 0;
  const request = XRSession.prototype.requestAnimationFrame;
  XRSession.prototype.requestAnimationFrame = function (callback) {
    // 25 a second, for software draws both eyes' pictures.
    if (frames) {
      count += 1;
      return setTimeout(() => { request.call(this, callback); }, 30);
    }
    held.push([this, callback]);
    return 0;
  };
  const spaces = [];
  const space = XRSession.prototype.requestReferenceSpace;
  XRSession.prototype.requestReferenceSpace = async function (type) {
    const found = await space.call(this, type);
    spaces.push(found);
    return found;
  };
  // iwer makes a rotation of any quaternion and calls all places guessed; runtimes hand on what they are given, and say.
  const [lying, guessed] = [new Set(), new Set()];
  const pulses = [];
  for (const [hand, { inputSource }] of Object.entries(device.controllers)) {
    for (const one of inputSource.gamepad.hapticActuators) {
      one.pulse = async (strength, duration) => { pulses.push({ hand, strength, duration }); return true; };
    }
  }
  const pose = XRFrame.prototype.getPose;
  XRFrame.prototype.getPose = function (of, base) {
    const found = pose.call(this, of, base);
    const isOf = (side) => [side.inputSource.gripSpace, side.inputSource.targetRaySpace].includes(of);
    if (!Object.values(device.controllers).some(isOf)) return found;
    const { position, orientation } = found.transform;
    const nothing = { x: 0, y: 0, z: 0, w: 0 };
    return {
      emulatedPosition: [...guessed].some(isOf),
      transform: { position, orientation: [...lying].some(isOf) ? nothing : orientation },
    };
  };
  window.worn = {
    device,
    get count() { return count; },
    pulses,
    model(hand, profiles, mapping) {
      const { inputSource } = device.controllers[hand];
      Object.defineProperty(inputSource, 'profiles', { value: profiles, configurable: true });
      Object.defineProperty(inputSource.gamepad, 'mapping', { value: mapping, configurable: true });
    },
    guess(hand, is) { guessed[is ? 'add' : 'delete'](device.controllers[hand]); },
    lie(hand, lies) { lying[lies ? 'add' : 'delete'](device.controllers[hand]); },
    frames(come) {
      frames = come;
      if (come) held.splice(0).forEach(([session, callback]) => request.call(session, callback));
    },
    reset(transform) {
      const event = new Event('reset');
      Object.defineProperty(event, 'transform', { value: transform });
      spaces.forEach((each) => each.dispatchEvent(event));
    },
    stick(hand, right, ahead) { device.controllers[hand].updateAxes('thumbstick', right, -ahead); },
    button(hand, name, value) { device.controllers[hand].updateButtonValue(name, value); },
    place(hand, x, y, z) { device.controllers[hand].position.set(x, y, z); },
    hands() { device.primaryInputMode = 'hand'; },
    pinch(hand, value) { device.hands[hand].updatePinchValue(value); },
    // Point a hand at a place of the room: its ray goes along -z.
    aim(hand, to) {
      const side = device.primaryInputMode === 'hand' ? device.hands[hand] : device.controllers[hand];
      const [x, y, z] = [to.x - side.position.x, to.y - side.position.y, to.z - side.position.z];
      const [yaw, pitch] = [Math.atan2(-x, -z), Math.atan2(y, Math.hypot(x, z))];
      const [cy, sy, cp, sp] = [Math.cos(yaw / 2), Math.sin(yaw / 2), Math.cos(pitch / 2), Math.sin(pitch / 2)];
      side.quaternion.set(cy * sp, sy * cp, -sy * sp, cy * cp);
    },
  };
})();
"""
PLAIN: Final = """
try { localStorage.setItem('farsteer.shown', JSON.stringify({ building: false, map: false, oldSweeps: false })); } catch {}
"""
CYCLES: Final = """async times => {
  const frame = () => new Promise((done) => { setTimeout(done, 30); });
  let entered = 0;
  for (let at = 0; at < times; at += 1) {
    document.querySelector('[aria-label="Enter VR"]').click();
    // Every third time the session ends before it has begun.
    for (let wait = 0; wait < 200 && !farsteerFigures().headset && at % 3 !== 2; wait += 1) await frame();
    entered += farsteerFigures().headset || at % 3 === 2 ? 1 : 0;
    while (!window.worn.device.activeSession) await frame();
    await window.worn.device.activeSession.end();
    for (let wait = 0; wait < 200 && !document.querySelector('[aria-label="Enter VR"]'); wait += 1) await frame();
  }
  return entered;
}"""
"""Goes in and out of the headset so often; returns how often it was in, or left before it was."""
POINTS_SHOWN: Final = (
    "try { localStorage.setItem('farsteer.shown', JSON.stringify({ map: true })); } catch {}"
)
FRAME: Final = 0.15
"""Time in which some frames come, on a loaded machine too [s]."""


VIVE: Final = """{
  names: { profileId: 'htc-vive', fallbackProfileIds: ['generic-trigger-squeeze-touchpad'] },
  gamepad: {
    mapping: 'xr-standard',
    buttons: [
      { id: 'trigger', type: 'analog', eventTrigger: 'select' }, { id: 'squeeze', type: 'analog', eventTrigger: 'squeeze' },
      { id: 'thumbstick', type: 'binary' }, null,
    ],
    axes: [{ id: 'thumbstick', type: 'x-axis' }, { id: 'thumbstick', type: 'y-axis' }, null, null],
  },
}"""
"""Controllers with a touch pad, which lies where others have nothing, and empty places where others have a stick."""


def headset(
    name: str = "metaQuest3", *, building: bool = False, controllers: str = "undefined"
) -> str:
    """Return the script of a headset: metaQuest3, metaQuest2, metaQuestPro, oculusQuest1 …

    Args:
        name: iwer's name of it.
        building: Whether the building is drawn, which without a graphics card takes a core.
        controllers: Other controllers than its own, such as ``VIVE``.
    """
    if not IWER.is_file():
        pytest.fail("iwer is not there: tools/build-console --dev fetches it")
    plain = "" if building else PLAIN
    device = DEVICE.replace("NAME", f"'{name}'").replace("CONTROLLERS", controllers)
    return IWER.read_text(encoding="utf-8") + device + plain


async def worn(page: Page, call: str, *arguments: object) -> Any:
    """Do something with the headset: ``worn(page, "button", "right", "squeeze", 1)``."""
    return await page.evaluate(f"given => window.worn.{call}(...given)", list(arguments))


async def figures(page: Page) -> dict[str, Any] | None:
    """Return what the page says of the headset; None while it shows nothing there."""
    found: dict[str, Any] | None = await page.evaluate(
        "() => { const it = farsteerFigures().headset; return it ? { ...it, keyAt: undefined, toRoom: undefined } : null; }"
    )
    return found


async def inside(
    page: Page, true: Callable[[dict[str, Any]], bool] = lambda _: True
) -> dict[str, Any]:
    """Wait until the headset shows the page, and what it shows is so."""
    found: dict[str, Any] | None = None
    try:
        async with asyncio.timeout(PATIENCE):
            while (found := await figures(page)) is None or not true(found):  # noqa: ASYNC110
                await asyncio.sleep(0.05)
    except TimeoutError:
        pytest.fail(f"waited in vain; the headset shows {found}")
    return found


async def enter(page: Page, mode: str = "VR") -> None:
    """Put the headset on."""
    await page.get_by_role("button", name=f"Enter {mode}").focus()
    await page.keyboard.press("Enter")
    await inside(page)


def grip(
    page: Page, forward: float = 0.9, turn: float = 0.0
) -> Callable[[bool], Awaitable[object]]:
    """Return a right hand that holds the grip and pushes the stick, or lets go of both."""

    async def hold(held: bool) -> None:
        await worn(page, "stick", "right", 0, 0)
        await worn(page, "button", "right", "squeeze", int(held))
        await asyncio.sleep(FRAME)
        if held:
            await worn(page, "stick", "right", -turn, forward)

    return hold


async def drives(page: Page, hold: Callable[[bool], Awaitable[object]]) -> None:
    """Hold what drives until the page says that it does, letting go and pressing again where it asks for that."""
    status = page.locator(".driving-status")
    try:
        async with asyncio.timeout(PATIENCE):
            while True:
                await hold(True)
                for _ in range(20):
                    await asyncio.sleep(0.1)
                    if "You drive" in await status.inner_text():
                        return
                await hold(False)
                await asyncio.sleep(2 * FRAME)
    except TimeoutError:
        pytest.fail(f"waited in vain to drive; the page says:\n{await status.inner_text()}")


async def tap(page: Page, hand: str, button: str) -> None:
    """Press a button of a controller and let go."""
    for value in (1, 0):
        await worn(page, "button", hand, button, value)
        await asyncio.sleep(FRAME)


async def aim(page: Page, hand: str, place: dict[str, float]) -> None:
    """Point a hand at a place of the operator's room [m]."""
    await worn(page, "aim", hand, place)
    await asyncio.sleep(FRAME)


async def aim_at_floor(page: Page, x: float, y: float, z: float) -> None:
    """Point the right hand at a place of the map [m]."""
    place = await page.evaluate(
        "([x, y, z]) => { const { x: a, y: b, z: c } = farsteerFigures().headset.toRoom(x, y, z);"
        " return { x: a, y: b, z: c }; }",
        [float(x), float(y), float(z)],
    )
    await worn(page, "aim", "right", place)
    await asyncio.sleep(FRAME)


async def aim_at_key(page: Page, hand: str, label: str) -> None:
    """Point at a key of a board as soon as it is there: boards are drawn from the first frame inside on."""
    find = "label => farsteerFigures().headset?.keyAt(label) ?? null"
    try:
        async with asyncio.timeout(PATIENCE):
            while (place := await page.evaluate(find, label)) is None:  # noqa: ASYNC110 - no event
                await asyncio.sleep(0.05)
    except TimeoutError:
        pytest.fail(f"no board has the key {label!r}: {(await figures(page) or {}).get('words')}")
    await aim(page, hand, place)


async def pinch_key(page: Page, label: str) -> None:
    """Point at a key of a board with an empty hand, and pinch."""
    await aim_at_key(page, "right", label)
    for value in (1, 0):
        await worn(page, "pinch", "right", value)
        await asyncio.sleep(FRAME)


async def press_key(page: Page, label: str, hand: str = "right", button: str = "trigger") -> None:
    """Point at a key of a board, and pull the trigger."""
    await aim_at_key(page, hand, label)
    await tap(page, hand, button)
