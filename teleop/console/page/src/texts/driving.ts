/** All words of driving: its status, its buttons, the mapping page. */

import { GEARS, type Gear } from "../operating_data";

/** Why everything counts as released. */
const lost = {
  "hidden": "Stopped: the tab was hidden.",
  "blurred": "Stopped: another window took the keys.",
  "menu": "Stopped: a menu took the keys, or a shortcut did.",
  "closed": "Stopped: the page was left.",
  "frozen-page": "Stopped: the browser suspended the page.",
  "slept": "Stopped: the computer slept, or was too busy to drive.",
  "touch": "Stopped: the system took the touch away.",
  "unplugged": "Stopped: the gamepad was unplugged.",
  "frozen": "Stopped: the gamepad no longer reports; is it out of range?",
  "connection": "Stopped: the connection was lost.",
  "unsent": "Stopped: the connection took no command.",
  "silent": "Stopped: the robot said nothing for a second.",
  "taken": "Stopped: somebody else drives now.",
  "not-listening": "Stopped: the robot no longer listened.",
  "headset-off": "Stopped: the headset was taken off, or shows its own menu.",
  "headset-left": "Stopped: the headset left the page.",
  "controller": "Stopped: the controller is not seen, or sleeps.",
  "recentred": "Stopped: the headset has moved the room's origin.",
} as const;

/** What to do, for hands at a keyboard, and for thumbs on a screen. */
const REMEDIES = {
  hold: ["Hold an arrow key, W A S D, the stick, or the gamepad's LB with its stick.", "Put a thumb on the stick, and keep it there while you drive."],
  holdMine: ["Hold a key or the stick to drive.", "Put a thumb on the stick to drive."],
  elsewhere: ["The keys are used elsewhere now: hold the stick to drive.", "Put a thumb on the stick to drive."],
  stopIt: ["Space stops it.", "Cancel stops it, and so does the red button."],
  take: ["Click into this page, then drive.", "Touch this page, then drive."],
  letGo: ["Let go of the keys and sticks first, then press again.", "Lift your thumb, then put it on the stick again."],
  again: ["Press again to drive.", "Put your thumb on the stick again to drive."],
} as const;
const FOR_THUMBS: ReadonlyMap<string, string> = new Map(Object.values(REMEDIES));

/** A time in words [s]. */
const seconds = (time: number) => `${time.toFixed(1)} s`;

export const drivingTexts = {
  title: "Driving",
  noReason: "the robot gave no reason",
  somebody: (client: number) => `client ${client}`,
  you: "you",
  nobody: "nobody",

  // What the page sends, and what the robot does
  pageSends: "You ask for",
  robotDoes: "The robot follows",
  nothing: "nothing",
  standstill: "stands still",
  unknown: "unknown",
  source: { keyboard: "keys", stick: "stick on the screen", gamepad: "gamepad", headset: "headset", hold: "a button that is held" },
  motion: (forward: number, turn: number) => {
    const ahead = `${Math.round(Math.abs(forward) * 100)} % ${forward < 0 ? "back" : "ahead"}`;
    const around = `${Math.round(Math.abs(turn) * 100)} % ${turn < 0 ? "right" : "left"}`;
    return forward === 0 && turn === 0 ? "standing still" : [forward && ahead, turn && around].filter(Boolean).join(", ");
  },
  velocity: (linear: number, angular: number) => {
    const degrees = (Math.abs(angular) * 180) / Math.PI;
    const ahead = `${Math.abs(linear).toFixed(2)} m/s ${linear < 0 ? "back" : "ahead"}`;
    const around = `${degrees.toFixed(0)}°/s ${angular < 0 ? "right" : "left"}`;
    return [Math.abs(linear) >= 0.005 && ahead, degrees >= 0.5 && around].filter(Boolean).join(", ");
  },
  speedFigure: (speed: number | undefined) => (speed === undefined ? "–" : Math.abs(speed) < 0.005 ? "0.00" : speed.toFixed(2).replace("-", "−")),
  gearLimit: (speed: number) => `up to ${speed.toFixed(2)}`,
  near: (distance: number, bearing: number) => {
    const eighths = ["behind", "behind right", "right", "ahead right", "ahead", "ahead left", "left", "behind left", "behind"];
    return `${distance.toFixed(1)} m ${eighths[4 + Math.round((4 * bearing) / Math.PI)] ?? ""}`;
  },
  speedLabel: (speed: number | undefined, near: string) =>
    `Measured speed: ${speed === undefined ? "unknown" : `${speed.toFixed(2)} m/s`}${near === "" ? "" : `; nearest: ${near}`}`,
  by: (source: string) => `by ${source}`,

  // Gears
  gears: "Gear",
  gear: (gear: Gear) => GEARS.find((one) => one.gear === gear)?.name ?? gear,
  gearHint: (meaning: string, key: number) => `${meaning} (key ${key})`,

  // Stick
  stick: "Stick",
  stickHelp: "Put a finger here and drag: the robot drives while you hold it. With a keyboard: arrow keys or W A S D; space stops.",
  stickHint: ["hold,", "drag"],

  // Status: words and the way out
  status: {
    connecting: ["Not connected to the robot yet.", "It connects by itself as soon as the robot answers."],
    lost: ["The connection is lost. The robot stops by itself.", "It connects again by itself; then press again to drive."],
    refusedConnection: ["The robot refuses the connection.", "Log in, or see what the connection panel says."],
    unknownDialect: ["Waiting for the robot's first answer.", "This takes a moment."],
    unguarded: ["Nothing guards this robot: no deadman, no watchdog, no e-stop.", "Confirm below that you want to drive it all the same."],
    recording: ["This is a recording.", "“Back to the robot” ends it."],
    watching: ["You may only watch.", "Log in with a token that may drive."],
    noState: ["Waiting for the robot to say who drives.", "This takes a moment."],
    centring: ["The stick was pushed before its deadman button.", "Let go of the stick first, then drive."],
    noDeadman: ["The stick is pushed, but the deadman button is not held.", "Hold the deadman button (LB) while you drive."],
    unmapped: ["This gamepad is of an unknown kind.", "Open “Gamepads” and show the page what its buttons do."],
    unfocused: ["Another window has the keys.", REMEDIES.take[0]],
    driving: ["You drive.", ""],
    starting: ["The robot gets ready to drive.", "Hold on."],
    ready: ["Ready.", REMEDIES.hold[0]],
    elsewhere: ["Ready.", REMEDIES.elsewhere[0]],
    readyMine: ["Ready: the robot is yours.", REMEDIES.holdMine[0]],
    moving: ["The robot drives by itself, as you told it.", REMEDIES.stopIt[0]],
    plainDriving: ["You drive. Nothing there guards the robot: keep it in sight.", ""],
    plainReady: ["Ready. Nothing there guards the robot: keep it in sight.", REMEDIES.holdMine[0]],
  },
  /** Return what to do as it is said to somebody with thumbs and no keyboard. */
  forThumbs: (remedy: string): string => FOR_THUMBS.get(remedy) ?? remedy,
  silent: (age: number): readonly [string, string] =>
    [`The robot has said nothing for ${seconds(age)}.`, "Wait until it answers; then press again."],
  estopBy: (who: string, may: boolean): readonly [string, string] =>
    [`E-stop, pressed by ${who}. The robot does not move.`, may ? "When all is clear, press “Release e-stop”." : "Somebody who may release it has to do so."],
  othersDrive: (who: string, mayAsk: boolean, mayTakeOver: boolean): readonly [string, string] =>
    [`${who} drives.`, mayTakeOver ? "Ask for the robot, or take it over." : mayAsk ? "Ask for the robot." : "Wait until it is free."],
  letGo: (why: string): readonly [string, string] => [why, REMEDIES.letGo[0]],
  heldBack: "What you hold does not count.",
  stopped: (why: string): readonly [string, string] => [why, REMEDIES.again[0]],
  late: (age: number): readonly [string, string] =>
    [`Commands arrive ${seconds(age)} late: the robot refuses them.`, "Let go, and wait for a faster connection."],
  slower: (age: number): readonly [string, string] =>
    [`Commands arrive ${seconds(age)} late: the robot drives slower.`, "Go nearer to the access point, or switch the picture to lean."],
  guarded: (reason: string): string => `Guard: ${reason}.`,
  because: (reason: string) => `The robot says: ${reason}.`,

  // The robot's reasons
  reasons: {
    neverDriven: "nobody has driven yet",
    neutral: "the stick is at rest",
    driving: "it drives",
    slowly: "it drives slowly, because commands arrive late",
    step: "drives a step",
    afterStep: "at rest after a step",
    neutralFirst: "let go of the stick first",
    zeroFirst: "a zero velocity has to come first",
    serverGone: "its server was started again, and everybody was disconnected",
    estop: (who: string) => `e-stop by ${who}`,
    reset: (who: string) => `the e-stop was released by ${who}`,
    watchdog: (time: string) => `watchdog: no command for ${time} s`,
    silent: (who: string, time: string) => `${who} sent nothing for ${time} s, so the robot is free`,
    late: (time: string) => `commands arrived ${time} s late`,
    takenOver: (who: string, from: string) => `${who} took it over from ${from}`,
    took: (who: string) => (who === "you" ? "you have the robot" : `${who} drives`),
    left: (who: string) => `${who} left`,
    othersDrive: (who: string) => `${who} drives`,
  },

  lostWords: (loss: keyof typeof lost, reason: string) => (reason === "" ? lost[loss] : `${lost[loss]} The robot says: ${reason}.`),
  plainStopped: "Stopped: the page has sent zero and lets go of the robot. This robot has no e-stop of its own.",

  // E-stop
  estop: "Stop!",
  estopLabel: "Emergency stop (Esc)",
  estopLatched: "Stopped",
  estopLatchedLabel: "Stopped: the emergency stop is latched",
  estopPending: (time: number) => `E-stop not confirmed yet: the robot has not answered for ${seconds(time)}. It is sent again and again.`,
  estopRefused: (why: string) => `E-stop refused: ${why}. It is sent again and again.`,
  release: "Release e-stop…",
  releaseQuestion: "Release the e-stop? Are people and things clear of the robot?",
  releaseYes: "Release it",
  releaseNo: "Keep it stopped",
  releaseRefused: (why: string) => `Not released: ${why}.`,

  // Taking turns
  turns: "Who drives",
  drives: (who: string) => `${who} drives`,
  youDrive: "You drive",
  nobodyDrives: "Nobody drives",
  ask: "Ask for the robot",
  takeOver: "Take over",
  waiting: "You have asked for the robot; its driver has 30 s to answer.",
  asks: (who: string) => `${who} asks for the robot.`,
  give: "Give",
  refuse: "Refuse",
  asked: "Asked.",
  given: "Given.",
  refused: "Refused.",
  tookOver: "The robot is yours: let go of everything, then drive.",
  notDone: (why: string) => `That did not work: ${why}.`,

  // A robot that nothing guards
  plainQuestion: "This robot is not a Farsteer robot: if this page or the connection fails, nothing known to the page stops it.",
  plainVelocity: "Drive by /cmd_vel all the same",
  plainJoy: "Drive by /joy all the same",

  // Mapping page
  mapping: "Gamepads",
  mappingNone: "No gamepad is seen. Plug one in and press any button on it.",
  mappingInsecure: "Gamepads work only on https or on this machine itself. Start the robot with “--lan” and open the https address that it prints.",
  mappingWhich: "Gamepad",
  mappingPaused: "While this dialog is open, gamepads do not drive.",
  mappingUse: {
    forward: "Stick forward", turn: "Stick to the left", deadman: "Deadman (hold to drive)", turbo: "Turbo",
    estop: "Emergency stop", takeOver: "Take over",
  },
  mappingAxis: (axis: number, sign: number) => `axis ${axis} ${sign < 0 ? "−" : "+"}`,
  mappingAxisName: (axis: number) => `axis ${axis}`,
  mappingButton: (button: number) => `button ${button}`,
  mappingUnset: "not set",
  mappingSet: (use: string) => `Set: ${use}`,
  mappingSetButton: "Set",
  mappingPush: "Now push it, and hold it there…",
  mappingPress: "Now press it…",
  mappingClear: (use: string) => `Do without: ${use}`,
  mappingClearButton: "Do without",
  mappingDeadZone: "Dead zone",
  mappingSave: "Save",
  mappingStandard: "Back to the usual one",
  mappingSaved: "Saved; it holds for all gamepads of this kind.",
  mappingNotKept: "In use; this browser keeps nothing, so it holds until the page is closed.",
  mappingIncomplete: "Set at least the two stick directions and the deadman.",
  mappingLive: "What it does now",
  mappingClose: "Close",
} as const;
