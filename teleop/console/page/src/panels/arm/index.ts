/** What the page loads for a robot with an arm. */

export { Arm } from "../../arm/arm";
export { ArmPanel } from "./arm_panel";
