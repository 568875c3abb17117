/** The guided first drive over the picture: what there is to do, what is done, and how to do the next thing. */

import { useSignal } from "@preact/signals";
import type { FirstDrive } from "../../guide/first_drive";
import { guideTexts as texts, type Hands } from "../../texts/guide";

/** @param pads How many gamepads there are. */
export function GuidePanel({ guide, pads }: { readonly guide: FirstDrive; readonly pads: number }) {
  const refused = useSignal("");
  if (!guide.shown.value) {
    return null;
  }
  const [tasks, next] = [guide.tasks.value, guide.next.value];
  const carry = (): void => {
    void guide.carry().then((why) => { refused.value = why; });
  };
  return (
    <section class="panel guide" aria-label={texts.title}>
      <header class="panel-header">
        <h2>{texts.title}</h2>
        <button type="button" onClick={() => { guide.close(); }}>{texts.skip}</button>
      </header>
      <ol>
        {tasks.map((task) => (
          <li key={task} aria-current={task === next ? "step" : undefined} data-done={guide.isDone(task)}>
            {texts.name(task)}{guide.isDone(task) && <span class="guide-tick" role="img" aria-label={texts.ticked}> ✓</span>}
          </li>
        ))}
      </ol>
      <p role="status">{next === undefined ? texts.done : texts.words(next, hands(pads))}</p>
      {next === "carried" && <button type="button" onClick={carry}>{texts.carry}</button>}
      {next === "carried" && refused.value !== "" && <p role="alert">{refused.value}</p>}
      {next === undefined && !tasks.includes("carried") && <p>{texts.left}</p>}
    </section>
  );
}

function hands(pads: number): Hands {
  return pads > 0 ? "pad" : window.matchMedia("(pointer: coarse) and (hover: none)").matches ? "thumb" : "keys";
}
