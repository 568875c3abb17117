/** What the page says of its connection to the robot. */

export const linkTexts = {
  nothingListens: (address: string): string =>
    `Nothing answers at ${address}. Is the robot running there (farsteer serve), and is this machine in its network? The page keeps trying.`,
  noTls: (address: string, page: string): string =>
    `Nothing that this browser trusts answers at ${address}. If the robot made its certificate itself, open ${page} once and accept it there. The page keeps trying.`,
  notRosbridge: (address: string): string =>
    `What answers at ${address} is not a rosbridge. Give the address of a robot: farsteer console ws://HOST:PORT, 9090 by default.`,
  refusesPage: (address: string, origin: string): string =>
    `The robot at ${address} runs, and does not take this page's connection. Start it with --origins ${origin}, or open the page from the robot itself.`,
  full: (address: string): string =>
    `The robot at ${address} has no place left. Close another page or program that is connected to it; the page keeps trying.`,
  evicted: "The robot needed this place for an operator. Log in with a token that may operate, or wait; the page keeps trying.",
  overloaded: (reason: string): string =>
    `The robot closed the connection: ${reason === "" ? "too much waited to be sent" : reason}. The page keeps trying; the lean setting needs less.`,
  tokenMissing: "This robot asks for a token. Enter the one that its owner gave you, or open the address with #token=… at its end.",
  tokenRefused: "The robot does not accept this token. Enter another, or ask the robot's owner whether it was withdrawn.",
  tokenLater: "Too many wrong tokens came from this machine. Wait ten seconds, then enter the right one.",
  accessChanged: "The robot's owner has changed what this token may do. The page logs in again.",
  mixedContent: (address: string): string =>
    `A page opened by https cannot connect to ${address}, which is not encrypted. Start the robot with --lan, or open the page by http from this machine.`,
  badAddress: (address: string): string => `${address} is not the address of a robot. One looks like ws://192.168.1.7:9090.`,
  handshakeHangs: (address: string): string =>
    `${address} does not answer. Is the robot on, and is this machine in its network? The page keeps trying.`,
  silentServer: (address: string): string =>
    `${address} took the connection and says nothing. Is it a rosbridge, and does it run?`,
  lost: "The connection to the robot is lost. The robot stops by itself; the page keeps trying.",
  fellSilent: "Nothing has come from the robot for 5 s. The robot stops by itself; the page keeps trying.",
  closedBecause: (reason: string): string => `The robot closed the connection: ${reason}. The page keeps trying.`,
  browserOffline: "This machine has no network. The robot stops by itself; the page is back when the network is.",

  events: {
    connected: (address: string): string => `Connected to ${address}.`,
    back: (seconds: number): string => `The connection is back after ${seconds.toFixed(1)} s.`,
    newRun: "The robot has started anew: what belonged to its last run is cleared.",
    clockBack: "The robot's clock has gone back: what belonged to its last run is cleared.",
    otherMap: (name: string): string => `The robot has another map, ${name}: what belonged to the last one is cleared.`,
    unreadable: "A frame of the robot cannot be read.",
    complaint: (source: string, complaint: string): string => `${source}: ${complaint}`,
    repeated: (source: string, complaint: string, count: number): string => `${source}: ${complaint} (${count} times more)`,
    plain: "This rosbridge is not a Farsteer robot: the page shows what there is. Nothing there guards the robot.",
    mapFailed: (reason: string): string => `The map cannot be had: ${reason}. The page does without it and tries again.`,
    mapUnverified: "The map's hash cannot be checked, since this page is not on a secure connection (https or localhost).",
    mapWrong: "The map that came is not the one that the robot uses: its SHA-256 differs. It is not shown.",
    mapBad: (reason: string): string => `The map cannot be read: ${reason}.`,
  },

  answers: {
    notConnected: "There is no connection to the robot.",
    lostMeanwhile: "The connection was lost before the robot answered; whether it obeyed shows in its state.",
    noAnswer: (seconds: number): string => `The robot did not answer within ${seconds} s.`,
    unreadable: (complaint: string): string => `The robot's answer cannot be read: ${complaint}.`,
    failed: (reason: string): string => (reason === "" ? "The robot refused without a reason." : reason),
  },
} as const;
