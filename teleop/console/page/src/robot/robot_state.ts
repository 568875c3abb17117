/** What is known of the robot: one signal for each thing, written by the link and read by everybody else. */

import { signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type {
  Attitude, Bumpers, CameraImage, CloudPoints, ControlState, DriveLimits, DriveTrouble, GridMap, GuardZone, HintVerdict, LocalizationStatus,
  MapInfo, MapPoints, MeasuredMotion, NearestObstacle, PlaceInQuestion, PlanarCovariance, Session, StampedPose,
} from "../values";

export type ConnectionPhase = "connecting" | "open" | "lost" | "refused";

export interface Connection {
  readonly phase: ConnectionPhase;
  /** One sentence with the way out; empty while all is well. */
  readonly words: string;
  readonly sinceAt: number;
}

/** What answers at the address: a Farsteer robot, another rosbridge, or not known yet. */
export type Dialect = "unknown" | "farsteer" | "plain";

/** A reading of the robot's clock [s] by the page's own [ms]. */
export interface RobotTime {
  readonly stamp: number;
  readonly receivedAt: number;
}

export interface RobotState {
  readonly connection: Signal<Connection>;
  readonly dialect: Signal<Dialect>;
  /** Identity of this run of the robot; whoever keeps something of a run drops it when this changes. */
  readonly run: Signal<string>;
  readonly session: Signal<Session | undefined>;
  readonly mapInfo: Signal<MapInfo | undefined>;
  readonly mapPoints: Signal<MapPoints | undefined>;
  /** The building's surfaces as a glTF file in the map's frame; undefined where the robot has none. */
  readonly surfaces: Signal<ArrayBuffer | undefined>;
  /** Progress of the map's download, 0 to 1; undefined while there is none. */
  readonly mapProgress: Signal<number | undefined>;
  readonly gridMap: Signal<GridMap | undefined>;
  readonly mapFromOdom: Signal<StampedPose | undefined>;
  readonly mapFromBase: Signal<StampedPose | undefined>;
  readonly odomFromBase: Signal<StampedPose | undefined>;
  readonly covariance: Signal<PlanarCovariance | undefined>;
  readonly cloud: Signal<CloudPoints | undefined>;
  /** Horizontal scan as points in `base_link`, shown while there is no pose. */
  readonly scan: Signal<CloudPoints | undefined>;
  readonly status: Signal<LocalizationStatus | undefined>;
  /** Nearest first. */
  readonly candidates: Signal<readonly PlaceInQuestion[]>;
  readonly verdict: Signal<HintVerdict | undefined>;
  readonly control: Signal<ControlState | undefined>;
  /** When `control` came [ms]. */
  readonly controlAt: Signal<number | undefined>;
  readonly bumpers: Signal<Bumpers | undefined>;
  /** What the guard keeps free; undefined while it limits nothing. */
  readonly guard: Signal<GuardZone | undefined>;
  readonly driveTrouble: Signal<DriveTrouble | undefined>;
  /** By the poses in the map: neither what was asked for nor what the wheels did. */
  readonly motion: Signal<MeasuredMotion | undefined>;
  /** Since when it is asked to move and stands all the same [ms]. */
  readonly blockedSince: Signal<number | undefined>;
  readonly nearest: Signal<NearestObstacle | undefined>;
  readonly attitude: Signal<Attitude | undefined>;
  readonly truth: Signal<StampedPose | undefined>;
  /** The robot's model as URDF. */
  readonly description: Signal<string | undefined>;
  readonly driveLimits: Signal<DriveLimits | undefined>;
  /** Whether the robot has an arm. */
  readonly arm: Signal<boolean>;
  /** Positions of the joints by their names [rad, m], of a robot with an arm. */
  readonly joints: Signal<ReadonlyMap<string, number> | undefined>;
  /** The camera's newest picture, of a plain rosbridge that has one. */
  readonly image: Signal<CameraImage | undefined>;
  /** Addresses of a Farsteer robot's streams of pictures by name; undefined if it has no camera. */
  readonly videoSources: Signal<ReadonlyMap<string, string> | undefined>;
  /** The best reading of the robot's clock: a stamp [s], and when it came [ms]. */
  readonly time: Signal<RobotTime | undefined>;
}

/** Return a state in which nothing is known. */
export function unknownState(): RobotState {
  return {
    connection: signal<Connection>({ phase: "connecting", words: "", sinceAt: 0 }),
    dialect: signal<Dialect>("unknown"),
    run: signal(""),
    session: signal(undefined),
    mapInfo: signal(undefined),
    mapPoints: signal(undefined),
    surfaces: signal(undefined),
    mapProgress: signal(undefined),
    gridMap: signal(undefined),
    mapFromOdom: signal(undefined),
    mapFromBase: signal(undefined),
    odomFromBase: signal(undefined),
    covariance: signal(undefined),
    cloud: signal(undefined),
    scan: signal(undefined),
    status: signal(undefined),
    candidates: signal<readonly PlaceInQuestion[]>([]),
    verdict: signal(undefined),
    control: signal(undefined),
    controlAt: signal(undefined),
    bumpers: signal(undefined),
    guard: signal(undefined),
    driveTrouble: signal(undefined),
    motion: signal(undefined),
    blockedSince: signal(undefined),
    nearest: signal(undefined),
    attitude: signal(undefined),
    truth: signal(undefined),
    description: signal(undefined),
    driveLimits: signal(undefined),
    arm: signal(false),
    joints: signal(undefined),
    image: signal(undefined),
    videoSources: signal(undefined),
    time: signal(undefined),
  };
}

/** Forget all that belongs to a run of the robot; the connection, the dialect and what the robot is made of stay. */
export function forgetRun(state: RobotState): void {
  const { connection, dialect, run, session, arm, candidates, ...rest } = state;
  candidates.value = [];
  for (const part of Object.values(rest) as Signal<unknown>[]) {
    part.value = undefined;
  }
}

/** A reading of the clock holds for so long [ms]: a robot that falls behind its pace is followed. */
const READING_HOLDS = 2000;

/**
 * Return the better of a clock's reading and a new one: that of the quickest message of the last seconds.
 *
 * A message that a busy machine held up says a time that has long passed when it comes.
 */
export function betterReading(known: RobotTime | undefined, fresh: RobotTime): RobotTime {
  if (known === undefined || fresh.receivedAt - known.receivedAt > READING_HOLDS) {
    return fresh;
  }
  const gained = 1000 * (fresh.stamp - known.stamp) - (fresh.receivedAt - known.receivedAt);
  return gained >= 0 ? fresh : known;
}

/** Return the robot's time now [s]: the best that is known, and what has passed here since; undefined if none is. */
export function robotTimeNow(state: RobotState, now: number): number | undefined {
  const time = state.time.peek();
  return time === undefined ? undefined : time.stamp + (now - time.receivedAt) / 1000;
}

/** Age and rate of one topic's messages. */
export interface StreamStatistics {
  readonly topic: string;
  /** Since the last message [ms]; undefined if none came. */
  readonly age: number | undefined;
  /** Messages per second over the last seconds. */
  readonly rate: number;
  /** Messages that the robot left out for this connection. */
  readonly dropped: number;
}

/** A part of the way of what is seen, or of a command. */
export type HopName = "robot" | "queue" | "wireDown" | "page" | "drawn" | "hand" | "wireUp" | "gateway" | "control";

export interface Hop {
  readonly name: HopName;
  /** How long it took [ms]. */
  readonly took: number;
  /** Whether it has grown much within two seconds, more than the others. */
  readonly grows: boolean;
}

/** How good the connection is, renewed twice a second. */
export interface LinkStatistics {
  /** Round trip now and 95th percentile of the last minute [ms]; undefined before the first. */
  readonly roundTrip: number | undefined;
  readonly roundTripP95: number | undefined;
  /** Mean difference of successive round trips [ms]. */
  readonly jitter: number | undefined;
  /** How late the page itself comes to what is due, 95th percentile of the last five seconds [ms]. */
  readonly pageLag: number;
  readonly bytesPerSecond: number;
  /** Since anything at all arrived [ms]. */
  readonly silence: number;
  readonly streams: readonly StreamStatistics[];
  /** Where the time goes; none while it is unknown. */
  readonly hops: readonly Hop[];
}

export type LinkStatisticsSignal = ReadonlySignal<LinkStatistics>;
