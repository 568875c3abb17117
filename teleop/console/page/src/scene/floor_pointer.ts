/** Presses and drags on the floor in the picture, while something is being placed there. */

/** A point of the floor in `map` [m]. */
export interface FloorPoint {
  readonly x: number;
  readonly y: number;
}

export type FloorEvent =
  | { readonly type: "press" | "drag"; readonly point: FloorPoint }
  | { readonly type: "release" };

/** A pointer that moved less than this does not drag yet [CSS pixels]: a finger is never still. */
export const SHORTEST_MOVE = 10;

/**
 * Turn one pointer's way over the picture into events; further fingers are ignored. Active only while `active()` says so.
 *
 * @param surface What is pressed.
 * @param floorPoint Point of the floor under a place of the window, undefined where there is none.
 * @returns A function that ends it.
 */
export function watchPointer(
  surface: HTMLElement,
  floorPoint: (clientX: number, clientY: number) => FloorPoint | undefined,
  active: () => boolean,
  dispatch: (event: FloorEvent) => void,
): () => void {
  const stop = new AbortController();
  let down: { id: number; x: number; y: number; dragging: boolean } | undefined;

  const listen = (type: "pointerdown" | "pointermove" | "pointerup" | "pointercancel" | "lostpointercapture",
    handle: (event: PointerEvent) => void): void => {
    surface.addEventListener(type, (event) => { handle(event); }, { signal: stop.signal });
  };
  const up = (event: PointerEvent): void => {
    if (event.pointerId === down?.id) {
      down = undefined;
      dispatch({ type: "release" });
    }
  };
  listen("pointerdown", (event) => {
    if (!active() || down !== undefined || event.button !== 0) {
      return;
    }
    const point = floorPoint(event.clientX, event.clientY);
    if (point === undefined) {
      return;
    }
    event.preventDefault();
    down = { id: event.pointerId, x: event.clientX, y: event.clientY, dragging: false };
    surface.setPointerCapture(event.pointerId);
    surface.focus({ preventScroll: true });
    dispatch({ type: "press", point });
  });
  listen("pointermove", (event) => {
    if (event.pointerId !== down?.id || !active()) {
      return;
    }
    down.dragging ||= Math.hypot(event.clientX - down.x, event.clientY - down.y) >= SHORTEST_MOVE;
    const point = down.dragging ? floorPoint(event.clientX, event.clientY) : undefined;
    if (point !== undefined) {
      dispatch({ type: "drag", point });
    }
  });
  listen("pointerup", up);
  listen("pointercancel", up);
  listen("lostpointercapture", up);
  return () => { stop.abort(); };
}
