import { signal, type Signal } from "@preact/signals";
import { afterEach, beforeEach, expect, it } from "vitest";
import { NO_HINT, type HintState } from "../../../src/hint/hint_state";
import type { Reply } from "../../../src/link/service_calls";
import { PlaygroundPanel } from "../../../src/panels/playground/playground_panel";
import { mount, type Mounted } from "../mounted";

const OK = { result: { result: 1, error_message: "" } };

let answers: Record<string, object>;
let asked: [string, object][];
let view: Signal<HintState>;
let page: Mounted;

beforeEach(async () => {
  asked = [];
  answers = {
    get_available_worlds: { ...OK, worlds: [{ name: "office" }, { name: "warehouse" }] },
    get_current_world: { ...OK, world: { name: "office" } },
    get_simulation_state: { ...OK, state: { state: 1 } },
    set_simulation_state: OK, set_entity_state: OK, spawn_entity: OK, reset_simulation: OK,
    slip: { success: true, message: "" }, world: { success: true, message: "" },
  };
  view = signal<HintState>(NO_HINT);
  const wire = {
    call: (service: string, request: object): Promise<Reply> => {
      const name = service.replace("/playground/", "");
      asked.push([name, request]);
      const values = answers[name];
      return Promise.resolve(values === undefined ? { ok: false, words: "no such service", refused: true } : { ok: true, values });
    },
  };
  const tool = {
    view,
    begin: () => { view.value = { ...NO_HINT, phase: "placing" }; },
    cancel: () => { view.value = NO_HINT; },
  };
  page = await mount(<PlaygroundPanel wire={wire} tool={tool} run="1" />);
  await page.act(() => undefined);
  asked = [];
});

afterEach(() => { page.unmount(); });

async function press(words: string): Promise<void> {
  await page.act(() => { page.button(words).click(); });
  await page.act(() => undefined);
}

it("carries the robot to where the ghost was put, and sends no hint", async () => {
  await press("Choose a place");
  expect(page.button("Carry the robot").disabled).toBe(true);
  await page.act(() => { view.value = { ...NO_HINT, phase: "placing", pose: { x: 3, y: 4, yaw: Math.PI } }; });
  await press("Carry the robot");
  expect(asked).toHaveLength(1);
  expect(asked[0]).toMatchObject(["set_entity_state", { entity: "robot", state: { pose: { position: { x: 3, y: 4 }, orientation: { z: 1 } } } }]);
  expect(view.value.phase).toBe("off");
  expect(page.text()).toContain("Done.");
});

it("says why something was not done, by either form of an answer", async () => {
  answers["reset_simulation"] = { result: { result: 4, error_message: "the robot would stand inside wall_3" } };
  await press("Reset");
  expect(page.text()).toContain("Not done: the robot would stand inside wall_3");
  answers["slip"] = { success: false, message: "seconds must be 0 to 60" };
  await press("Wheels spin now");
  expect(page.text()).toContain("Not done: seconds must be 0 to 60");
  delete answers["slip"];
  await press("Wheels spin now");
  expect(page.text()).toContain("Not done: no such service");
});

it("pauses and goes on", async () => {
  await press("Pause");
  expect(page.text()).toContain("The world stands still.");
  await press("Go on");
  expect(asked.map(([, request]) => request)).toEqual([{ state: { state: 2 } }, { state: { state: 1 } }]);
  expect(page.text()).not.toContain("The world stands still.");
});

it("starts another scene with people and with furniture that has moved", async () => {
  const [, scene] = page.root.querySelectorAll("select");
  await page.act(() => {
    if (scene !== undefined) {
      scene.value = "warehouse";
      scene.dispatchEvent(new Event("change", { bubbles: true }));
    }
    page.root.querySelectorAll<HTMLInputElement>("input[type=checkbox]").forEach((box) => { box.click(); });
  });
  await press("Start there");
  expect(asked).toEqual([["world", { scene: "warehouse", people: true, rearranged: 1 }]]);
  expect(page.text()).toContain("the page comes back by itself");
});
