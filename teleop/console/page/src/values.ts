/**
 * The vocabulary of the page: plain frozen values that all parts share.
 *
 * Units are SI and radians, frames as in REP 103 and 105. Times are milliseconds of the page's monotonic clock
 * (`performance.now()`) where a name ends in `At`, and seconds of the robot's clock where it is `stamp`.
 */

/** A value that its owner renews each frame, rather than leave a new one behind in each: those come back as a pause. */
export type Renewed<T> = { -readonly [Field in keyof T]: T[Field] };

export interface Vector3 {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

export interface Quaternion {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly w: number;
}

export interface Pose {
  readonly position: Vector3;
  readonly orientation: Quaternion;
}

/** A pose on the floor: position [m] and heading [rad], left positive. */
export interface PlanarPose {
  readonly x: number;
  readonly y: number;
  readonly yaw: number;
}

/** A pose and when it was so. */
export interface StampedPose extends Pose {
  readonly stamp: number;
  readonly receivedAt: number;
}

/** Covariance of x, y and yaw in the map, row by row: 9 values [m², m rad, rad²]. */
export type PlanarCovariance = readonly number[];

/** Points of a cloud: x, y, z in turn [m], and each point's distance to the map [m], NaN where it is unknown. */
export interface CloudPoints {
  readonly stamp: number;
  readonly receivedAt: number;
  readonly frame: string;
  readonly positions: Float32Array;
  readonly distances: Float32Array;
}

/** The cloud that the robot localises in. */
export interface MapInfo {
  readonly name: string;
  readonly frame: string;
  readonly sha256: string;
  readonly points: number;
  readonly min: Vector3;
  readonly max: Vector3;
  readonly run: string;
  readonly places?: readonly NamedPlace[];
}

/** A place in the map, and where a robot looks there. */
export interface NamedPlace {
  readonly name: string;
  readonly pose: Pose;
}

/** Where the robot may be: by name, the share of what it sees that is explained there, and how far from where it was [m]. */
export interface PlaceInQuestion extends Pose {
  readonly name?: string;
  readonly share?: number | undefined;
  readonly away?: number | undefined;
}

/** The map's points: x, y, z in turn [m] in the map's frame, and normals if there are some. */
export interface MapPoints {
  readonly sha256: string;
  readonly positions: Float32Array;
  /** x, y, z of each point's unit normal in turn, times 127. */
  readonly normals?: Int8Array;
}

/** An occupancy grid of a plain rosbridge, in place of a map of points. */
export interface GridMap {
  readonly frame: string;
  readonly origin: Pose;
  readonly resolution: number;
  readonly width: number;
  readonly height: number;
  readonly cells: Int8Array;
}

export type Health =
  | "waiting" | "tracking" | "degraded" | "slipping" | "suspect" | "lost" | "relocalising";

export interface LocalizationStatus {
  readonly stamp: number;
  readonly health: Health;
  readonly reasons: readonly string[];
  readonly fit: number;
  readonly positionSigma: number;
  readonly headingSigma: number;
  /** Share of the sweep that each place in question explains. */
  readonly candidateScores?: readonly number[];
}

export interface HintVerdict {
  readonly stamp: number;
  readonly verdict: "accepted" | "kept" | "ambiguous" | "rejected";
  readonly reason: string;
  readonly hint: Pose;
  readonly candidates: readonly Pose[];
  readonly scores: readonly number[];
}

/** A picture of a camera: a blob's address, which holds until two newer pictures have come. */
export interface CameraImage {
  readonly topic: string;
  readonly url: string;
  readonly receivedAt: number;
}

/** Which segments of the bumpers were pressed last, each ring from the robot's left. */
export interface Bumpers {
  readonly front: readonly boolean[];
  readonly rear: readonly boolean[];
  readonly receivedAt: number;
}

/** What the drive reports of falls and stalls: 0 nothing, 1 a warning, 2 an error. */
export interface DriveTrouble {
  readonly level: number;
  readonly words: string;
}

/** How fast the robot moves by where it is: along its heading [m/s], and to the left [rad/s]. */
export interface MeasuredMotion {
  readonly linear: number;
  readonly angular: number;
  readonly receivedAt: number;
}

/** The nearest thing in what the robot sees now: from its outline [m], and where, left of ahead [rad]. */
export interface NearestObstacle {
  readonly distance: number;
  readonly bearing: number;
  readonly receivedAt: number;
}

/** Who drives and whether the robot listens: `/teleop/state`. */
export interface ControlState {
  readonly stamp: number;
  readonly state: "idle" | "armed" | "disarmed" | "estop";
  readonly reason: string;
  readonly controller: string;
  readonly armed: boolean;
  readonly estop: boolean;
  readonly commandAge: number;
  readonly linear: number;
  readonly angular: number;
  readonly linkAge: number;
  readonly slowAbove: number;
  readonly refuseAbove: number;
  /** Number of the client that asks for the robot; 0 if none does. */
  readonly asking: number;
  readonly askingName: string;
  /** What the guard does to what is asked for, and why. */
  readonly guard: "free" | "slowed" | "stopped" | "off";
  readonly guardReason: string;
  /** Who has switched the guard off; empty if nobody has. */
  readonly guardOffBy: string;
  /** How much of what is asked for is driven; undefined of a robot that does not say. */
  readonly pace?: Pace;
}

/** How much of what is asked for the robot drives, and for how long. */
export interface Pace {
  /** Share that the guard lets through. */
  readonly guard: number;
  /** Share at which it drives since commands come late. */
  readonly late: number;
  /** Time for which what is asked for goes on until the guard stops it [s]. */
  readonly ahead: number;
}

/** How the robot answers a command: `/drive_limits` [m/s^2, rad/s^2, s]. */
export interface DriveLimits {
  readonly acceleration: number;
  readonly braking: number;
  readonly turnAcceleration: number;
  readonly turnBraking: number;
  readonly lag: number;
}

/** What limits the robot, in `base_link` [m]: `/teleop/guard`. */
export interface GuardZone {
  readonly stopped: boolean;
  /** Corners of what would be swept until the robot stands. */
  readonly outline: readonly Spot[];
  /** Of the obstacle that decides. */
  readonly point?: Spot;
}

/** A spot on the floor [m]. */
export interface Spot {
  readonly x: number;
  readonly y: number;
}

/** What this connection is to the robot: `/teleop/session`. */
export interface Session {
  readonly client: number;
  readonly name: string;
  readonly role: string;
  readonly tokens: boolean;
  readonly mayDrive: boolean;
  readonly mayStop: boolean;
  readonly mayReset: boolean;
  readonly mayHint: boolean;
  readonly maySearch: boolean;
  readonly mayTakeOver: boolean;
  readonly mayShare: boolean;
  /** Whether the token is that of a link, and the robot gives this device one of its own. */
  readonly link: boolean;
  /** Whether the robot is simulated, and this page may change its world. */
  readonly mayPlay: boolean;
}

/** Roll (left side up) and pitch (nose down) [rad], and the topic that they are from. */
export interface Attitude {
  readonly roll: number;
  readonly pitch: number;
  readonly source: string;
  readonly receivedAt: number;
}

/** Share of a sweep's points that lie on the map, at a proposed pose and at the present one (undefined: none). */
export interface HintPreview {
  readonly pose: PlanarPose;
  readonly explained: number;
  readonly present: number | undefined;
}

/** What a service answered. */
export interface Answer {
  readonly success: boolean;
  readonly message: string;
}

export type Severity = "info" | "warning" | "alarm";

/** A line of the event list. */
export interface ConsoleEvent {
  readonly time: Date;
  readonly severity: Severity;
  readonly words: string;
  /** How often it came in a row, and of an alarm how often it began. */
  readonly count: number;
  /** Which alarm it is, when it began last, and for how long it lasted before in all [s]. */
  readonly alarm?: { readonly kind: string; readonly begun: Date; readonly active: boolean; readonly lasted: number } | undefined;
}
