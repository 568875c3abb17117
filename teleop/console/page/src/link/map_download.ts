/** Fetches a map's file over HTTP and keeps it in the browser under its hash. */

import { tokenHeaders } from "./token_headers";

const STORE = "farsteer-maps";
/** Maps that the browser keeps; a robot changes its map seldom. */
const MOST_KEPT = 3;
const LARGEST = 1024 * 1024 * 1024;

/** What the download needs of its surroundings. */
export interface DownloadParts {
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  /** The browser's store of responses; undefined where there is none, such as without a secure context. */
  readonly caches: CacheStorage | undefined;
}

export interface MapRequest {
  /** Address of the robot by HTTP. */
  readonly http: string;
  readonly sha256: string;
  readonly token: string;
  readonly signal: AbortSignal;
  /** Called with the share that has come, 0 to 1. */
  readonly progress: (share: number) => void;
}

/** Why a file cannot be had, in words. */
export class DownloadError extends Error {}

/**
 * Fetch the file by its hash; of a robot that does not know it by its hash, as `/map.ply`.
 *
 * @throws DownloadError with the reason; the fetch's own error if it is aborted or the network fails.
 */
export async function downloadMap(request: MapRequest, parts: DownloadParts): Promise<ArrayBuffer> {
  const { http, sha256, token, signal, progress } = request;
  const kept = await fromStore(parts.caches, sha256);
  if (kept !== undefined) {
    progress(1);
    return kept;
  }
  const headers = tokenHeaders(token);
  const init: RequestInit = { headers, signal, credentials: "omit" };
  let response = await parts.fetch(`${http}/map/${sha256}.ply`, init);
  if (response.status === 404) {
    response = await parts.fetch(`${http}/map.ply`, init);
  }
  if (!response.ok) {
    throw new DownloadError(response.status === 401 ? "the robot asks for a token" : `the robot answers ${response.status}`);
  }
  return await readBody(response, progress);
}

async function readBody(response: Response, progress: (share: number) => void): Promise<ArrayBuffer> {
  // Of a compressed response the length is that of what is sent, and what arrives is more.
  const length = response.headers.get("Content-Encoding") === null ? Number(response.headers.get("Content-Length")) : 0;
  if (response.body === null) {
    return await response.arrayBuffer();
  }
  const chunks: Uint8Array[] = [];
  let size = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) {
      break;
    }
    chunks.push(value);
    size += value.length;
    if (size > LARGEST) {
      await reader.cancel();
      throw new DownloadError("it is larger than 1 GB");
    }
    progress(length > 0 ? Math.min(1, size / length) : 0);
  }
  const whole = new Uint8Array(size);
  let at = 0;
  for (const chunk of chunks) {
    whole.set(chunk, at);
    at += chunk.length;
  }
  return whole.buffer;
}

async function fromStore(caches: CacheStorage | undefined, sha256: string): Promise<ArrayBuffer | undefined> {
  try {
    const store = await caches?.open(STORE);
    const response = await store?.match(key(sha256));
    return await response?.arrayBuffer();
  } catch {
    // A store that is full, broken or forbidden is as none.
    return undefined;
  }
}

/** Keep a file that was verified. */
export async function keepMap(caches: CacheStorage | undefined, sha256: string, file: ArrayBuffer): Promise<void> {
  try {
    const store = await caches?.open(STORE);
    if (store === undefined) {
      return;
    }
    await store.put(key(sha256), new Response(file));
    const kept = await store.keys();
    await Promise.all(kept.slice(0, Math.max(0, kept.length - MOST_KEPT)).map((old) => store.delete(old)));
  } catch {
    // The next visit fetches it again.
  }
}

/** Drop a file that proved to be another than its name says. */
export async function dropMap(caches: CacheStorage | undefined, sha256: string): Promise<void> {
  try {
    const store = await caches?.open(STORE);
    await store?.delete(key(sha256));
  } catch {
    // There is none then.
  }
}

function key(sha256: string): string {
  return `/map/${sha256}.ply`;
}
