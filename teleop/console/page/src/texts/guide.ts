/** Words of the guided first drive, for keys, for thumbs and for gamepads. */

/** What the person holds, which decides the words. */
export type Hands = "keys" | "thumb" | "pad";

type Words = string | Readonly<Record<Hands, string>>;

const tasks = {
  forward: ["Drive forward", {
    keys: "Hold W or the arrow up.",
    thumb: "Put a thumb on the stick and push it up.",
    pad: "Hold LB and push the left stick forward.",
  }],
  curve: ["Drive a curve", {
    keys: "Hold W and A together.",
    thumb: "Push the stick up and to one side.",
    pad: "Hold LB and push the stick forward and to one side.",
  }],
  rest: ["Let go", {
    keys: "Let go of all keys: the robot brakes by itself.",
    thumb: "Lift the thumb: the robot brakes by itself.",
    pad: "Let go of LB: the robot brakes by itself.",
  }],
  stop: ["Stop it for certain", {
    keys: "Press Esc, or Stop! below: it stays stopped until somebody releases it.",
    thumb: "Press Stop! below: it stays stopped until somebody releases it.",
    pad: "Press B, or Stop! below: it stays stopped until somebody releases it.",
  }],
  carried: ["Have it carried off", "Press the button: the simulated robot is put down elsewhere, and soon doubts where it is. If it does not, release the e-stop and drive on a little."],
  placed: ["Show it where it is", {
    keys: "Press H, then press on the map where its points fit the walls, drag to where it looks, and confirm.",
    thumb: "Under Panels press “Show where it is”, put a finger where its points fit the walls, drag to where it looks, and confirm.",
    pad: "Press “Show where it is”, press on the map where its points fit the walls, drag to where it looks, and confirm.",
  }],
} as const satisfies Readonly<Record<string, readonly [title: string, words: Words]>>;

export type Task = keyof typeof tasks;

export const guideTexts = {
  title: "First drive",
  name: (task: Task): string => tasks[task][0],
  words: (task: Task, hands: Hands): string => {
    const words: Words = tasks[task][1];
    return typeof words === "string" ? words : words[hands];
  },
  carry: "Carry it off",
  left: "Being carried off and showing where it is are left out: that needs a simulated robot served with --playground.",
  done: "Done: you can drive. Release the e-stop to go on.",
  skip: "Close",
  ticked: "done",
} as const;
