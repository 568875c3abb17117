/** Reads clouds as the console page does; `cloud_clock.js` notes how long that takes. */

import { Ros, Topic } from "roslib";
import { check } from "../../teleop/console/page/src/link/message_checks/field";
import { readPointCloud2 } from "../../teleop/console/page/src/link/message_checks/point_cloud2";
import { SocketTransport } from "../../teleop/console/page/src/link/socket_transport";

declare const noteCloud: (decodedAt: number, points: number) => void;

const socket = new WebSocket(`ws://${location.host}/`);
const transport = new SocketTransport(socket, "", () => undefined, () => undefined);
const ros = new Ros({ transportFactory: () => Promise.resolve(transport) });
void ros.connect("");
const topic = new Topic({
  ros, name: "/cloud", messageType: "sensor_msgs/PointCloud2", compression: "cbor", queue_length: 1,
  reconnect_on_close: false,
});
topic.subscribe((message) => {
  const decodedAt = performance.now();
  const checked = check((field) => readPointCloud2(field, decodedAt), message);
  if (checked.ok) {
    noteCloud(decodedAt, checked.value.positions.length / 3);
  }
});
