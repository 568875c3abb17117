/** The components of driving. */

export { DrivingPanel, type DrivingProps } from "./status_panel";
export { EstopButton } from "./estop_button";
export { GearSwitch } from "./gear_switch";
export { MappingPage, type MappingPageProps } from "./mapping_page";
export { StickPad } from "./stick_pad";
export { TurnTaking } from "./turn_taking";
