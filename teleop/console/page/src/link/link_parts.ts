/** What the link takes from the browser, in one place, so that tests can give their own. */

import { diagnose } from "./diagnosis";
import type { DownloadParts } from "./map_download";
import type { MapJob, MapResult } from "./map_file";
import { readMap } from "./map_reading";
import type { ConnectionParts } from "./rosbridge_connection";

export interface LinkParts extends ConnectionParts, DownloadParts {
  readonly readMap: (job: MapJob) => Promise<MapResult>;
  /** Time of a steady clock since 1970 [ms]. */
  readonly epoch: () => number;
  /** Calls back with the next frame that is drawn. */
  readonly nextFrame: (call: () => void) => void;
  /** Where the browser says that the network or the person is back. */
  readonly awake: EventTarget;
}

/** The browser's own. */
export function browserParts(address: string): LinkParts {
  const fetchHere = (url: string, init: RequestInit): Promise<Response> => fetch(url, init);
  return {
    openSocket: (url) => new WebSocket(url),
    diagnose: (hung) =>
      diagnose(address, hung, { fetch: fetchHere, origin: location.origin, online: navigator.onLine }),
    now: () => performance.now(),
    epoch: () => performance.timeOrigin + performance.now(),
    fetch: fetchHere,
    caches: cacheStorage(),
    readMap,
    nextFrame: (call) => {
      requestAnimationFrame(call);
    },
    awake: globalThis,
  };
}

/** Browsers offer it in secure contexts only, whatever its type says. */
function cacheStorage(): CacheStorage | undefined {
  const { caches }: { readonly caches?: CacheStorage } = globalThis;
  return caches;
}
