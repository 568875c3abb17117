/** Words of the picture. */

export const sceneTexts = {
  canvas:
    "Picture of the map, the robot and what its scanners see. Plus and minus zoom, I J K L move the view, U and O turn it, Home brings it back to the robot.",
  noWebGl:
    "This browser shows no 3D picture because WebGL is missing: switch on hardware acceleration or use another browser; driving and stopping work without it.",
  contextLost: "The graphics card dropped the picture; it comes back by itself, else reload the page.",
  notLocated: "not located yet",
  distance: {
    title: "Live points: distance to the map",
    off: (metres: number) => `${metres.toFixed(1)} m off or more`,
    unknown: "unknown",
  },
} as const;
