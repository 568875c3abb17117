import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { PlyError, readPly, readPlyNormals } from "../../src/link/ply";
import { ply, type Property, TYPES, XYZ } from "./ply_files";

describe("a PLY", () => {
  it("is read with any properties in any order and of any type", () => {
    const type = fc.constantFrom(...Object.keys(TYPES));
    const properties = fc.tuple(fc.shuffledSubarray(["x", "y", "z", "nx", "red"], { minLength: 5 }), fc.array(type, { minLength: 5, maxLength: 5 }))
      .map(([names, types]) => names.map((name, i): Property => [name, types[i] ?? "float"]));
    fc.assert(fc.property(properties, fc.integer({ min: 0, max: 9 }), fc.boolean(), (columns, count, other) => {
      const before = other ? "element thing 1\nproperty uchar a\nproperty short b" : "";
      const expected = Array.from({ length: count }, (_, row) =>
        ["x", "y", "z"].map((axis) => row + 10 * columns.findIndex(([name]) => name === axis)));
      expect(Array.from(readPly(ply(columns, count, before)))).toEqual(expected.flat());
    }));
  });

  it("has the normals of the vertices that are kept, as bytes, or none", () => {
    expect(readPlyNormals(ply(XYZ, 2))).toBeUndefined();
    const columns: Property[] = ["x", "y", "z", "nx", "ny", "nz"].map((name) => [name, "float"]);
    const file = ply(columns, 3);
    const values = new DataView(file, file.byteLength - 72);
    // The second vertex is nowhere; the last has a normal that is none.
    [[0, 0, 0, 0.5, -1, 0], [NaN, 0, 0, 1, 1, 1], [0, 0, 0, NaN, 7, -7]].flat().forEach((value, at) => {
      values.setFloat32(4 * at, value, true);
    });
    expect(Array.from(readPlyNormals(file) ?? [])).toEqual([64, -127, 0, 0, 127, -127]);
    expect(readPly(file).length).toBe(6);
  });

  it("loses vertices that are not finite", () => {
    const file = ply(XYZ, 2);
    new DataView(file).setFloat32(file.byteLength - 12, NaN, true);
    expect(Array.from(readPly(file))).toEqual([0, 10, 20]);
  });

  it.each([
    ["", "it is no PLY file"],
    ["ply\nformat ascii 1.0\nelement vertex 1\nend_header\n", "it is not binary and little-endian"],
    ["ply\nformat binary_little_endian 1.0\n", "its header has no end"],
    ["ply\nformat binary_little_endian 1.0\nend_header\n", "it has no vertices"],
    ["ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n", "it ends before its 9 vertices do"],
    ["ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nend_header\n", "its vertices have no x, y and z"],
    ["ply\nformat binary_little_endian 1.0\nelement vertex -1\nend_header\n", "it has -1 of an element, which is no number of at most 50000000"],
    ["ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uchar int i\nend_header\n", "a property of its vertex has the type list, of no fixed size"],
  ])("that is %j is refused with the reason", (text, reason) => {
    expect(() => readPly(new TextEncoder().encode(text).buffer)).toThrow(new PlyError(reason));
  });

  it("is read or refused, whatever its bytes", () => {
    const whole = new Uint8Array(ply(XYZ, 3));
    fc.assert(fc.property(fc.integer({ min: 0, max: whole.length - 1 }), fc.integer({ min: 0, max: 255 }), (at, byte) => {
      const file = whole.slice();
      file[at] = byte;
      try {
        readPly(file.buffer);
      } catch (error) {
        expect(error).toBeInstanceOf(PlyError);
      }
    }));
  });
});
