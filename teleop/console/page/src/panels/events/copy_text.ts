/** Text to the clipboard. */

/** Copy a text; false if the page cannot reach the clipboard, as on http pages of other hosts. */
export async function copyText(text: string): Promise<boolean> {
  if (!("clipboard" in navigator)) {
    return false;
  }
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
