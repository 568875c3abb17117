/** The topics that the page listens to on a Farsteer robot, and how often each is wanted. */

import type { MessageIntake } from "./message_intake";
import type { MessageKinds } from "./message_kinds";
import type { Stream } from "./subscriptions";

export interface StreamSettings {
  /** At most 256 kbit/s instead of 4 Mbit/s. */
  readonly lean: boolean;
  /** Whether the scan is wanted, which stands in for the cloud while there is no pose. */
  readonly scan: boolean;
  /** The server's topics with their types; undefined if it does not say. */
  readonly topics: ReadonlyMap<string, string> | undefined;
}

/** Topic that only a robot with an arm has. */
export const ARM_TOPIC = "/arm/info";

/** Topics that the page needs of any Farsteer robot. */
export const CONTROL_TOPIC = "/teleop/state";
export const CONTROL_TYPE = "farsteer_msgs/TeleopState";

/** Shortest time between messages [ms]: of the whole picture, and of the lean one. */
type Rate = readonly [whole: number, lean: number];

/**
 * Those without a rate are latched.
 *
 * What is shown as stale after 0.5 s comes four times a second at least.
 */
const STREAMS: readonly (readonly [topic: string, type: string, kind: keyof MessageKinds, rate?: Rate])[] = [
  // First the map: it says which run of the robot all that follows is of.
  ["/map_info", "farsteer_msgs/MapInfo", "mapInfo"],
  ["/tf_static", "tf2_msgs/TFMessage", "fixedTransforms"],
  ["/robot_description", "std_msgs/String", "description"],
  ["/drive_limits", "farsteer_msgs/DriveLimits", "driveLimits"],
  ["/cam_sources", "std_msgs/String", "videoSources"],
  ["/localization/hint_verdict", "farsteer_msgs/HintVerdict", "verdict"],
  [CONTROL_TOPIC, CONTROL_TYPE, "control", [0, 200]],
  ["/teleop/guard", "farsteer_msgs/Guard", "guard", [100, 250]],
  ["/bumper_state", "farsteer_msgs/BumperState", "bumpers", [100, 250]],
  ["/diagnostics", "diagnostic_msgs/DiagnosticArray", "driveTrouble", [0, 0]],
  ["/tf", "tf2_msgs/TFMessage", "transforms", [50, 200]],
  ["/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", "estimate", [100, 500]],
  ["/localization/status", "farsteer_msgs/LocalizationStatus", "status", [0, 250]],
  ["/localization/candidates", "geometry_msgs/PoseArray", "candidates", [200, 500]],
  ["/imu/data", "sensor_msgs/Imu", "inertial", [100, 250]],
  ["/ground_truth/odom", "nav_msgs/Odometry", "truth", [100, 250]],
  ["/local_cloud/lean", "farsteer_msgs/LeanCloud", "leanCloud", [400, 400]],
  ["/local_cloud", "sensor_msgs/PointCloud2", "cloud", [90, 1000]],
  ["/joint_states", "sensor_msgs/JointState", "joints", [50, 200]],
  ["/scan", "sensor_msgs/LaserScan", "scan", [200, 1000]],
];

export function robotStreams(intake: MessageIntake, kinds: MessageKinds, { lean, scan, topics }: StreamSettings): Stream[] {
  const has = (topic: string): boolean => topics?.has(topic) ?? true;
  const wanted: Readonly<Record<string, boolean>> = {
    "/cam_sources": topics?.has("/cam_sources") === true,
    "/local_cloud/lean": lean,
    "/local_cloud": !(lean && has("/local_cloud/lean")),
    "/joint_states": topics?.has(ARM_TOPIC) === true,
    "/scan": scan,
  };
  return STREAMS.filter(([topic]) => has(topic) && wanted[topic] !== false).map(([topic, type, kind, rate]) => {
    const request = { topic, type, throttle: rate?.[lean ? 1 : 0] ?? 0, latched: rate === undefined, cbor: true };
    return intake.stream(request, kinds[kind]);
  });
}
