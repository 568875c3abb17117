import { describe, expect, it, vi } from "vitest";
import { PlaceLoader } from "../../src/link/place_loader";
import { unknownState } from "../../src/robot/robot_state";
import type { MapInfo } from "../../src/values";

const INFO: MapInfo = {
  name: "office", frame: "map", sha256: "ab".repeat(32), points: 3, run: "1",
  min: { x: 0, y: 0, z: 0 }, max: { x: 1, y: 1, z: 1 },
};

/** A GLB file of a table alone, of a map with this hash. */
function surfaces(sha256: string): ArrayBuffer {
  const table = new TextEncoder().encode(JSON.stringify({ asset: { version: "2.0", extras: { sha256 } } }));
  const file = new ArrayBuffer(20 + table.length);
  new DataView(file).setUint32(12, table.length, true);
  new Uint8Array(file).set(table, 20);
  return file;
}

function loader(answer: () => Response) {
  const state = unknownState();
  const urls: string[] = [];
  const place = new PlaceLoader({
    http: "http://robot", caches: undefined, token: () => "secret", state, events: () => undefined,
    fetch: (url, init) => {
      urls.push(url);
      expect(init.headers).toEqual({ Authorization: "Bearer secret" });
      return Promise.resolve(url.endsWith(".glb") ? answer() : new Response(new ArrayBuffer(8)));
    },
    read: () => Promise.resolve({ kind: "map", positions: new Float32Array(9), verified: true }),
  });
  const load = (info = INFO): void => {
    state.mapInfo.value = info;
    place.load(info);
  };
  return { state, urls, place, load };
}

describe("what shows the place", () => {
  it("is the surfaces of the robot's map, and no point of it is fetched", async () => {
    const { state, urls, load } = loader(() => new Response(surfaces(INFO.sha256)));
    load();
    load();
    await vi.waitFor(() => { expect(state.surfaces.value).toBeDefined(); });
    expect(urls).toEqual(["http://robot/map.glb"]);
  });

  it.each([
    ["has none", () => new Response("", { status: 404 })],
    ["has those of another map", () => new Response(surfaces("cd".repeat(32)))],
    ["sends something else", () => new Response("<html>" + "x".repeat(40))],
  ])("is the map's points where the robot %s", async (_, answer) => {
    const { state, load } = loader(answer);
    load();
    await vi.waitFor(() => { expect(state.mapPoints.value).toBeDefined(); });
    expect(state.surfaces.value).toBeUndefined();
  });

  it("is both once the points are wanted", async () => {
    const { state, place, load } = loader(() => new Response(surfaces(INFO.sha256)));
    load();
    place.wantPoints();
    await vi.waitFor(() => { expect(state.surfaces.value).toBeDefined(); expect(state.mapPoints.value).toBeDefined(); });
  });

  it("is asked for again with a new token, and anew for another map", async () => {
    let status = 401;
    const { state, urls, place, load } = loader(() => status === 401
      ? new Response("", { status }) : new Response(surfaces(state.mapInfo.value?.sha256 ?? "")));
    load();
    await vi.waitFor(() => { expect(state.mapPoints.value).toBeDefined(); });
    status = 200;
    place.again();
    await vi.waitFor(() => { expect(state.surfaces.value).toBeDefined(); });
    const first = state.surfaces.value;
    load({ ...INFO, sha256: "ef".repeat(32) });
    await vi.waitFor(() => { expect(state.surfaces.value).not.toBe(first); expect(state.surfaces.value).toBeDefined(); });
    expect(urls.filter((url) => url.endsWith(".glb"))).toHaveLength(3);
  });
});
