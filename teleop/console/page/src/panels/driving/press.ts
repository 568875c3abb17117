/** Buttons that also work for a second finger, while the first one holds the stick: browsers make no click of it. */

export interface PressProps {
  readonly onClick: () => void;
  readonly onPointerUp: (event: PointerEvent) => void;
}

/** Properties of a button that does something when it is pressed. */
export function press(action: () => void): PressProps {
  return {
    onClick: action,
    onPointerUp: (event) => {
      if (event.pointerType === "touch" && !event.isPrimary) {
        action();
      }
    },
  };
}
