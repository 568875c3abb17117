import { describe, expect, it } from "vitest";
import { hintKey } from "../../src/hint/hint_keys";
import { qualityOf } from "../../src/hint/hint_quality";
import { hintTexts } from "../../src/texts/hint";

const preview = (explained: number, present: number | undefined) => ({ pose: { x: 0, y: 0, yaw: 0 }, explained, present });

describe("the quality of a hint", () => {
  it("is good if the place explains enough and not clearly less than the present pose", () => {
    expect(qualityOf(preview(0.93, 0.41), false)).toBe("good");
    expect(qualityOf(preview(0.6, undefined), false)).toBe("good");
    expect(qualityOf(preview(0.85, 0.93), false)).toBe("good");
  });

  it("is bad if it explains little, or the present pose much more", () => {
    expect(qualityOf(preview(0.5, undefined), false)).toBe("bad");
    expect(qualityOf(preview(0.6, 0.95), false)).toBe("bad");
  });

  it("is unknown without a preview of this pose", () => {
    expect(qualityOf(undefined, false)).toBe("unknown");
    expect(qualityOf(preview(0.93, 0.41), true)).toBe("unknown");
    expect(qualityOf(preview(NaN, 0.41), false)).toBe("unknown");
  });

  it("is said in shares of what the scanner sees", () => {
    expect(hintTexts.preview(0.93, 0.41)).toBe("explains 93 % of what the scanner sees; the present pose 41 %");
    expect(hintTexts.preview(0.2, undefined)).toBe("explains 20 % of what the scanner sees; there is no present pose");
  });
});

describe("keys", () => {
  it("move along the map in the view from above, by 0.1 or 0.5 m", () => {
    expect(hintKey("ArrowUp", false)).toMatchObject({ type: "move", dy: 0.1 });
    expect(hintKey("ArrowDown", true)).toMatchObject({ type: "move", dy: -0.5 });
    const right = hintKey("ArrowRight", false);
    expect(right?.type === "move" ? right.dx : 0).toBeCloseTo(0.1);
    const left = hintKey("ArrowLeft", false);
    expect(left?.type === "move" ? left.dx : 0).toBeCloseTo(-0.1);
  });

  it("move as the screen shows it, if the view is turned", () => {
    const up = hintKey("ArrowUp", false, 0);
    expect(up).toEqual({ type: "move", dx: 0.1, dy: 0 });
  });

  it("turn left by Q and right by E, and know no others", () => {
    const q = hintKey("q", false);
    expect(q?.type === "turn" ? (q.angle * 180) / Math.PI : 0).toBeCloseTo(5);
    const e = hintKey("E", true);
    expect(e?.type === "turn" ? (e.angle * 180) / Math.PI : 0).toBeCloseTo(-5);
    expect(hintKey("w", false)).toBeUndefined();
    expect(hintKey(" ", false)).toBeUndefined();
  });
});
