import fc from "fast-check";
import { afterEach, describe, expect, it, vi } from "vitest";
import { DownloadError, downloadMap, keepMap } from "../../src/link/map_download";
import { readMapFile } from "../../src/link/map_file";
import { MapLoader } from "../../src/link/map_loader";
import { PlyError, readPly } from "../../src/link/ply";
import { unknownState } from "../../src/robot/robot_state";
import { linkTexts } from "../../src/texts/link";

type Write = (view: DataView, at: number, value: number) => void;

const TYPES: Readonly<Record<string, readonly [number, Write]>> = {
  char: [1, (view, at, value) => { view.setInt8(at, value); }],
  uint8: [1, (view, at, value) => { view.setUint8(at, value); }],
  short: [2, (view, at, value) => { view.setInt16(at, value, true); }],
  ushort: [2, (view, at, value) => { view.setUint16(at, value, true); }],
  int: [4, (view, at, value) => { view.setInt32(at, value, true); }],
  uint32: [4, (view, at, value) => { view.setUint32(at, value, true); }],
  float: [4, (view, at, value) => { view.setFloat32(at, value, true); }],
  double: [8, (view, at, value) => { view.setFloat64(at, value, true); }],
};

type Property = readonly [name: string, type: string];

/** A PLY with these properties, whose values are the row plus ten times the column. */
function ply(properties: readonly Property[], count: number, before = ""): ArrayBuffer {
  const lines = properties.map(([name, type]) => `property ${type} ${name}`);
  const text = ["ply", "format binary_little_endian 1.0", "comment x", ...(before === "" ? [] : [before]),
    `element vertex ${count}`, ...lines, "end_header", ""].join("\n");
  const head = new TextEncoder().encode(text);
  const skipped = before === "" ? 0 : 3;
  const stride = properties.reduce((sum, [, type]) => sum + (TYPES[type]?.[0] ?? 0), 0);
  const file = new Uint8Array(head.length + skipped + count * stride);
  file.set(head);
  const view = new DataView(file.buffer, head.length + skipped);
  let at = 0;
  for (let row = 0; row < count; row++) {
    for (const [column, [, type]] of properties.entries()) {
      const [size, write] = TYPES[type] ?? [0, () => undefined];
      write(view, at, row + 10 * column);
      at += size;
    }
  }
  return file.buffer;
}

const XYZ: readonly Property[] = [["x", "float"], ["y", "float"], ["z", "float"]];

async function sha256(file: ArrayBuffer): Promise<string> {
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", file));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

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

describe("a map's file", () => {
  it("is verified by its hash", async () => {
    const file = ply(XYZ, 1);
    expect(await readMapFile({ file, sha256: await sha256(file) })).toMatchObject({ kind: "map", verified: true });
    expect(await readMapFile({ file, sha256: "0b".repeat(32) })).toEqual({ kind: "wrong" });
    const bad = new ArrayBuffer(5);
    expect(await readMapFile({ file: bad, sha256: await sha256(bad) })).toEqual({ kind: "bad", reason: "it is no PLY file" });
  });
});

describe("a map's download", () => {
  const request = (progress: (share: number) => void = () => undefined): Parameters<typeof downloadMap>[0] => ({
    http: "http://robot", sha256: "abc", token: "secret", signal: new AbortController().signal, progress,
  });

  it("falls back to a robot that knows its map by no hash, with the token in the header", async () => {
    const asked: [string, RequestInit][] = [];
    const shares: number[] = [];
    const fetch = (url: string, init: RequestInit): Promise<Response> => {
      asked.push([url, init]);
      return Promise.resolve(url.endsWith("/map.ply")
        ? new Response("abcd", { headers: { "Content-Length": "4" } })
        : new Response("", { status: 404 }));
    };
    const file = await downloadMap(request((share) => shares.push(share)), { fetch, caches: undefined });
    expect(new TextDecoder().decode(file)).toBe("abcd");
    expect(asked.map(([url]) => url)).toEqual(["http://robot/map/abc.ply", "http://robot/map.ply"]);
    expect(asked.every(([, init]) => new Headers(init.headers).get("Authorization") === "Bearer secret")).toBe(true);
    expect(shares.at(-1)).toBe(1);
  });

  it("says why there is none", async () => {
    const fetch = (): Promise<Response> => Promise.resolve(new Response("", { status: 401 }));
    await expect(downloadMap(request(), { fetch, caches: undefined })).rejects.toThrow(new DownloadError("the robot asks for a token"));
  });

  it("does without a store that fails", async () => {
    const caches = { open: () => Promise.reject(new Error("forbidden")) } as unknown as CacheStorage;
    const fetch = (): Promise<Response> => Promise.resolve(new Response("abcd"));
    expect((await downloadMap(request(), { fetch, caches })).byteLength).toBe(4);
    await expect(keepMap(caches, "abc", new ArrayBuffer(1))).resolves.toBeUndefined();
  });
});

describe("a map's loader", () => {
  afterEach(() => {
    vi.useRealTimers();
  });

  it("says once what is wrong, tries again, and shows the map when it comes", async () => {
    vi.useFakeTimers();
    const state = unknownState();
    const events: string[] = [];
    let status = 500;
    const loader = new MapLoader({
      http: "http://robot", token: () => "", state, caches: undefined,
      fetch: () => Promise.resolve(new Response("abcd", { status })),
      read: () => Promise.resolve({ kind: "map", positions: new Float32Array(3), verified: false }),
      events: (_severity, words) => {
        events.push(words);
      },
    });
    const corner = { x: 0, y: 0, z: 0 };
    loader.load({ name: "office", frame: "map", sha256: "abc", points: 1, min: corner, max: corner, run: "" });
    await vi.advanceTimersByTimeAsync(20_000);
    expect(events).toEqual([linkTexts.events.mapFailed("the robot answers 500")]);
    status = 200;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(state.mapPoints.value?.sha256).toBe("abc");
    expect(state.mapProgress.value).toBeUndefined();
    expect(events.at(-1)).toBe(linkTexts.events.mapUnverified);
  });

  it("shows no map that is another than the robot's", async () => {
    const state = unknownState();
    const events: string[] = [];
    const loader = new MapLoader({
      http: "http://robot", token: () => "", state, caches: undefined,
      fetch: () => Promise.resolve(new Response("abcd")),
      read: () => Promise.resolve({ kind: "wrong" }),
      events: (_severity, words) => {
        events.push(words);
      },
    });
    const corner = { x: 0, y: 0, z: 0 };
    loader.load({ name: "office", frame: "map", sha256: "abc", points: 1, min: corner, max: corner, run: "" });
    await vi.waitFor(() => {
      expect(events).toEqual([linkTexts.events.mapWrong]);
    });
    expect(state.mapPoints.value).toBeUndefined();
    loader.stop();
  });
});
