/** Words of the alarms. */

const seconds = (milliseconds: number): string => `${(milliseconds / 1000).toFixed(1)} s`;
const because = (reason: string): string => (reason === "" ? "" : ` (${reason})`);

export const alarmTexts = {
  title: "Alarms",
  none: "No alarms",
  connection: (words: string): string => (words === "" ? "No connection to the robot." : words),
  stale: (silence: number): string => `Nothing received for ${seconds(silence)}: the picture is old.`,
  estop: (reason: string): string => `E-stop${because(reason)}`,
  tipping: (degrees: number): string => `About to tip over: tilted by ${degrees.toFixed(0)}°. Drive back the way it came.`,
  tilt: (degrees: number): string => `Tilted by ${degrees.toFixed(0)}°`,
  lost: (reason: string): string => `The robot is lost${because(reason)}: show where it is, or have it found.`,
  suspect: (reason: string): string => `The pose is in doubt${because(reason)}`,
  searching: (reason: string): string => `The robot does not know where it is${because(reason)}: show it, or drive slowly.`,
  link: (words: string): string => `The link is bad: ${words}`,
  asking: (name: string): string => `${name} asks for the robot: give it or refuse.`,
  over: (words: string): string => `Over: ${words}`,
  mute: "Switch the alarms' sound off",
  unmute: "Switch the alarms' sound on",
  muted: "Sound off",
  sounding: "Sound on",
  locked: "Sound waits: press anything on the page",
  unavailable: "This browser has no sound",
  severity: { info: "note", warning: "warning", alarm: "alarm" },
} as const;
