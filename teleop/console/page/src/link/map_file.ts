/** A map's file: verified, then read. The same in a worker and, where there is none, in the page. */

import { PlyError, readPly, readPlyNormals } from "./ply";

/** A map that was asked for, as the worker gets it. */
export interface MapJob {
  readonly file: ArrayBuffer;
  readonly sha256: string;
}

export type MapResult =
  | {
    readonly kind: "map";
    readonly positions: Float32Array<ArrayBuffer>;
    readonly normals?: Int8Array<ArrayBuffer>;
    readonly verified: boolean;
  }
  | { readonly kind: "wrong" }
  | { readonly kind: "bad"; readonly reason: string };

/** Verify a file by its SHA-256, if the context has the means, and read its points. */
export async function readMapFile({ file, sha256 }: MapJob): Promise<MapResult> {
  const subtle = subtleCrypto();
  if (subtle !== undefined && hexadecimal(await subtle.digest("SHA-256", file)) !== sha256) {
    return { kind: "wrong" };
  }
  try {
    const map = { kind: "map", positions: readPly(file), verified: subtle !== undefined } as const;
    const normals = readPlyNormals(file);
    return normals === undefined ? map : { ...map, normals };
  } catch (error) {
    if (error instanceof PlyError) {
      return { kind: "bad", reason: error.message };
    }
    throw error;
  }
}

/** Browsers offer it in secure contexts only, whatever its type says. */
function subtleCrypto(): SubtleCrypto | undefined {
  const { subtle }: { readonly subtle?: SubtleCrypto } = globalThis.crypto;
  return subtle;
}

function hexadecimal(bytes: ArrayBuffer): string {
  return Array.from(new Uint8Array(bytes), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Whether a value is what the worker answers. */
export function isMapResult(value: unknown): value is MapResult {
  if (typeof value !== "object" || value === null || !("kind" in value)) {
    return false;
  }
  return value.kind === "map"
    ? "positions" in value && value.positions instanceof Float32Array && "verified" in value &&
      (!("normals" in value) || value.normals instanceof Int8Array)
    : value.kind === "wrong" || (value.kind === "bad" && "reason" in value);
}

/** Whether a value is what the worker is asked. */
export function isMapJob(value: unknown): value is MapJob {
  return typeof value === "object" && value !== null && "file" in value && value.file instanceof ArrayBuffer &&
    "sha256" in value && typeof value.sha256 === "string";
}
