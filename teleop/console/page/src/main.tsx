/** Puts the page together. */

import { render } from "preact";
import { App } from "./page/app";
import { watchKeys } from "./page/page_keys";
import { startParts } from "./page/page_parts";
import { publishFigures } from "./page/figures";
import { fetchConfig, robotAddress } from "./session/robot_address";
import { pageTexts } from "./texts/page";

async function start(): Promise<void> {
  document.title = pageTexts.title;
  const root = document.getElementById("console");
  if (root === null) {
    return;
  }
  const config = await fetchConfig();
  const canvas = document.createElement("canvas");
  const parts = startParts(robotAddress(config, location), config.version, canvas);
  window.addEventListener("unhandledrejection", (event) => {
    parts.events.add("warning", pageTexts.rejected(String(event.reason)));
  });
  watchKeys(parts);
  publishFigures(parts);
  render(<App parts={parts} canvas={canvas} />, root);
}

void start();
