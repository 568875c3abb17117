/** Mounts a component for a test. */

import { render, type ComponentChild } from "preact";
import { act } from "preact/test-utils";

export interface Mounted {
  readonly root: HTMLElement;
  /** Do something and wait until it is shown. */
  readonly act: (what: () => void) => Promise<void>;
  readonly text: () => string;
  readonly button: (words: string) => HTMLButtonElement;
  readonly unmount: () => void;
}

export async function mount(component: ComponentChild): Promise<Mounted> {
  const root = document.body.appendChild(document.createElement("div"));
  await act(() => { render(component, root); });
  return {
    root,
    act: async (what) => { await act(what); },
    text: () => root.textContent,
    button: (words) => {
      const found = [...root.querySelectorAll("button")].find((button) =>
        button.textContent.includes(words) || button.getAttribute("aria-label") === words);
      if (found === undefined) {
        throw new Error(`no button "${words}" in: ${root.textContent}`);
      }
      return found;
    },
    unmount: () => {
      render(null, root);
      root.remove();
    },
  };
}
