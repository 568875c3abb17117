import { signal } from "@preact/signals";
import { render } from "preact";
import { act } from "preact/test-utils";
import { beforeEach, describe, expect, it } from "vitest";
import { Fold } from "../../src/page/fold";
import { Guarded } from "../../src/page/guarded";

let root: HTMLElement;

beforeEach(() => {
  root = document.createElement("div");
  document.body.replaceChildren(root);
});

describe("a part of the page that fails", () => {
  it("says so in its place while the others go on, and is shown again on request", async () => {
    const broken = signal(true);
    const Part = () => {
      if (broken.value) {
        throw new Error("no such number");
      }
      return <p>well</p>;
    };
    await act(() => {
      render(<><Guarded name="Link"><Part /></Guarded><p>another</p></>, root);
    });
    expect(root.textContent).toContain("no such number");
    expect(root.textContent).toContain("another");
    broken.value = false;
    await act(() => { root.querySelector("button")?.click(); });
    expect(root.textContent).toContain("well");
    expect(root.querySelector("[role=alert]")).toBeNull();
  });
});

describe("a fold", () => {
  it("opens by itself when it must be seen", async () => {
    await act(() => { render(<Fold title="Session"><p>inside</p></Fold>, root); });
    const details = root.querySelector("details");
    expect(details?.open).toBe(false);
    await act(() => { render(<Fold title="Session" open><p>inside</p></Fold>, root); });
    expect(details?.open).toBe(true);
  });
});
