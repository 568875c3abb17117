/** A worker's script: verifies and reads a map off the page's thread, so that the picture does not stop for it. */

import { isMapJob, readMapFile, type MapResult } from "./map_file";

/** The part of a worker's global scope that is used; the page's own library of types has none. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<unknown>) => void) | null;
  postMessage: (message: unknown, transfer: { transfer: Transferable[] }) => void;
}

/** What is handed over rather than copied. */
function buffers(result: MapResult): Transferable[] {
  if (result.kind !== "map") {
    return [];
  }
  return [result.positions.buffer, ...(result.normals === undefined ? [] : [result.normals.buffer])];
}

function serve(scope: WorkerScope): void {
  scope.onmessage = (event) => {
    if (isMapJob(event.data)) {
      void readMapFile(event.data).then(
        (result) => {
          scope.postMessage(result, { transfer: buffers(result) });
        },
        (error: unknown) => {
          scope.postMessage({ kind: "bad", reason: String(error) }, { transfer: [] });
        },
      );
    }
  };
}

serve(globalThis);
