// The published ros3d, with the roslib 1.x it brings: a cloud and a scan in CBOR, placed by /tf, as
// points in the scene. Prints the positions; exits with 1 after 15 s without them.

globalThis.self ??= globalThis; // which the library expects in a browser
const ROSLIB = require("roslib");
const ROS3D = require("ros3d");

const points = [[1.5, -2, 0.25], [3, 4, -0.5], [0, 0, 1]];
const bytes = Buffer.alloc(16 * points.length);
points.forEach((point, i) => point.forEach((x, j) => bytes.writeFloatLE(x, 16 * i + 4 * j)));
const fields = ["x", "y", "z"].map((name, i) => ({ name, offset: 4 * i, datatype: 7, count: 1 }));
const cloud = {
  header: { frame_id: "turtle1" }, height: 1, width: points.length, fields, is_bigendian: false,
  point_step: 16, row_step: bytes.length, data: bytes.toString("base64"), is_dense: true,
};
const scan = {
  header: { frame_id: "turtle1" }, angle_min: 0, angle_max: Math.PI / 2, angle_increment: Math.PI / 2,
  range_min: 0.1, range_max: 10, ranges: [2, 3],
};

const ros = new ROSLIB.Ros({ url: process.argv[2] });
ros.on("connection", () => {
  const tfClient = new ROSLIB.TFClient({ ros, fixedFrame: "world", rate: 10 });
  const scene = { add() {} };
  const seen = new ROS3D.PointCloud2({ ros, tfClient, rootObject: scene, topic: "/checks/cloud", max_pts: 100 });
  const beams = new ROS3D.LaserScan({ ros, tfClient, rootObject: scene, topic: "/checks/laser", max_pts: 100 });
  const publish = (name, messageType, message) =>
    new ROSLIB.Topic({ ros, name, messageType }).publish(new ROSLIB.Message(message));
  publish("/checks/cloud", "sensor_msgs/PointCloud2", cloud);
  publish("/checks/laser", "sensor_msgs/LaserScan", scan);
  const positions = (object, n) => [...object.points.positions.array.slice(0, 3 * n)];
  setInterval(() => {
    const ready = [seen, beams].every((object) => object.points.sn !== null && object.points.sn.visible);
    if (!ready) return;
    console.log(JSON.stringify({ cloud: positions(seen, 3), scan: positions(beams, 2) }));
    process.exit(0);
  }, 20);
});
setTimeout(() => process.exit(1), 15000);
