import { afterEach, beforeEach, expect, it } from "vitest";
import { Sharing } from "../../../src/panels/session/sharing";
import { SessionPanel } from "../../../src/panels/session/session_panel";
import { unknownState, type RobotState } from "../../../src/robot/robot_state";
import type { Reply } from "../../../src/link/service_calls";
import type { Session } from "../../../src/values";
import { SESSION } from "../../driving/harness";
import { RecordingCommands } from "../../hint/recording_commands";
import { mount, type Mounted } from "../mounted";

const VIEWER: Session = {
  ...SESSION, client: 4, name: "client 4", role: "view", mayDrive: false, mayReset: false, mayHint: false, maySearch: false, mayTakeOver: false,
};

/** What the robot answers, by service. */
let answers: Record<string, object>;
let asked: [string, object][];
const wire = {
  call: (service: string, request: object): Promise<Reply> => {
    asked.push([service, request]);
    const values = answers[service];
    return Promise.resolve(values === undefined ? { ok: false, words: "no such service", refused: true } : { ok: true, values });
  },
};

let state: RobotState;
let commands: RecordingCommands;
let page: Mounted;
let loggedOut: number;
let renamed: string[];

beforeEach(async () => {
  state = unknownState();
  state.connection.value = { phase: "refused", words: "The robot asks for a token.", sinceAt: 0 };
  commands = new RecordingCommands();
  loggedOut = 0;
  renamed = [];
  asked = [];
  answers = {};
  page = await mount(<SessionPanel state={state} commands={commands} onLogout={() => { loggedOut += 1; }} name="Red Robin" onRename={(name) => { renamed.push(name); }} sharing={new Sharing(wire)} />);
});

afterEach(() => { page.unmount(); });

async function enter(token: string): Promise<void> {
  const field = page.root.querySelector<HTMLInputElement>("input[type=password]");
  if (field === null) {
    throw new Error("no field for the token");
  }
  field.value = token;
  await page.act(() => { page.root.querySelector<HTMLFormElement>("form:has([type=password])")?.requestSubmit(); });
}

it("hands the token to the link and keeps it nowhere", async () => {
  expect(page.text()).toContain("The robot asks for a token.");
  await enter("  secret-token ");
  expect(commands.tokens).toEqual(["secret-token"]);
  expect(page.root.querySelector<HTMLInputElement>("input[type=password]")?.value).toBe("");
  expect(page.text()).not.toContain("secret-token");
  expect([localStorage.length, sessionStorage.length]).toEqual([0, 0]);
  expect(document.title + location.href).not.toContain("secret-token");
});

it("asks for a token if the field is empty", async () => {
  await enter(" ");
  expect(commands.tokens).toEqual([]);
  expect(page.text()).toContain("Enter the token");
});

it("says who one is and what one may do, and logs out", async () => {
  await page.act(() => { state.session.value = VIEWER; });
  expect(page.text()).toContain("You are client 4. Role: view");
  expect(page.text()).toContain("You may: stop the robot");
  await page.act(() => { page.button("Log out").click(); });
  expect(loggedOut).toBe(1);
  await page.act(() => { state.session.value = { ...VIEWER, mayStop: false }; });
  expect(page.text()).toContain("You may: only watch");
});

it("lets a viewer without a token log in, and nobody where there are no tokens", async () => {
  await page.act(() => { state.session.value = VIEWER; });
  await enter("another");
  expect(commands.tokens).toEqual(["another"]);
  await page.act(() => { state.session.value = { ...VIEWER, tokens: false }; });
  expect(page.root.querySelector("input[type=password]")).toBeNull();
  expect(page.text()).toContain("asks for no tokens");
});

it("does not ask for a token while the link is lost, nor at a robot without sessions", async () => {
  await page.act(() => { state.connection.value = { phase: "lost", words: "The robot does not answer.", sinceAt: 0 }; });
  expect(page.text()).toContain("The robot does not answer.");
  expect(page.root.querySelector("input[type=password]")).toBeNull();
  await page.act(() => {
    state.connection.value = { phase: "open", words: "", sinceAt: 0 };
    state.dialect.value = "plain";
  });
  expect(page.text()).toContain("knows no sessions");
  expect(page.root.querySelector("input[type=password]")).toBeNull();
});

it("offers the name that others see, and takes another one", async () => {
  await page.act(() => { state.session.value = { ...VIEWER, name: "Red Robin", tokens: false }; });
  expect(page.text()).toContain("You are Red Robin.");
  const field = page.root.querySelector<HTMLInputElement>("input[type=text]");
  expect(field?.value).toBe("Red Robin");
  await page.act(() => { page.button("Change").click(); });
  expect(renamed).toEqual([]);
  if (field !== null) {
    field.value = "  Anna ";
  }
  await page.act(() => { page.button("Change").click(); });
  expect(renamed).toEqual(["Anna"]);
});

async function openShare(): Promise<void> {
  await page.act(() => {
    const part = [...page.root.querySelectorAll("details")].find(({ textContent }) => textContent.includes("who is here"));
    if (part !== undefined) {
      part.open = true; // which is announced by an event
    }
  });
  await page.act(() => undefined);
}

it("shows who is here, makes a link to watch with its code, and revokes a device", async () => {
  answers = {
    "/teleop/clients": { numbers: [4, 5], names: ["Red Robin", "Guest"], roles: ["operate", "view"], tokens: ["", ""] },
    "/teleop/tokens": { names: ["Guest's phone"], roles: ["view"], seconds: [7200], links: [false] },
    "/teleop/share": { success: true, message: "", name: "l", link: "https://192.168.1.7:9090/#token=t", qr: "data:image/svg+xml,x" },
    "/teleop/revoke_token": { success: true, message: "Guest's phone has ended" },
  };
  await page.act(() => { state.session.value = { ...VIEWER, name: "Red Robin", role: "operate", mayShare: true }; });
  await openShare();
  expect(page.text()).toContain("Red Robin (you): drives");
  expect(page.text()).toContain("Guest: watches");
  expect(page.text()).toContain("Guest's phone: watches, 2 hours left");
  await page.act(() => { page.button("Make a link").click(); });
  await page.act(() => undefined);
  expect(asked).toContainEqual(["/teleop/share", { role: "view", seconds: 3600, name: "" }]);
  expect(page.root.querySelector("img")?.getAttribute("src")).toBe("data:image/svg+xml,x");
  await page.act(() => { page.button("Revoke Guest's phone").click(); });
  await page.act(() => undefined);
  expect(asked).toContainEqual(["/teleop/revoke_token", { name: "Guest's phone" }]);
  expect(page.text()).toContain("Guest's phone has ended");
});

it("offers neither links nor tokens to who may not share, and says how a robot is shared", async () => {
  answers = { "/teleop/clients": { numbers: [4], names: ["client 4"], roles: ["view"], tokens: [""] } };
  await page.act(() => { state.session.value = VIEWER; });
  await openShare();
  expect(new Set(asked.map(([service]) => service))).toEqual(new Set(["/teleop/clients"]));
  expect(page.text()).not.toContain("Make a link");
  await page.act(() => { state.session.value = { ...VIEWER, role: "admin", tokens: false }; });
  expect(page.text()).toContain("serve it with --lan");
});

it("shows no picture from elsewhere as a code", async () => {
  answers = {
    "/teleop/share": { success: true, message: "", name: "l", link: "https://x/#token=t", qr: "https://evil.example/x.svg" },
  };
  await page.act(() => { state.session.value = { ...VIEWER, role: "operate", mayShare: true }; });
  await openShare();
  await page.act(() => { page.button("Make a link").click(); });
  await page.act(() => undefined);
  expect(page.root.querySelector("img")).toBeNull();
});
