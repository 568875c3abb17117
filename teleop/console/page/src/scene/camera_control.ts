/**
 * Turns pointer, wheel and keys into wishes about the view.
 *
 * One pointer turns the view, from above it moves it; with Shift or the right button it always moves it. Two
 * pointers move and zoom. Two taps go back to the robot. Keys work while the canvas has the focus; the arrows and
 * W A S D are left to driving.
 */

export interface CameraWishes {
  /** Whether one pointer moves the view rather than turning it. */
  dragMoves(): boolean;
  /** Turn by pixels right and down. */
  turn(right: number, down: number): void;
  /** Move by pixels right and down. */
  pan(right: number, down: number): void;
  /** Zoom by a factor (above 1: farther) at a place of the page. */
  zoom(factor: number, clientX: number, clientY: number): void;
  recentre(): void;
}

interface Finger {
  readonly x: number;
  readonly y: number;
  readonly moves: boolean;
  readonly downX: number;
  readonly downY: number;
  readonly downAt: number;
}

/** A tap is shorter [ms] and goes less far [px] than a drag. */
const TAP = { time: 300, distance: 10 };
const DOUBLE_TAP = { time: 400, distance: 40 };
const KEY_STEP = { pan: 60, turn: 60, zoom: 1.2 };

const KEYS: Readonly<Record<string, (wishes: CameraWishes) => void>> = {
  "+": (wishes) => { wishes.zoom(1 / KEY_STEP.zoom, NaN, NaN); },
  "=": (wishes) => { wishes.zoom(1 / KEY_STEP.zoom, NaN, NaN); },
  "-": (wishes) => { wishes.zoom(KEY_STEP.zoom, NaN, NaN); },
  i: (wishes) => { wishes.pan(0, KEY_STEP.pan); },
  k: (wishes) => { wishes.pan(0, -KEY_STEP.pan); },
  j: (wishes) => { wishes.pan(KEY_STEP.pan, 0); },
  l: (wishes) => { wishes.pan(-KEY_STEP.pan, 0); },
  u: (wishes) => { wishes.turn(-KEY_STEP.turn, 0); },
  o: (wishes) => { wishes.turn(KEY_STEP.turn, 0); },
  PageUp: (wishes) => { wishes.turn(0, -KEY_STEP.turn / 2); },
  PageDown: (wishes) => { wishes.turn(0, KEY_STEP.turn / 2); },
  Home: (wishes) => { wishes.recentre(); },
};

export class CameraControl {
  /** False leaves pointers to somebody else; wheel and keys go on working. */
  enabled = true;
  readonly #canvas: HTMLCanvasElement;
  readonly #wishes: CameraWishes;
  readonly #fingers = new Map<number, Finger>();
  readonly #ended = new AbortController();
  #tap = { x: 0, y: 0, at: -Infinity };

  constructor(canvas: HTMLCanvasElement, wishes: CameraWishes) {
    this.#canvas = canvas;
    this.#wishes = wishes;
    const { signal } = this.#ended;
    canvas.addEventListener("pointerdown", (event) => { this.#down(event); }, { signal });
    canvas.addEventListener("pointermove", (event) => { this.#move(event); }, { signal });
    canvas.addEventListener("pointerup", (event) => { this.#up(event); }, { signal });
    for (const lost of ["pointercancel", "lostpointercapture"] as const) {
      canvas.addEventListener(lost, (event) => { this.#fingers.delete(event.pointerId); }, { signal });
    }
    canvas.addEventListener("wheel", (event) => { this.#wheel(event); }, { signal, passive: false });
    canvas.addEventListener("keydown", (event) => { this.#key(event); }, { signal });
    canvas.addEventListener("contextmenu", (event) => { event.preventDefault(); }, { signal });
  }

  dispose(): void {
    this.#ended.abort();
  }

  #down(event: PointerEvent): void {
    if (!this.enabled) {
      return;
    }
    try {
      this.#canvas.setPointerCapture(event.pointerId);
    } catch {
      // The pointer is gone already; its moves just do not come.
    }
    const { clientX: x, clientY: y } = event;
    const moves = event.button === 1 || event.button === 2 || event.shiftKey;
    this.#fingers.set(event.pointerId, { x, y, moves, downX: x, downY: y, downAt: event.timeStamp });
  }

  #move(event: PointerEvent): void {
    const before = this.#fingers.get(event.pointerId);
    if (before === undefined || !this.enabled) {
      return;
    }
    const after = { ...before, x: event.clientX, y: event.clientY };
    this.#fingers.set(event.pointerId, after);
    const other = [...this.#fingers].find(([id]) => id !== event.pointerId)?.[1];
    const [right, down] = [after.x - before.x, after.y - before.y];
    if (other !== undefined) {
      const apart = (finger: Finger): number => Math.max(Math.hypot(finger.x - other.x, finger.y - other.y), 20);
      this.#wishes.zoom(apart(before) / apart(after), (after.x + other.x) / 2, (after.y + other.y) / 2);
      this.#wishes.pan(right / 2, down / 2);
    } else if (before.moves || this.#wishes.dragMoves()) {
      // A tap that trembles is not a drag.
      if (Math.hypot(after.x - before.downX, after.y - before.downY) > 3) {
        this.#wishes.pan(right, down);
      }
    } else {
      this.#wishes.turn(right, down);
    }
  }

  #up(event: PointerEvent): void {
    const finger = this.#fingers.get(event.pointerId);
    this.#fingers.delete(event.pointerId);
    if (finger === undefined || !this.enabled) {
      return;
    }
    const { clientX: x, clientY: y, timeStamp: at } = event;
    const moved = Math.hypot(x - finger.downX, y - finger.downY);
    if (moved > TAP.distance || at - finger.downAt > TAP.time) {
      return;
    }
    const again = at - this.#tap.at < DOUBLE_TAP.time && Math.hypot(x - this.#tap.x, y - this.#tap.y) < DOUBLE_TAP.distance;
    this.#tap = { x, y, at: again ? -Infinity : at };
    if (again) {
      this.#wishes.recentre();
    }
  }

  #wheel(event: WheelEvent): void {
    event.preventDefault();
    // Lines and pages are units of old wheels; a notch of a new one is about 100 pixels.
    const pixels = event.deltaY * ([1, 30, 300][event.deltaMode] ?? 1);
    const factor = Math.exp(Math.min(Math.max(pixels, -300), 300) * 0.0015);
    this.#wishes.zoom(factor, event.clientX, event.clientY);
  }

  #key(event: KeyboardEvent): void {
    const wish = event.ctrlKey || event.metaKey || event.altKey ? undefined : KEYS[event.key];
    if (wish !== undefined) {
      event.preventDefault();
      wish(this.#wishes);
    }
  }
}
