import { signal } from "@preact/signals";
import { afterEach, beforeEach, expect, it } from "vitest";
import { LayersPanel } from "../../../src/panels/layers/layers_panel";
import { LegendPanel } from "../../../src/panels/layers/legend_panel";
import type { SceneSettings } from "../../../src/scene/settings";
import { mount, type Mounted } from "../mounted";

let settings: SceneSettings;
let page: Mounted;

beforeEach(() => {
  settings = {
    view: signal("chase"), theme: signal("day"), pointSize: signal(1), decay: signal(4), pathAhead: signal("late"),
    layers: signal({ building: true, map: true, cloud: true, oldSweeps: true, path: true, covariance: true, hypotheses: true, names: true, minimap: true, truth: true, grid: false }),
  };
});

afterEach(() => { page.unmount(); });

function field(label: string): HTMLInputElement {
  const found = [...page.root.querySelectorAll("label")].find(({ textContent }) => textContent.includes(label));
  const input = found?.querySelector("input") ?? page.root.querySelector<HTMLInputElement>(`#${CSS.escape(found?.htmlFor ?? "")}`);
  if (input === null) {
    throw new Error(`no field "${label}"`);
  }
  return input;
}

it("binds to the settings of the picture both ways", async () => {
  page = await mount(<LayersPanel settings={settings} />);
  await page.act(() => { field("Above").click(); });
  expect(settings.view.value).toBe("top");
  await page.act(() => { settings.view.value = "first"; });
  expect(field("On board").checked).toBe(true);
  await page.act(() => { field("Grid of metres").click(); });
  expect(settings.layers.value).toMatchObject({ grid: true, map: true });
  await page.act(() => {
    const slider = field("Size of the points");
    slider.value = "2.5";
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  expect(settings.pointSize.value).toBe(2.5);
  expect(page.text()).toContain("2.5 times");
});

it("offers lean pictures where the link has them, and no layer that the robot has nothing for", async () => {
  const lean = signal(false);
  page = await mount(
    <LayersPanel settings={settings} absent={["truth"]} lean={{ lean, setLean: (value) => { lean.value = value; } }} />,
  );
  expect(page.text()).not.toContain("True pose");
  await page.act(() => { field("Save bandwidth").click(); });
  expect(lean.value).toBe(true);
});

it("has a legend of the distances", async () => {
  page = await mount(<LegendPanel entries={[
    { distance: 0, colour: "rgb(0, 0, 255)" }, { distance: 0.2, colour: "rgb(255, 0, 0)" }, { distance: undefined, colour: "grey" },
  ]} />);
  expect([...page.root.querySelectorAll("li")].map(({ textContent }) => textContent)).toEqual(["0 cm", "20 cm or more", "unknown"]);
});
