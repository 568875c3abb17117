import { afterEach, expect, it, vi } from "vitest";
import { keepAwake, rememberedGear } from "../../src/page/hands";
import { unknownState } from "../../src/robot/robot_state";

afterEach(() => { localStorage.clear(); });

it("keeps the gear for the next visit, and begins as normal where what was kept is no gear", () => {
  localStorage.setItem("farsteer.gear", "\"warp\"");
  const gear = rememberedGear();
  expect(gear.value).toBe("normal");
  gear.value = "precision";
  expect(rememberedGear().value).toBe("precision");
});

it("keeps the screen awake while a robot is connected and the page is seen, and lets it sleep otherwise", async () => {
  const [state, release] = [unknownState(), vi.fn(() => Promise.resolve())];
  const request = vi.fn(() => Promise.resolve({ release } as unknown as WakeLockSentinel));
  const page = new EventTarget() as unknown as { visibilityState: string } & EventTarget;
  page.visibilityState = "visible";
  const show = (visibility: string): void => {
    page.visibilityState = visibility;
    page.dispatchEvent(new Event("visibilitychange"));
  };
  keepAwake(state, { wakeLock: { request } }, page as unknown as Document);
  expect(request).not.toHaveBeenCalled();
  state.connection.value = { phase: "open", words: "", sinceAt: 0 };
  expect(request).toHaveBeenCalledTimes(1);
  show("hidden");
  await Promise.resolve();
  await Promise.resolve();
  expect(release).toHaveBeenCalledTimes(1);
  show("visible");
  expect(request).toHaveBeenCalledTimes(2);
  state.connection.value = { phase: "lost", words: "", sinceAt: 1 };
  await Promise.resolve();
  await Promise.resolve();
  expect(release).toHaveBeenCalledTimes(2);
});

it("goes on where the browser has no such lock, or refuses it", () => {
  const state = unknownState();
  keepAwake(state, {}, document);
  keepAwake(state, { wakeLock: { request: () => Promise.reject(new Error("battery")) } }, document);
  state.connection.value = { phase: "open", words: "", sinceAt: 0 };
  expect(state.connection.value.phase).toBe("open");
});
