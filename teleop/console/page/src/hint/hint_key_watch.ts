/** Takes keys from the window while a hint is being placed. */

/**
 * Give presses of keys to `handle` while `active()`. They count before those that drive, since arrows mean both; releases
 * are left alone, so that whoever drives never misses one.
 *
 * @param view The window; null if the page has none, as in a frame that is gone.
 * @param handle Does what the key means; false if it means nothing here.
 * @returns A function that ends it.
 */
export function watchKeys(
  view: Window | null,
  active: () => boolean,
  handle: (key: string, shift: boolean) => boolean,
): () => void {
  const stop = new AbortController();
  view?.addEventListener("keydown", (event) => {
    const modified = event.ctrlKey || event.altKey || event.metaKey;
    if (!active() || modified || event.isComposing || takesKeys(event.target, event.key)) {
      return;
    }
    if (handle(event.key, event.shiftKey)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    }
  }, { capture: true, signal: stop.signal });
  return () => { stop.abort(); };
}

/** Return whether a key belongs to the element that has the focus: a field, an open dialog, a button's Enter. */
function takesKeys(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof Element)) {
    return false;
  }
  const field = target.closest("input, select, textarea, [contenteditable], dialog[open]") !== null;
  return field || (key === "Enter" && target.closest("button, a, summary") !== null);
}
