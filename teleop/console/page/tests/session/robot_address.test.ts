import fc from "fast-check";
import { afterEach, describe, expect, it, vi } from "vitest";
import { configFrom, fetchConfig, robotAddress } from "../../src/session/robot_address";

afterEach(() => { vi.unstubAllGlobals(); });

describe("the robot's address", () => {
  it("is the page's own where the server names none", () => {
    const page = { protocol: "http:", host: "127.0.0.1:9090" };
    expect(robotAddress({ robot: "", version: "1" }, page)).toBe("ws://127.0.0.1:9090");
    expect(robotAddress({ robot: "", version: "1" }, { ...page, protocol: "https:" })).toBe("wss://127.0.0.1:9090");
  });

  it("is the one that the server names", () => {
    const config = configFrom({ robot: "ws://10.0.0.7:9090", version: "0.2" });
    expect(robotAddress(config, { protocol: "http:", host: "127.0.0.1:9080" })).toBe("ws://10.0.0.7:9090");
    expect(config.version).toBe("0.2");
  });

  it("is never of another scheme, whatever the server says", () => {
    fc.assert(fc.property(fc.anything(), (value) => {
      expect(configFrom(value).robot).toMatch(/^$|^wss?:\/\//);
    }));
    expect(configFrom({ robot: "javascript:alert(1)" }).robot).toBe("");
  });

  it("falls back to the page's own where the server gives no answer", async () => {
    vi.stubGlobal("fetch", () => Promise.reject(new Error("gone")));
    expect(await fetchConfig()).toEqual({ robot: "", version: "" });
    vi.stubGlobal("fetch", () => Promise.resolve(new Response("<html>")));
    expect(await fetchConfig()).toEqual({ robot: "", version: "" });
  });
});
