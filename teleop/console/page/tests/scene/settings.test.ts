import { fc, describe, expect, test } from "./tools";
import { LAYERS, sceneSettings, withLayer } from "../../src/scene/settings";
import type { Keeper } from "../../src/scene/stored_signals";

function keeper(kept: Record<string, string> = {}): Keeper & { readonly kept: Record<string, string> } {
  return {
    kept,
    getItem: (key) => kept[key] ?? null,
    setItem: (key, value) => { kept[key] = value; },
  };
}

const BROKEN: Keeper = {
  getItem: () => { throw new Error("blocked"); },
  setItem: () => { throw new Error("full"); },
};

describe("the settings of the picture", () => {
  test("are the defaults at first, with the theme of the system, and nothing is written for that", () => {
    const store = keeper();
    const settings = sceneSettings(store, true);
    expect(settings.theme.value).toBe("night");
    expect(sceneSettings(store, false).theme.value).toBe("day");
    expect(settings.view.value).toBe("chase");
    expect(LAYERS.filter((layer) => !settings.layers.value[layer])).toEqual(["map", "truth"]);
    expect(store.kept).toEqual({});
  });

  test("are there again after a reload", () => {
    const store = keeper();
    const before = sceneSettings(store, false);
    before.view.value = "top";
    before.theme.value = "night";
    before.pointSize.value = 2;
    before.decay.value = 0;
    before.layers.value = withLayer(before.layers.value, "truth", false);
    const after = sceneSettings(store, false);
    expect(after.view.value).toBe("top");
    expect(after.theme.value).toBe("night");
    expect(after.pointSize.value).toBe(2);
    expect(after.decay.value).toBe(0);
    expect(after.layers.value).toEqual(before.layers.value);
  });

  test("work where the storage throws or is missing", () => {
    for (const store of [BROKEN, undefined]) {
      const settings = sceneSettings(store, false);
      settings.view.value = "first";
      expect(settings.view.value).toBe("first");
    }
  });

  test("are valid whatever was kept", () => {
    fc.assert(fc.property(fc.oneof(fc.string(), fc.json()), (text) => {
      const kept = { "farsteer.view": text, "farsteer.theme": text, "farsteer.pointSize": text, "farsteer.decay": text, "farsteer.layers": text };
      const settings = sceneSettings(keeper(kept), false);
      expect(["chase", "top", "first"]).toContain(settings.view.value);
      expect(settings.pointSize.value).toBeGreaterThan(0);
      expect(settings.decay.value).toBeGreaterThanOrEqual(0);
      expect(Object.keys(settings.layers.value).sort()).toEqual([...LAYERS].sort());
      expect(Object.values(settings.layers.value).every((shown) => typeof shown === "boolean")).toBe(true);
    }));
  });
});
