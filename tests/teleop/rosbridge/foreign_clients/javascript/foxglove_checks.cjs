// What Foxglove's data source "Rosbridge" does, in its order and with the packages it uses, unmodified
// (RosbridgePlayer of Foxglove Studio 1.x, and of Lichtblick): it requests all topics with the texts of
// their types, derives the ROS version from the type of /rosout, reads every message in its
// serialisation, requests all nodes, calls a service and publishes. Prints one object of JSON: the
// version, what it read on each topic, the nodes' details, and the response of the service; exits with
// 1 after 30 s.

globalThis.WebSocket ??= require("ws"); // which browsers have
const roslib = require("@foxglove/roslibjs");
const { parse } = require("@foxglove/rosmsg");
const { LazyMessageReader } = require("@foxglove/rosmsg-serialization");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const [url, service, published] = process.argv.slice(2);

const ask = (ros, method, ...args) =>
  new Promise((resolve, reject) => ros[method](...args, (...answer) => resolve(answer), reject));

// JSON of what a reader returns: it has typed arrays, and integers that a double does not hold.
function plain(value) {
  if (typeof value === "bigint") return String(value);
  if (typeof value?.toObject === "function") return plain(value.toObject());
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (value !== null && typeof value === "object")
    return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, plain(inner)]));
  return value;
}

async function play(ros) {
  const [{ topics, types, typedefs_full_text: texts }] = await ask(ros, "getTopicsAndRawTypes");
  const version = types.includes("rcl_interfaces/msg/Log") ? 2 : types.includes("rosgraph_msgs/Log") ? 1 : 0;
  const read = {};
  await Promise.all(
    topics.map((name, i) => {
      const definition = parse(texts[i], { ros2: version === 2 });
      const reader = version === 2 ? new MessageReader(definition) : new LazyMessageReader(definition);
      if (!name.startsWith("/all/")) return null;
      const topic = new roslib.Topic({ ros, name, compression: "cbor-raw" });
      return new Promise((resolve) =>
        topic.subscribe(({ bytes }) => {
          const buffer = new Uint8Array(bytes);
          if (version === 1 && reader.size(buffer) > buffer.byteLength) throw new Error(`${name} is cut off`);
          read[types[i]] = plain(reader.readMessage(buffer));
          topic.unsubscribe();
          resolve();
        }),
      );
    }),
  );
  const nodes = {};
  for (const node of (await ask(ros, "getNodes"))[0]) nodes[node] = await ask(ros, "getNodeDetails", node);
  const [serviceType] = await ask(ros, "getServiceType", service);
  const proxy = new roslib.Service({ ros, name: service, serviceType });
  const answer = await new Promise((resolve, reject) => proxy.callService({ data: true }, resolve, reject));
  const twist = version === 2 ? "geometry_msgs/msg/Twist" : "geometry_msgs/Twist";
  const publisher = new roslib.Topic({ ros, name: published, messageType: twist, queue_size: 0 });
  publisher.publish({ linear: { x: 0.5, y: 0, z: 0 }, angular: { x: 0, y: 0, z: -1 } });
  publisher.unadvertise();
  return { version, read, nodes, serviceType, answer };
}

const ros = new roslib.Ros({ url });
const fail = (error) => {
  console.error(error);
  process.exit(1);
};
ros.on("status", fail);
ros.on("error", fail);
ros.on("connection", () =>
  play(ros).then((said) => process.stdout.write(JSON.stringify(said), () => process.exit(0)), fail),
);
setTimeout(() => fail("no end within 200 s"), 200_000);
