/** The picture's size and scale, as the layers need it each frame. */

export interface Viewport {
  /** Size of the drawing buffer [px]. */
  readonly width: number;
  readonly height: number;
  /** Pixels of the drawing buffer for one of the page. */
  readonly ratio: number;
  /** Tangent of half the vertical field of view. */
  readonly tangent: number;
  /** Pixels of the drawing buffer that a metre covers at a distance of 1 m. */
  readonly pixelsPerMetre: number;
  /** Size of a pixel of the page at the target [m]. */
  readonly metresPerPixel: number;
}

/** Heights that alarms and controls cover [CSS pixels], and the largest share of the picture that is left to them. */
const COVERED = { top: 70, bottom: 150, most: 0.45 };

/** Return the shares of a picture of this height [CSS pixels] that are covered. */
export function covered(height: number): { readonly top: number; readonly bottom: number } {
  const share = Math.min(1 / Math.max(height, 1), COVERED.most / (COVERED.top + COVERED.bottom));
  return { top: COVERED.top * share, bottom: COVERED.bottom * share };
}
