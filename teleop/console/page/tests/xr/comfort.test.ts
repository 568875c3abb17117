import { describe, expect, it } from "vitest";
import { comfortSettings, Vignette } from "../../src/xr/comfort";

function keeper(kept: string | null) {
  const held = { value: kept };
  return { held, keeper: { getItem: () => held.value, setItem: (_: string, value: string) => { held.value = value; } } };
}

describe("comfort", () => {
  it("darkens the rim by half within a few tenths of a second of motion, and clears it when that ends", () => {
    const rim = new Vignette();
    for (let passed = 0; passed < 400; passed += 14) {
      rim.update(14, 0.5, 0.5, 0);
    }
    expect(rim.covered).toBeGreaterThan(0.48);
    for (let passed = 0; passed < 500; passed += 14) {
      rim.update(14, 0.5, 0, 0);
    }
    expect(rim.covered).toBeLessThan(0.01);
    expect(rim.object.visible).toBe(false);
  });

  it("begins with the figures of its sources, and takes back what it kept, but no strength that there is not", () => {
    const first = { vignette: 0.5, turning: 30, cap: 0.75, turns: false, tilts: false };
    expect(comfortSettings(undefined).value).toEqual(first);
    expect(comfortSettings(keeper(JSON.stringify({ ...first, turning: 45 })).keeper).value.turning).toBe(45);
    expect(comfortSettings(keeper(JSON.stringify({ ...first, vignette: 9 })).keeper).value).toEqual(first);
  });
});
