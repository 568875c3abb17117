/** Marks parts of buffers as changed, so that only these are sent to the graphics card. */

interface Changing {
  readonly updateRanges: readonly { readonly start: number; readonly count: number }[];
  addUpdateRange(start: number, count: number): void;
  clearUpdateRanges(): void;
  set needsUpdate(changed: boolean);
}

/** While nothing is drawn, as in a hidden tab, ranges pile up: this many become one. */
const MOST_RANGES = 16;

/** Mark `count` values from `start` on as changed. */
export function markChanged(buffer: Changing, start: number, count: number): void {
  const ranges = [...buffer.updateRanges, { start, count }];
  if (ranges.length > MOST_RANGES) {
    const first = Math.min(...ranges.map((range) => range.start));
    const end = Math.max(...ranges.map((range) => range.start + range.count));
    buffer.clearUpdateRanges();
    buffer.addUpdateRange(first, end - first);
  } else {
    buffer.addUpdateRange(start, count);
  }
  buffer.needsUpdate = true;
}
