/** Words around the alarms, whose own words are with their rules. */

export const alarmTexts = {
  title: "Alarms",
  mute: "Switch the alarms' sound off",
  unmute: "Switch the alarms' sound on",
  muted: "Sound off",
  sounding: "Sound on",
  locked: "Sound: any key",
  unavailable: "This browser has no sound",
  severity: { info: "note", warning: "warning", alarm: "alarm" },
} as const;
