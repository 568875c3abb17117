import { signal } from "@preact/signals";
import { afterEach, expect, it } from "vitest";
import { AlarmSound } from "../../../src/alarms/alarm_sound";
import { Alarms } from "../../../src/alarms/alarms";
import { AlarmBar, MuteButton } from "../../../src/panels/alarms/alarm_bar";
import { unknownState } from "../../../src/robot/robot_state";
import { mount, type Mounted } from "../mounted";

let page: Mounted;
afterEach(() => { page.unmount(); });

it("shows the alarms, tells them to screen readers, and shows whether the sound is off", async () => {
  const state = unknownState();
  let look = (): void => undefined;
  const kept = signal<string | null>(null);
  const alarms = new Alarms(state, undefined, () => undefined, {
    now: () => 0,
    every: (_, callback) => { look = callback; return () => undefined; },
    sound: new AlarmSound(() => new AudioContext()),
    vibrate: () => undefined,
    keeper: { getItem: () => kept.value, setItem: (_key, value) => { kept.value = value; } },
    onGesture: () => () => undefined,
  });
  page = await mount(<><AlarmBar alarms={alarms} /><MuteButton alarms={alarms} /></>);
  expect(page.root.querySelector("[role='alert']")?.textContent).toBe("");
  await page.act(() => {
    state.status.value = { stamp: 1, health: "lost", reasons: ["<i>carried</i>"], fit: 0, positionSigma: 9, headingSigma: 1 };
    look();
  });
  expect(page.root.querySelector("[data-kind='lost']")?.textContent).toContain("<i>carried</i>");
  expect(page.root.querySelector("[role='alert']")?.textContent).toContain("The robot is lost");
  expect(page.text()).toContain("Sound: any key");
  const button = page.root.querySelector("button");
  await page.act(() => { button?.click(); });
  expect(button?.getAttribute("data-muted")).toBe("true");
  expect(page.text()).toContain("Sound off");
  expect(kept.value).toBe("true");
  alarms.dispose();
});
