/** Reads clouds as published pages do, by roslib 1.4 and ros3d 1.1; `cloud_clock.js` notes how long that takes. */
/* global ROSLIB, ROS3D, noteCloud */
const read = ROS3D.PointCloud2.prototype.processMessage;
ROS3D.PointCloud2.prototype.processMessage = function (message) {
  const decodedAt = performance.now();
  read.call(this, message);
  noteCloud(decodedAt, this.points.geom.drawRange.count);
};
const ros = new ROSLIB.Ros({ url: `ws://${location.host}/` });
const still = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
ros.on("connection", () => {
  window.cloud = new ROS3D.PointCloud2({
    ros, topic: "/cloud", max_pts: 100000, rootObject: { add() {} },
    tfClient: { subscribe(frame, callback) { callback(still); }, unsubscribe() {} },
  });
});
