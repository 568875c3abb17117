/** A rosbridge of which the test decides everything, and a link to it. */

import { RobotLink } from "../../src/link/robot_link";
import type { MapJob, MapResult } from "../../src/link/map_file";
import { type RobotState, unknownState } from "../../src/robot/robot_state";
import { EXAMPLES } from "./message_checks/valid_messages";
import { FakeSocket, type Sent } from "./fake_socket";

export const ROBOT_TOPICS: Readonly<Record<string, string>> = {
  "/map_info": "farsteer_msgs/msg/MapInfo",
  "/tf_static": "tf2_msgs/msg/TFMessage",
  "/tf": "tf2_msgs/msg/TFMessage",
  "/teleop/state": "farsteer_msgs/msg/TeleopState",
  "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
  "/local_cloud": "sensor_msgs/msg/PointCloud2",
  "/local_cloud/lean": "farsteer_msgs/msg/LeanCloud",
  "/localization/status": "farsteer_msgs/msg/LocalizationStatus",
  "/localization/hint_verdict": "farsteer_msgs/msg/HintVerdict",
  "/imu/data": "sensor_msgs/msg/Imu",
  "/scan": "sensor_msgs/msg/LaserScan",
};

export class FakeRobot {
  readonly sockets: FakeSocket[] = [];
  readonly events: string[] = [];
  readonly fetched: string[] = [];
  readonly state: RobotState = unknownState();
  readonly link: RobotLink;
  /** What services answer; those without an answer are refused, and null is silence. */
  services: Record<string, object | null>;
  read: (job: MapJob) => Promise<MapResult> = () =>
    Promise.resolve({ kind: "map", positions: new Float32Array([1, 2, 3]), verified: true });

  constructor(topics: Readonly<Record<string, string>> | null = ROBOT_TOPICS) {
    this.services = topics === null
      ? {}
      : { "/rosapi/topics": { topics: Object.keys(topics), types: Object.values(topics) } };
    this.link = new RobotLink(
      "ws://robot:9090", { token: "secret", name: () => "Anna" }, this.state,
      (severity, words) => {
        this.events.push(`${severity}: ${words}`);
      },
      {
        openSocket: () => {
          const socket = new FakeSocket();
          socket.receive = (operation) => {
            this.#receive(socket, operation);
          };
          this.sockets.push(socket);
          setTimeout(() => {
            socket.accept();
          });
          return socket;
        },
        diagnose: () => Promise.resolve("diagnosed"),
        now: () => performance.now(),
        epoch: () => 5500,
        fetch: (url) => {
          this.fetched.push(url);
          return Promise.resolve(new Response("map"));
        },
        caches: undefined,
        readMap: (job) => this.read(job),
        nextFrame: (call) => {
          setTimeout(call, 16);
        },
        awake: new EventTarget(),
      },
    );
  }

  get socket(): FakeSocket {
    const socket = this.sockets.at(-1);
    if (socket === undefined) {
      throw new Error("nobody has connected");
    }
    return socket;
  }

  /** Topics that the page listens to now. */
  get topics(): string[] {
    const names = new Set<string>();
    for (const { op, topic } of this.socket.sent) {
      if (op === "subscribe") {
        names.add(String(topic));
      } else if (op === "unsubscribe") {
        names.delete(String(topic));
      }
    }
    return [...names];
  }

  publish(topic: string, message: unknown): void {
    this.socket.deliver({ op: "publish", topic, msg: message });
  }

  /** Publish a good message, with these fields changed. */
  example(topic: string, kind: string, part: object = {}): void {
    this.publish(topic, { ...EXAMPLES[kind]?.message, ...part });
  }

  #receive(socket: FakeSocket, { op, id, service }: Sent): void {
    if (op === "call_service") {
      const values = this.services[String(service)];
      if (values !== null) {
        const answer = values === undefined ? { result: false, values: "no such service" } : { result: true, values };
        setTimeout(() => {
          if (socket.readyState === 1) {
            socket.deliver({ op: "service_response", id, service, ...answer });
          }
        }, 5);
      }
    }
  }
}

/** A header of a time [s]. */
export function headerAt(seconds: number, frame = "map"): object {
  return { stamp: { sec: Math.floor(seconds), nanosec: 0 }, frame_id: frame };
}

/** A transform of a frame at x [m] in its parent. */
export function transform(parent: string, child: string, x: number, seconds = 3): object {
  const rotation = { x: 0, y: 0, z: 0, w: 1 };
  return { header: headerAt(seconds, parent), child_frame_id: child, transform: { translation: { x, y: 0, z: 0 }, rotation } };
}
