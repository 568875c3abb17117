/** Words of sharing a robot. */

const ROLES: Readonly<Record<string, string>> = {
  recording: "a recording", view: "watches", operate: "drives", admin: "administers" };

/** Return a time [s] in the unit that suits it. */
function lasting(seconds: number): string {
  const units = [["day", 86_400], ["hour", 3600], ["minute", 60]] as const;
  const [unit, size] = units.find(([, length]) => seconds >= length) ?? (["second", 1] as const);
  const count = Math.round(seconds / size);
  return `${count} ${unit}${count === 1 ? "" : "s"}`;
}

export const sharingTexts = {
  title: "Share, and who is here",
  here: "Here now",
  me: (name: string): string => `${name} (you)`,
  role: (role: string): string => ROLES[role] ?? "not logged in",
  driving: "has the robot",
  look: "Look again",
  notHere: "To share the robot with others in your network, serve it with --lan.",
  make: "A link for others",
  watch: "to watch",
  drive: "to drive",
  ends: "It ends after",
  times: [["an hour", 3600], ["a day", 86_400], ["a week", 604_800]] as const,
  share: "Make a link",
  open: "Scan this, or open the link. Each device that opens it gets a token of its own.",
  code: "QR code of the link",
  copy: "Link",
  tokens: "Devices and links",
  token: (name: string, role: string, seconds: number, link: boolean): string =>
    `${name}: ${link ? "link, " : ""}${ROLES[role] ?? role}${seconds < 0 ? "" : `, ${lasting(seconds)} left`}`,
  revoke: "Revoke",
  revokeNamed: (name: string): string => `Revoke ${name}`,
  refused: (why: string): string => `Not done: ${why}`,
} as const;
