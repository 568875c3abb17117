import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { CameraFeed } from "../../../src/camera/camera_feed";
import { PhotoControl } from "../../../src/camera/photo_control";
import { CameraPanel } from "../../../src/panels/camera/camera_panel";
import type { CameraCommands, PhotoAnswer } from "../../../src/robot/robot_actions";
import { unknownState, type RobotState } from "../../../src/robot/robot_state";
import type { Answer } from "../../../src/values";
import { SESSION } from "../../driving/harness";
import { mount, type Mounted } from "../mounted";

class Camera implements CameraCommands {
  answer: PhotoAnswer = { success: true, name: "photo3.jpg", message: "stored photo3.jpg" };
  ticket: Answer = { success: true, message: "a ticket" };
  takePhoto(): Promise<PhotoAnswer> { return Promise.resolve(this.answer); }
  videoTicket(): Promise<Answer> { return Promise.resolve(this.ticket); }
}

let state: RobotState;
let camera: Camera;
let feed: CameraFeed;
let photo: PhotoControl;
let page: Mounted;

beforeEach(async () => {
  state = unknownState();
  state.connection.value = { phase: "open", words: "", sinceAt: 0 };
  camera = new Camera();
  feed = new CameraFeed(state, {
    fetch: () => Promise.reject(new Error("nothing here")), now: () => 0, document, keeper: undefined,
    page: "http://robot:9090/", robot: "http://robot:9090", token: () => "",
  });
  photo = new PhotoControl(camera, "http://robot:9090");
  page = await mount(<CameraPanel feed={feed} photo={photo} state={state} />);
});

afterEach(() => {
  page.unmount();
  feed.dispose();
});

const sources = new Map([
  ["p3at", "http://robot:9090/stream?topic=/camera/rgb/image_rect_color"], ["far", "http://far:8080/stream?topic=/c"],
]);

it("is there for a robot with a camera only, and on at first", async () => {
  expect(page.text()).toBe("");
  await page.act(() => { state.videoSources.value = sources; });
  const options = [...page.root.querySelectorAll("option")].map((option) => option.textContent);
  expect(options).toEqual(["off", "p3at"]);
  expect(page.root.querySelector("select")?.value).toBe("p3at");
  expect(page.text()).toContain("It is at http://far:8080/stream?topic=/c");
});

it("takes a photograph and links to it, or says why there is none", async () => {
  await page.act(() => { state.videoSources.value = sources; });
  await page.act(() => { page.button("Take a photograph").click(); });
  expect(page.root.querySelector("a")?.getAttribute("href")).toBe("http://robot:9090/photos/photo3.jpg");
  camera.answer = { success: false, name: "", message: "the disk is full" };
  await page.act(() => { page.button("Take a photograph").click(); });
  expect(page.text()).toContain("No photograph: the disk is full");
});

it("opens a photograph of a robot with tokens by a ticket", async () => {
  const opened = { close: vi.fn(), location: { replace: vi.fn() } };
  await photo.open("photo3.jpg", () => opened);
  expect(opened.location.replace).toHaveBeenCalledWith("http://robot:9090/photos/photo3.jpg?ticket=a%20ticket");
  camera.ticket = { success: false, message: "no connection" };
  await photo.open("photo3.jpg", () => opened);
  expect(opened.close).toHaveBeenCalledOnce();
  expect(photo.trouble.value).toContain("no connection");
});

it("offers no photograph to those who may only watch", async () => {
  await page.act(() => {
    state.videoSources.value = sources;
    state.session.value = { ...SESSION, role: "view", mayDrive: false };
  });
  expect(page.root.querySelector("button")).toBeNull();
});
