/** The topics that the page listens to on a rosbridge that it knows nothing of: found by their types. */

import { canonicalType } from "./message_checks/answers";
import type { MessageIntake } from "./message_intake";
import type { MessageKinds } from "./message_kinds";
import { CONTROL_TOPIC, CONTROL_TYPE } from "./robot_streams";
import type { Stream } from "./subscriptions";

interface Wish {
  /** Types in the form of ROS 1. */
  readonly types: readonly string[];
  /** The usual name, which is tried if the server does not say what there is. */
  readonly usual: string;
  /** Whether another topic of the type will do. */
  readonly other: boolean;
  readonly throttle: number;
  readonly latched: boolean;
  /** What the name of a better one among several contains. */
  readonly better?: RegExp;
  /** What the name of one that is not meant contains. */
  readonly not?: RegExp;
}

const TF = ["tf2_msgs/TFMessage", "tf/tfMessage"];
const LIVE = { other: true, latched: false } as const;
const KEPT = { throttle: 0, latched: true } as const;

const WISHES: readonly (readonly [kind: keyof MessageKinds, wish: Wish])[] = [
  ["fixedTransforms", { types: TF, usual: "/tf_static", other: false, ...KEPT }],
  ["description", { types: ["std_msgs/String"], usual: "/robot_description", other: false, ...KEPT }],
  ["grid", { types: ["nav_msgs/OccupancyGrid"], usual: "/map", other: true, ...KEPT, not: /costmap/ }],
  ["transforms", { types: TF, usual: "/tf", other: false, throttle: 0, latched: false }],
  ["odometry", { types: ["nav_msgs/Odometry"], usual: "/odom", ...LIVE, throttle: 50, not: /ground_truth/ }],
  ["estimate", { types: ["geometry_msgs/PoseWithCovarianceStamped"], usual: "/amcl_pose", other: false, throttle: 100, latched: false }],
  ["scan", { types: ["sensor_msgs/LaserScan"], usual: "/scan", ...LIVE, throttle: 200 }],
  // Clouds in JSON take four bytes for three, and a depth camera has ten times a scanner's points.
  ["cloud", { types: ["sensor_msgs/PointCloud2"], usual: "/points", ...LIVE, throttle: 500, better: /local|lidar|velodyne/ }],
  ["inertial", { types: ["sensor_msgs/Imu"], usual: "/imu/data", ...LIVE, throttle: 100 }],
  ["image", { types: ["sensor_msgs/CompressedImage"], usual: "/image_raw/compressed", ...LIVE, throttle: 200, not: /depth|[tT]heora/ }],
];

export function plainStreams(
  intake: MessageIntake, kinds: MessageKinds, topics: ReadonlyMap<string, string> | undefined, pictures: boolean,
): Stream[] {
  const streams = WISHES.filter(([kind]) => pictures || kind !== "image").flatMap(([kind, wish]) => {
    const found = choose(wish, topics);
    const { throttle, latched } = wish;
    // Not every server has CBOR; all have JSON.
    return found === undefined ? [] : [intake.stream({ ...found, throttle, latched, cbor: false }, kinds[kind])];
  });
  if (topics === undefined) {
    // A server that does not say what there is may still be our robot.
    streams.push(intake.stream({ topic: CONTROL_TOPIC, type: CONTROL_TYPE, cbor: false }, kinds.control));
  }
  return streams;
}

/** The topic for a wish, and its type as the server calls it; undefined if there is none. */
function choose(
  wish: Wish, topics: ReadonlyMap<string, string> | undefined,
): { readonly topic: string; readonly type: string } | undefined {
  if (topics === undefined) {
    return { topic: wish.usual, type: wish.types[0] ?? "" };
  }
  const fits = [...topics].filter(
    ([name, type]) => wish.types.includes(canonicalType(type)) && (wish.not?.test(name) !== true || name === wish.usual),
  );
  const usual = fits.find(([name]) => name === wish.usual);
  const others = wish.other ? fits.sort(([a], [b]) => a.localeCompare(b)) : [];
  const chosen = usual ?? others.find(([name]) => wish.better?.test(name)) ?? others[0];
  return chosen === undefined ? undefined : { topic: chosen[0], type: chosen[1] };
}
