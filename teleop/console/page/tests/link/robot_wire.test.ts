/** A robot with an arm, and what is loaded later for it, over the wire. */

import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FakeRobot, ROBOT_TOPICS } from "./fake_robot";

const WITH_ARM = {
  ...ROBOT_TOPICS, "/arm/info": "farsteer_msgs/msg/ArmInfo", "/joint_states": "sensor_msgs/msg/JointState",
};
const REQUEST = { topic: "/arm/info", type: "farsteer_msgs/ArmInfo", latched: true, cbor: true };
const JOINTS = { name: ["arm_joint_1", "gripper_joint"], position: [0.5, 0.02] };

let robot: FakeRobot;

async function started(topics: Readonly<Record<string, string>>): Promise<void> {
  robot = new FakeRobot(topics);
  robot.link.start();
  await vi.advanceTimersByTimeAsync(20);
}

beforeEach(() => { vi.useFakeTimers(); });

afterEach(() => {
  robot.link.stop();
  vi.useRealTimers();
});

it("asks a robot without an arm for no joints", async () => {
  await started({ ...ROBOT_TOPICS, "/joint_states": "sensor_msgs/msg/JointState" });
  expect(robot.state.arm.value).toBe(false);
  expect(robot.topics).not.toContain("/joint_states");
  expect(robot.topics.filter((topic) => topic.startsWith("/arm"))).toEqual([]);
});

it("knows the joints of an arm, and complains of what are none", async () => {
  await started(WITH_ARM);
  expect(robot.state.arm.value).toBe(true);
  expect(robot.topics).not.toContain("/arm/info");
  robot.publish("/joint_states", JOINTS);
  robot.publish("/joint_states", { ...JOINTS, position: [1] });
  expect([...(robot.state.joints.value ?? [])]).toEqual([["arm_joint_1", 0.5], ["gripper_joint", 0.02]]);
  expect(robot.events.join()).toContain("/joint_states: position does not have a number for each name");
});

it("listens to more topics until that is ended, also on the next connection", async () => {
  await started(WITH_ARM);
  const heard: string[] = [];
  const stream = robot.link.wire.stream(REQUEST, {
    read: (message) => message.at("name").text(), use: (name) => { heard.push(name); },
  });
  const end = robot.link.wire.listen([stream]);
  expect(robot.topics).toContain("/arm/info");
  robot.publish("/arm/info", { name: "s2" });
  robot.publish("/arm/info", { name: 2 });
  expect(heard).toEqual(["s2"]);
  robot.socket.drop();
  await vi.advanceTimersByTimeAsync(2000);
  expect(robot.sockets.length).toBe(2);
  expect(robot.topics).toContain("/arm/info");
  end();
  expect(robot.topics).not.toContain("/arm/info");
});

it("publishes with the time of sending and a frame", async () => {
  await started(WITH_ARM);
  const { wire } = robot.link;
  expect(wire.publish("/arm/hand", "farsteer_msgs/Hand", "base_link", { engaged: false })).toBe(true);
  expect(wire.publishPlain("/arm/confirm", "std_msgs/Bool", { data: true })).toBe(true);
  expect(robot.socket.operations("publish").map(({ msg }) => msg)).toEqual([
    { header: { stamp: { sec: 5, nanosec: 500_000_000 }, frame_id: "base_link" }, engaged: false }, { data: true },
  ]);
  robot.socket.drop();
  expect(wire.publishPlain("/arm/confirm", "std_msgs/Bool", { data: true })).toBe(false);
  expect(wire.goal("/arm/move", "farsteer_msgs/action/ArmMove", {}, { feedback: vi.fn(), ended: vi.fn() })).toBeUndefined();
});
