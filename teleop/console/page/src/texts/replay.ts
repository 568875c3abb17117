/** Words of runs: recording one, listing them, looking at one again. */

const clock = (ms: number): string => `${Math.floor(ms / 60_000)}:${String(Math.floor(ms / 1000) % 60).padStart(2, "0")}`;

export const replayTexts = {
  title: "Runs",
  record: "Record",
  recording: "End the recording",
  screenshot: "Save the picture",
  begun: (name: string): string => `The robot records ${name}.`,
  ended: (name: string): string => `${name} is complete.`,
  refresh: "List the runs",
  none: "No runs have been recorded yet.",
  open: (name: string): string => `Look at ${name}`,
  save: (name: string): string => `Save ${name}`,
  look: "Look",
  keep: "Save",
  file: "Look at a run of a file …",
  drop: "Or drop the file on the page.",
  facts: (start: string, seconds: number | undefined, bytes: number): string =>
    `${start.replace("T", " ").replace("Z", " UTC")}, ${seconds === undefined ? "cut off" : clock(1000 * seconds)}, ${(bytes / 1e6).toFixed(1)} MB`,
  failed: (why: string): string => `The runs could not be fetched: ${why}.`,
  unreadable: (name: string, why: string): string => `${name} is no run that can be read (${why}): it takes an MCAP file of ROS 2 messages, as Record makes.`,
  empty: "it holds no messages",
  bar: "Recorded run",
  watching: (name: string): string => `Recorded run ${name}: nothing here moves the robot.`,
  play: "Play",
  pause: "Pause",
  position: "Moment of the run",
  time: (at: number, of: number): string => `${clock(at)} of ${clock(of)}`,
  back: "Back to the robot",
  strip: "Quality of localisation over time: fit above, uncertainty below; the colour is the state",
} as const;
