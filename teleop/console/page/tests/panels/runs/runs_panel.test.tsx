import { afterEach, beforeEach, expect, it } from "vitest";
import { check } from "../../../src/link/message_checks/field";
import type { Kind } from "../../../src/link/message_intake";
import type { Stream } from "../../../src/link/subscriptions";
import { RunsPanel } from "../../../src/panels/runs/runs_panel";
import { unknownState } from "../../../src/robot/robot_state";
import { Runs } from "../../../src/runs/runs";
import type { Answer } from "../../../src/values";
import { mount, type Mounted } from "../mounted";

const NAME = "run-20261124-193000.mcap";
const RUN = { name: NAME, url: `/runs/${NAME}`, start: "2026-11-24T19:30:00Z", seconds: 62, bytes: 12_000_000, kept: false };

let stored: (typeof RUN)[];
let asked: [string, object][];
let said: string[];
let answer: Answer;
let state: (message: object) => void;
let file: () => Response;
let runs: Runs;
let page: Mounted;

beforeEach(async () => {
  [stored, asked, said] = [[RUN], [], []];
  answer = { success: true, message: "done" };
  runs = new Runs({
    wire: {
      stream: <T,>(_request: unknown, kind: Kind<T>) => {
        state = (message) => {
          const read = check((field) => kind.read(field, 0), { data: JSON.stringify(message) });
          if (read.ok) {
            kind.use(read.value, 0, "/runs/state");
          }
        };
        return {} as Stream;
      },
      listen: () => () => undefined,
      trigger: (service, request) => {
        if (request !== undefined) {
          asked.push([service, request]);
        }
        return Promise.resolve(answer);
      },
    },
    state: unknownState(), robot: "http://robot:9090", token: () => "", events: (_severity, words) => { said.push(words); },
    fetch: (url) => Promise.resolve(url.endsWith(NAME) ? file() : new Response(JSON.stringify({ runs: stored }))),
  });
  await show(true);
  await runs.refresh();
  await page.act(() => undefined);
});

afterEach(() => { page.unmount(); });

async function show(mayRecord: boolean): Promise<void> {
  page = await mount(<RunsPanel runs={runs} mayRecord={mayRecord} onLook={() => undefined} onPicture={() => undefined} />);
}

async function press(words: string): Promise<void> {
  await page.act(() => { page.button(words).click(); });
  await settled();
}

/** Until what was asked of the robot has been answered and shown. */
async function settled(): Promise<void> {
  await new Promise((resolve) => { setTimeout(resolve, 5); });
  await page.act(() => undefined);
}

it("deletes a run when that was asked twice, and lists what is left", async () => {
  await press(`Delete ${NAME}`);
  expect(asked).toEqual([]);
  await press("Leave it");
  await press(`Delete ${NAME}`);
  stored = [];
  await press("Delete for good");
  expect(asked).toEqual([["/runs/delete", { name: NAME }]]);
  expect(said).toEqual(["done"]);
  expect(page.text()).toContain("No runs have been recorded yet.");
});

it("keeps a run and shows that it is kept", async () => {
  stored = [{ ...RUN, kept: true }];
  await press(`Keep ${NAME} when room is made`);
  expect(asked).toEqual([["/runs/keep", { name: NAME, keep: true }]]);
  expect(page.button(`Keep ${NAME} when room is made`).getAttribute("aria-pressed")).toBe("true");
});

it("says why the robot did not", async () => {
  answer = { success: false, message: "role view may not call /runs/delete" };
  await press(`Delete ${NAME}`);
  await press("Delete for good");
  expect(said).toEqual(["Not done: role view may not call /runs/delete."]);
});

it("offers neither to those who may not drive", async () => {
  page.unmount();
  await show(false);
  expect(page.root.querySelectorAll("li button").length).toBe(2);
  expect(page.text()).not.toContain("Delete");
});

it("names the runs that made room, and lists anew", async () => {
  stored = [];
  await page.act(() => { state({ recording: "", ended: "", removed: [NAME] }); });
  await settled();
  expect(said).toEqual([`${NAME} made room for newer runs. Keep those that must stay.`]);
  expect(runs.list.value).toEqual([]);
});

it("says that a run did not arrive whole", async () => {
  file = () => Object.assign(new Response(), { blob: () => Promise.reject(new TypeError("network error")) });
  await press(`Look at ${NAME}`);
  expect(said).toEqual(["The runs could not be fetched: TypeError: network error."]);
});
