import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { linkTexts } from "../../src/texts/link";
import { FakeRobot, headerAt, ROBOT_TOPICS, transform } from "./fake_robot";

const INFO = { run_id: "first" };

describe("a link to our robot", () => {
  let robot: FakeRobot;

  beforeEach(async () => {
    vi.useFakeTimers();
    robot = new FakeRobot();
    robot.link.start();
    await vi.advanceTimersByTimeAsync(20);
  });

  afterEach(() => {
    robot.link.stop();
    vi.useRealTimers();
  });

  it("knows it by its topics and listens to what it has, the map first", () => {
    expect(robot.state.dialect.value).toBe("farsteer");
    expect(robot.topics[0]).toBe("/map_info");
    expect(robot.topics).not.toContain("/robot_description");
    expect(robot.topics.sort()).toEqual(Object.keys(ROBOT_TOPICS).filter((name) => name !== "/local_cloud/lean").sort());
    expect(robot.events).toEqual([`info: ${linkTexts.events.connected("ws://robot:9090")}`]);
  });

  it("takes the lean cloud if it is told to", () => {
    robot.link.setLean(true);
    expect(robot.topics).toContain("/local_cloud/lean");
    expect(robot.topics).not.toContain("/local_cloud");
  });

  it("composes the pose of transforms, and the attitude of it", () => {
    robot.publish("/tf", { transforms: [transform("map", "odom", 1), transform("odom", "base_link", 2)] });
    expect(robot.state.mapFromBase.value).toMatchObject({ position: { x: 3, y: 0, z: 0 }, stamp: 3 });
    expect(robot.state.odomFromBase.value?.position.x).toBe(2);
    expect(robot.state.attitude.value?.source).toBe("/tf");
    robot.example("/imu/data", "inertial");
    expect(robot.state.attitude.value?.source).toBe("/tf");
  });

  it("takes the attitude from the inertial unit while there is no pose", () => {
    robot.publish("/tf", { transforms: [transform("odom", "base_link", 2)] });
    robot.example("/imu/data", "inertial");
    expect(robot.state.mapFromBase.value).toBeUndefined();
    expect(robot.state.attitude.value?.source).toBe("/imu/data");
  });

  it("lets the pose grow old when the robot has none any more", async () => {
    robot.publish("/tf", { transforms: [transform("map", "odom", 1), transform("odom", "base_link", 2)] });
    await vi.advanceTimersByTimeAsync(400);
    const before = robot.state.mapFromBase.value;
    robot.publish("/tf", { transforms: [transform("odom", "base_link", 2.5, 4)] });
    expect(robot.state.mapFromBase.value).toBe(before);
    expect(robot.state.odomFromBase.value?.position.x).toBe(2.5);
  });

  it("listens to the scan only while there is no pose", async () => {
    expect(robot.topics).toContain("/scan");
    robot.publish("/tf", { transforms: [transform("map", "odom", 1), transform("odom", "base_link", 2)] });
    await vi.advanceTimersByTimeAsync(600);
    expect(robot.topics).not.toContain("/scan");
    await vi.advanceTimersByTimeAsync(1500);
    expect(robot.topics).toContain("/scan");
  });

  it("draws the scan from where its scanner is", () => {
    robot.publish("/tf_static", { transforms: [transform("base_link", "laser", 0.5)] });
    robot.example("/scan", "scan", { header: headerAt(3, "laser") });
    expect(robot.state.scan.value?.frame).toBe("base_link");
    expect(Array.from(robot.state.scan.value?.positions ?? [])).toEqual([1.5, 0, 0]);
  });

  it("fetches the map that the robot names, once, and its points where it has no surfaces", async () => {
    robot.example("/map_info", "mapInfo", INFO);
    await vi.advanceTimersByTimeAsync(20);
    expect(robot.fetched).toEqual(["http://robot:9090/map.glb", `http://robot:9090/map/${"0b".repeat(32)}.ply`]);
    expect(Array.from(robot.state.mapPoints.value?.positions ?? [])).toEqual([1, 2, 3]);
    robot.example("/map_info", "mapInfo", INFO);
    await vi.advanceTimersByTimeAsync(20);
    expect(robot.fetched).toHaveLength(2);
  });

  it("forgets a run when the robot has begun another", async () => {
    robot.example("/map_info", "mapInfo", INFO);
    await vi.advanceTimersByTimeAsync(20);
    const run = robot.state.run.value;
    const points = robot.state.mapPoints.value;
    robot.example("/localization/status", "status");
    robot.example("/map_info", "mapInfo", { run_id: "second" });
    expect(robot.state.run.value).not.toBe(run);
    expect(robot.state.status.value).toBeUndefined();
    expect(robot.state.mapInfo.value?.run).toBe("second");
    expect(robot.state.mapPoints.value).toBe(points);
    expect(robot.events).toContain(`warning: ${linkTexts.events.newRun}`);
    expect(robot.socket.operations("subscribe").filter(({ topic }) => topic === "/tf_static")).toHaveLength(2);
  });

  it("forgets it when the clock goes back, and names another map", () => {
    robot.example("/map_info", "mapInfo", INFO);
    robot.example("/localization/status", "status", { header: headerAt(100) });
    robot.example("/localization/status", "status", { header: headerAt(99) });
    const run = robot.state.run.value;
    expect(robot.state.mapInfo.value).toBeDefined();
    robot.example("/localization/status", "status", { header: headerAt(1) });
    expect(robot.state.run.value).not.toBe(run);
    expect(robot.state.mapInfo.value).toBeUndefined();
    robot.example("/map_info", "mapInfo", { ...INFO, name: "hall", sha256: "1c".repeat(32) });
    expect(robot.events).toContain(`warning: ${linkTexts.events.clockBack}`);
    expect(robot.events).toContain(`warning: ${linkTexts.events.otherMap("hall")}`);
  });

  it("keeps the rest alive when a message is bad, and says so once", () => {
    for (let i = 0; i < 50; i++) {
      robot.example("/localization/status", "status", { fit: null });
    }
    robot.example("/teleop/state", "control");
    expect(robot.state.status.value).toBeUndefined();
    expect(robot.state.control.value?.state).toBe("idle");
    expect(robot.events.filter((words) => words.includes("fit"))).toEqual(["warning: /localization/status: fit is missing"]);
  });

  it("lists errors that the robot reports", () => {
    robot.socket.deliver({ op: "status", level: "error", msg: "joy: <b>no</b> lease" });
    expect(robot.events).toContain("warning: robot: joy: <b>no</b> lease");
  });

  it("comes back with all subscriptions and without commands", async () => {
    robot.link.commands.joy(1, 0, true, false);
    const before = robot.topics;
    robot.socket.drop();
    expect(robot.link.commands.joy(1, 0, true, false)).toBe(false);
    expect(robot.link.commands.hint({ x: 0, y: 0, yaw: 0 }, 1, 1)).toBe(false);
    expect(await robot.link.commands.request("estop")).toEqual({ success: false, message: linkTexts.answers.notConnected });
    await vi.advanceTimersByTimeAsync(600);
    expect(robot.sockets).toHaveLength(2);
    expect(robot.topics.sort()).toEqual(before.sort());
    expect(robot.socket.sent[0]).toEqual({ op: "auth", token: "secret" });
    expect(robot.socket.operations("publish")).toEqual([]);
    expect(robot.events.at(-1)).toMatch(/^info: The connection is back after 0\.5 s/);
  });

  it("ends calls whose connection is lost", async () => {
    robot.services["/teleop/estop_reset"] = null;
    const answer = robot.link.commands.request("resetEstop");
    robot.socket.drop();
    expect(await answer).toEqual({ success: false, message: linkTexts.answers.lostMeanwhile });
  });

  it("ends calls that are not answered", async () => {
    robot.services["/teleop/give"] = null;
    const answer = robot.link.commands.request("give");
    await vi.advanceTimersByTimeAsync(5000);
    expect(await answer).toEqual({ success: false, message: linkTexts.answers.noAnswer(5) });
  });

  it("gives the robot's answers, and its reasons", async () => {
    robot.services["/teleop/estop"] = { success: true, message: "braked" };
    robot.services["/teleop/ask"] = { success: "yes" };
    const answers = Promise.all([
      robot.link.commands.request("estop"), robot.link.commands.request("takeOver"), robot.link.commands.request("ask"),
    ]);
    await vi.advanceTimersByTimeAsync(10);
    expect(await answers).toEqual([
      { success: true, message: "braked" },
      { success: false, message: "no such service" },
      { success: false, message: linkTexts.answers.unreadable("success is neither true nor false") },
    ]);
  });

  it("sends a Joy in the robot's layout, with the time of sending", () => {
    expect(robot.link.commands.joy(0.5, -0.25, true, false)).toBe(true);
    expect(robot.socket.operations("advertise")).toMatchObject([{ topic: "/joy" }]);
    expect(robot.socket.operations("publish")[0]?.["msg"]).toEqual({
      header: { stamp: { sec: 5, nanosec: 500_000_000 }, frame_id: "" },
      axes: [-0.25, 0.5],
      buttons: [0, 0, 0, 0, 1, 0],
    });
  });

  it("previews a hint", async () => {
    robot.services["/localization/preview_hint"] = { success: true, message: "", explained: 0.93, present: 0.4 };
    const pose = { x: 1, y: 2, yaw: Math.PI };
    const preview = robot.link.commands.previewHint(pose);
    await vi.advanceTimersByTimeAsync(10);
    expect(await preview).toEqual({ pose, explained: 0.93, present: 0.4 });
    const [call] = robot.socket.operations("call_service").filter(({ service }) => service === "/localization/preview_hint");
    expect(call?.["args"]).toMatchObject({ pose: { position: { x: 1, y: 2, z: 0 }, orientation: { z: 1 } } });
  });

  it("sends a hint with its covariance", () => {
    robot.link.commands.hint({ x: 1, y: 2, yaw: 0 }, 0.5, 0.2);
    const message = robot.socket.operations("publish")[0]?.["msg"];
    expect(message).toMatchObject({ header: { frame_id: "map" }, pose: { pose: { position: { x: 1 } } } });
    expect(JSON.stringify(message)).toContain("0.25,");
  });

  it("measures the link and knows the session", async () => {
    robot.services["/teleop/session"] = {
      client: 3, name: "client 3", role: "view", tokens: true, may_drive: false, may_stop: true, may_reset: false,
      may_hint: false, may_search: false, may_take_over: false, may_share: false, link: false, may_play: false,
    };
    robot.services["/teleop/link"] = { topics: ["/tf"], sent: [1], dropped: [7], bytes: 1, made: [-1], queued: [-1], now: 1, stamp: 1, taken: -1, round_trip: -1 };
    robot.socket.drop();
    await vi.advanceTimersByTimeAsync(4000);
    robot.publish("/tf", { transforms: [] });
    await vi.advanceTimersByTimeAsync(500);
    expect(robot.state.session.value).toMatchObject({ client: 3, role: "view", mayDrive: false });
    const calls = robot.socket.operations("call_service").filter(({ service }) => String(service).startsWith("/teleop/"));
    expect(calls.slice(0, 2).map(({ service, args }) => [service, args])).toEqual([
      ["/teleop/introduce", { name: "Anna" }], ["/teleop/session", {}],
    ]);
    expect(calls.filter(({ service }) => service === "/teleop/introduce")).toHaveLength(1);
    const statistics = robot.link.statistics.value;
    expect(statistics.roundTrip).toBeCloseTo(5);
    expect(statistics.streams.find(({ topic }) => topic === "/tf")?.dropped).toBe(7);
    expect(statistics.bytesPerSecond).toBeGreaterThan(0);
    robot.socket.drop();
    expect(robot.state.session.value).toBeUndefined();
  });
});

describe("a link to a rosbridge that does not say what it has", () => {
  it("tries the usual names, and knows our robot by its state", async () => {
    vi.useFakeTimers();
    const robot = new FakeRobot(null);
    robot.services = {};
    robot.link.start();
    await vi.advanceTimersByTimeAsync(20);
    expect(robot.state.dialect.value).toBe("plain");
    expect(robot.topics).toContain("/teleop/state");
    robot.example("/teleop/state", "control");
    await vi.advanceTimersByTimeAsync(1);
    expect(robot.state.dialect.value).toBe("farsteer");
    expect(robot.topics).toContain("/localization/status");
    robot.link.stop();
    vi.useRealTimers();
  });
});
