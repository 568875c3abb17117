import { describe, expect, it } from "vitest";
import { keepToken, takeToken } from "../../src/session/token";

class Places {
  readonly location: { hash: string; pathname: string; search: string };
  shown: string;
  readonly kept = new Map<string, string>();
  blocked = false;

  constructor(hash: string) {
    this.location = { hash, pathname: "/", search: "?x=1" };
    this.shown = `/?x=1${hash}`;
  }

  readonly history = {
    replaceState: (_data: unknown, _title: string, url?: string | URL | null): void => { this.shown = String(url); },
  };

  readonly lasted = new Map<string, string>();
  readonly storage = (): Storage => this.in(this.kept);
  readonly lasting = (): Storage => this.in(this.lasted);

  private in(kept: Map<string, string>): Storage {
    if (this.blocked) {
      throw new DOMException("blocked");
    }
    return {
      getItem: (key: string) => kept.get(key) ?? null,
      setItem: (key: string, value: string) => { kept.set(key, value); },
      removeItem: (key: string) => { kept.delete(key); },
    } as unknown as Storage;
  }
}

describe("the session's token", () => {
  it("leaves the address bar at once and lives in the tab", () => {
    const places = new Places("#token=s3cret%2B");
    expect(takeToken(places)).toBe("s3cret+");
    expect(places.shown).toBe("/?x=1");
    expect([...places.kept.values()]).toEqual(["s3cret+"]);
  });

  it("is that of before after a reload", () => {
    const places = new Places("");
    keepToken(places, "before");
    expect(takeToken(places)).toBe("before");
    expect(places.shown).toBe("/?x=1");
  });

  it("is removed from the address also if it is empty, and that of before stays", () => {
    const places = new Places("#token=");
    keepToken(places, "before");
    expect(takeToken(places)).toBe("before");
    expect(places.shown).toBe("/?x=1");
  });

  it("is forgotten at log-out", () => {
    const places = new Places("");
    keepToken(places, "before");
    keepToken(places, "");
    expect(takeToken(places)).toBe("");
  });

  it("holds for the page where the browser keeps nothing", () => {
    const places = new Places("#token=s3cret");
    places.blocked = true;
    expect(takeToken(places)).toBe("s3cret");
    places.location.hash = "";
    expect(takeToken(places)).toBe("");
  });

  it("of the device itself outlives the tab and the link's, until log-out", () => {
    const places = new Places("#token=of-a-link");
    takeToken(places);
    places.location.hash = "";
    keepToken(places, "own", "lasting");
    expect(places.kept.size).toBe(0);
    expect(takeToken(places)).toBe("own");
    keepToken(places, "typed");
    expect(takeToken(places)).toBe("typed");
    expect([...places.lasted.values()]).toEqual(["own"]);
    keepToken(places, "");
    expect(takeToken(places)).toBe("");
  });
});
