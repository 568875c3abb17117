/** What shows a recorded run: loaded when somebody opens one. */

export { Player } from "../../replay/player";
export { readRun } from "../../replay/run_reader";
export { qualityPath } from "../../replay/quality_path";
export { qualityOf } from "../../replay/quality";
export { ReplayBar } from "./replay_bar";
