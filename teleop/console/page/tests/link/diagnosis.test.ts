import { describe, expect, it } from "vitest";
import { diagnose, type Surroundings } from "../../src/link/diagnosis";
import { linkTexts } from "../../src/texts/link";

const HERE = "http://127.0.0.1:9090";
const ADDRESS = "ws://127.0.0.1:9090";

function surroundings(pages: Readonly<Record<string, Response>>, origin = HERE): Surroundings {
  return {
    origin,
    online: true,
    fetch: (url) => {
      const page = pages[url];
      return page === undefined ? Promise.reject(new TypeError("Failed to fetch")) : Promise.resolve(page);
    },
  };
}

const VERSION = `${HERE}/version`;
const version = (): Response => Response.json({ protocol: { major: 2 }, server: "1" });

describe("a handshake that fails is explained by HTTP", () => {
  it.each<[string, string, boolean, Surroundings, string]>([
    ["nothing listens", ADDRESS, false, surroundings({}), linkTexts.nothingListens(ADDRESS)],
    ["nothing answers", ADDRESS, true, surroundings({}), linkTexts.handshakeHangs(ADDRESS)],
    [
      "a certificate is not trusted", "wss://robot:9090", false, surroundings({}),
      linkTexts.noTls("wss://robot:9090", "https://robot:9090/version"),
    ],
    ["another web server", ADDRESS, false, surroundings({ [VERSION]: new Response("hello") }), linkTexts.notRosbridge(ADDRESS)],
    [
      "another web server elsewhere", ADDRESS, false,
      surroundings({ [VERSION]: Object.defineProperty(new Response(), "type", { value: "opaque" }) }, "http://127.0.0.1:1"),
      linkTexts.notRosbridge(ADDRESS),
    ],
    [
      "a robot that refuses the page", ADDRESS, false,
      surroundings({ [VERSION]: version(), [`${HERE}/healthz`]: Response.json({ clients: 3 }) }),
      linkTexts.refusesPage(ADDRESS, HERE),
    ],
    [
      "a full robot", ADDRESS, false,
      surroundings({ [VERSION]: version(), [`${HERE}/healthz`]: Response.json({ clients: 32 }) }), linkTexts.full(ADDRESS),
    ],
    [
      "a robot too busy to say all that it is in time", ADDRESS, false,
      surroundings({ [VERSION]: Object.defineProperty(version(), "json", { value: () => Promise.reject(new DOMException("", "TimeoutError")) }) }),
      linkTexts.handshakeHangs(ADDRESS),
    ],
    ["no network", "ws://robot:1", false, { ...surroundings({}), online: false }, linkTexts.browserOffline],
  ])("%s", async (_what, address, hung, around, words) => {
    expect(await diagnose(address, hung, around)).toBe(words);
  });
});
