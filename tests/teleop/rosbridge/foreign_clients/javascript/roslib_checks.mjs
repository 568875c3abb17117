// The published roslib against the server at a URL. Each check prints one line of JSON: its name and
// null, or its error. Every check has a connection of its own.

import { webcrypto } from "node:crypto";

globalThis.crypto ??= webcrypto; // Node 18 has it elsewhere

const { ActionClient, Action, Goal, Param, Ros, ROS2TFClient, Service, TFClient, Topic } = await import("roslib");

const url = process.argv[2];

class Failed extends Error {}

function expect(truth, text, ...more) {
  if (!truth) throw new Failed([text, ...more.map((m) => JSON.stringify(m))].join(" "));
}

function same(got, wanted) {
  expect(JSON.stringify(got) === JSON.stringify(wanted), "got and wanted", got, wanted);
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// For functions whose last two arguments are callbacks.
const ask = (object, method, ...args) =>
  new Promise((resolve, reject) =>
    object[method](...args, resolve, (error) => reject(new Failed(`refused: ${JSON.stringify(error)}`))),
  );

async function until(truth) {
  while (!truth()) await sleep(10);
}

const checks = {
  getTopics: async (ros) => {
    const { topics, types } = await ask(ros, "getTopics");
    expect(topics.includes("/rosout"), "no /rosout", topics);
    expect(topics.length === types.length, "as many types as topics");
    for (const end of ["feedback", "status", "result"]) expect(topics.includes(`/fibonacci/${end}`), end, topics);
    for (const end of ["feedback", "status"]) expect(topics.includes(`/tf2_web_republisher/${end}`), end, topics);
  },
  getNodes: async (ros) => expect((await ask(ros, "getNodes")).includes("/rosbridge_websocket"), "no node"),
  getNodeDetails: async (ros) => {
    const details = await ask(ros, "getNodeDetails", "/rosbridge_websocket");
    expect(details.publishing.includes("/rosout"), "publishing", details);
    expect(details.services.includes("/add_two_ints"), "services", details);
    expect(details.subscribing.includes("/fibonacci/goal"), "subscribing", details);
  },
  getServices: async (ros) => expect((await ask(ros, "getServices")).includes("/add_two_ints"), "no service"),
  getTopicType: async (ros) => same(await ask(ros, "getTopicType", "/listener"), "std_msgs/msg/String"),
  getServiceType: async (ros) => same(await ask(ros, "getServiceType", "/add_two_ints"), "rospy_tutorials/srv/AddTwoInts"),
  getTopicsAndRawTypes: async (ros) => {
    const { topics, types, typedefs_full_text: texts } = await ask(ros, "getTopicsAndRawTypes");
    same([topics.length, types.length], [texts.length, texts.length]);
    same(texts[topics.indexOf("/listener")].trim(), "string data");
    const tf = texts[topics.indexOf("/tf_static")];
    expect(tf.startsWith("geometry_msgs/TransformStamped[] transforms\n" + "=".repeat(80) + "\nMSG: "), tf);
  },
  getMessageDetails: async (ros) => {
    const details = ros.decodeTypeDefs(await ask(ros, "getMessageDetails", "sensor_msgs/LaserScan"));
    same(details.ranges, ["float32"]);
    same(details.header.frame_id, "string");
    same(details.header.stamp, { sec: "int32", nanosec: "uint32" });
  },
  getActionServers: async (ros) =>
    same(await ask(ros, "getActionServers"), ["/fibonacci", "/tf2_web_republisher"]),
  getParams: async (ros) => {
    await ask(new Param({ ros, name: "/checks/listed" }), "set", 1);
    expect((await ask(ros, "getParams")).includes("/checks/listed"), "not listed");
  },
  setParam: async (ros) => {
    const param = new Param({ ros, name: "/checks/foo" });
    await ask(param, "set", { a: [1, 2.5, "é"], b: true });
  },
  getParam: async (ros) => {
    const param = new Param({ ros, name: "/checks/got" });
    await ask(param, "set", { a: [1, 2.5, "é"], b: true });
    same(await ask(param, "get"), { a: [1, 2.5, "é"], b: true });
  },
  deleteParam: async (ros) => {
    const param = new Param({ ros, name: "/checks/gone" });
    await ask(param, "set", "x");
    await ask(param, "delete");
    expect(!(await ask(ros, "getParams")).includes("/checks/gone"), "still listed");
  },
  publishAndSubscribe: (ros) => loop(ros, "none", (received_on) => same(received_on.header.frame_id, "é")),
  publishAndSubscribePng: (ros) => loop(ros, "png", (received_on) => same(received_on.header.frame_id, "é")),
  publishAndSubscribeCbor: (ros) =>
    loop(ros, "cbor", (received_on) => {
      same(received_on.header.frame_id, "é");
      expect(received_on.ranges instanceof Float32Array, "no Float32Array");
      same([...received_on.ranges], [1.5, 2.5]);
    }),
  publishAndSubscribeCborRaw: (ros) =>
    loop(ros, "cbor-raw", (received_on) => {
      expect(typeof received_on.secs === "number" && typeof received_on.nsecs === "number", "no time");
      const bytes = Buffer.from(received_on.bytes);
      same([...bytes.subarray(0, 4)], [0, 1, 0, 0]);
      expect(bytes.includes(Buffer.from("é")), "no é in it");
    }),
  serviceLoopBack: async (ros) => {
    const provider = new Service({ ros, name: "/checks/trigger", serviceType: "std_srvs/Trigger" });
    await provider.advertise((request, response) => {
      response.success = true;
      response.message = "é";
      return true;
    });
    const service = new Service({ ros, name: "/checks/trigger", serviceType: "std_srvs/Trigger" });
    same(await ask(service, "callService", {}), { success: true, message: "é" });
    await provider.unadvertise();
    await provider.advertiseAsync(async () => ({ success: true, message: "later" }));
    same((await ask(service, "callService", {})).message, "later");
  },
  failingService: async (ros) => {
    const provider = new Service({ ros, name: "/checks/failing", serviceType: "std_srvs/Trigger" });
    const service = new Service({ ros, name: "/checks/failing", serviceType: "std_srvs/Trigger" });
    const fail = () => new Promise((resolve) => service.callService({}, () => resolve(null), resolve));
    await provider.advertise(() => false);
    same(await fail(), "Service /checks/failing failed: its provider gave no reason");
    await provider.unadvertise();
    await provider.advertiseAsync(async () => {
      throw new Error("out of order");
    });
    same(await fail(), "Service /checks/failing failed: Error: out of order");
    await provider.unadvertise();
    same(await fail(), "Service /checks/failing does not exist");
  },
  fragments: async (ros) => {
    const text = "é".repeat(2000);
    let received_on = null;
    ros.on("/checks/long", (message) => (received_on = message.msg.data));
    const topic = "/checks/long";
    ros.callOnConnection({ op: "subscribe", topic, type: "std_msgs/String", fragment_size: 100 });
    ros.callOnConnection({ op: "publish", topic, msg: { data: text } });
    await until(() => received_on !== null);
    same(received_on, text);
  },

  // Further checks: those of roslib's own network tests

  twoTopicObjects: async (ros) => {
    const options = { ros, name: "/checks/two", messageType: "std_msgs/String" };
    const [one, two] = [new Topic(options), new Topic(options)];
    const received_on = { one: [], two: [] };
    one.subscribe((message) => received_on.one.push(message.data));
    two.subscribe((message) => received_on.two.push(message.data));
    one.publish({ data: "1" });
    two.publish({ data: "2" });
    await until(() => received_on.two.length === 2);
    one.unsubscribe();
    one.unadvertise();
    two.publish({ data: "3" });
    await until(() => received_on.two.length === 3);
    same(received_on, { one: ["1", "2"], two: ["1", "2", "3"] });
    same((await ask(two, "getPublishers")).length, 1);
  },
  topicsComeAndGo: async (ros) => {
    const topic = new Topic({ ros, name: "/checks/some_test_topic", messageType: "std_msgs/String" });
    topic.advertise();
    expect((await ask(ros, "getTopics")).topics.includes(topic.name), "not there");
    topic.unadvertise();
    while ((await ask(ros, "getTopics")).topics.includes(topic.name)) await sleep(100);
  },
  actionlibGoal: async (ros) => {
    const client = new ActionClient({ ros, serverName: "/fibonacci", actionName: "actionlib_tutorials/FibonacciAction" });
    const goal = new Goal({ actionClient: client, goalMessage: { order: 3 } });
    const feedback = [];
    let result = null;
    goal.on("feedback", (message) => feedback.push(message.sequence));
    goal.on("result", (message) => (result = message.sequence));
    goal.send();
    await until(() => result !== null);
    same(feedback, [[0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2, 3]]);
    same(result, [0, 1, 1, 2, 3]);
  },
  actionLoopBack: async (ros) => {
    const options = { ros, name: "/checks/action", actionType: "example_interfaces/action/Fibonacci" };
    const [server, client] = [new Action(options), new Action(options)];
    server.advertise((goal, id) => {
      server.sendFeedback(id, { sequence: [0, 1] });
      if (goal.order < 0) server.setFailed(id);
      else server.setSucceeded(id, { sequence: [goal.order] });
    }, () => {});
    const send = (order) =>
      new Promise((resolve) => {
        const feedback = [];
        client.sendGoal({ order }, (r) => resolve([feedback, r]), (f) => feedback.push(f), (e) => resolve(e));
      });
    same(await send(5), [[{ sequence: [0, 1] }], { sequence: [5] }]);
    expect((await send(-1)).includes("Action was aborted"), "not aborted");
  },
  actionCancel: async (ros) => {
    const client = new Action({ ros, name: "/fibonacci", actionType: "example_interfaces/action/Fibonacci" });
    let ended = null;
    const id = client.sendGoal({ order: 40 }, () => (ended = "done"), () => client.cancelGoal(id), (e) => (ended = e));
    await until(() => ended !== null);
    expect(String(ended).includes("Action was canceled"), ended);
  },
  tfByActionlib: (ros) => follow(new TFClient({ ros, fixedFrame: "world" })),
  tfByAction: (ros) => follow(new ROS2TFClient({ ros, fixedFrame: "world" })),
  statusLevel: async (ros) => {
    let status = null;
    ros.on("status:mine", (message) => (status = message));
    ros.callOnConnection({ op: "publish", topic: "/nobody/knows", msg: {}, id: "mine" });
    await until(() => status !== null);
    expect(status.level === "error" && status.msg.includes("not yet advertised"), "status", status);
  },
};

async function loop(ros, compression, check) {
  const messageType = "sensor_msgs/LaserScan";
  const topic = new Topic({ ros, name: `/checks/scan_${compression}`, messageType, compression });
  let received_on = null;
  topic.subscribe((message) => (received_on = message));
  topic.publish({ header: { frame_id: "é" }, ranges: [1.5, 2.5] });
  await until(() => received_on !== null);
  check(received_on);
}

async function follow(client) {
  let transform = null;
  client.subscribe("turtle1", (message) => (transform = message));
  await until(() => transform !== null);
  same(transform.translation, { x: 0, y: 0, z: 0 });
  same(transform.rotation, { x: 0, y: 0, z: 0, w: 1 });
  client.dispose();
}

async function run(name, check) {
  const ros = new Ros({ url });
  const lost = new Promise((_, reject) => ros.on("error", (error) => reject(new Failed(String(error)))));
  const late = sleep(15000).then(() => Promise.reject(new Failed("no answer within 15 s")));
  lost.catch(() => {});
  late.catch(() => {});
  try {
    await Promise.race([new Promise((resolve) => ros.on("connection", resolve)), lost, late]);
    await Promise.race([check(ros), lost, late]);
    return [name, null];
  } catch (error) {
    return [name, error instanceof Failed ? error.message : error.stack];
  } finally {
    ros.close();
  }
}

const results = await Promise.all(Object.entries(checks).map(([name, check]) => run(name, check)));
for (const result of results) console.log(JSON.stringify(result));
process.exit(0);
