/** The canvas: renderer, size, lost and restored context, and frames drawn only when something has changed. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { PerspectiveCamera, Scene as ThreeScene, WebGLRenderer } from "three";
import { sceneTexts } from "../texts/scene";
import { Detail } from "./detail";
import { FrameTimes } from "./frame_times";
import { drawsInSoftware } from "./software_drawing";

/** More pixels than this for each one of the page cost time and show nothing. */
const MOST_RATIO = 2;

/**
 * What is done for each frame, so many ms after the last one; true if there is motion left, so that another frame is
 * wanted. `followsAtOnce` says that the last one wanted this one.
 */
export type Update = (interval: number, followsAtOnce: boolean) => boolean;

/** A camera, and the part of the canvas's width that its picture takes, from 0 to 1. */
export interface ViewShare {
  readonly camera: PerspectiveCamera;
  readonly left: number;
  readonly width: number;
}

export class Stage {
  readonly scene = new ThreeScene();
  readonly camera = new PerspectiveCamera();
  readonly frameTimes = new FrameTimes();
  readonly detail = new Detail();
  readonly #trouble = signal("");
  readonly #canvas: HTMLCanvasElement;
  #update: Update;
  #views: readonly ViewShare[] | undefined;
  readonly #renderer: WebGLRenderer | undefined;
  readonly #observer: ResizeObserver | undefined;
  readonly #ended = new AbortController();
  #request: number | undefined;
  #last = 0;
  #moving = false;
  #immersed = false;
  #sharpness = 1;
  #whole = false;
  #size = { width: 300, height: 150, ratio: 1 };

  constructor(canvas: HTMLCanvasElement, update: Update) {
    this.#canvas = canvas;
    this.#update = update;
    this.#renderer = this.#makeRenderer();
    const { signal: ended } = this.#ended;
    canvas.addEventListener("webglcontextlost", () => { this.#trouble.value = sceneTexts.contextLost; }, { signal: ended });
    canvas.addEventListener("webglcontextrestored", () => {
      this.#trouble.value = "";
      this.invalidate();
    }, { signal: ended });
    if (typeof ResizeObserver === "function") {
      this.#observer = new ResizeObserver(() => { this.resize(); });
      this.#observer.observe(canvas);
    }
    this.resize();
  }

  /** One sentence on what is wrong with the picture; empty while all is well. */
  get trouble(): ReadonlySignal<string> {
    return this.#trouble;
  }

  /** Size of the picture in pixels of the page, and pixels that are drawn for each of these. */
  get size(): { readonly width: number; readonly height: number; readonly ratio: number } {
    return this.#size;
  }

  /** Have a frame drawn soon; whole with all pixels, however slow that is. */
  invalidate(whole = false): void {
    this.#whole ||= whole;
    if (this.#request === undefined && !this.#immersed && !this.#ended.signal.aborted) {
      this.#request = requestAnimationFrame((now) => { this.#frame(now); });
    }
  }

  /** Take the canvas's size; a picture of the new size is drawn at once, for a resized canvas is empty. */
  resize(): void {
    if (this.#fit()) {
      this.invalidate();
    }
  }

  /** Draw this share of the screen's pixels along each side, from this frame on. */
  setSharpness(sharpness: number): void {
    this.#sharpness = this.#whole ? 1 : sharpness;
    this.#whole = false;
    this.#fit();
  }

  /** Give the picture the canvas's size; true if that is another one. */
  #fit(): boolean {
    const { clientWidth, clientHeight } = this.#canvas;
    const ratio = Math.min(window.devicePixelRatio || 1, MOST_RATIO) * this.#sharpness;
    const size = { width: Math.max(clientWidth, 1), height: Math.max(clientHeight, 1), ratio };
    const { width, height } = this.#size;
    // An immersed canvas is the headset's.
    if (this.#immersed || (size.width === width && size.height === height && ratio === this.#size.ratio)) {
      return false;
    }
    this.#size = size;
    this.#renderer?.setDrawingBufferSize(size.width, size.height, ratio);
    return true;
  }

  /**
   * Draw a headset's frames in place of the page's, until its session ends.
   *
   * @param frame Is called for each of them, so many ms after the last one.
   * @param ended Is called once the page draws again.
   * @throws Error If there is no WebGL, or the session ends before it has begun.
   */
  async immerse(session: XRSession, frame: (interval: number, xr: XRFrame) => void, ended: () => void): Promise<void> {
    const renderer = this.#renderer;
    if (renderer === undefined || this.#immersed) {
      throw new Error(this.#trouble.peek());
    }
    const left = new AbortController();
    const leave = (): void => {
      if (left.signal.aborted) {
        return;
      }
      left.abort();
      renderer.xr.removeEventListener("sessionend", leave);
      renderer.setAnimationLoop(null);
      this.#immersed = renderer.xr.enabled = false;
      ended();
      this.resize();
      this.invalidate();
    };
    this.#immersed = renderer.xr.enabled = true;
    this.frameTimes.clear();
    renderer.xr.addEventListener("sessionend", leave);
    renderer.setAnimationLoop((now, xr) => {
      if (renderer.xr.isPresenting) {
        const before = performance.now();
        frame(Math.max(now - this.#last, 0), xr);
        this.#last = now;
        renderer.render(this.scene, this.camera);
        this.frameTimes.add(performance.now() - before);
      }
    });
    try {
      await renderer.xr.setSession(session);
    } catch (error) {
      await session.end().catch(() => undefined); // it may have ended by itself
      leave();
      throw error;
    }
  }

  /** Draw these cameras' pictures side by side in place of the page's own. */
  divide(views: readonly ViewShare[], update: Update): void {
    [this.#views, this.#update] = [views, update];
    this.invalidate();
  }

  /** Where a headset's poses are given, while one is worn. */
  get roomSpace(): XRReferenceSpace | null {
    return this.#renderer?.xr.getReferenceSpace() ?? null;
  }

  dispose(): void {
    this.#ended.abort();
    this.#observer?.disconnect();
    if (this.#request !== undefined) {
      cancelAnimationFrame(this.#request);
    }
    this.#renderer?.dispose();
  }

  #makeRenderer(): WebGLRenderer | undefined {
    // Tried first, because three reports a missing WebGL to the console as an error of its own.
    // Several samples for each pixel cost a processor 40 % of its frames; they are better spent on pixels.
    const antialias = window.devicePixelRatio < 2 && !drawsInSoftware();
    const context = this.#canvas.getContext("webgl2", { antialias, powerPreference: "high-performance" });
    try {
      if (context !== null) {
        return new WebGLRenderer({ canvas: this.#canvas, context, antialias });
      }
    } catch {
      // The same as no context.
    }
    this.#trouble.value = sceneTexts.noWebGl;
    return undefined;
  }

  #render(renderer: WebGLRenderer): void {
    const { width, height, ratio } = this.#size;
    if (this.#views === undefined) {
      renderer.render(this.scene, this.camera);
      return;
    }
    renderer.setScissorTest(true);
    for (const { camera, left, width: share } of this.#views) {
      // Whole pixels of the screen, so that no column belongs to two pictures or to none.
      const [from, to] = [left, left + share].map((edge) => Math.round(edge * width * ratio) / ratio) as [number, number];
      renderer.setViewport(from, 0, to - from, height);
      renderer.setScissor(from, 0, to - from, height);
      renderer.render(this.scene, camera);
    }
  }

  #frame(now: number): void {
    this.#request = undefined;
    const before = performance.now();
    const interval = Math.max(now - this.#last, 0);
    if (this.#moving) {
      this.detail.frame(interval);
    }
    this.#moving = this.#update(interval, this.#moving);
    this.#last = now;
    if (this.#renderer !== undefined && !this.#renderer.getContext().isContextLost()) {
      this.#render(this.#renderer);
    }
    this.frameTimes.add(performance.now() - before);
    if (this.#moving) {
      this.invalidate();
    }
  }
}
