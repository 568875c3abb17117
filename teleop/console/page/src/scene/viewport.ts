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
