// A driver with the published roslib for JavaScript: node roslib_driver.mjs URL FORWARD_AXIS TURN_AXIS THEN AFTER
// It does what drivers.py does.

import { webcrypto } from "node:crypto";

globalThis.crypto ??= webcrypto; // Node 18 has it elsewhere

const { Ros, Topic } = await import("roslib");

const [url, forward, turn, then, after] = process.argv.slice(2);
const NEUTRAL = 10;
const PERIOD = 50; // [ms]

const ros = new Ros({ url });
const joy = new Topic({ ros, name: "/joy", messageType: "sensor_msgs/msg/Joy" });
const say = (word) => console.log(`${word} ${(Date.now() / 1000).toFixed(6)}`);
let number = 0;
let begun = 0;
let failed = false;

function send() {
  const pushed = number >= NEUTRAL;
  if (number === NEUTRAL) {
    begun = performance.now();
    say("driving");
  }
  if (pushed && !failed && then !== "nothing" && performance.now() - begun > 1000 * Number(after)) {
    failed = true;
    say("failed");
  }
  const seconds = Date.now() / 1000 + (failed && then === "clock" ? 3600 : 0);
  const header = { stamp: { sec: Math.floor(seconds), nanosec: Math.floor((seconds % 1) * 1e9) }, frame_id: "stick" };
  let axes = pushed ? [Number(turn), Number(forward)] : [0, 0];
  if (failed && then === "nan") axes = number % 2 ? [NaN, Infinity] : ["NaN", null];
  if (failed && then === "garbage") axes = "garbage";
  if (!failed || then !== "silence") joy.publish({ header, axes, buttons: [0, 0, 0, 0, 1] });
  number += 1;
}

ros.on("connection", () => setInterval(send, PERIOD));
ros.on("error", () => {});
