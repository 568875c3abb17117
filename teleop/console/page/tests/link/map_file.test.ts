import { describe, expect, it } from "vitest";
import { readMapFile } from "../../src/link/map_file";
import { ply, XYZ } from "./ply_files";

async function sha256(file: ArrayBuffer): Promise<string> {
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", file));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

describe("a map's file", () => {
  it("is verified by its hash", async () => {
    const file = ply(XYZ, 1);
    expect(await readMapFile({ file, sha256: await sha256(file) })).toMatchObject({ kind: "map", verified: true });
    expect(await readMapFile({ file, sha256: "0b".repeat(32) })).toEqual({ kind: "wrong" });
    const bad = new ArrayBuffer(5);
    expect(await readMapFile({ file: bad, sha256: await sha256(bad) })).toEqual({ kind: "bad", reason: "it is no PLY file" });
  });
});
