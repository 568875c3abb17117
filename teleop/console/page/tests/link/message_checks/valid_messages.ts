/** A good message of each kind, and its reader. */

import { readArmInfo, readArmState, readGripEnd, readMoveEnd, readMoveProgress, readRumble } from "../../../src/link/message_checks/arm_messages";
import { readLinkAnswer, readPreview, readSession, readTopics } from "../../../src/link/message_checks/answers";
import type { Field } from "../../../src/link/message_checks/field";
import { readLeanCloud } from "../../../src/link/message_checks/lean_cloud";
import { readPointCloud2 } from "../../../src/link/message_checks/point_cloud2";
import {
  readEstimate, readInertial, readOdometry, readPoses, readTransforms,
} from "../../../src/link/message_checks/pose_messages";
import {
  readControl, readDescription, readMapInfo, readStatus, readVerdict,
} from "../../../src/link/message_checks/robot_messages";
import { readCompressedImage, readLaserScan, readOccupancyGrid } from "../../../src/link/message_checks/sensor_messages";

const header = { stamp: { sec: 3, nanosec: 500_000_000 }, frame_id: "map" };
const position = { x: 1, y: 2, z: 0 };
const orientation = { x: 0, y: 0, z: 0, w: 1 };
const pose = { position, orientation };
const covariance = Array.from({ length: 36 }, (_, i) => (i % 7 === 0 ? 0.01 : 0));

/** A cloud of two points in the robot's own layout. */
export function cloudMessage(): Record<string, unknown> {
  const data = new Uint8Array(new Float32Array([1, 2, 3, 0, 0.5, 4, 5, 6, 0, NaN]).buffer);
  const fields = ["x", "y", "z", "intensity", "distance"].map((name, i) => ({
    name, offset: 4 * i, datatype: 7, count: 1,
  }));
  return {
    header, height: 1, width: 2, fields, is_bigendian: false, point_step: 20, row_step: 40, data, is_dense: false,
  };
}

export interface Example {
  readonly read: (message: Field) => unknown;
  readonly message: Readonly<Record<string, unknown>>;
}

export const EXAMPLES: Readonly<Record<string, Example>> = {
  transforms: {
    read: readTransforms,
    message: {
      transforms: [{ header, child_frame_id: "odom", transform: { translation: position, rotation: orientation } }],
    },
  },
  odometry: {
    read: (message) => readOdometry(message, 0),
    message: {
      header,
      child_frame_id: "base_link",
      pose: { pose, covariance },
      twist: { twist: { linear: position, angular: position }, covariance },
    },
  },
  estimate: {
    read: (message) => readEstimate(message, 0),
    message: { header, pose: { pose, covariance: Float64Array.from(covariance) } },
  },
  poses: { read: readPoses, message: { header, poses: [pose, pose] } },
  inertial: {
    read: readInertial,
    message: { header, orientation, orientation_covariance: Array<number>(9).fill(0) },
  },
  cloud: { read: (message) => readPointCloud2(message, 0), message: cloudMessage() },
  leanCloud: {
    read: (message) => readLeanCloud(message, 0),
    message: { header, origin: position, resolution: 0.02, data: "AQACAAMAMg==" },
  },
  scan: {
    read: (message) => readLaserScan(message, 0),
    message: {
      header, angle_min: 0, angle_max: 1, angle_increment: 0.5, range_min: 0.1, range_max: 20, ranges: [1, null, 21],
    },
  },
  grid: {
    read: readOccupancyGrid,
    message: { header, info: { resolution: 0.05, width: 2, height: 2, origin: pose }, data: [0, 100, -1, 50] },
  },
  image: { read: readCompressedImage, message: { header, format: "rgb8; jpeg compressed bgr8", data: "/9g=" } },
  mapInfo: {
    read: readMapInfo,
    message: {
      name: "office", frame_id: "map", sha256: "0b".repeat(32), points: 171_074, min: position, max: position,
      run_id: "95601136827a3f22", place_names: ["small_office"], places: [pose],
    },
  },
  status: {
    read: readStatus,
    message: {
      header, health: "tracking", reasons: ["few points"], fit: 0.9, nis: 1, position_sigma: 0.01, heading_sigma: 0.01,
      candidate_scores: [0.9],
    },
  },
  verdict: {
    read: readVerdict,
    message: {
      header, verdict: "ambiguous", reason: "two places", hint: pose, candidates: [pose, pose], scores: [0.9, 0.8],
    },
  },
  control: {
    read: readControl,
    message: {
      header, state: "idle", reason: "no driver yet", controller: "", armed: false, estop: false, command_age: 0,
      linear: 0, angular: 0, link_age: 0, slow_above: 0.5, refuse_above: 1, asking: 3, asking_name: "client 3",
    },
  },
  description: { read: readDescription, message: { data: "<robot name='p3at'/>" } },
  session: {
    read: readSession,
    message: {
      client: 3, name: "client 3", role: "admin", tokens: false, may_drive: true, may_stop: true, may_reset: true,
      may_hint: true, may_search: true, may_take_over: true, may_share: false, link: false, may_play: false,
    },
  },
  preview: {
    read: (values) => readPreview(values, { x: 0, y: 0, yaw: 0 }),
    message: { success: true, message: "", explained: 0.93, present: -1 },
  },
  dropped: {
    read: readLinkAnswer,
    message: {
      topics: ["/tf", "/scan"], sent: [10, 20], dropped: new BigUint64Array([1n, 2n]), made: [0.01, -1],
      queued: [0.002, -1], now: 70.5, stamp: 60.5, taken: 0.012,
    },
  },
  topics: { read: readTopics, message: { topics: ["/tf"], types: ["tf2_msgs/msg/TFMessage"] } },
  armInfo: {
    read: readArmInfo,
    message: {
      name: "s2", joints: ["a", "b"], turns: ["yaw", "elbow"], lower: [-1, -1], upper: [1, 1], stall: [1, 1], gripper_joint: "g",
      opening: 0.06, force: 6, pose_names: ["stow"], pose_angles: [0, 1], mount: pose,
    },
  },
  armState: {
    read: readArmState,
    message: {
      header, mode: "idle", reason: "nobody moves the arm", way_out: "", way_out_text: "", angles: [0, 1], load: [0.1, 0.2], tip: pose,
      opening: 0.03, grip_force: 4, holding: true, stowed: false,
    },
  },
  rumble: { read: readRumble, message: { array: [{ type: 1, id: 0, intensity: 0.5 }] } },
  moveProgress: { read: readMoveProgress, message: { state: "moving", share: 0.5, path: { points: [{ positions: [0, 1] }] } } },
  moveEnd: { read: readMoveEnd, message: { outcome: "done", message: "" } },
  gripEnd: { read: readGripEnd, message: { position: 0.03, effort: 4, stalled: true, reached_goal: false } },
};
