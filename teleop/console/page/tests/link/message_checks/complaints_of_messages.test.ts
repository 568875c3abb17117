import { describe, expect, it } from "vitest";
import { check } from "../../../src/link/message_checks/field";
import { readInertial, readOdometry } from "../../../src/link/message_checks/pose_messages";
import { readControl, readDescription, readMapInfo } from "../../../src/link/message_checks/robot_messages";
import { readCompressedImage, readLaserScan, readOccupancyGrid } from "../../../src/link/message_checks/sensor_messages";
import { readLeanCloud } from "../../../src/link/message_checks/lean_cloud";
import { readLinkAnswer, readPreview } from "../../../src/link/message_checks/answers";
import { EXAMPLES } from "./valid_messages";

function example(kind: string): Record<string, unknown> {
  return { ...EXAMPLES[kind]?.message };
}

describe("a complaint", () => {
  it("names the field that is not a number", () => {
    const message = example("odometry");
    message["pose"] = { pose: { position: { x: "1", y: 0, z: 0 } } };
    const checked = check((field) => readOdometry(field, 0), message);
    expect(checked).toEqual({ ok: false, complaint: "pose.pose.position.x is not a number" });
  });

  it("names what is missing", () => {
    expect(check((field) => readOdometry(field, 0), undefined)).toEqual({ ok: false, complaint: "the message is missing" });
    expect(check(readDescription, {})).toEqual({ ok: false, complaint: "data is missing" });
  });

  it("is made of a hash that is none", () => {
    const checked = check(readMapInfo, { ...example("mapInfo"), sha256: "../../etc/passwd" });
    expect(checked).toEqual({ ok: false, complaint: "sha256 is not a SHA-256" });
  });

  it("is made of a model that is too long, not of a long reason", () => {
    expect(check(readDescription, { data: "x".repeat(2_000_000) }).ok).toBe(false);
    const control = check(readControl, { ...example("control"), reason: "x".repeat(5000) });
    expect(control.ok && control.value.reason.length).toBe(1001);
  });
});

describe("a reader", () => {
  it("takes stamps of ROS 1 and of ROS 2", () => {
    const old = { ...example("control"), header: { stamp: { secs: 3, nsecs: 5e8 }, frame_id: "/map" } };
    for (const message of [old, example("control")]) {
      const checked = check(readControl, message);
      expect(checked.ok && checked.value.stamp).toBe(3.5);
    }
  });

  it("takes a robot that knows of no asking", () => {
    const { asking: _asking, asking_name: _name, ...message } = example("control");
    const checked = check(readControl, message);
    expect(checked.ok && checked.value.asking).toBe(0);
  });

  it("leaves out the orientation that an inertial unit says it has not", () => {
    const message = { ...example("inertial"), orientation_covariance: [-1, 0, 0, 0, 0, 0, 0, 0, 0] };
    const checked = check(readInertial, message);
    expect(checked.ok && checked.value.orientation).toBeUndefined();
  });

  it("turns a scan into points and leaves out beams without a return", () => {
    const checked = check((field) => readLaserScan(field, 0), example("scan"));
    expect(checked.ok && Array.from(checked.value.positions)).toEqual([1, 0, 0]);
  });

  it("reads a grid's cells, unknown where they are none", () => {
    const checked = check(readOccupancyGrid, { ...example("grid"), data: [0, 100, -1, 101] });
    expect(checked.ok && Array.from(checked.value.cells)).toEqual([0, 100, -1, -1]);
    expect(check(readOccupancyGrid, { ...example("grid"), data: [0, 100, -1] })).toEqual({
      ok: false, complaint: "data does not have width times height cells",
    });
  });

  it("reads a lean cloud", () => {
    const checked = check((field) => readLeanCloud(field, 0), example("leanCloud"));
    expect(checked.ok).toBe(true);
    if (checked.ok) {
      expect(Array.from(checked.value.positions, (value) => value.toFixed(2))).toEqual(["1.02", "2.04", "0.06"]);
      expect(checked.value.distances[0]).toBeCloseTo(0.5);
    }
    const short = check((field) => readLeanCloud(field, 0), { ...example("leanCloud"), data: "AQACAA==" });
    expect(short).toEqual({ ok: false, complaint: "data is not a multiple of 7 bytes" });
  });

  it("takes the kinds of pictures that browsers show", () => {
    const typeOf = (format: string): string | false => {
      const checked = check(readCompressedImage, { ...example("image"), format });
      return checked.ok && checked.value.type;
    };
    expect([typeOf("jpeg"), typeOf("rgb8; png compressed"), typeOf("h264")]).toEqual(["image/jpeg", "image/png", false]);
  });

  it("says that there is no present pose, and no preview without success", () => {
    const of = { x: 1, y: 2, yaw: 3 };
    const preview = check((values) => readPreview(values, of), example("preview"));
    expect(preview.ok && preview.value).toEqual({ pose: of, explained: 0.93, present: undefined });
    const failed = check((values) => readPreview(values, of), { success: false, message: "no sweep yet", explained: -1 });
    expect(failed).toEqual({ ok: true, value: undefined });
  });

  it("reads counts of 64 bits", () => {
    const dropped = check(readLinkAnswer, example("dropped"));
    expect(dropped.ok && [...dropped.value.topics.values()].map((topic) => topic.dropped)).toEqual([1, 2]);
  });
});
