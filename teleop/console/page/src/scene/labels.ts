/** Small words and numbers in the picture, the same size wherever they are. */

import { CanvasTexture, LinearFilter, Sprite, SpriteMaterial, SRGBColorSpace } from "three";
import { css, type Rgb } from "./palette";

/** Pixels of the texture for one of the screen. */
const SHARPNESS = 2;

/** Words with the middle of their line, and their width [px]. */
export interface Words {
  readonly at: readonly [number, number];
  readonly width: number;
}

/** Return the words that lie over none before them, in lines of this height [px]. */
export function withoutOverlap<T extends Words>(words: readonly T[], height: number): readonly T[] {
  return words.reduce<readonly T[]>((kept, one) =>
    kept.some(({ at: [x, y], width }) => Math.abs(x - one.at[0]) < (width + one.width) / 2 && Math.abs(y - one.at[1]) < height)
      ? kept : [...kept, one], []);
}

/** A label that keeps its height in pixels. */
export class Label {
  readonly object: Sprite;
  readonly #height: number;
  readonly #aspect: number;

  /** `height` in pixels of the screen; `paper` colours the ground behind the words. */
  constructor(words: string, height: number, ink: Rgb, paper: Rgb) {
    const canvas = document.createElement("canvas");
    const tall = height * SHARPNESS;
    const font = `600 ${Math.round(tall * 0.62)}px system-ui, sans-serif`;
    const pen = canvas.getContext("2d");
    let wide = tall;
    if (pen !== null) {
      pen.font = font;
      wide = Math.max(Math.ceil(pen.measureText(words).width + 0.7 * tall), tall);
      canvas.width = wide;
      canvas.height = tall;
      pen.font = font;
      pen.fillStyle = css(paper);
      pen.beginPath();
      pen.roundRect(1, 1, wide - 2, tall - 2, tall / 2);
      pen.fill();
      pen.fillStyle = css(ink);
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText(words, wide / 2, tall * 0.53);
    }
    const texture = new CanvasTexture(canvas);
    texture.colorSpace = SRGBColorSpace;
    texture.minFilter = LinearFilter;
    texture.generateMipmaps = false;
    this.#height = height;
    this.#aspect = wide / tall;
    this.object = new Sprite(new SpriteMaterial({ map: texture, depthTest: false, transparent: true, sizeAttenuation: false }));
    this.object.renderOrder = 10;
  }

  /** Its width [px]. */
  get width(): number {
    return this.#height * this.#aspect;
  }

  /** Tell the label the height of the picture in pixels of the screen and the tangent of half its field of view. */
  setViewport(height: number, tangent: number): void {
    const scale = (2 * tangent * this.#height) / Math.max(height, 1);
    this.object.scale.set(scale * this.#aspect, scale, 1);
  }

  dispose(): void {
    this.object.material.map?.dispose();
    this.object.material.dispose();
  }
}
