/** The frame of a panel. */

import type { ComponentChildren } from "preact";
import { useId } from "preact/hooks";

/** A titled region of the page. `aside` stands beside the title. */
export function Panel(
  { title, name, aside, children }:
  { title: string; name: string; aside?: ComponentChildren; children: ComponentChildren },
) {
  const id = useId();
  return (
    <section class={`panel panel-${name}`} aria-labelledby={id}>
      <header class="panel-header">
        <h2 id={id}>{title}</h2>
        {aside}
      </header>
      {children}
    </section>
  );
}

/** One named value. */
export function Row({ name, children, grade }: { name: string; children: ComponentChildren; grade?: string }) {
  return (
    <div class="panel-row" data-grade={grade}>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}
