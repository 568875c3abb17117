import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { HintTool, type HintScene } from "../../src/hint/hint_tool";
import type { HintQuality } from "../../src/hint/hint_quality";
import { forgetRun, unknownState, type RobotState } from "../../src/robot/robot_state";
import type { Health, PlanarPose, StampedPose } from "../../src/values";
import { CONTROL, ME } from "../driving/harness";
import { RecordingCommands } from "./recording_commands";

/** A picture in which a pixel is a centimetre. */
class Picture implements HintScene {
  ghost: PlanarPose | undefined;
  quality: HintQuality = "unknown";
  mode = "";
  floorPoint(x: number, y: number): { x: number; y: number } | undefined {
    return x < 0 ? undefined : { x: x / 100, y: -y / 100 };
  }
  showGhost(pose: PlanarPose | undefined, quality: HintQuality): void {
    this.ghost = pose;
    this.quality = quality;
  }
  setInteraction(mode: "hint" | "camera"): void {
    this.mode = mode;
  }
}

function stamped(x: number, y: number, yaw: number, receivedAt = performance.now()): StampedPose {
  const orientation = { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) };
  return { position: { x, y, z: 0 }, orientation, stamp: 1, receivedAt };
}

let surface: HTMLElement;
let picture: Picture;
let commands: RecordingCommands;
let state: RobotState;
let tool: HintTool;

beforeEach(() => {
  vi.useFakeTimers();
  surface = document.createElement("div");
  surface.setPointerCapture = () => undefined;
  document.body.append(surface);
  picture = new Picture();
  commands = new RecordingCommands();
  state = unknownState();
  state.dialect.value = "farsteer";
  tool = new HintTool(surface, picture, commands, state);
});

afterEach(() => {
  tool.dispose();
  surface.remove();
  vi.useRealTimers();
});

function point(type: string, clientX: number, clientY: number, pointerId = 1): void {
  surface.dispatchEvent(new PointerEvent(type, { clientX, clientY, pointerId, button: 0, bubbles: true, cancelable: true }));
}

function press(key: string, target: EventTarget = surface): KeyboardEvent {
  const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
  target.dispatchEvent(event);
  return event;
}

function dragToTheRight(): void {
  tool.begin();
  point("pointerdown", 100, 200);
  point("pointermove", 300, 200);
  point("pointerup", 300, 200);
}

describe("a search of the whole map", () => {
  const status = (health: Health): void => {
    state.status.value = { stamp: 1, health, reasons: [], fit: 1, positionSigma: 0, headingSigma: 0 };
  };

  it("says so until the robot knows its place again, and can be undone then", async () => {
    status("tracking");
    await tool.find();
    expect(tool.view.value.result?.kind).toBe("search");
    expect(tool.undoable.value).toBe(false);
    status("relocalising");
    expect(tool.view.value.result?.kind).toBe("search");
    status("tracking");
    expect(tool.view.value.result).toEqual({ kind: "found" });
    expect(tool.undoable.value).toBe(true);
    await tool.undo();
    expect(tool.undoable.value, "once").toBe(false);
  });
});

describe("a hint by press and drag", () => {
  it("shows the ghost, its preview and quality, and is sent on confirmation", async () => {
    dragToTheRight();
    expect(picture.mode).toBe("hint");
    expect(picture.ghost).toEqual({ x: 1, y: -2, yaw: 0 });
    await vi.advanceTimersByTimeAsync(200);
    expect(tool.view.value.preview).toMatchObject({ explained: 0.93, present: 0.41 });
    expect(picture.quality).toBe("good");
    tool.confirm();
    expect(commands.hints).toHaveLength(1);
    expect(commands.hints[0]).toMatchObject({ pose: { x: 1, y: -2, yaw: 0 }, sigma: 0.5 });
    expect(tool.view.value.phase).toBe("waiting");
    state.verdict.value = { stamp: 2, verdict: "accepted", reason: "", hint: stamped(1, -2, 0), candidates: [], scores: [] };
    expect(tool.view.value.phase).toBe("answered");
    expect(picture.mode).toBe("camera");
    expect(picture.ghost).toBeUndefined();
  });

  it("ignores a second finger and presses beside the floor", () => {
    tool.begin();
    point("pointerdown", -5, 0);
    expect(tool.view.value.pose).toBeUndefined();
    point("pointerdown", 100, 0);
    point("pointerdown", 900, 900, 2);
    point("pointermove", 900, 900, 2);
    expect(tool.view.value.pose).toMatchObject({ x: 1 });
    point("pointercancel", 100, 0);
    expect(tool.view.value.pressedAt).toBeUndefined();
  });

  it("says that nothing came after 3 s", async () => {
    dragToTheRight();
    tool.confirm();
    await vi.advanceTimersByTimeAsync(3600);
    expect(tool.view.value.result).toEqual({ kind: "silent" });
  });

  it("stays to be confirmed again if it could not be sent", () => {
    dragToTheRight();
    commands.connected = false;
    tool.confirm();
    expect(tool.view.value.result).toEqual({ kind: "notSent" });
    commands.connected = true;
    tool.confirm();
    expect(commands.hints).toHaveLength(1);
  });

  it("has no preview and no verdict on a plain rosbridge", async () => {
    state.dialect.value = "plain";
    dragToTheRight();
    await vi.advanceTimersByTimeAsync(1000);
    expect(commands.previews).toHaveLength(0);
    tool.confirm();
    expect(tool.view.value.result).toEqual({ kind: "unanswered" });
  });

  it("ends with a new run of the robot", () => {
    state.run.value = "one";
    dragToTheRight();
    expect(tool.placing).toBe(true);
    state.run.value = "another";
    forgetRun(state);
    expect(tool.view.value.phase).toBe("off");
    expect(picture.ghost).toBeUndefined();
  });
});

describe("a hint by keys", () => {
  it("begins at the present pose and keeps its keys from those who drive", () => {
    state.mapFromBase.value = stamped(5, 6, 1);
    const driving = vi.fn();
    window.addEventListener("keydown", driving);
    expect(press("ArrowUp").defaultPrevented).toBe(false);
    expect(driving).toHaveBeenCalledTimes(1);
    tool.begin();
    expect(press("ArrowUp").defaultPrevented).toBe(true);
    expect(driving).toHaveBeenCalledTimes(1);
    expect(tool.view.value.pose?.y).toBeCloseTo(6.1);
    press("q");
    expect(tool.view.value.pose?.yaw).toBeCloseTo(1 + (5 * Math.PI) / 180);
    press(" ");
    expect(driving).toHaveBeenCalledTimes(2);
    press("Enter");
    expect(commands.hints[0]?.pose.y).toBeCloseTo(6.1);
    window.removeEventListener("keydown", driving);
  });

  it("does not begin at a pose that the robot no longer has", () => {
    state.mapFromBase.value = stamped(5, 6, 1, performance.now() - 2000);
    tool.begin();
    expect(tool.view.value.pose).toBeUndefined();
  });

  it("leaves keys to fields, and Enter to buttons", () => {
    state.mapFromBase.value = stamped(5, 6, 1);
    const field = document.body.appendChild(document.createElement("input"));
    const button = document.body.appendChild(document.createElement("button"));
    tool.begin();
    press("ArrowUp", field);
    press("q", field);
    press("Enter", button);
    expect(tool.view.value.pose).toMatchObject({ x: 5, y: 6 });
    expect(commands.hints).toHaveLength(0);
    field.remove();
    button.remove();
  });

  it("is left by Esc, once", () => {
    state.mapFromBase.value = stamped(5, 6, 1);
    tool.begin();
    expect(press("Escape").defaultPrevented).toBe(true);
    expect(tool.view.value.phase).toBe("off");
    expect(press("Escape").defaultPrevented).toBe(false);
    expect(tool.escape()).toBe(false);
  });
});

describe("Esc while the robot moves", () => {
  it("leaves the hint and stays with whoever stops the robot", () => {
    state.mapFromBase.value = stamped(5, 6, 1);
    state.control.value = { ...CONTROL, state: "armed", controller: ME, armed: true, linear: 0.3 };
    const stop = vi.fn();
    window.addEventListener("keydown", stop);
    tool.begin();
    press("Escape");
    window.removeEventListener("keydown", stop);
    expect(tool.view.value.phase).toBe("off");
    expect(stop).toHaveBeenCalledTimes(1);
  });
});

describe("finding the robot", () => {
  it("picks one of the places that the robot has found, with small sigmas", () => {
    tool.pick(stamped(7, 8, 2));
    expect(commands.hints[0]).toMatchObject({ sigma: 0.1, pose: { x: 7, y: 8 } });
    expect(commands.hints[0]?.headingSigma).toBeLessThan(0.1);
  });

  it("says what the robot answers, also if the call fails", async () => {
    await tool.find();
    expect(tool.view.value.result).toEqual({ kind: "search", answer: { success: true, message: "done" } });
    commands.answer = { success: false, message: "no link" };
    await tool.find();
    expect(tool.view.value.result).toEqual({ kind: "search", answer: commands.answer });
    await tool.undo();
    expect(tool.view.value.result).toMatchObject({ kind: "undo" });
  });
});
