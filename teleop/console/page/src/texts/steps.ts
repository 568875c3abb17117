/** Words of the panel of steps. */

const number = (value: number, digits: number): string => value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
const metres = (value: number): string => `${number(value, 2)} m`;
const degrees = (radians: number): string => `${number((radians * 180) / Math.PI, 1)}°`;
const done = (goal: { readonly distance: number }, way: { readonly distance: number; readonly angle: number }): string =>
  goal.distance === 0 ? degrees(Math.abs(way.angle)) : metres(Math.abs(way.distance));

function named({ distance, angle }: { readonly distance: number; readonly angle: number }): string {
  if (distance !== 0 && angle !== 0) {
    return `Arc of ${metres(Math.abs(distance))}, ${degrees(Math.abs(angle))} to the ${angle > 0 ? "left" : "right"}`;
  }
  if (distance !== 0) {
    return `${distance > 0 ? "Forward" : "Back"} ${metres(Math.abs(distance))}`;
  }
  return `${angle > 0 ? "Left" : "Right"} ${degrees(Math.abs(angle))}`;
}

export const stepTexts = {
  title: "Steps",
  directions: { forward: "Forward", back: "Back", left: "Left", right: "Right" },
  button: { forward: "Step forward", back: "Step back", left: "Turn left by a step", right: "Turn right by a step" },
  cancel: "Cancel",
  cancelAll: "Cancel all steps",
  distance: "Distance",
  angle: "Angle",
  ofDistance: "Distances",
  ofAngle: "Angles",
  speed: "Speed",
  paces: { own: "the robot's own", slow: "slow: 0.1 m/s, 0.2 rad/s", fast: "fast: 0.6 m/s, 1 rad/s" },
  named,
  outOfRange: (name: string, { min, max, unit }: { readonly min: number; readonly max: number; readonly unit: string }, entered: string): string =>
    `${name}: a number from ${min} to ${max} ${unit}, not “${entered}”.`,
  asked: (goal: { readonly distance: number; readonly angle: number }): string => `${named(goal)}: asked for`,
  waiting: (goal: { readonly distance: number; readonly angle: number }, ahead: number): string => `${named(goal)}: waits behind ${ahead}`,
  moving: (goal: { readonly distance: number; readonly angle: number }, way: { readonly distance: number; readonly angle: number }): string =>
    `${named(goal)}: ${done(goal, way)} done`,
  queue: (count: number): string => (count === 0 ? "" : count === 1 ? "1 more waits." : `${count} more wait.`),
  idle: "No step is asked for.",
  done: (goal: { readonly distance: number; readonly angle: number }, way: { readonly distance: number; readonly angle: number; readonly duration: number }): string =>
    `${named(goal)}: done, ${done(goal, way)} in ${way.duration.toFixed(1)} s.`,
  ended: (goal: { readonly distance: number; readonly angle: number }, way: { readonly distance: number; readonly angle: number }, why: string): string =>
    `${named(goal)}: ended after ${done(goal, way)}; ${why}.`,
  notBegun: (goal: { readonly distance: number; readonly angle: number }, why: string): string => `${named(goal)}: not driven; ${why}.`,
  why: {
    cancelled: "cancelled", e_stop: "emergency stop", taken_over: "somebody drives by hand", contact: "the bumper touched something",
    stalled: "it could not move on", guard: "the guard stopped it", released: "", time_limit: "it took too long", silent: "the link was silent", lost: "it has lost its place",
    refused: "refused",
  },
  because: (why: string, words: string): string => (words === "" ? why : why === "" ? words : `${why} (${words})`),
  there: "Drive there",
  thereHelp: "Press where the robot is to go, or drag.",
  thereHold: "Hold to drive there",
  thereNoPose: "The robot does not know where it is.",
  notSent: "Not sent: there is no connection.",
} as const;
