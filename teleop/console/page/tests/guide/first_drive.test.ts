import { signal } from "@preact/signals";
import { beforeEach, expect, test } from "vitest";
import { Carrier } from "../../src/guide/carrier";
import { FirstDrive } from "../../src/guide/first_drive";
import type { Reply } from "../../src/link/service_calls";
import { unknownState, type RobotState } from "../../src/robot/robot_state";
import type { ControlState, HintVerdict, LocalizationStatus, Session } from "../../src/values";

let state: RobotState;
let asked: { readonly service: string; readonly request: object }[];

beforeEach(() => {
  state = unknownState();
  asked = [];
});

const at = (x: number, y: number): object => ({ pose: { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });

function firstDrive(poses: Reply = { ok: false, words: "no such service", refused: true }, closed = false): FirstDrive {
  const carrier = new Carrier({
    call: (service, request) => {
      asked.push({ service, request });
      return Promise.resolve(service.endsWith("poses") ? poses : { ok: true, values: { result: { result: 1, error_message: "" } } });
    },
  }, state);
  state.dialect.value = "farsteer";
  state.session.value = { mayDrive: true } as Session;
  state.run.value = "run:1";
  return new FirstDrive(state, carrier, signal(closed));
}

const moves = (linear: number, angular = 0): void => { state.motion.value = { linear, angular, receivedAt: 0 }; };
const follows = (linear: number, estop = false): void => { state.control.value = { linear, angular: 0, estop } as ControlState; };

test("each task is ticked in its turn by what the robot reports, and by no command alone", () => {
  const guide = firstDrive();
  follows(0.5);
  expect(guide.next.value).toBe("forward");
  moves(0, 0.5);
  expect(guide.next.value).toBe("forward");
  moves(0.4);
  expect(guide.next.value).toBe("curve");
  moves(0.4, -0.4);
  expect(guide.next.value).toBe("rest");
  moves(0.01);
  expect(guide.next.value).toBe("rest");
  follows(0);
  expect(guide.next.value).toBe("stop");
  follows(0, true);
  expect(guide.next.value).toBeUndefined();
  expect(guide.tasks.value).not.toContain("carried");
});

test("with a playground the robot is put down far away, doubts, and is placed by a new verdict only", async () => {
  const guide = firstDrive({ ok: true, values: { poses: [at(1, 0), at(9, 2)] } });
  await Promise.resolve();
  await Promise.resolve();
  state.mapFromBase.value = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: 1, receivedAt: 1 };
  moves(0.4, 0.4);
  moves(0);
  follows(0);
  follows(0, true);
  expect(guide.next.value).toBe("carried");
  state.verdict.value = { verdict: "accepted" } as HintVerdict;
  expect(await guide.carry()).toBe("");
  expect(asked.at(-1)).toMatchObject({ service: "/playground/set_entity_state", request: { entity: "robot", state: at(9, 2) } });
  state.status.value = { health: "lost" } as LocalizationStatus;
  expect(guide.next.value).toBe("placed");
  state.verdict.value = { verdict: "rejected" } as HintVerdict;
  expect(guide.next.value).toBe("placed");
  state.verdict.value = { verdict: "accepted" } as HintVerdict;
  expect(guide.next.value).toBeUndefined();
});

test("who has closed it, or may not drive, is not shown it until it is asked for", () => {
  const guide = firstDrive(undefined, true);
  expect(guide.shown.value).toBe(false);
  guide.again();
  expect(guide.shown.value).toBe(true);
  state.session.value = { mayDrive: false } as Session;
  expect(guide.shown.value).toBe(false);
});
