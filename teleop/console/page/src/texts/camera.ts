/** Words of the camera's panel. */

export const cameraTexts = {
  title: "Camera",
  stream: "Stream",
  off: "off",
  picture: (name: string): string => `Camera: ${name}`,
  waiting: "Waiting for a picture; a busy robot draws few.",
  age: (words: string, lowerBound: boolean): string => `${lowerBound ? "at least " : ""}${words} old`,
  few: "five a second: this browser is slow",
  given: "Camera off: this browser is too slow for it.",
  allTheSame: "Show it all the same",
  enlarge: "Enlarge",
  shrink: "Shrink",
  elsewhere: "is not shown here: browsers let a page read its own robot's pictures only. It is at",
  refused: (why: string): string => `No picture: ${why === "" ? "the robot refuses" : why}`,
  ended: "No picture: the robot has ended the stream. It is asked again.",
  failed: (why: string): string => `No picture: ${why}. It is asked again.`,
  photo: "Take a photograph",
  taking: "The robot takes a photograph.",
  stored: "Stored:",
  noPhoto: (why: string): string => `No photograph: ${why}`,
  noTicket: (why: string): string => `It cannot be opened: ${why}`,
} as const;
