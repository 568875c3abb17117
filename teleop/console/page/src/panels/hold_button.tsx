/** A button that does something as long as it is held, by pointer or by Enter; the space bar stops, as everywhere. */

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";

interface HoldProps {
  readonly name?: string | undefined;
  readonly kind?: string;
  readonly disabled?: boolean;
  readonly begin: () => void;
  readonly end: () => void;
  readonly children: ComponentChildren;
}

export function HoldButton({ name, kind = "", disabled = false, begin, end, children }: HoldProps) {
  const held = useRef(false);
  const letGo = useRef(end);
  letGo.current = end;
  const hold = (): void => {
    if (!held.current && !disabled) {
      held.current = true;
      begin();
    }
  };
  const release = (): void => {
    if (held.current) {
      held.current = false;
      letGo.current();
    }
  };
  useEffect(() => {
    if (disabled) {
      release();
    }
  }, [disabled]);
  useEffect(() => release, []);
  return (
    <button
      type="button" class={`panel-hold ${kind}`} aria-label={name} title={name} disabled={disabled}
      onPointerDown={(event) => {
        if (event.button === 0) {
          event.currentTarget.setPointerCapture(event.pointerId);
          hold();
        }
      }}
      onPointerUp={release} onPointerCancel={release} onLostPointerCapture={release}
      onKeyDown={(event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) {
          release(); // macOS reports no key-up while Cmd is held
        } else if (event.key === "Enter") {
          event.preventDefault();
          if (!event.repeat) {
            hold();
          }
        }
      }}
      onKeyUp={(event) => {
        if (event.key === "Enter") {
          release();
        }
      }}
      onBlur={release}
      onContextMenu={(event) => { event.preventDefault(); }}
    >
      {children}
    </button>
  );
}
