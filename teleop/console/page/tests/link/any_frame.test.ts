/** Whatever frames come, the link outlives them: nothing throws, and the next good message is used. */

import { encode } from "cbor2";
import fc from "fast-check";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FakeRobot, ROBOT_TOPICS, transform } from "./fake_robot";

const topic = fc.constantFrom(...Object.keys(ROBOT_TOPICS), "connection", "close", "error", "message", "__proto__", "");
const operation = fc.constantFrom("publish", "service_response", "status", "fragment", "action_result", "set_level", "nonsense");

const frame = fc.oneof(
  fc.record({ op: operation, topic, id: fc.oneof(topic, fc.jsonValue()), msg: fc.jsonValue(), values: fc.jsonValue() }),
  fc.record({ op: fc.constant("publish"), topic, msg: fc.jsonValue() }),
  fc.record({ op: fc.constant("publish"), topic, msg: fc.jsonValue() })
    .map((message) => Uint8Array.from(encode(message)).buffer),
  fc.string(),
  fc.json(),
  fc.uint8Array().map((bytes) => Uint8Array.from(bytes).buffer),
);

let robot: FakeRobot;

beforeEach(async () => {
  vi.useFakeTimers();
  vi.spyOn(console, "error").mockImplementation(() => undefined);
  robot = new FakeRobot();
  robot.link.start();
  await vi.advanceTimersByTimeAsync(20);
});

afterEach(() => {
  robot.link.stop();
  vi.restoreAllMocks();
  vi.useRealTimers();
});

it("outlives any frames", () => {
  fc.assert(
    fc.property(fc.array(frame, { maxLength: 20 }), fc.double({ min: -100, max: 100, noNaN: true }), (frames, x) => {
      for (const bytes of frames) {
        robot.socket.deliver(bytes);
      }
      expect(robot.state.connection.value.phase).toBe("open");
      robot.publish("/tf", { transforms: [transform("map", "odom", 1), transform("odom", "base_link", x)] });
      expect(robot.state.mapFromBase.value?.position.x).toBeCloseTo(1 + x);
      expect(robot.link.commands.joy(0, 0, false, false)).toBe(true);
    }),
    { numRuns: 300 },
  );
  expect(robot.sockets).toHaveLength(1);
});
