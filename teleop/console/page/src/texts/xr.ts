/** Words of the headset's part: its buttons, boards and troubles. */

const ms = (value: number | undefined): string => (value === undefined || Number.isNaN(value) ? "unknown" : `${Math.round(value)} ms`);

export const xrTexts = {
  enter: { "immersive-vr": "Enter VR", "immersive-ar": "Enter AR" },
  short: { "immersive-vr": "VR", "immersive-ar": "AR" },
  leave: "Leave",
  notLoaded: "The part of the page for headsets could not be loaded: reload the page.",
  notBegun: (why: string): string => `The headset did not begin: ${why === "" ? "it gives no reason" : why}`,

  stands: { free: "Beside it", ride: "Ride along", chase: "Follow it", table: "On a table" },
  turn: { left: "↶ turn", right: "turn ↷" },
  hands: { right: "right drives", left: "left drives" },
  putTable: "Look at a table and pull the trigger: the building is put there.",

  steps: (distance: number, angle: number): string => `Steps of ${distance} m and ${angle}°`,
  shorter: "− m", longer: "+ m", smaller: "− °", larger: "+ °",
  arrows: { forward: "↑ ahead", left: "← left", right: "right →", back: "back ↓" },
  stream: (name: string): string => `Camera: ${name === "" ? "off" : name}`,
  photo: "Photograph",

  comfort: {
    vignette: (strength: number): string => (strength === 0 ? "edges clear" : `edges dark ${strength}`),
    turning: (degrees: number): string => (degrees === 0 ? "turn smoothly" : `turn by ${degrees}°`),
    horizon: (tilts: boolean): string => (tilts ? "tilt with it" : "level horizon"),
    heading: (turns: boolean): string => (turns ? "turn with it" : "keep heading"),
    cap: (speed: number): string => (speed === 0 ? "no speed cap" : `≤ ${speed} m/s`),
  },

  delays: (hand: number | undefined, head: number | undefined, cloud: number | undefined): string =>
    `hand to wheels ${ms(hand)}, head to picture ${ms(head)}, points ${ms(cloud)} old`,
  unusable: (name: string): string =>
    `The controller${name === "" ? "" : ` “${name}”`} has no grip and stick that are known, and drives nothing. Put it down: empty hands drive by steps.`,
  help: "Hold the grip and push the stick to drive. B or Y: emergency stop. A: next place to stand. X: this board.",
} as const;
