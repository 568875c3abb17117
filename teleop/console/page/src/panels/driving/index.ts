/** The components of driving. */

export type { DrivingProps } from "./driving_props";
export { DrivingPanel } from "./status_panel";
export { EstopButton } from "./estop_button";
export { GearSwitch } from "./gear_switch";
export { MappingPage, type MappingPageProps } from "./mapping_page";
export { SpeedFigure } from "./speed_figure";
export { StickPad } from "./stick_pad";
export { TurnTaking } from "./turn_taking";
