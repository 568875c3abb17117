/** What shows the page as a wall of screens. */

export { showWall, type WallFigures } from "./wall";
export { wallOf } from "./wall_setting";
