/** A part of the page that a person opens when it is needed. */

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Guarded } from "./guarded";

/** @param open Whether it is open at first, and opens by itself when this becomes true. */
export function Fold(
  { title, open = false, children }:
  { readonly title: string; readonly open?: boolean; readonly children: ComponentChildren },
) {
  const element = useRef<HTMLDetailsElement>(null);
  useEffect(() => {
    if (open && element.current !== null) {
      element.current.open = true;
    }
  }, [open]);
  return (
    <details class="page-fold" ref={element}>
      <summary>{title}</summary>
      <Guarded name={title}>{children}</Guarded>
    </details>
  );
}
