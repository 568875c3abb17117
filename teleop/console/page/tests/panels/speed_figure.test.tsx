import { act } from "preact/test-utils";
import { render } from "preact";
import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { SpeedFigure } from "../../src/panels/driving/speed_figure";
import { pageClock } from "../../src/panels/use_now";
import { unknownState, type RobotState } from "../../src/robot/robot_state";

describe("the speed in the picture", () => {
  let state: RobotState;
  let root: HTMLElement;
  const show = (gear: "precision" | "normal" | "turbo" = "normal"): string => {
    void act(() => { render(<SpeedFigure state={state} gear={gear} />, root); });
    return root.textContent;
  };

  beforeEach(() => {
    state = unknownState();
    root = document.createElement("div");
    pageClock.value = () => 1000;
  });
  afterEach(() => { render(null, root); });

  it("is what was measured, beside what the gear allows", () => {
    state.motion.value = { linear: -0.234, angular: 0, receivedAt: 990 };
    expect(show()).toBe("−0.23 m/sup to 0.50");
    expect(show("turbo")).toContain("up to 0.70");
    expect(show("precision")).toContain("up to 0.17");
  });

  it("is unknown before there is any, and grey when it is old", () => {
    expect(show()).toContain("–");
    state.motion.value = { linear: 0.5, angular: 0, receivedAt: 100 };
    show();
    expect(root.firstElementChild?.className).toContain("panel-stale");
    expect(root.firstElementChild?.getAttribute("aria-label")).toContain("unknown");
  });

  it.each([[0.42, 0, "0.4 m ahead", "true"], [0.9, 1.6, "0.9 m left", "false"], [0.3, -3.1, "0.3 m behind", "true"], [2.5, 0, "", "false"]])(
    "says what is %f m away at %f rad", (distance, bearing, words, close) => {
      state.nearest.value = { distance, bearing, receivedAt: 990 };
      show();
      const near = root.querySelector(".driving-speed-near");
      expect(near?.textContent).toBe(words);
      expect(near?.getAttribute("data-close")).toBe(close);
    },
  );
});
