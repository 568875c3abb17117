/** A modal dialog: the browser's own, so the page behind it is inert and Esc closes it. */

import type { ComponentChildren } from "preact";
import { useEffect, useId, useRef } from "preact/hooks";
import { panelTexts } from "../texts/panels";

/**
 * Show a dialog while `open`. The focus stays inside: the browser makes the page behind inert, and Tab goes round at the
 * ends instead of leaving for the browser's own controls. The focus returns to where it was.
 */
export function Dialog(
  { title, open, onClose, children }:
  { title: string; open: boolean; onClose: () => void; children: ComponentChildren },
) {
  const id = useId();
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    const element = dialog.current;
    if (open && element !== null && !element.open) {
      const before = document.activeElement;
      element.showModal();
      return () => {
        element.close();
        if (before instanceof HTMLElement) {
          before.focus();
        }
      };
    }
    return undefined;
  }, [open]);
  return (
    <dialog
      ref={dialog}
      class="panel-dialog"
      aria-labelledby={id}
      onKeyDown={(event) => { keepFocus(event, dialog.current); }}
      onCancel={(event) => { event.preventDefault(); onClose(); }}
      onClose={() => { if (open) { onClose(); } }}
      onClick={(event) => { if (event.target === dialog.current) { onClose(); } }}
    >
      <div class="panel-dialog-body">
        <div class="panel-header">
          <h2 id={id}>{title}</h2>
          <button type="button" class="panel-close" aria-label={panelTexts.close} onClick={onClose}>✕</button>
        </div>
        {open && children}
      </div>
    </dialog>
  );
}

const FOCUSABLE = "a[href], button:not([disabled]), input:not([disabled]), select:not([disabled]), textarea, [tabindex='0']";

function keepFocus(event: KeyboardEvent, dialog: HTMLDialogElement | null): void {
  if (event.key !== "Tab" || dialog === null) {
    return;
  }
  const elements = [...dialog.querySelectorAll<HTMLElement>(FOCUSABLE)];
  const [first, last] = [elements[0], elements.at(-1)];
  const leaving = event.shiftKey ? first : last;
  if (leaving !== undefined && document.activeElement === leaving) {
    event.preventDefault();
    (event.shiftKey ? last : first)?.focus();
  }
}

/** Ask the topmost open dialog to close, for Esc; false if there is none. */
export function closeTopDialog(): boolean {
  const open = [...document.querySelectorAll<HTMLDialogElement>("dialog[open]")].at(-1);
  open?.dispatchEvent(new Event("cancel", { cancelable: true }));
  return open !== undefined;
}
