/** Words of the panels about link, attitude, localisation, events, session and picture. */

const UNKNOWN = "unknown";

const milliseconds = (value: number | undefined): string => (value === undefined ? UNKNOWN : `${Math.round(value)} ms`);

/** Return a data rate in the unit of links, bits per second. */
function bitRate(bytesPerSecond: number): string {
  const kilobits = (8 * bytesPerSecond) / 1000;
  return kilobits < 1000 ? `${Math.round(kilobits)} kbit/s` : `${(kilobits / 1000).toFixed(1)} Mbit/s`;
}

/** Return an age [ms] in the unit that suits it. */
function ageWords(age: number): string {
  return age < 1000 ? `${Math.round(age / 10) * 10} ms` : age < 60_000 ? `${(age / 1000).toFixed(1)} s` : `${Math.round(age / 60_000)} min`;
}

export const panelTexts = {
  unknown: UNKNOWN,
  old: (age: number): string => `${ageWords(age)} old`,
  close: "Close",
} as const;

export const linkPanelTexts = {
  title: "Link",
  roundTrip: "Round trip",
  roundTripP95: "95 % of the last minute",
  jitter: "Jitter",
  received: "Received",
  silence: "Last message",
  ageWords,
  ago: (age: number): string => `${ageWords(age)} ago`,
  milliseconds,
  bitRate,
  summary: (roundTrip: number | undefined, jitter: number | undefined): string =>
    `round trip ${milliseconds(roundTrip)}, jitter ${milliseconds(jitter)}`,
  ways: { view: "What you see", command: "What you command" },
  way: (name: string, took: number): string => `${name}: ${took.toFixed(0)} ms`,
  hop: (name: string, took: number, grows: boolean): string => `${name} ${took.toFixed(0)} ms${grows ? ", growing" : ""}`,
  hops: {
    robot: "robot", queue: "waiting to be sent", wireDown: "link", page: "page", drawn: "until drawn",
    hand: "page", wireUp: "link", gateway: "waiting for the tick", control: "until the wheels",
  },
  streams: "Streams",
  topic: "topic",
  age: "age",
  rate: "per second",
  dropped: "left out",
  droppedHint: "Messages that the robot left out for this page, because newer ones were there",
  never: "never",
  about: "What the colours mean",
  threshold: (name: string, green: number, amber: number): string =>
    `${name}: green up to ${green} ms, amber up to ${amber} ms, red above.`,
  lostAfter: (after: number): string => `Lost: nothing for ${after} ms, or no connection.`,
} as const;

export const attitudeTexts = {
  title: "Attitude",
  horizon: (roll: string, pitch: string): string => `Horizon: roll ${roll}, pitch ${pitch}`,
  unknownHorizon: "Horizon: unknown",
  roll: "Roll",
  pitch: "Pitch",
  degrees: (radians: number): string => `${((radians * 180) / Math.PI).toFixed(1).replace(/^-(0\.0)$/, "$1")}°`,
  rollMeaning: "positive: left side up",
  pitchMeaning: "positive: nose down",
  source: (topic: string): string => `from ${topic}`,
} as const;

export const localizationTexts = {
  title: "Place",
  oldHealth: (words: string): string => `${words} (old)`,
  position: "Position",
  heading: "Heading",
  sigma: "one sigma",
  fit: "Fit",
  metres: (value: number): string => (Number.isFinite(value) ? (value < 1 ? `± ${(100 * value).toFixed(1)} cm` : `± ${value.toFixed(2)} m`) : UNKNOWN),
  degrees: (radians: number): string => (Number.isFinite(radians) ? `± ${((radians * 180) / Math.PI).toFixed(2)}°` : UNKNOWN),
  share: (value: number): string => (Number.isFinite(value) ? `${Math.round(100 * value)} % of what it sees` : UNKNOWN),
  pose: "Pose",
} as const;

export const eventTexts = {
  title: "Events",
  none: "Nothing has happened yet.",
  times: (count: number): string => `${count} times`,
  over: (lasted: number): string => `over, ${ageWords(1000 * lasted)} in all`,
  gravest: "Warnings and alarms only",
  copy: "Copy",
  copied: "Copied",
  byHand: "This page cannot reach the clipboard (it needs https or localhost): select the text and copy it.",
  severity: { info: "note", warning: "warning", alarm: "alarm" },
} as const;

export const sessionTexts = {
  title: "Session",
  token: "Token",
  login: "Log in",
  loggingIn: "The robot checks the token.",
  another: "Log in with a token",
  logout: "Log out",
  empty: "Enter the token that the robot's owner gave you.",
  who: (name: string): string => `You are ${name}.`,
  role: (role: string): string => `Role: ${role}`,
  name: "Your name, as others see it",
  rename: "Change",
  noTokens: "This robot asks for no tokens: whoever reaches it may do everything.",
  may: "You may",
  nothing: "only watch",
  rights: {
    mayDrive: "drive",
    mayStop: "stop the robot",
    mayReset: "release the e-stop",
    mayHint: "show where the robot is",
    maySearch: "have the robot found",
    mayTakeOver: "take over",
  },
  unknown: "Not known yet.",
  plain: "This robot knows no sessions: whoever reaches it may do everything.",
} as const;

export const layerTexts = {
  title: "Picture",
  view: "View",
  views: { chase: "Behind", top: "Above", first: "On board", arm: "Arm" },
  theme: "Colours",
  themes: { day: "Day", night: "Night" },
  pointSize: "Size of the points",
  factor: (value: number): string => `${value.toFixed(1)} times`,
  decay: "Old sweeps stay for",
  seconds: (value: number): string => (value === 0 ? "not at all" : `${value.toFixed(0)} s`),
  pathAhead: "Where it will go",
  pathsAhead: { late: "If late", always: "Always", never: "Never" },
  layers: "Shown",
  names: {
    building: "Building",
    map: "Map's points",
    cloud: "What the scanners see",
    oldSweeps: "Old sweeps",
    path: "Path",
    covariance: "Uncertainty of the pose",
    hypotheses: "Places in question",
    names: "Names of places",
    minimap: "Small map",
    truth: "True pose (simulation)",
    grid: "Grid of metres",
  },
  lean: "Save bandwidth",
  leanMeaning: "At most 256 kbit/s: two thinned sweeps a second.",
  legend: "Distance of live points to the map",
  legendValue: (distance: number | undefined, last: boolean): string =>
    distance === undefined ? UNKNOWN : `${Math.round(100 * distance)} cm${last ? " or more" : ""}`,
} as const;

export const aboutTexts = {
  title: "About this console",
  open: "About",
  version: (version: string): string => `Farsteer ${version}`,
  what: "This page drives a robot through its rosbridge and has no channel of its own: what it does, any page can do.",
  licences: "Licences of what this page contains",
  tried: "Tried with Chromium and Firefox on Debian 12. Other current browsers should work; nobody has tried them with this version.",
  keys: "Keys",
} as const;
