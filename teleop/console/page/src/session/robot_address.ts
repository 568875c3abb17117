/** Where the robot is: at the page's own address, or where the server of this page says. */

/** What the server of the page says about it: `/console/config.json`. */
export interface PageConfig {
  /** Address of the robot; empty if it is at the page's own. */
  readonly robot: string;
  readonly version: string;
}

const UNKNOWN: PageConfig = { robot: "", version: "" };

/** Fetch what the server says; without an answer the robot is taken to be at the page's own address. */
export async function fetchConfig(): Promise<PageConfig> {
  try {
    const answer = await fetch("/console/config.json", { cache: "no-store" });
    return configFrom(await answer.json());
  } catch {
    return UNKNOWN;
  }
}

/** Return the parts of the configuration that are what they should be. */
export function configFrom(value: unknown): PageConfig {
  if (typeof value !== "object" || value === null) {
    return UNKNOWN;
  }
  const { robot, version } = value as Record<string, unknown>;
  return {
    robot: typeof robot === "string" && /^wss?:\/\//.test(robot) ? robot : "",
    version: typeof version === "string" ? version : "",
  };
}

/** Return the address of the robot's WebSocket. */
export function robotAddress(config: PageConfig, page: Pick<Location, "protocol" | "host">): string {
  return config.robot !== "" ? config.robot : `${page.protocol === "https:" ? "wss" : "ws"}://${page.host}`;
}
