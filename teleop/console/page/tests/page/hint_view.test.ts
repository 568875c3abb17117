/** The view from above comes with a hint and goes with it, unless a person chose another. */

import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";
import type { HintPhase, HintResult } from "../../src/hint/hint_state";
import { viewHintsFromAbove } from "../../src/page/hint_view";
import type { View } from "../../src/scene/settings";

function bench(first: View) {
  const [hint, view] = [signal<{ phase: HintPhase; result: HintResult | undefined }>({ phase: "off", result: undefined }), signal<View>(first)];
  viewHintsFromAbove(hint, view);
  return { view, go: (phase: HintPhase) => { hint.value = { phase, result: undefined }; },
    search: () => { hint.value = { phase: "answered", result: { kind: "search", answer: { success: true, message: "" } } }; }, };
}

describe("the view while a hint is placed", () => {
  test.each(["chase", "first"] as const)("is from above, and %s again once the robot has judged it", (first) => {
    const { view, go } = bench(first);
    go("placing");
    expect(view.value).toBe("top");
    go("placing");
    go("waiting");
    expect(view.value).toBe("top");
    go("answered");
    expect(view.value).toBe(first);
  });

  test("goes back when the hint is left", () => {
    const { view, go } = bench("chase");
    go("placing");
    go("off");
    expect(view.value).toBe("chase");
  });

  test("is from above while the whole map is searched, until the robot has found its place", () => {
    const { view, go, search } = bench("chase");
    search();
    expect(view.value).toBe("top");
    go("answered");
    expect(view.value).toBe("chase");
  });

  test("stays as a person chose it meanwhile", () => {
    const { view, go } = bench("chase");
    go("placing");
    view.value = "first";
    go("placing");
    expect(view.value).toBe("first");
    view.value = "top";
    go("off");
    expect(view.value).toBe("top");
  });

  test("stays from above if it was so before", () => {
    const { view, go } = bench("top");
    go("placing");
    go("off");
    expect(view.value).toBe("top");
  });
});
