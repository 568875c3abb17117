/** A robot with an arm that records what it is sent and follows it, and the page's part for the arm. */

import { signal } from "@preact/signals";
import { Group, PerspectiveCamera } from "three";
import { Arm } from "../../src/arm/arm";
import type { GoalListener } from "../../src/link/action_goals";
import { readAnswer } from "../../src/link/message_checks/answers";
import { Field } from "../../src/link/message_checks/field";
import type { RobotWire } from "../../src/link/robot_wire";
import { readReply, type Reply } from "../../src/link/service_calls";
import type { Theme } from "../../src/scene/settings";
import { robotModel } from "../../src/scene/robot_model";
import { Harness } from "../driving/harness";

const HEADER = { stamp: { sec: 3, nanosec: 0 }, frame_id: "arm_base" };
const TURN = { x: 0, y: 0, z: 0, w: 1 };

export const INFO = {
  name: "s2", joints: ["arm_joint_1", "arm_joint_2"], turns: ["yaw", "shoulder"], lower: [-1.5, -0.7], upper: [1.5, 2.3], stall: [1, 1],
  gripper_joint: "gripper_joint", opening: 0.06, force: 6, pose_names: ["stow", "ready"], pose_angles: [0, 0.5, 0, 1],
  mount: { position: { x: 0.29, y: 0, z: 0.2 }, orientation: TURN },
};

export const STATE = {
  header: HEADER, mode: "idle", reason: "nobody moves the arm", way_out: "", way_out_text: "", controller: "", angles: [0, 0.5], wanted: [0, 0.5],
  load: [0, 0.4], tip: { position: { x: 0.2, y: 0, z: -0.1 }, orientation: TURN }, target: { position: { x: 0.2, y: 0, z: -0.1 }, orientation: TURN },
  clearance: 0.1, nearest: "", opening: 0, grip_force: 0, holding: false, stowed: true, speed_limit: 0,
};

const joint = (name: string, parent: string, child: string, kind = "revolute"): string =>
  `<link name="${child}"><visual><geometry><box size="0.1 0.02 0.02"/></geometry></visual></link>
  <joint name="${name}" type="${kind}"><parent link="${parent}"/><child link="${child}"/><origin xyz="0.1 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>`;

export const URDF = `<robot name="r"><link name="base_link"><visual><geometry><box size="0.5 0.3 0.2"/></geometry></visual></link>
  ${joint("mount", "base_link", "arm_base", "fixed")}${joint("arm_joint_1", "arm_base", "arm_link_1")}${joint("arm_joint_2", "arm_link_1", "arm_link_2")}
  ${joint("tool", "arm_link_2", "tool0", "fixed")}${joint("gripper_joint", "arm_link_2", "jaw", "prismatic")}</robot>`;

export interface SentGoal {
  readonly action: string;
  readonly goal: Readonly<Record<string, unknown>>;
  readonly listener: GoalListener;
  cancelled: boolean;
}

export interface Published {
  readonly topic: string;
  readonly frame: string;
  readonly message: Readonly<Record<string, unknown>>;
  readonly at: number;
}

const MODES: Readonly<Record<string, string>> = {
  "/arm/hand": "hand", "/servo_node/delta_joint_cmds": "jog", "/servo_node/delta_twist_cmds": "twist",
};

export class ArmBench {
  readonly page = new Harness();
  readonly sent: Published[] = [];
  readonly goals: SentGoal[] = [];
  readonly calls: { service: string; request: object }[] = [];
  readonly listened: string[] = [];
  reply: Reply = { ok: true, values: { success: true, message: "done" } };
  reachable = true;
  /** Whether the arm does what it is sent. */
  follows = true;
  readonly lean = signal(false);
  readonly throttles: number[] = [];
  readonly arm: Arm;
  readonly canvas = document.createElement("canvas");
  readonly base = new Group();
  readonly viewHeld: boolean[] = [];
  readonly #takers = new Map<string, (message: unknown) => void>();

  constructor() {
    this.page.state.arm.value = true;
    document.body.append(this.canvas);
    this.canvas.setPointerCapture = () => undefined;
    this.arm = new Arm({
      wire: this.wire(), robot: this.page.state, driving: this.page.driving, theme: signal<Theme>("day"), lean: this.lean,
      workshop: {
        canvas: this.canvas, camera: new PerspectiveCamera(), world: new Group(), base: this.base, model: signal(robotModel(URDF).object),
        draw: () => undefined, holdView: (held) => { this.viewHeld.push(held); },
      },
      environment: { window, document, now: () => performance.now(), wallNow: () => Date.now() + this.page.wallSkew },
    });
    this.says("/arm/info", INFO);
    this.state();
    this.page.wait(50);
  }

  dispose(): void {
    this.arm.dispose();
    this.page.dispose();
    this.canvas.remove();
  }

  says(topic: string, message: object): void {
    this.#takers.get(topic)?.(message);
  }

  state(change: Partial<typeof STATE> = {}): void {
    this.says("/arm/state", { ...STATE, ...change });
  }

  on(topic: string): readonly Published[] {
    return this.sent.filter((one) => one.topic === topic);
  }

  private wire(): RobotWire {
    const publish = (topic: string, frame: string, message: object): boolean => {
      if (this.reachable) {
        this.sent.push({ topic, frame, message: { ...message }, at: performance.now() });
        const mode = MODES[topic];
        const moves = /"engaged":true|"velocities":\[[^\]]*[1-9]|"(?:x|y|z)":-?0?\.?[1-9]|"(?:x|y|z)":-?0\.\d*[1-9]/.test(JSON.stringify(message));
        if (this.follows && mode !== undefined) {
          this.state({ mode: moves ? mode : "idle" });
        }
      }
      return this.reachable;
    };
    const call = (service: string, request: object): Promise<Reply> => {
      this.calls.push({ service, request });
      return Promise.resolve(this.reply);
    };
    return {
      stream: ({ topic, type, throttle = 0 }, kind) => {
        this.throttles.push(throttle);
        const take = (message: unknown): void => { kind.use(kind.read(new Field(message, ""), 0), 0, topic); };
        this.#takers.set(topic, take);
        return { topic, type, throttle: 0, latched: false, cbor: true, take };
      },
      listen: (streams) => {
        this.listened.push(...streams.map(({ topic }) => topic));
        return () => { this.listened.length = 0; };
      },
      publish: (topic, _type, frame, message) => publish(topic, frame, message),
      publishPlain: (topic, _type, message) => publish(topic, "", message),
      call,
      trigger: async (service, request = {}) => {
        const answer = readReply(await call(service, request), readAnswer);
        return answer.ok ? answer.value : { success: false, message: answer.words };
      },
      goal: (action, _type, goal, listener) => {
        if (!this.reachable) {
          return undefined;
        }
        const sent: SentGoal = { action, goal: { ...goal }, listener, cancelled: false };
        this.goals.push(sent);
        return () => { sent.cancelled = true; };
      },
    };
  }
}
