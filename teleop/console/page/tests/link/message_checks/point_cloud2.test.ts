import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { check, type Checked } from "../../../src/link/message_checks/field";
import { MOST_POINTS, readPointCloud2 } from "../../../src/link/message_checks/point_cloud2";
import type { CloudPoints } from "../../../src/values";
import { cloudMessage } from "./valid_messages";

const SIZES = [0, 1, 1, 2, 2, 4, 4, 4, 8];

function read(message: unknown): Checked<CloudPoints> {
  return check((field) => readPointCloud2(field, 7), message);
}

function write(view: DataView, at: number, datatype: number, value: number, little: boolean): void {
  switch (datatype) {
    case 1: view.setInt8(at, value); break;
    case 2: view.setUint8(at, value); break;
    case 3: view.setInt16(at, value, little); break;
    case 4: view.setUint16(at, value, little); break;
    case 5: view.setInt32(at, value, little); break;
    case 6: view.setUint32(at, value, little); break;
    case 7: view.setFloat32(at, value, little); break;
    default: view.setFloat64(at, value, little);
  }
}

describe("a point cloud", () => {
  it("is read in the robot's own layout", () => {
    const cloud = read(cloudMessage());
    expect(cloud.ok && Array.from(cloud.value.positions)).toEqual([1, 2, 3, 4, 5, 6]);
    expect(cloud.ok && Array.from(cloud.value.distances)).toEqual([0.5, NaN]);
    expect(cloud.ok && cloud.value.stamp).toBe(3.5);
  });

  it("is read in any layout", () => {
    const datatype = fc.integer({ min: 1, max: 8 });
    const layout = fc.record({
      names: fc.shuffledSubarray(["x", "y", "z", "distance", "ring"], { minLength: 5 }),
      datatypes: fc.tuple(datatype, datatype, datatype, datatype, datatype),
      gaps: fc.array(fc.integer({ min: 0, max: 5 }), { minLength: 6, maxLength: 6 }),
      width: fc.integer({ min: 0, max: 5 }),
      height: fc.integer({ min: 1, max: 3 }),
      padding: fc.integer({ min: 0, max: 9 }),
      start: fc.integer({ min: 0, max: 3 }),
      little: fc.boolean(),
    });
    fc.assert(fc.property(layout, ({ names, datatypes, gaps, width, height, padding, start, little }) => {
      let step = 0;
      const fields = names.map((name, i) => {
        const datatype = datatypes[i] ?? 7;
        const offset = step + (gaps[i] ?? 0);
        step = offset + (SIZES[datatype] ?? 0);
        return { name, offset, datatype, count: 1 };
      });
      step += gaps[5] ?? 0;
      const rowStep = width * step + padding;
      // A view into a larger buffer, as a decoder gives it.
      const data = new Uint8Array(new ArrayBuffer(start + height * rowStep), start);
      const view = new DataView(data.buffer, data.byteOffset);
      const expected: number[] = [];
      for (let i = 0; i < width * height; i++) {
        const at = Math.floor(i / width) * rowStep + (i % width) * step;
        for (const [j, field] of fields.entries()) {
          write(view, at + field.offset, field.datatype, 10 * j + (i % 10), little);
        }
        expected.push(...["x", "y", "z", "distance"].map((name) => 10 * names.indexOf(name) + (i % 10)));
      }
      const cloud = read({
        ...cloudMessage(), fields, width, height, point_step: step, row_step: rowStep, data, is_bigendian: !little,
      });
      expect(cloud.ok).toBe(true);
      if (cloud.ok) {
        const { positions, distances } = cloud.value;
        const found = Array.from(distances, (distance, i) => [...positions.slice(3 * i, 3 * i + 3), distance]);
        expect(found.flat()).toEqual(expected);
      }
    }));
  });

  it("loses points that are not finite", () => {
    const message = cloudMessage();
    message["data"] = new Uint8Array(new Float32Array([NaN, 2, 3, 0, 0.5, 4, 5, 6, 0, 0.1]).buffer);
    const cloud = read(message);
    expect(cloud.ok && Array.from(cloud.value.positions)).toEqual([4, 5, 6]);
    expect(cloud.ok && cloud.value.distances.length).toBe(1);
  });

  it("has unknown distances if it names none", () => {
    const message = cloudMessage();
    message["fields"] = ["x", "y", "z"].map((name, i) => ({ name, offset: 4 * i, datatype: 7, count: 1 }));
    const cloud = read(message);
    expect(cloud.ok && Array.from(cloud.value.distances)).toEqual([NaN, NaN]);
  });

  it("is thinned if it is larger than what is shown", () => {
    const width = 2 * MOST_POINTS + 1;
    const data = new Uint8Array(20 * width);
    const cloud = read({ ...cloudMessage(), width, row_step: 20 * width, data });
    expect(cloud.ok && cloud.value.distances.length).toBeLessThanOrEqual(MOST_POINTS);
  });

  it("may be empty", () => {
    const cloud = read({ ...cloudMessage(), width: 0, height: 0, row_step: 0, point_step: 20, data: "" });
    expect(cloud.ok && cloud.value.positions.length).toBe(0);
  });

  it.each([
    [{ data: new Uint8Array(39) }, "data is shorter than its points"],
    [{ height: 2, row_step: 19 }, "row_step is shorter than a row of points"],
    [{ height: 2, data: new Uint8Array(79) }, "data is shorter than its points"],
    [{ width: 1e9 }, "width is not within 0 and 67108864"],
    [{ point_step: 19 }, "fields[4].offset is beyond the point"],
    [{ fields: [] }, "fields have no x"],
    [{ data: "not base64!" }, "data is not base64"],
    [{ fields: [{ name: "x", offset: 0, datatype: 9, count: 1 }] }, "fields[0].datatype is not a type of point fields"],
  ])("with %o is refused by name", (part, complaint) => {
    expect(read({ ...cloudMessage(), ...part })).toEqual({ ok: false, complaint });
  });
});
