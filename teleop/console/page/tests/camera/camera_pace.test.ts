import { describe, expect, it } from "vitest";
import { FULL, paced, type PaceState } from "../../src/camera/camera_pace";

/** Look ten times a second for so long [s] at a page that is so late [ms]. */
function after(state: PaceState, lateness: number, seconds: number, wanted = false): PaceState {
  let present = state;
  for (let at = 0; at <= 1000 * seconds; at += 100) {
    present = paced(present, lateness, at, wanted);
  }
  return { ...present, lateSince: undefined, easySince: undefined };
}

describe("the camera's pictures", () => {
  it("are all shown by a page that keeps up, and by one that was late for a moment", () => {
    expect(after(FULL, 20, 60).pace).toBe("full");
    expect(after(after(FULL, 200, 2), 20, 1).pace).toBe("full");
  });

  it("become five a second, then none, on a page that stays late, and none stays none", () => {
    expect(after(FULL, 80, 5).pace).toBe("slow");
    const off = after(FULL, 80, 10);
    expect(off.pace).toBe("off");
    expect(after(off, 5, 60).pace).toBe("off");
  });

  it("are never none for a person who has asked for them", () => {
    expect(after(FULL, 80, 60, true).pace).toBe("slow");
  });

  it("are all shown again once the page has had time to spare for 20 s", () => {
    const slow = after(FULL, 80, 5);
    expect(after(slow, 10, 15).pace).toBe("slow");
    expect(after(slow, 40, 60).pace).toBe("slow");
    expect(after(slow, 10, 21).pace).toBe("full");
  });
});
