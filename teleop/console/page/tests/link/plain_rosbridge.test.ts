/** A rosbridge with standard types only, and frames as rosbridge_suite sends them: JSON, base64, no status. */

import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { linkTexts } from "../../src/texts/link";
import { FakeRobot, headerAt, transform } from "./fake_robot";
import { cloudMessage } from "./message_checks/valid_messages";

const TOPICS = {
  "/tf": "tf2_msgs/msg/TFMessage",
  "/tf_static": "tf2_msgs/msg/TFMessage",
  "/odom": "nav_msgs/msg/Odometry",
  "/base_scan": "sensor_msgs/msg/LaserScan",
  "/map": "nav_msgs/msg/OccupancyGrid",
  "/global_costmap/costmap": "nav_msgs/msg/OccupancyGrid",
  "/velodyne_points": "sensor_msgs/msg/PointCloud2",
  "/camera/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
  "/cmd_vel": "geometry_msgs/msg/TwistStamped",
  "/rosout": "rcl_interfaces/msg/Log",
};

function base64(bytes: Uint8Array): string {
  return btoa(String.fromCharCode(...bytes));
}

describe("a plain rosbridge", () => {
  let robot: FakeRobot;

  beforeEach(async () => {
    vi.useFakeTimers();
    robot = new FakeRobot(TOPICS);
    robot.link.start();
    await vi.advanceTimersByTimeAsync(20);
  });

  afterEach(() => {
    robot.link.stop();
    vi.useRealTimers();
  });

  it("is known as such, which is said", () => {
    expect(robot.state.dialect.value).toBe("plain");
    expect(robot.events).toContain(`warning: ${linkTexts.events.plain}`);
  });

  it("is asked for what there is, in JSON, with its own types", () => {
    expect(robot.topics.sort()).toEqual([
      "/base_scan", "/camera/image_raw/compressed", "/map", "/odom", "/tf", "/tf_static", "/velodyne_points",
    ]);
    expect(robot.socket.operations("subscribe").every(({ compression }) => compression === "none")).toBe(true);
    const scan = robot.socket.operations("subscribe").find(({ topic }) => topic === "/base_scan");
    expect(scan?.["type"]).toBe("sensor_msgs/msg/LaserScan");
  });

  it("finds topics that appear later", async () => {
    robot.services["/rosapi/topics"] = { topics: ["/odom", "/late"], types: ["nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu"] };
    await vi.advanceTimersByTimeAsync(6000);
    expect(robot.topics.sort()).toEqual(["/late", "/odom"]);
  });

  it("gives odometry where there are no transforms", () => {
    robot.example("/odom", "odometry");
    expect(robot.state.odomFromBase.value?.position).toEqual({ x: 1, y: 2, z: 0 });
  });

  it("gives a pose in the map by transforms of several publishers", async () => {
    robot.publish("/tf", { transforms: [transform("map", "odom", 1)] });
    await vi.advanceTimersByTimeAsync(2000);
    robot.publish("/tf", { transforms: [transform("odom", "base_footprint", 2)] });
    expect(robot.state.mapFromBase.value?.position.x).toBe(3);
  });

  it("shows a cloud in base64, moved from its sensor", () => {
    const { data, ...rest } = cloudMessage();
    robot.publish("/tf_static", { transforms: [transform("base_link", "velodyne", 10)] });
    robot.publish("/velodyne_points", {
      ...rest, header: headerAt(1, "velodyne"), data: data instanceof Uint8Array ? base64(data) : "",
    });
    expect(robot.state.cloud.value?.frame).toBe("base_link");
    expect(Array.from(robot.state.cloud.value?.positions ?? [])).toEqual([11, 2, 3, 14, 5, 6]);
  });

  it("draws a scan of which nothing says where it is, and says so", () => {
    robot.example("/base_scan", "scan", { header: headerAt(1, "laser") });
    expect(robot.state.scan.value?.frame).toBe("base_link");
    expect(robot.events.at(-1)).toContain("no transform says where laser is");
  });

  it("gives the grid, and pictures of the camera as addresses", () => {
    robot.example("/map", "grid");
    expect(robot.state.gridMap.value?.width).toBe(2);
    robot.example("/camera/image_raw/compressed", "image");
    expect(robot.state.image.value).toMatchObject({ topic: "/camera/image_raw/compressed" });
    expect(robot.state.image.value?.url).toMatch(/^blob:/);
  });

  it("is driven by the type of velocity that it has", () => {
    expect(robot.link.commands.velocity(0.3, -0.1)).toBe(true);
    expect(robot.socket.operations("advertise")).toMatchObject([{ topic: "/cmd_vel", type: "geometry_msgs/msg/TwistStamped" }]);
    expect(robot.socket.operations("publish")[0]?.["msg"]).toMatchObject({ twist: { linear: { x: 0.3 }, angular: { z: -0.1 } } });
  });

  it("is driven by a Joy without a stamp, whose names differ between ROS 1 and ROS 2", () => {
    robot.link.commands.joy(1, 0, false, true);
    expect(robot.socket.operations("publish")[0]?.["msg"]).toEqual({ axes: [0, 1], buttons: [0, 0, 0, 0, 0, 1] });
  });

  it("begins anew when its clock goes back, as of a bag that is played again", () => {
    robot.example("/odom", "odometry", { header: headerAt(1000, "odom") });
    robot.example("/map", "grid");
    robot.example("/odom", "odometry", { header: headerAt(1, "odom") });
    expect(robot.state.gridMap.value).toBeUndefined();
    expect(robot.socket.operations("subscribe").filter(({ topic }) => topic === "/map")).toHaveLength(2);
  });

  it("may be of ROS 1, with another name of transforms", async () => {
    robot.services["/rosapi/topics"] = { topics: ["/tf"], types: ["tf/tfMessage"] };
    await vi.advanceTimersByTimeAsync(6000);
    expect(robot.topics).toEqual(["/tf"]);
  });

  it("may become our robot", async () => {
    robot.example("/odom", "odometry");
    robot.services["/rosapi/topics"] = { topics: ["/teleop/state"], types: ["farsteer_msgs/TeleopState"] };
    await vi.advanceTimersByTimeAsync(6000);
    expect(robot.state.dialect.value).toBe("farsteer");
    expect(robot.state.odomFromBase.value).toBeUndefined();
  });
});
