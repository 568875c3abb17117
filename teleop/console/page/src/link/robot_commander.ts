/** What the page asks of the robot, as messages and calls. Nothing is kept for later: what cannot leave now is not sent. */

import { JOY_LAYOUT } from "../operating_data";
import type { CameraCommands, PhotoAnswer, StepCommands, StepGoal, StepListener } from "../robot/robot_actions";
import type { RobotCommands, Wish } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import type { Answer, HintPreview, PlanarPose } from "../values";
import { ActionGoals, type GoalListener } from "./action_goals";
import { canonicalType, readPreview } from "./message_checks/answers";
import { check } from "./message_checks/field";
import { readPhoto, readStepEnd, readStepProgress } from "./message_checks/step_messages";
import type { RosbridgeClient } from "./rosbridge_client";
import { readReply, type ServiceCalls } from "./service_calls";

/** What the commands need of the connection. */
export interface CommandParts {
  readonly calls: ServiceCalls;
  readonly state: RobotState;
  /** Whether what is sent now leaves now. */
  readonly flows: () => boolean;
  readonly authenticate: (token: string) => void;
  /** The robot's type of a topic; undefined if it has not said so. */
  readonly typeOf: (topic: string) => string | undefined;
  /** Time of the page's steady clock since 1970 [ms]. */
  readonly epoch: () => number;
}

const JOY = "sensor_msgs/Joy";
const TWIST = "geometry_msgs/Twist";
const TWIST_STAMPED = "geometry_msgs/TwistStamped";
const HINT = "geometry_msgs/PoseWithCovarianceStamped";

const SERVICES: Record<Wish, string> = {
  estop: "/teleop/estop",
  resetEstop: "/teleop/estop_reset",
  takeOver: "/teleop/take_over",
  ask: "/teleop/ask",
  give: "/teleop/give",
  refuse: "/teleop/refuse",
  undo: "/localization/undo",
  find: "/localization/relocalize",
};

/** The robot waits up to 10 s for a picture, and as long for its disk [s]. */
const PHOTO_PATIENCE = 25;

export class RobotCommander implements RobotCommands, StepCommands, CameraCommands {
  readonly #parts: CommandParts;
  readonly #goals = new ActionGoals();
  #client: RosbridgeClient | undefined;

  constructor(parts: CommandParts) {
    this.#parts = parts;
  }

  attach(client: RosbridgeClient): void {
    this.#goals.attach(client);
    this.#client = client;
  }

  detach(): void {
    this.#goals.detach();
    this.#client = undefined;
  }

  joy(forward: number, turn: number, deadman: boolean, turbo: boolean): boolean {
    const [axes, buttons] = [[0, 0], Array<number>(6).fill(0)];
    axes[JOY_LAYOUT.forward_axis] = forward;
    axes[JOY_LAYOUT.turn_axis] = turn;
    buttons[JOY_LAYOUT.deadman_button] = Number(deadman);
    buttons[JOY_LAYOUT.turbo_button] = Number(turbo);
    return this.publish("/joy", JOY, { ...this.header(), axes, buttons });
  }

  velocity(linear: number, angular: number): boolean {
    const twist = { linear: { x: linear, y: 0, z: 0 }, angular: { x: 0, y: 0, z: angular } };
    const stamped = canonicalType(this.#parts.typeOf("/cmd_vel") ?? TWIST) === TWIST_STAMPED;
    return stamped
      ? this.publish("/cmd_vel", TWIST_STAMPED, { header: { frame_id: "base_link" }, twist })
      : this.publish("/cmd_vel", TWIST, twist);
  }

  hint(pose: PlanarPose, sigma: number, headingSigma: number): boolean {
    const covariance = Array<number>(36).fill(0);
    covariance[0] = covariance[7] = sigma * sigma;
    covariance[35] = headingSigma * headingSigma;
    return this.publish("/initialpose", HINT, {
      header: { frame_id: "map" },
      pose: { pose: poseMessage(pose), covariance },
    });
  }

  async previewHint(pose: PlanarPose): Promise<HintPreview | undefined> {
    const request = { pose: poseMessage(pose) };
    const reply = await this.#parts.calls.call("/localization/preview_hint", request, 3);
    const preview = readReply(reply, (values) => readPreview(values, pose));
    return preview.ok ? preview.value : undefined;
  }

  request(wish: Wish): Promise<Answer> {
    return this.#parts.calls.trigger(SERVICES[wish]);
  }

  step({ held = false, ...goal }: StepGoal, listener: StepListener): (() => void) | undefined {
    const way = held ? { hold_to_run: true, measure_by: "localization" } : {};
    return this.goal("/move", "farsteer_msgs/action/Move", { ...goal, ...way }, {
      feedback: (values) => {
        const progress = check(readStepProgress, values);
        if (progress.ok) {
          listener.progress(progress.value);
        }
      },
      ended: (how) => {
        const end = readReply(how, readStepEnd);
        listener.ended(end.ok ? end.value : { outcome: "", message: end.words, distance: 0, angle: 0, duration: 0 });
      },
    });
  }

  /** Send a goal of an action; returns what cancels it, or undefined if it cannot be sent now. */
  goal(action: string, type: string, goal: object, listener: GoalListener): (() => void) | undefined {
    return this.#parts.flows() ? this.#goals.send(action, type, goal, listener) : undefined;
  }

  async takePhoto(): Promise<PhotoAnswer> {
    const answer = readReply(await this.#parts.calls.call("/camera/photo", {}, PHOTO_PATIENCE), readPhoto);
    return answer.ok ? answer.value : { success: false, message: answer.words, name: "" };
  }

  videoTicket(): Promise<Answer> {
    return this.#parts.calls.trigger("/video/ticket");
  }

  authenticate(token: string): void {
    this.#parts.authenticate(token);
  }

  /**
   * A header with the time of sending, by which our robot estimates how old a command is.
   *
   * Others fill in their own: the names of a stamp's parts differ between ROS 1 and ROS 2.
   */
  header(frame = ""): object {
    if (this.#parts.state.dialect.peek() !== "farsteer") {
      return frame === "" ? {} : { header: { frame_id: frame } };
    }
    const milliseconds = this.#parts.epoch();
    const sec = Math.floor(milliseconds / 1000);
    const nanosec = Math.min(999_999_999, Math.floor((milliseconds - 1000 * sec) * 1e6));
    return { header: { stamp: { sec, nanosec }, frame_id: frame } };
  }

  /** Publish a message; false if it cannot be sent now. */
  publish(name: string, type: string, message: object): boolean {
    return this.#parts.flows() && this.#client?.publish(name, this.#parts.typeOf(name) ?? type, message) === true;
  }
}

function poseMessage({ x, y, yaw }: PlanarPose): object {
  return {
    position: { x, y, z: 0 },
    orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) },
  };
}
