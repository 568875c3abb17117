/** Words of the arm: its panel, and why it does not move. */

const centimetres = (value: number): string => `${(100 * Math.abs(value)).toFixed(1)} cm`;
const millimetres = (value: number): string => `${(1000 * value).toFixed(0)} mm`;

const outcomes: Readonly<Record<string, string>> = {
  cancelled: "given up", unreachable: "it does not reach there", no_path: "it found no way there", blocked: "something is in the way",
  silent: "the link was silent", e_stop: "emergency stop", taken_over: "somebody else has the robot", refused: "refused", "": "refused",
};

export const armTexts = {
  title: "Arm",
  loading: "Waiting for the robot to describe its arm.",
  wheels: "The wheels are driven: let go of them first.",

  // Why it does what it does
  /** Words of the robot's that a person at the page would take for an order. */
  reasons: { "let go": "It stands: nothing is held", "follows the hand": "It follows the ghost", "is led to a pose": "It is led to a pose" } as Readonly<Record<string, string>>,
  /** Reasons that the robot gives in its modes of moving while nothing hinders it. */
  smooth: {
    hand: "follows the hand", twist: "its tip moves as wanted", jog: "its joints move as wanted", pose: "is led to a pose",
  } as Readonly<Record<string, string>>,
  capital: (words: string): string => words.charAt(0).toUpperCase() + words.slice(1),
  /** Words of the robot as a sentence; names of its parts have underscores. */
  sentence: (words: string): string => `${armTexts.capital(words).replaceAll("_", " ")}${/[.!?]$/.test(words) ? "" : "."}`,
  plan: { planning: "looks for a way", waiting: "waits for you to hold the button", moving: "goes its way" } as Readonly<Record<string, string>>,
  gettingOut: "The robot is at it …",
  notOut: (why: string): string => `That did not work: ${why}.`,
  tip: ({ x, y, z }: { readonly x: number; readonly y: number; readonly z: number }, floor: number): string =>
    `Tip: ${centimetres(x)} ${x < 0 ? "behind" : "ahead"}, ${centimetres(y)} ${y < 0 ? "right" : "left"}, ${centimetres(z + floor)} above the floor`,

  // Wheels or arm
  moves: "Keys and gamepad move",
  wheelsName: "the wheels",
  armName: "the arm",
  keyHelp: [
    "Drag the arrows and rings at the gripper in the picture; or hold keys:",
    "I K ahead and back, J L left and right, U O up and down; with Shift they turn the gripper",
    "1 to 5 choose a joint, comma and period move it; G opens and closes the gripper",
    "Gamepad: hold LB; left stick ahead and aside, right stick up and down; with RB they turn; the cross chooses a joint and moves it; RT closes, LT opens; Back switches to the wheels",
  ],
  keys: "Keys and gamepad",
  frames: "Directions of",
  frame: { base: "the arm", tool: "the gripper", view: "the picture" },
  ghost: "The ghost",
  follows: "the arm follows it",
  stays: "plan first, then go",

  // Picking something up
  guide: "Pick something up",
  steps: {
    open: "Open the gripper.",
    reach: "Choose “the arm”, and bring the gripper around the thing.",
    close: "Close the gripper.",
    lift: "Lift it, and fold the arm (“stow”) to drive.",
  },
  done: "It is lifted.",

  // Gripper
  gripper: "Gripper",
  open: "Open",
  close: "Close",
  force: "Force",
  newtons: (value: number): string => `${value.toFixed(1)} N`,
  jaws: (opening: number, holding: boolean, force: number): string =>
    holding ? `Holds something ${millimetres(opening)} wide with ${armTexts.newtons(force)}.` : `Its jaws are ${millimetres(Math.max(0, opening))} apart.`,
  gripFailed: (why: string): string => `The gripper did not move: ${why}.`,

  // Planned moves
  poses: "Planned moves",
  pose: (name: string): string => `Pose “${name}”`,
  toGhost: "Go there",
  ghostMove: "To the ghost",
  forgetGhost: "Take it back",
  hold: "Hold to move",
  holdHint: "The blue ghosts show the way. The arm moves as long as you hold the button.",
  giveUp: "Give up",
  planning: (title: string): string => `${title}: the robot looks for a way …`,
  waiting: (title: string): string => `${title}: hold the button to move.`,
  moving: (title: string, share: number): string => `${title}: ${Math.round(100 * share)} %`,
  ended: (title: string, outcome: string, words: string): string => {
    const why = [outcome === "done" ? "" : outcomes[outcome] ?? outcome, words].filter((part) => part !== "").join(": ");
    return outcome === "done" ? `${title}: the arm is there.` : `${title}: not reached; ${why}.`;
  },
  noMove: "Choose a pose: the way there is shown first.",

  // Joints
  joints: "Joints",
  joint: (number: number, turns: string): string => `${number} ${turns}`,
  angle: (radians: number): string => `${((radians * 180) / Math.PI).toFixed(0)}°`,
  limits: (lower: number, upper: number): string => `${armTexts.angle(lower)} to ${armTexts.angle(upper)}`,
  load: (turns: string): string => `Load of ${turns}`,
  loadShare: (share: number): string => `Load ${Math.round(100 * share)} %`,
  back: (turns: string): string => `Move ${turns} back`,
  forward: (turns: string): string => `Move ${turns} forward`,

  // Teaching
  teaching: "Teach and replay",
  teach: "Keep this position",
  replay: "Go through them",
  position: (number: number): string => `Position ${number}`,
  positionWords: (opening: number): string => `jaws at ${millimetres(opening)}`,
  forget: (number: number): string => `Forget position ${number}`,
  forgetMark: "✕",
  noPositions: "None kept. Move the arm, and keep positions to go through again.",
} as const;
