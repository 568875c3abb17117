/** The streams that a robot announces, and which of them this page can show. */

/** A stream by its name. */
export interface CameraStream {
  readonly name: string;
  /** Its address on the robot's own port, which the page may read; undefined if it may not. */
  readonly path: string | undefined;
  /** Where it is, as the robot announces it. */
  readonly address: string;
}

const LOOPBACK = /^(localhost|127(\.\d+){3}|\[::1\])$/;

/**
 * Sort out what is announced on `/cam_sources`.
 *
 * The page's policy, and the robot's, let a page read nothing but the server that it comes from. A robot serves its streams
 * on its own port as on any further one, and announces one address of the several that it may have; so an address counts as
 * the robot's own if its host or its port is the page's.
 *
 * @param sources Addresses by name.
 * @param page Address of the page.
 * @param robot Address of the robot over HTTP.
 */
export function cameraStreams(sources: ReadonlyMap<string, string>, page: string, robot: string): CameraStream[] {
  const [here, there] = [parsed(page), parsed(robot)];
  return [...sources].map(([name, address]) => {
    const url = parsed(address);
    const own = url !== undefined && here !== undefined && here.origin === there?.origin && url.pathname === "/stream"
      && (sameHost(url, here) || url.port === here.port);
    return { name, path: own ? url.pathname + url.search : undefined, address };
  });
}

function parsed(address: string): URL | undefined {
  try {
    const url = new URL(address);
    return url.protocol === "http:" || url.protocol === "https:" ? url : undefined;
  } catch {
    return undefined;
  }
}

function sameHost(a: URL, b: URL): boolean {
  return a.hostname === b.hostname || (LOOPBACK.test(a.hostname) && LOOPBACK.test(b.hostname));
}
