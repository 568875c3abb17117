import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { AttitudePanel, horizonTransform, tiltGrade } from "../../../src/panels/attitude/attitude_panel";
import { LocalizationPanel } from "../../../src/panels/attitude/localization_panel";
import { pageClock } from "../../../src/panels/use_now";
import { unknownState, type RobotState } from "../../../src/robot/robot_state";
import type { LocalizationStatus } from "../../../src/values";
import { mount, type Mounted } from "../mounted";

const degrees = Math.PI / 180;
let page: Mounted;
let state: RobotState;

beforeEach(() => {
  vi.useFakeTimers();
  pageClock.value = () => Date.now();
  state = unknownState();
});

afterEach(() => {
  page.unmount();
  vi.useRealTimers();
});

describe("the attitude", () => {
  it("is shown in degrees with its source, grey half a second after the last one", async () => {
    state.attitude.value = { roll: 5 * degrees, pitch: -2 * degrees, source: "/tf", receivedAt: Date.now() };
    page = await mount(<AttitudePanel state={state} />);
    expect(page.text()).toContain("5.0°");
    expect(page.text()).toContain("-2.0°");
    expect(page.text()).toContain("from /tf");
    expect(page.root.querySelector("svg")?.getAttribute("aria-label")).toBe("Horizon: roll 5.0°, pitch -2.0°");
    await page.act(() => { vi.advanceTimersByTime(750); });
    expect(page.root.querySelector("[data-stale='true']")).not.toBeNull();
    expect(page.text()).not.toContain("5.0°");
    expect(page.text()).toContain("unknown");
    expect(page.text()).toContain("750 ms old");
  });

  it("is unknown before the first, and if it is not finite", async () => {
    page = await mount(<AttitudePanel state={state} />);
    expect(page.text()).toContain("unknown");
    await page.act(() => { state.attitude.value = { roll: NaN, pitch: 0, source: "/tf", receivedAt: Date.now() }; });
    expect(page.text()).not.toContain("NaN");
  });

  it("turns the horizon left when the left side goes up, and raises it when the nose goes down", async () => {
    page = await mount(<AttitudePanel state={state} />);
    expect(horizonTransform({ roll: 10 * degrees, pitch: 0 })).toBe("rotate(-10.00) translate(0 0.00)");
    expect(horizonTransform({ roll: 0, pitch: 15 * degrees })).toBe("rotate(0.00) translate(0 -25.00)");
    expect(horizonTransform({ roll: 0, pitch: 80 * degrees })).toBe("rotate(0.00) translate(0 -50.00)");
  });

  it("has the alarms' colours", async () => {
    page = await mount(<AttitudePanel state={state} />);
    expect(tiltGrade({ roll: 5 * degrees, pitch: 0 })).toBe("green");
    expect(tiltGrade({ roll: 6 * degrees, pitch: 6 * degrees })).toBe("amber");
    expect(tiltGrade({ roll: 0, pitch: -16 * degrees })).toBe("red");
  });
});

describe("the place", () => {
  const status: LocalizationStatus = {
    stamp: 1, health: "suspect", reasons: ["<b>the map explains only 41%</b>"], fit: 0.41, positionSigma: 0.034, headingSigma: NaN,
  };

  function place(): void {
    const orientation = { x: 0, y: 0, z: 0, w: 1 };
    state.mapFromBase.value = { position: { x: 1, y: 2, z: 0 }, orientation, stamp: 1, receivedAt: Date.now() };
  }

  it("is said in words with reasons, sigmas and fit", async () => {
    page = await mount(<LocalizationPanel state={state} />);
    expect(page.text()).toContain("unknown");
    await page.act(() => {
      place();
      state.status.value = status;
    });
    expect(page.text()).toContain("In doubt where it is");
    expect(page.text()).toContain("<b>the map explains only 41%</b>");
    expect(page.text()).toContain("± 3.4 cm");
    expect(page.text()).toContain("41 % of what it sees");
    expect(page.text()).toContain("x 1.00 m, y 2.00 m, heading 0°");
    expect(page.text()).not.toContain("NaN");
  });

  it("has an old pose and no sigmas while the robot goes on without a pose", async () => {
    place();
    page = await mount(<LocalizationPanel state={state} />);
    await page.act(() => {
      vi.advanceTimersByTime(1000);
      state.status.value = { ...status, health: "relocalising", fit: 0, positionSigma: 0, headingSigma: 0 };
    });
    expect(page.text()).toContain("1.0 s old");
    expect(page.text()).not.toContain("0.0 cm");
    expect(page.root.querySelector(".panel-health")?.textContent).toBe("Searching for its place");
  });
});
