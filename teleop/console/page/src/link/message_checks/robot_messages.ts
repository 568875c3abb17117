/** Messages of a Farsteer robot's own types. */

import type {
  Bumpers, ControlState, DriveLimits, DriveTrouble, GuardZone, Health, HintVerdict, LocalizationStatus, MapInfo, NamedPlace, Pace, Spot,
} from "../../values";
import type { Field } from "./field";
import { frame, headerStamp, pose, vector } from "./geometry";

const HEALTH: readonly Health[] = [
  "waiting", "tracking", "degraded", "slipping", "suspect", "lost", "relocalising",
];
const GUARD = ["free", "slowed", "stopped", "off"] as const;
const MOST_CORNERS = 200;
const SENTENCE = 1000;
/** A model of primitive shapes has a few kB; one with meshes inside is not for this page. */
const LONGEST_SOURCES = 64 * 1024;
const MOST_SOURCES = 50;
const MOST_PLACES = 200;
const MOST_SEGMENTS = 100;
const LONGEST_DESCRIPTION = 1_000_000;

/** `farsteer_msgs/MapInfo`. */
export function readMapInfo(message: Field): MapInfo {
  const sha256 = message.at("sha256").text().toLowerCase();
  if (!/^[0-9a-f]{64}$/.test(sha256)) {
    message.at("sha256").fail("is not a SHA-256");
  }
  return {
    name: message.at("name").text(),
    frame: frame(message.at("frame_id")),
    sha256,
    points: message.at("points").count(0xffffffff),
    min: vector(message.at("min")),
    max: vector(message.at("max")),
    run: message.at("run_id").text(),
    places: places(message.at("place_names"), message.at("places")),
  };
}

/** Named places, of robots that know some. */
function places(names: Field, poses: Field): NamedPlace[] {
  const found = names.missing || poses.missing ? [] : poses.list(MOST_PLACES).map(pose);
  const words = found.length === 0 ? [] : names.list(MOST_PLACES).map((name) => name.text().replaceAll("_", " "));
  return found.flatMap((at, index) => (words[index] === undefined ? [] : [{ name: words[index], pose: at }]));
}

function shares(scores: Field): number[] {
  return Array.from(scores.numbers(1000), (score) => (score >= 0 && score <= 1 ? score : 0));
}

/** `farsteer_msgs/LocalizationStatus`. */
export function readStatus(message: Field): LocalizationStatus {
  const scores = message.at("candidate_scores");
  return {
    stamp: headerStamp(message),
    health: message.at("health").word(HEALTH),
    reasons: message.at("reasons").list(100).map((reason) => reason.text(SENTENCE)),
    fit: message.at("fit").within(0, 1),
    positionSigma: message.at("position_sigma").within(0, 1e7),
    headingSigma: message.at("heading_sigma").within(0, 1e3),
    candidateScores: scores.missing ? [] : shares(scores),
  };
}

/** `farsteer_msgs/HintVerdict`. */
export function readVerdict(message: Field): HintVerdict {
  return {
    stamp: headerStamp(message),
    verdict: message.at("verdict").word(["accepted", "kept", "ambiguous", "rejected"]),
    reason: message.at("reason").text(SENTENCE),
    hint: pose(message.at("hint")),
    candidates: message.at("candidates").list(1000).map(pose),
    scores: shares(message.at("scores")),
  };
}

/** `farsteer_msgs/TeleopState`; a robot that knows of no asking is one of which nobody asks. */
export function readControl(message: Field): ControlState {
  const seconds = (name: string): number => message.at(name).within(0, 1e12);
  const asking = message.at("asking");
  const askingName = message.at("asking_name");
  const guard = message.at("guard");
  return {
    stamp: headerStamp(message),
    state: message.at("state").word(["idle", "armed", "disarmed", "estop"]),
    reason: message.at("reason").text(SENTENCE),
    controller: message.at("controller").text(),
    armed: message.at("armed").boolean(),
    estop: message.at("estop").boolean(),
    commandAge: seconds("command_age"),
    linear: message.at("linear").within(-1e3, 1e3),
    angular: message.at("angular").within(-1e3, 1e3),
    linkAge: seconds("link_age"),
    slowAbove: seconds("slow_above"),
    refuseAbove: seconds("refuse_above"),
    asking: asking.missing ? 0 : asking.count(0xffffffff),
    askingName: askingName.missing ? "" : askingName.text(),
    guard: guard.missing ? "off" : guard.word(GUARD),
    guardReason: guard.missing ? "" : message.at("guard_reason").text(SENTENCE),
    guardOffBy: guard.missing ? "" : message.at("guard_overridden_by").text(),
    ...(message.at("guard_ahead").missing ? {} : { pace: pace(message) }),
  };
}

function pace(message: Field): Pace {
  const share = (name: string): number => message.at(name).within(0, 1);
  return { guard: share("guard_factor"), late: share("late_factor"), ahead: message.at("guard_ahead").within(0, 1e3) };
}

/** `farsteer_msgs/DriveLimits`. */
export function readDriveLimits(message: Field): DriveLimits {
  const limit = (name: string): number => message.at(name).within(0.01, 1e3);
  return {
    acceleration: limit("acceleration"), braking: limit("braking"), turnAcceleration: limit("turn_acceleration"),
    turnBraking: limit("turn_braking"), lag: message.at("lag").within(0, 10),
  };
}

/** `farsteer_msgs/Guard`; undefined while it limits nothing. */
export function readGuard(message: Field): GuardZone | undefined {
  const state = message.at("state").word(GUARD);
  if (state === "free" || state === "off") {
    return undefined;
  }
  const spot = (field: Field): Spot => ({ x: field.at("x").within(-1e3, 1e3), y: field.at("y").within(-1e3, 1e3) });
  const outline = message.at("outline").at("points").list(MOST_CORNERS).map(spot);
  const point = message.at("has_point").boolean() ? { point: spot(message.at("point")) } : {};
  return { stopped: state === "stopped", outline, ...point };
}

/** `farsteer_msgs/BumperState`. */
export function readBumpers(message: Field): Omit<Bumpers, "receivedAt"> {
  const ring = (name: string): boolean[] => message.at(name).list(MOST_SEGMENTS).map((segment) => segment.boolean());
  return { front: ring("front_bumpers"), rear: ring("rear_bumpers") };
}

/** `diagnostic_msgs/DiagnosticArray`: of its drive, without bumps, which come sooner by themselves; undefined: not said. */
export function readDriveTrouble(message: Field): DriveTrouble | undefined {
  for (const part of message.at("status").list(MOST_SOURCES)) {
    if (part.at("name").text() === "drive") {
      const troubles = part.at("message").text(SENTENCE).split("; ").filter((words) => words !== "ok" && !words.startsWith("bumped"));
      return { level: troubles.length === 0 ? 0 : part.at("level").count(3), words: troubles.join("; ") };
    }
  }
  return undefined;
}

/** `std_msgs/String` with the robot's model as URDF. */
export function readDescription(message: Field): string {
  return message.at("data").text(LONGEST_DESCRIPTION, false);
}

/** `std_msgs/String` with a JSON object: addresses of streams by name. */
export function readVideoSources(message: Field): ReadonlyMap<string, string> {
  const data = message.at("data");
  let sources: unknown;
  try {
    sources = JSON.parse(data.text(LONGEST_SOURCES, false));
  } catch (error) {
    if (error instanceof SyntaxError) {
      return data.fail("is not JSON");
    }
    throw error;
  }
  if (typeof sources !== "object" || sources === null || Array.isArray(sources)) {
    return data.fail("is not an object of names and addresses");
  }
  const entries: [string, unknown][] = Object.entries(sources);
  return new Map(entries.slice(0, MOST_SOURCES).map(([name, address]) =>
    typeof address === "string" ? [name.slice(0, SENTENCE), address] : data.fail(`has an address that is not a text: ${name.slice(0, 80)}`)));
}
