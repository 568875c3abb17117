import { expect, it } from "vitest";
import { cameraStreams } from "../../src/camera/camera_streams";

const PATH = "/stream?topic=/camera/rgb/image_rect_color&type=mjpeg&quality=30";

function shown(address: string, page: string, robot = new URL(page).origin): boolean {
  const [stream] = cameraStreams(new Map([["p3at", address]]), page, robot);
  expect(stream).toMatchObject({ name: "p3at", address });
  return stream?.path !== undefined;
}

it("reads the robot's own streams from where the page is", () => {
  expect(cameraStreams(new Map([["p3at", `http://127.0.0.1:9090${PATH}`]]), "http://localhost:9090/", "http://localhost:9090"))
    .toEqual([{ name: "p3at", path: PATH, address: `http://127.0.0.1:9090${PATH}` }]);
  expect(shown(`http://192.168.1.7:8080${PATH}`, "http://192.168.1.7:9090/"), "a further port").toBe(true);
  expect(shown(`https://192.168.1.7:9090${PATH}`, "https://robot.local:9090/"), "another name").toBe(true);
});

it("does not take streams of others for the robot's, nor what is no stream", () => {
  expect(shown(`http://192.168.1.8:8080${PATH}`, "http://192.168.1.7:9090/")).toBe(false);
  expect(shown("http://192.168.1.7:9090/teleop", "http://192.168.1.7:9090/")).toBe(false);
  expect(shown("javascript:alert(1)", "http://192.168.1.7:9090/")).toBe(false);
  expect(shown("", "http://192.168.1.7:9090/")).toBe(false);
});

it("shows none on a page that another server sends", () => {
  expect(shown(`http://127.0.0.1:9090${PATH}`, "http://127.0.0.1:9080/", "http://127.0.0.1:9090")).toBe(false);
});
