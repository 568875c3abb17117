/** A worker's script: verifies and reads a map off the page's thread, so that the picture does not stop for it. */

import { isMapJob, readMapFile } from "./map_file";

/** The part of a worker's global scope that is used; the page's own library of types has none. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<unknown>) => void) | null;
  postMessage: (message: unknown, transfer: { transfer: Transferable[] }) => void;
}

function serve(scope: WorkerScope): void {
  scope.onmessage = (event) => {
    if (isMapJob(event.data)) {
      void readMapFile(event.data).then(
        (result) => {
          scope.postMessage(result, { transfer: result.kind === "map" ? [result.positions.buffer] : [] });
        },
        (error: unknown) => {
          scope.postMessage({ kind: "bad", reason: String(error) }, { transfer: [] });
        },
      );
    }
  };
}

serve(globalThis);
