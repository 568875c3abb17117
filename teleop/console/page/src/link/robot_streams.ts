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

/**
 * Rates as the shortest time between messages [ms]: of the whole picture, and of the lean one.
 *
 * What is shown as stale after 0.5 s comes four times a second at least.
 */
const RATES = {
  tf: [50, 200],
  estimate: [100, 500],
  cloud: [90, 1000],
  leanCloud: [400, 400],
  scan: [200, 1000],
  status: [0, 250],
  candidates: [200, 500],
  control: [0, 200],
  guard: [100, 250],
  bumpers: [100, 250],
  diagnostics: [0, 0],
  inertial: [100, 250],
  truth: [100, 250],
  joints: [50, 200],
} as const;

/** Topic that only a robot with an arm has. */
export const ARM_TOPIC = "/arm/info";

/** Topics that the page needs of any Farsteer robot. */
export const CONTROL_TOPIC = "/teleop/state";
export const CONTROL_TYPE = "farsteer_msgs/TeleopState";

export function robotStreams(intake: MessageIntake, kinds: MessageKinds, settings: StreamSettings): Stream[] {
  const { lean, topics } = settings;
  const has = (topic: string): boolean => topics?.has(topic) ?? true;
  const throttle = (rate: keyof typeof RATES): number => RATES[rate][lean ? 1 : 0];
  const latched = { latched: true, cbor: true } as const;
  const live = (rate: keyof typeof RATES): { throttle: number; cbor: true } => ({ throttle: throttle(rate), cbor: true });
  const leanCloud = lean && has("/local_cloud/lean");
  const streams = [
    // First the map: it says which run of the robot all that follows is of.
    intake.stream({ topic: "/map_info", type: "farsteer_msgs/MapInfo", ...latched }, kinds.mapInfo),
    intake.stream({ topic: "/tf_static", type: "tf2_msgs/TFMessage", ...latched }, kinds.fixedTransforms),
    intake.stream({ topic: "/robot_description", type: "std_msgs/String", ...latched }, kinds.description),
    intake.stream({ topic: "/drive_limits", type: "farsteer_msgs/DriveLimits", ...latched }, kinds.driveLimits),
    intake.stream({ topic: "/cam_sources", type: "std_msgs/String", ...latched }, kinds.videoSources),
    intake.stream(
      { topic: "/localization/hint_verdict", type: "farsteer_msgs/HintVerdict", ...latched }, kinds.verdict,
    ),
    intake.stream({ topic: CONTROL_TOPIC, type: CONTROL_TYPE, ...live("control") }, kinds.control),
    intake.stream({ topic: "/teleop/guard", type: "farsteer_msgs/Guard", ...live("guard") }, kinds.guard),
    intake.stream({ topic: "/bumper_state", type: "farsteer_msgs/BumperState", ...live("bumpers") }, kinds.bumpers),
    intake.stream({ topic: "/diagnostics", type: "diagnostic_msgs/DiagnosticArray", ...live("diagnostics") }, kinds.driveTrouble),
    intake.stream({ topic: "/tf", type: "tf2_msgs/TFMessage", ...live("tf") }, kinds.transforms),
    intake.stream(
      { topic: "/amcl_pose", type: "geometry_msgs/PoseWithCovarianceStamped", ...live("estimate") }, kinds.estimate,
    ),
    intake.stream(
      { topic: "/localization/status", type: "farsteer_msgs/LocalizationStatus", ...live("status") }, kinds.status,
    ),
    intake.stream(
      { topic: "/localization/candidates", type: "geometry_msgs/PoseArray", ...live("candidates") }, kinds.candidates,
    ),
    intake.stream({ topic: "/imu/data", type: "sensor_msgs/Imu", ...live("inertial") }, kinds.inertial),
    intake.stream({ topic: "/ground_truth/odom", type: "nav_msgs/Odometry", ...live("truth") }, kinds.truth),
    leanCloud
      ? intake.stream(
        { topic: "/local_cloud/lean", type: "farsteer_msgs/LeanCloud", ...live("leanCloud") }, kinds.leanCloud,
      )
      : intake.stream({ topic: "/local_cloud", type: "sensor_msgs/PointCloud2", ...live("cloud") }, kinds.cloud),
  ];
  if (topics?.has(ARM_TOPIC) === true) {
    streams.push(intake.stream({ topic: "/joint_states", type: "sensor_msgs/JointState", ...live("joints") }, kinds.joints));
  }
  if (settings.scan) {
    streams.push(intake.stream({ topic: "/scan", type: "sensor_msgs/LaserScan", ...live("scan") }, kinds.scan));
  }
  return streams.filter(({ topic }) => (topic === "/cam_sources" ? topics?.has(topic) === true : has(topic)));
}
