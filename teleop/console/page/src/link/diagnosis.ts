/** Why a WebSocket did not open: browsers keep it from the page, so HTTP is asked at the same address. */

import { linkTexts } from "../texts/link";

/** What the diagnosis needs of its surroundings. */
export interface Surroundings {
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  /** Origin of the page, such as `http://127.0.0.1:9090`. */
  readonly origin: string;
  readonly online: boolean;
}

/** A robot takes 32 connections; where its own page counts nearly as many, that is the reason. */
const NEARLY_FULL = 28;
const PATIENCE = 3000;

/** The address by which HTTP reaches what a WebSocket's address names. */
export function httpAddress(address: string): string {
  return address.replace(/^ws/, "http").replace(/\/+$/, "");
}

/** Return one sentence that says what is wrong and what to do. */
export async function diagnose(address: string, hung: boolean, surroundings: Surroundings): Promise<string> {
  const http = httpAddress(address);
  if (!surroundings.online && !/\/\/(localhost|127\.|\[::1\])/.test(http)) {
    return linkTexts.browserOffline;
  }
  const sameOrigin = new URL(http).origin === surroundings.origin;
  const ask = async (path: string): Promise<Response | undefined> => {
    try {
      const mode = sameOrigin ? "same-origin" : "no-cors";
      return await surroundings.fetch(http + path, { mode, cache: "no-store", signal: AbortSignal.timeout(PATIENCE) });
    } catch {
      return undefined;
    }
  };
  const version = await ask("/version");
  if (version === undefined) {
    if (http.startsWith("https:")) {
      return linkTexts.noTls(address, `${http}/version`);
    }
    return hung ? linkTexts.handshakeHangs(address) : linkTexts.nothingListens(address);
  }
  if (version.type === "opaque") {
    return linkTexts.notRosbridge(address);
  }
  const content = await json(version);
  if (content === LATE) {
    return linkTexts.handshakeHangs(address);
  }
  if (!isRobot(content)) {
    return version.status === 503 ? linkTexts.full(address) : linkTexts.notRosbridge(address);
  }
  const clients = await clientsOf(await ask("/healthz"));
  return clients >= NEARLY_FULL ? linkTexts.full(address) : linkTexts.refusesPage(address, surroundings.origin);
}

/** What a server that is too busy to send all of its answer in time says. */
const LATE = Symbol("late");

function isRobot(content: unknown): boolean {
  return typeof content === "object" && content !== null && "protocol" in content;
}

async function clientsOf(response: Response | undefined): Promise<number> {
  const content = response === undefined ? undefined : await json(response);
  if (typeof content === "object" && content !== null && "clients" in content) {
    return typeof content.clients === "number" ? content.clients : 0;
  }
  return 0;
}

async function json(response: Response): Promise<unknown> {
  try {
    return response.ok ? await response.json() : undefined;
  } catch (error) {
    return error instanceof DOMException && error.name === "TimeoutError" ? LATE : undefined;
  }
}
