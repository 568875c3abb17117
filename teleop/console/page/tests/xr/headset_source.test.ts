import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { FRAMES_MISSING, HeadsetSource } from "../../src/xr/headset_source";
import type { Side } from "../../src/xr/inputs";
import type { Joined } from "../../src/driving/driving_environment";
import { Harness } from "../driving/harness";

const LAYOUT = { squeeze: 1, stick: [2, 3] };
let page: Harness;
let joined: Joined;
let source: HeadsetSource;
let hand: { squeeze: boolean; axes: number[]; there: boolean };

/** Let frames come for so many ms. */
function frames(time: number): void {
  for (let passed = 0; passed < time; passed += 14) {
    const pad = { mapping: "xr-standard", axes: hand.axes, buttons: [{ pressed: false }, { pressed: hand.squeeze }] };
    source.frame({ hand: "right", pad: hand.there ? pad : undefined, layout: LAYOUT } as unknown as Side);
    page.wait(14);
  }
}

beforeEach(() => {
  page = new Harness();
  page.wait(50);
  hand = { squeeze: false, axes: [0, 0, 0, 0], there: true };
  source = new HeadsetSource(() => page.driving.now(), () => { joined.lose("controller"); });
  joined = page.driving.join(source);
  frames(100);
});
afterEach(() => { page.dispose(); });

function drive(): void {
  hand.squeeze = true;
  frames(100);
  hand.axes = [0, 0, -0.5, -1];
  frames(200);
}

describe("a headset's controller", () => {
  it("drives by its stick while its grip is held, also when another window has the keys", () => {
    window.dispatchEvent(new Event("blur"));
    frames(60);
    drive();
    expect(page.last).toMatchObject({ forward: 1, deadman: true });
    expect(page.last?.turn).toBeGreaterThan(0.3);
    hand.squeeze = false;
    frames(60);
    expect(page.last).toMatchObject({ forward: 0, turn: 0, deadman: false });
  });

  it("asks for no more than the cap", () => {
    source.cap = 0.4;
    drive();
    expect(page.last?.forward).toBeCloseTo(0.4, 6);
  });

  it.each([
    ["is gone", () => { hand.there = false; frames(60); hand.there = true; }],
    ["sends no frames", () => { page.wait(FRAMES_MISSING + 60); }],
    ["is taken off", () => { joined.lose("headset-off"); }],
  ])("that %s counts as let go until it was let go and held anew", (_, happens) => {
    drive();
    happens();
    expect(page.last?.deadman).toBe(false);
    expect(page.driving.stoppedBecause.value?.words).toMatch(/^Stopped: the (controller|headset)/);
    const sent = page.joys.length;
    frames(500);
    expect(page.movedSince(sent)).toBe(false);
    hand.squeeze = false;
    hand.axes = [0, 0, 0, 0];
    frames(100);
    drive();
    expect(page.last).toMatchObject({ forward: 1, deadman: true });
  });

  it("is an input no more once the headset is off", () => {
    drive();
    joined.leave();
    expect(page.last?.deadman).toBe(false);
    const sent = page.joys.length;
    frames(300);
    expect(page.movedSince(sent)).toBe(false);
  });
});
