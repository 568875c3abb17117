// roslib as it is published drives each interface of the arm. Prints a line of JSON for each: its name, and what is
// wrong or null. Time passes by /sim/step alone.

import { webcrypto } from "node:crypto";

globalThis.crypto ??= webcrypto; // Node 18 has it elsewhere

const { Action, Ros, Service, Topic } = await import("roslib");
const ros = new Ros({ url: `ws://127.0.0.1:${process.argv[2]}` });
const joints = [1, 2, 3, 4, 5].map((n) => `arm_joint_${n}`);
const newest = {};
const publishers = {};

const outputs = {
  "/arm/state": "farsteer_msgs/msg/ArmState",
  "/arm/info": "farsteer_msgs/msg/ArmInfo",
  "/arm/mirror": "farsteer_msgs/msg/ArmMirror",
  "/servo_node/status": "moveit_msgs/msg/ServoStatus",
  "/arm/joint_degrees": "std_msgs/msg/Float64MultiArray",
  "/arm/servo_pulses": "std_msgs/msg/UInt16MultiArray",
  "/arm/feedback": "sensor_msgs/msg/JoyFeedbackArray",
  "/joint_states": "sensor_msgs/msg/JointState",
  "/robot_description": "std_msgs/msg/String",
};

const publish = (name, messageType, message) => {
  publishers[name] ??= new Topic({ ros, name, messageType });
  publishers[name].publish(message);
};
const ask = (name, serviceType, request = {}) =>
  new Promise((resolve, reject) => new Service({ ros, name, serviceType }).callService(request, resolve, reject));
const step = (ticks = 1) => ask("/sim/step", "farsteer_msgs/srv/Step", { ticks });
const state = () => newest["/arm/state"];
const stamped = (tick, frame_id = "base_link") => ({ stamp: { sec: 100, nanosec: 20_000_000 * tick }, frame_id });
const turned = { x: 0, y: 0, z: 0, w: 1 };
const pose = (x, y, z) => ({ position: { x, y, z }, orientation: turned });

// Send for some ticks; return what is wrong unless the arm moved by that.
async function moved(mode, send) {
  const before = state().wanted;
  for (let tick = 0; tick < 25; tick++) {
    send(tick);
    await step();
  }
  const now = state();
  await step(80); // silence ends it, and a pause of a second is over
  if (now.mode !== mode) return `mode ${now.mode}: ${now.reason}`;
  const way = Math.max(...now.wanted.map((angle, k) => Math.abs(angle - before[k])));
  return way > 0.01 ? null : `moved by ${way} only`;
}

// Run what ends later, and step until it has.
async function ends(begin) {
  let ended = null;
  begin((result) => (ended = { result }), (error) => (ended = { error: String(error) }));
  for (let n = 0; n < 400 && ended === null; n++) await step(5);
  return ended ?? { error: `did not end: ${state().reason}` };
}
const goal = (name, actionType, values) =>
  ends((done, failed) => new Action({ ros, name, actionType }).sendGoal(values, done, () => {}, failed));
const later = (name) =>
  ends((done, failed) => new Service({ ros, name, serviceType: "std_srvs/srv/Trigger" }).callService({}, done, failed));
const unless = (good, found) => (good ? null : JSON.stringify(found));

const twist = (tick) =>
  publish("/servo_node/delta_twist_cmds", "geometry_msgs/msg/TwistStamped", {
    header: stamped(tick),
    twist: { linear: { x: 0, y: 0, z: 0.05 }, angular: { x: 0, y: 0, z: 0 } },
  });
const jog = (tick) =>
  publish("/servo_node/delta_joint_cmds", "control_msgs/msg/JointJog", {
    header: stamped(tick),
    joint_names: joints,
    velocities: [0, 0.5, 0.8, 0, 0],
  });
const lead = (tick) => {
  const { x, y, z } = state().tip.position;
  const header = stamped(tick, "arm_base");
  publish("/servo_node/pose_target_cmds", "geometry_msgs/msg/PoseStamped", { header, pose: pose(x, y + 0.03, z) });
};
const hand = (tick) =>
  publish("/arm/hand", "farsteer_msgs/msg/Hand", {
    header: stamped(tick, "arm_base"),
    pose: pose(0, -0.002 * tick, 0),
    engaged: tick > 1,
    tracked: true,
  });
const joined = (tick) => {
  const header = stamped(tick, "arm_base");
  publish("/arm/joy", "sensor_msgs/msg/Joy", { header, axes: [0], buttons: [Number(tick > 1)] });
  publish("/arm/hand_pose", "geometry_msgs/msg/PoseStamped", { header, pose: pose(0, 0.002 * tick, 0) });
};
const points = (...angles) => ({
  joint_names: joints,
  points: angles.map((positions, sec) => ({ positions, time_from_start: { sec, nanosec: 0 } })),
});
const beside = (way) => [state().wanted[0] + way, ...state().wanted.slice(1)];

async function kinematics() {
  const robot_state = { joint_state: { name: joints, position: state().wanted } };
  const header = { frame_id: "base_link" };
  const fk = { header, fk_link_names: ["tool0"], robot_state };
  const { pose_stamped } = await ask("/compute_fk", "moveit_msgs/srv/GetPositionFK", fk);
  const ik_request = { group_name: "arm", pose_stamped: pose_stamped[0], robot_state };
  const { solution } = await ask("/compute_ik", "moveit_msgs/srv/GetPositionIK", { ik_request });
  const off = solution.joint_state.position.map((angle, k) => Math.abs(angle - state().wanted[k]));
  return unless(Math.max(...off) < 1e-6, off);
}

const checks = {
  "/servo_node/delta_joint_cmds": () => moved("jog", jog),
  "/servo_node/delta_twist_cmds": () => moved("twist", twist),
  "/servo_node/pose_target_cmds": () => moved("pose", lead),
  "/arm/hand": () => moved("hand", hand),
  "/arm/hand_pose": () => moved("hand", joined),
  "/arm/joy": () => moved("hand", joined),
  "/arm_controller/joint_trajectory": async () => {
    const there = beside(0.2);
    const message = points(state().wanted, there);
    publish("/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory", message);
    await step(100);
    return unless(Math.abs(state().wanted[0] - there[0]) < 0.01, state());
  },
  "/arm_controller/follow_joint_trajectory": async () => {
    const trajectory = points(state().wanted, beside(-0.2));
    const name = "/arm_controller/follow_joint_trajectory";
    const found = await goal(name, "control_msgs/action/FollowJointTrajectory", { trajectory });
    return unless(found.result?.error_code === 0, found);
  },
  "/gripper_controller/gripper_cmd": async () => {
    const command = { position: 0.04, max_effort: 4 };
    const found = await goal("/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand", { command });
    return unless(found.result?.reached_goal, found);
  },
  "/arm/move": async () => {
    const found = await goal("/arm/move", "farsteer_msgs/action/ArmMove", { name: "ready" });
    return unless(found.result?.outcome === "done", found);
  },
  "/arm/confirm": async () => {
    const values = { angles: beside(0.3), hold_to_run: true };
    const confirming = (done, failed) => {
      const move = new Action({ ros, name: "/arm/move", actionType: "farsteer_msgs/action/ArmMove" });
      move.sendGoal(values, done, () => publish("/arm/confirm", "std_msgs/msg/Bool", { data: true }), failed);
    };
    const found = await ends(confirming);
    return unless(found.result?.outcome === "done", found);
  },
  "/arm/mirror_degrees": async () => {
    const data = [...state().angles.map((angle) => (180 / Math.PI) * angle), 0];
    for (let n = 0; n < 10; n++) {
      publish("/arm/mirror_degrees", "std_msgs/msg/Float64MultiArray", { data });
      await step();
    }
    return unless(newest["/arm/mirror"]?.state === "following", newest["/arm/mirror"]);
  },
  "/compute_fk": kinematics,
  "/compute_ik": kinematics,
  "/arm/way_out": async () => {
    const found = await later("/arm/way_out"); // there is nothing to get out of, which it says
    return unless(found.result?.success === false && found.result.message.includes("nothing"), found);
  },
  "/arm/stow": async () => {
    const found = await later("/arm/stow");
    return unless(found.result?.success, found);
  },
  "/servo_node/switch_command_type": async () => {
    const request = { command_type: 0 };
    const found = await ask("/servo_node/switch_command_type", "moveit_msgs/srv/ServoCommandType", request);
    return unless(found.success, found);
  },
  "/servo_node/pause_servo": async () => {
    const set = (data) => ask("/servo_node/pause_servo", "std_srvs/srv/SetBool", { data });
    const both = [await set(true), await set(false)];
    return unless(both.every(({ success }) => success), both);
  },
  "/file_server/get_file": async () => {
    const name = "package://farsteer/robot.urdf";
    const { value } = await ask("/file_server/get_file", "file_server/srv/GetBinaryFile", { name });
    return unless(value.length > 1000, value);
  },
};

await new Promise((resolve, reject) => ros.on("connection", resolve).on("error", reject));
for (const [name, messageType] of Object.entries(outputs))
  new Topic({ ros, name, messageType }).subscribe((message) => (newest[name] = message));
await step(10);
const say = (name, problem) => console.log(JSON.stringify([name, problem]));
for (const [name, check] of Object.entries(checks)) say(name, await check().catch(String));
for (const name of Object.keys(outputs)) say(name, newest[name] ? null : "nothing came");
process.exit(0);
