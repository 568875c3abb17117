/** The ghost, the way, and the handles. */

import { Group, Mesh, MeshBasicMaterial, Vector3, type Object3D } from "three";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ArmFigure } from "../../../src/arm/picture/arm_figure";
import { Gizmo } from "../../../src/arm/picture/gizmo";
import { along } from "../../../src/arm/picture/swept_path";
import { readArmInfo } from "../../../src/link/message_checks/arm_messages";
import { Field } from "../../../src/link/message_checks/field";
import { moveJoints, robotModel } from "../../../src/scene/robot_model";
import { ArmBench, INFO, URDF } from "../arm_bench";

let bench: ArmBench;

beforeEach(() => { bench = new ArmBench(); });
afterEach(() => {
  bench.dispose();
  vi.restoreAllMocks();
});

const shown = (object: Object3D | undefined): boolean => object?.visible === true && (object.parent === null || shown(object.parent));
const mounted = (): Group => bench.base.children[0] as Group;

it("copies the arm without moving the robot's own", () => {
  const { object } = robotModel(URDF);
  moveJoints(object, new Map([["arm_joint_1", 0.3]]));
  const figure = ArmFigure.of(object, readArmInfo(new Field(INFO, "")), new MeshBasicMaterial());
  figure?.move([Math.PI / 2, 0], 0.05);
  expect(object.getObjectByName("arm_joint_1")).toMatchObject({ angle: 0.3 });
  expect(object.getObjectByName("gripper_joint")).toMatchObject({ angle: 0 });
  const tip = new Vector3().setFromMatrixPosition(figure?.tip() ?? mounted().matrix);
  expect(tip.toArray().map((value) => value.toFixed(3))).toEqual(["0.100", "0.200", "0.000"]);
  expect(ArmFigure.of(robotModel(undefined).object, readArmInfo(new Field(INFO, "")), new MeshBasicMaterial())).toBeUndefined();
});

it("goes along a way by the angles that the joints turn", () => {
  expect(along([[0, 0], [1, 0], [1, 3]], 0.25)).toEqual([1, 0]);
  expect(along([[0, 0], [1, 0], [1, 3]], 1)).toEqual([1, 3]);
  expect(along([[0, 0], [0, 0], [1, 3]], 0)).toEqual([0, 0]);
  expect(along([[2, 1]], 0.5)).toEqual([2, 1]);
  expect(along([], 0.5)).toEqual([]);
});

it("shows the way while a move has one", () => {
  const sweep = mounted().children[1];
  expect(shown(sweep)).toBe(false);
  bench.arm.moved.ask("Pose", { name: "ready" });
  bench.goals[0]?.listener.feedback({ state: "waiting", share: 0, path: { points: [{ positions: [0, 0.5] }, { positions: [1, 1] }] } });
  expect(shown(sweep)).toBe(true);
  bench.goals[0]?.listener.ended({ ok: true, values: { outcome: "done", message: "", path: { points: [] } } });
  expect(shown(sweep)).toBe(false);
});

it("lets the arm follow what is dragged, with the clutch closed while the pointer is down, 50 times a second at most", async () => {
  const load = vi.spyOn(Gizmo, "load");
  bench.arm.chosen.value = true;
  await vi.dynamicImportSettled();
  const [, hand, hooks] = load.mock.calls[0] ?? [];
  if (hand === undefined || hooks === undefined) {
    throw new Error("no handles");
  }
  hooks.begin();
  hand.position.x += 0.05;
  hooks.moved();
  bench.page.wait(1000);
  hooks.end();
  bench.page.wait(500);
  const sent = bench.on("/arm/hand");
  expect(sent[0]?.message).toMatchObject({ engaged: false, tracked: true, trigger: 1, scale: 1 });
  const engaged = sent.filter(({ message }) => message["engaged"] === true);
  expect(engaged.length).toBeGreaterThan(30);
  expect(engaged.every(({ at }, i) => i === 0 || at - (engaged[i - 1]?.at ?? 0) >= 20)).toBe(true);
  expect(engaged.at(-1)?.message["pose"]).toMatchObject({ position: { x: expect.closeTo(0.25, 4) as number } });
  expect(sent.slice(-3).map(({ message }) => message["engaged"])).toEqual([false, false, false]);
  expect(bench.arm.known.value?.picture.placed.value).toBeUndefined();
  expect(hand.position.x, "back at the gripper").toBeCloseTo(0.2, 6);
});

it("leaves the ghost where it was dragged, if the arm is to go there by a plan", async () => {
  const load = vi.spyOn(Gizmo, "load");
  bench.arm.follows.value = false;
  bench.arm.chosen.value = true;
  await vi.dynamicImportSettled();
  const [, hand, hooks] = load.mock.calls[0] ?? [];
  hooks?.begin();
  hand?.position.setZ(0.1);
  hooks?.end();
  bench.page.wait(200);
  bench.state();
  expect(bench.sent).toEqual([]);
  const picture = bench.arm.known.value?.picture;
  expect(picture?.placed.value?.position.z).toBe(0.1);
  expect(hand?.children.some((part) => part.visible)).toBe(true);
  picture?.forget();
  expect(hand?.position.z).toBeCloseTo(-0.1, 6);
  expect(hand?.children.some((part) => part.visible)).toBe(false);
});

it("has three arrows and two rings, and leaves nothing behind", async () => {
  bench.arm.chosen.value = true;
  await vi.dynamicImportSettled();
  const gizmo = await Gizmo.load(
    { canvas: bench.canvas, camera: new (await import("three")).PerspectiveCamera(), world: new Group(), base: bench.base,
      model: { value: new Group() } as never, draw: () => undefined, holdView: () => undefined },
    mounted().children[0]?.children[0] ?? new Mesh(), { begin: () => undefined, moved: () => undefined, end: () => undefined },
  );
  gizmo.show(true);
  gizmo.align("tool");
  gizmo.align(0.5);
  gizmo.dispose();
  bench.arm.dispose();
  expect(bench.base.children).toEqual([]);
});
