/** More words about something, by pointer, touch or keyboard. */

import type { ComponentChildren } from "preact";
import { useId } from "preact/hooks";
import { useSignal } from "@preact/signals";

/** A button with a question mark that shows its content while it has the pointer or the focus, or was pressed. */
export function Tooltip({ label, children }: { label: string; children: ComponentChildren }) {
  const id = useId();
  const hovered = useSignal(false);
  const pinned = useSignal(false);
  const shown = hovered.value || pinned.value;
  return (
    <span
      class="panel-tooltip"
      onPointerEnter={() => { hovered.value = true; }}
      onPointerLeave={() => { hovered.value = false; }}
    >
      <button
        type="button"
        class="panel-help"
        aria-label={label}
        aria-expanded={shown}
        aria-controls={id}
        onClick={() => { pinned.value = !pinned.value; }}
        onFocus={() => { hovered.value = true; }}
        onBlur={() => { hovered.value = false; pinned.value = false; }}
        // Escape stops the robot too: these words may be open while it is driven.
        onKeyDown={(event) => {
          if (event.key === "Escape" && shown) {
            hovered.value = false;
            pinned.value = false;
          }
        }}
      >?</button>
      <span id={id} role="note" class="panel-tooltip-text" hidden={!shown}>{children}</span>
    </span>
  );
}
