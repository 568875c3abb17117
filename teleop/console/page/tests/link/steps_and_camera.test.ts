/** Steps, photographs and the announced streams over the wire. */

import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { StepEnd, StepProgress } from "../../src/robot/robot_actions";
import { FakeRobot, headerAt, ROBOT_TOPICS } from "./fake_robot";

const GOAL = { distance: 0.5, angle: 0, speed: 0 };
const RESULT = { outcome: "stalled", message: "the wheels turn and the robot does not", distance: 0.2, angle: 0, duration: 3 };

describe("a robot with a camera", () => {
  let robot: FakeRobot;
  let heard: (StepProgress | StepEnd)[];
  const listener = { progress: (p: StepProgress) => { heard.push(p); }, ended: (e: StepEnd) => { heard.push(e); } };

  beforeEach(async () => {
    vi.useFakeTimers();
    heard = [];
    robot = new FakeRobot({ ...ROBOT_TOPICS, "/cam_sources": "std_msgs/msg/String" });
    robot.link.start();
    await vi.advanceTimersByTimeAsync(20);
  });

  afterEach(() => {
    robot.link.stop();
    vi.useRealTimers();
  });

  function goal(): unknown {
    const [sent] = robot.socket.operations("send_action_goal").slice(-1);
    return sent?.["id"];
  }

  it("sends a step and hears of it to its end", () => {
    robot.link.commands.step(GOAL, listener);
    const id = goal();
    expect(robot.socket.operations("send_action_goal")).toEqual([{
      op: "send_action_goal", id, action: "/move", action_type: "farsteer_msgs/action/Move", args: GOAL, feedback: true,
    }]);
    const values = { state: "moving", ahead: 0, distance: 0.1, angle: 0 };
    robot.socket.deliver({ op: "action_feedback", action: "/move", id, values });
    robot.socket.deliver({ op: "action_feedback", action: "/move", id, values: { ...values, distance: null } });
    robot.socket.deliver({ op: "action_result", action: "/move", id, values: RESULT, status: 6, result: true });
    robot.socket.deliver({ op: "action_result", action: "/move", id, values: RESULT, status: 6, result: true });
    expect(heard).toEqual([{ moving: true, ahead: 0, distance: 0.1, angle: 0 }, RESULT]);
  });

  it("cancels a step, once it is there and not when it has ended", () => {
    const cancel = robot.link.commands.step(GOAL, listener);
    const id = goal();
    cancel?.();
    expect(robot.socket.operations("cancel_action_goal")).toEqual([{ op: "cancel_action_goal", id, action: "/move" }]);
    robot.socket.deliver({ op: "action_result", action: "/move", id, values: "angle must be 0", status: 0, result: false });
    expect(heard).toEqual([{ outcome: "", message: "angle must be 0", distance: 0, angle: 0, duration: 0 }]);
    cancel?.();
    expect(robot.socket.operations("cancel_action_goal").length).toBe(1);
  });

  it("ends steps with the connection, and sends none again", async () => {
    robot.link.commands.step(GOAL, listener);
    robot.socket.drop();
    expect(heard).toMatchObject([{ outcome: "" }]);
    expect(robot.link.commands.step(GOAL, listener)).toBeUndefined();
    await vi.advanceTimersByTimeAsync(2000);
    expect(robot.sockets.length).toBe(2);
    expect(robot.socket.operations("send_action_goal")).toEqual([]);
  });

  it("takes photographs, and says why there is none", async () => {
    const ask = async (): Promise<unknown> => {
      const answer = robot.link.commands.takePhoto();
      await vi.advanceTimersByTimeAsync(20);
      return answer;
    };
    expect(await ask()).toMatchObject({ success: false, name: "" });
    robot.services["/camera/photo"] = { success: true, name: "photo3.jpg", message: "stored photo3.jpg" };
    expect(await ask()).toEqual({ success: true, name: "photo3.jpg", message: "stored photo3.jpg" });
    robot.services["/camera/photo"] = { success: true };
    expect(await ask()).toMatchObject({ success: false });
  });

  it("knows its streams, and complains of what are none", () => {
    const sources = { p3at: "http://robot:9090/stream?topic=/camera/rgb/image_rect_color" };
    robot.publish("/cam_sources", { data: JSON.stringify(sources) });
    expect([...(robot.state.videoSources.value ?? [])]).toEqual(Object.entries(sources));
    robot.publish("/cam_sources", { data: "{p3at" });
    robot.publish("/cam_sources", { data: '{"p3at": 7}' });
    expect(robot.events.some((line) => line.includes("/cam_sources: data is not JSON"))).toBe(true);
    expect(robot.state.videoSources.value?.size).toBe(1);
  });

  it("keeps the best reading of the robot's clock", () => {
    robot.example("/teleop/state", "control", { header: headerAt(9) });
    expect(robot.state.time.value?.stamp).toBe(9);
    robot.example("/teleop/state", "control", { header: headerAt(8) });
    expect(robot.state.time.value?.stamp).toBe(9);
  });
});

it("asks for no streams where there is no camera", async () => {
  vi.useFakeTimers();
  const robot = new FakeRobot();
  robot.link.start();
  await vi.advanceTimersByTimeAsync(20);
  expect(robot.topics).not.toContain("/cam_sources");
  robot.link.stop();
  vi.useRealTimers();
});
