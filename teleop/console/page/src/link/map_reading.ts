/** Has a map read by the worker, or by the page itself where no worker can be had. */

import { isMapResult, type MapJob, type MapResult, readMapFile } from "./map_file";

/** Where the built page keeps the worker's script. */
const WORKER = "/console/map_worker.js";

/** Read a map; the worker lives only for one. */
export async function readMap(job: MapJob): Promise<MapResult> {
  let worker: Worker;
  try {
    worker = new Worker(WORKER, { type: "module" });
  } catch {
    return readMapFile(job);
  }
  try {
    // The file is not handed over: should the worker not start, the page reads it.
    return await answer(worker, job);
  } catch {
    return await readMapFile(job);
  } finally {
    worker.terminate();
  }
}

function answer(worker: Worker, job: MapJob): Promise<MapResult> {
  return new Promise((resolve, reject) => {
    worker.onmessage = (event: MessageEvent<unknown>) => {
      if (isMapResult(event.data)) {
        resolve(event.data);
      }
    };
    worker.onerror = () => {
      reject(new Error("the worker does not run"));
    };
    worker.postMessage(job);
  });
}
