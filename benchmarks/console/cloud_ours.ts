/** Reads clouds as the console page does; `cloud_clock.js` notes how long that takes. */

import { check } from "../../teleop/console/page/src/link/message_checks/field";
import { readPointCloud2 } from "../../teleop/console/page/src/link/message_checks/point_cloud2";
import { RosbridgeClient } from "../../teleop/console/page/src/link/rosbridge_client";
import { SocketTransport } from "../../teleop/console/page/src/link/socket_transport";

declare const noteCloud: (decodedAt: number, points: number) => void;

const ignored = (): void => undefined;
const client = new RosbridgeClient((operation) => transport.send(operation));
const transport = new SocketTransport(new WebSocket(`ws://${location.host}/`), "", {
  opened: () => {
    client.subscribe("/cloud", { compression: "cbor", queue_length: 1 }, (message) => {
      const decodedAt = performance.now();
      const checked = check((field) => readPointCloud2(field, decodedAt), message);
      if (checked.ok) {
        noteCloud(decodedAt, checked.value.positions.length / 3);
      }
    });
  },
  took: (operation) => { client.take(operation); },
  received: ignored, unreadable: ignored, ended: ignored,
});
