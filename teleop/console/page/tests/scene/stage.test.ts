import { afterEach, describe, expect, test, vi } from "./tools";
import { Stage } from "../../src/scene/stage";

let draw: FrameRequestCallback = () => undefined;

afterEach(() => { vi.restoreAllMocks(); });

describe("the canvas", () => {
  test("is drawn with fewer pixels once frames that follow at once are slow, and with all again when asked to, or for one that is kept", () => {
    vi.spyOn(globalThis, "requestAnimationFrame").mockImplementation((frame) => {
      draw = frame;
      return 1;
    });
    const stage = new Stage(document.createElement("canvas"), () => {
      stage.setSharpness(stage.detail.sharpness);
      return true;
    });
    const { width, height, ratio } = stage.size;
    for (let now = 0; now < 3000; now += 120) { draw(now); }
    expect(stage.size).toEqual({ width, height, ratio: ratio / 2 });
    stage.invalidate(true);
    draw(3100);
    expect(stage.size).toEqual({ width, height, ratio });
    draw(3220);
    expect(stage.size).toEqual({ width, height, ratio: ratio / 2 });
    stage.setSharpness(1);
    expect(stage.size).toEqual({ width, height, ratio });
    stage.dispose();
  });

  test("is drawn with all its pixels, however long the pauses between frames that do not follow at once", () => {
    vi.spyOn(globalThis, "requestAnimationFrame").mockImplementation((frame) => {
      draw = frame;
      return 1;
    });
    const stage = new Stage(document.createElement("canvas"), () => false);
    for (let now = 0; now < 3000; now += 120) {
      stage.invalidate();
      draw(now);
    }
    expect(stage.detail.sharpness).toBe(1);
    stage.dispose();
  });
});
