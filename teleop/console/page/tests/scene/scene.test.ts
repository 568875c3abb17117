import { Quaternion, Vector3 } from "three";
import { afterEach, describe, expect, points, test, vi } from "./tools";
import { forgetRun, unknownState, type RobotState } from "../../src/robot/robot_state";
import { moveJoints, robotModel } from "../../src/scene/robot_model";
import { Scene } from "../../src/scene/scene";
import { sceneSettings, shownView, viewsOf } from "../../src/scene/settings";
import { waitingPose, worldBounds, worldFromBase } from "../../src/scene/located";
import { SmoothPose } from "../../src/scene/smooth_pose";
import { sceneTexts } from "../../src/texts/scene";
import type { CloudPoints, StampedPose } from "../../src/values";

const pose = (x: number, y: number): StampedPose => ({
  position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: 0, receivedAt: 0,
});
const cloud = (frame: string): CloudPoints => ({
  stamp: 0, receivedAt: 0, frame, positions: points([1, 0, 0.3], [0, 1, 0.3]), distances: Float32Array.of(0, NaN),
});

const URDF = `<robot name="r">
  <link name="base_link"><visual><geometry><box size="0.5 0.3 0.2"/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual></link>
  <link name="mast"><visual><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual></link>
  <joint name="j" type="fixed"><parent link="base_link"/><child link="mast"/><origin xyz="0 0 0.3"/></joint>
</robot>`;

let open: Scene | undefined;

function scene(): { readonly scene: Scene; readonly state: RobotState } {
  const state = unknownState();
  open = new Scene(document.createElement("canvas"), state, sceneSettings(undefined, false));
  return { scene: open, state };
}

afterEach(() => {
  open?.dispose();
  open = undefined;
  vi.restoreAllMocks();
});

describe("the picture", () => {
  test("says in one sentence that WebGL is missing, and takes everything in all the same", () => {
    const { scene: picture, state } = scene();
    expect(picture.trouble.value).toBe(sceneTexts.noWebGl);
    state.mapPoints.value = { sha256: "a", positions: points([0, 0, 0], [4, 4, 0], [4, 4, 2]) };
    state.description.value = URDF;
    state.mapFromBase.value = pose(1, 1);
    state.cloud.value = cloud("map");
    state.scan.value = cloud("base_link");
    state.covariance.value = [0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01];
    state.candidates.value = [pose(1, 2), pose(2, 3)];
    state.truth.value = pose(1, 1.1);
    picture.showGhost({ x: 1, y: 2, yaw: 0.5 }, "good");
    picture.setInteraction("hint");
    picture.stale.value = true;
    picture.recentre();
    forgetRun(state);
    state.run.value = "another";
    expect(picture.frameTimes()).toEqual([]);
  });

  test("takes a grid in place of a map", () => {
    const { state } = scene();
    const origin = { position: { x: -1, y: -1, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
    state.gridMap.value = { frame: "map", origin, resolution: 0.5, width: 2, height: 2, cells: Int8Array.of(-1, 0, 50, 100) };
    state.gridMap.value = { frame: "map", origin, resolution: 0.5, width: 0, height: 0, cells: new Int8Array() };
    state.gridMap.value = undefined;
    expect(state.gridMap.value).toBeUndefined();
  });

  test("reacts to nothing after its end", () => {
    const { scene: picture, state } = scene();
    const frames = vi.spyOn(globalThis, "requestAnimationFrame");
    picture.dispose();
    state.mapFromBase.value = pose(1, 1);
    state.cloud.value = cloud("map");
    expect(frames).not.toHaveBeenCalled();
  });
});

describe("the robot's place", () => {
  test("is that in the map, and in its odometry only where there is no map at all", () => {
    const state = unknownState();
    expect(worldFromBase(state)).toBeUndefined();
    state.odomFromBase.value = pose(3, 3);
    expect(worldFromBase(state)?.position.x).toBe(3);
    state.mapPoints.value = { sha256: "a", positions: points([0, 0, 0]) };
    expect(worldFromBase(state)).toBeUndefined();
    state.mapFromBase.value = pose(5, 5);
    expect(worldFromBase(state)?.position.x).toBe(5);
  });

  test("is beside the map while it is not known, and all is in view", () => {
    const map = { min: { x: 0, y: 0, z: -1 }, max: { x: 20, y: 10, z: 3 } };
    const waiting = waitingPose(map, 0, false);
    expect(waiting.position.x).toBeLessThan(0);
    const bounds = worldBounds(map, 0, waiting);
    expect(bounds?.min.x).toBeLessThan(waiting.position.x);
    expect(bounds?.max.x).toBe(20);
    expect(waitingPose(map, 0, true).position.y).toBeLessThan(0);
    expect(waitingPose(undefined, 0, false).position).toEqual({ x: 0, y: 0, z: 0 });
  });
});

describe("the robot as it is drawn", () => {
  test("glides to where it is reported, and leaps when it was found elsewhere", () => {
    const smooth = new SmoothPose();
    smooth.set(pose(0, 0), false);
    smooth.set(pose(0.1, 0), false);
    expect(smooth.position.x).toBe(0);
    expect(smooth.advance(60)).toBe(true);
    expect(smooth.position.x).toBeGreaterThan(0.05);
    for (let step = 0; step < 50; step += 1) { smooth.advance(60); }
    expect(smooth.position.x).toBeCloseTo(0.1, 5);
    expect(smooth.advance(60)).toBe(false);
    smooth.set(pose(10, 0), false);
    expect(smooth.position.x).toBe(10);
  });
});

const WITH_ARM = URDF.replace("</robot>", `
  <link name="tool0"><visual><geometry><box size="1 0.1 0.1"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="mast"/><child link="tool0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
</robot>`);

describe("an arm", () => {
  test("stands where its joints are, beyond a limit too, and does not count as body", () => {
    const { object, box } = robotModel(WITH_ARM);
    expect(box).toEqual(robotModel(URDF).box);
    expect(moveJoints(object, new Map([["shoulder", 1.2], ["elsewhere", 1]]))).toBe(true);
    expect(moveJoints(object, new Map([["shoulder", 1.2]]))).toBe(false);
    const tool = object.getObjectByName("tool0");
    expect(tool?.getWorldDirection(new Vector3()).z).toBeCloseTo(1, 6);
    expect(new Vector3(1, 0, 0).applyQuaternion(tool?.getWorldQuaternion(new Quaternion()) ?? new Quaternion()).y).toBeCloseTo(Math.sin(1.2), 6);
  });

  test("is in the picture, with a view of its own", () => {
    const { scene: picture, state } = scene();
    state.description.value = WITH_ARM;
    state.joints.value = new Map([["shoulder", 0.5]]);
    expect(picture.workshop.model.value.getObjectByName("shoulder")).toMatchObject({ angle: 0.5 });
    expect(viewsOf(false)).toEqual(["chase", "top", "first"]);
    expect(shownView("arm", false)).toBe("chase");
    expect(shownView("arm", true)).toBe("arm");
  });
});

describe("the robot's model", () => {
  test("is that of its URDF", () => {
    const { box, paints } = robotModel(URDF);
    expect(paints.length).toBe(2);
    expect(box.max.x).toBeCloseTo(0.25, 6);
    expect(box.max.z).toBeCloseTo(0.5, 6);
  });

  test("asks no other host for anything", () => {
    const fetched = vi.spyOn(globalThis, "fetch");
    const images = vi.spyOn(document, "createElementNS");
    const hostile = URDF.replace(`<box size="0.5 0.3 0.2"/>`, `<mesh filename="http://elsewhere/x.stl"/>`)
      .replace(`<color rgba="1 0 0 1"/>`, `<texture filename="http://elsewhere/x.png"/>`);
    robotModel(hostile);
    expect(fetched).not.toHaveBeenCalled();
    expect(images.mock.calls.filter(([, name]) => name === "img")).toEqual([]);
  });

  test("is one of a usual size where the URDF cannot be shown", () => {
    const usual = robotModel(undefined).box;
    for (const text of ["", "no xml <", "<robot/>", URDF.replace("0.5 0.3 0.2", "900 1 1"), URDF.replace("0.5 0.3 0.2", "a b c"), `<robot>${"x".repeat(600_000)}</robot>`]) {
      expect(robotModel(text).box).toEqual(usual);
    }
  });
});
