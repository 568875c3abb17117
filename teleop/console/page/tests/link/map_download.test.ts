import { describe, expect, it } from "vitest";
import { DownloadError, downloadMap, keepMap } from "../../src/link/map_download";

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
