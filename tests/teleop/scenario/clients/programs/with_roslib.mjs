// roslib as it is published, by the name under which it is installed; version 2 drives by /joy, version 1 by /cmd_vel.

const name = process.argv[2];
const published = await import(name);
const { Ros, Topic, Message = class { constructor(fields) { Object.assign(this, fields); } } } = published.default ?? published;
const byJoystick = process.argv[3] === "joy";

const token = process.env.FARSTEER_TOKEN;
const ros = new Ros({ url: process.env.FARSTEER_URL + (token ? `/?token=${token}` : "") });
const topic = (name, messageType, more) => new Topic({ ros, name, messageType, ...more });

const commands = byJoystick ? topic("/joy", "sensor_msgs/Joy") : topic("/cmd_vel", "geometry_msgs/Twist");
let state = null;
let control = null;

topic("/scenario/state", "farsteer_msgs/ScenarioState").subscribe((message) => {
  state = message;
  if (state.phase !== "over") return;
  console.log(state.ending);
  process.exit(state.goals_reached === state.goals ? 0 : 1);
});

topic("/teleop/state", "farsteer_msgs/TeleopState").subscribe((message) => {
  control = message;
});

topic("/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", { compression: "cbor" }).subscribe(({ pose }) => {
  if (state === null || control === null) return;
  const { position, orientation } = pose.pose;
  const heading = 2 * Math.atan2(orientation.z, orientation.w);
  const bearing = Math.atan2(state.next_y - position.y, state.next_x - position.x);
  const off = Math.atan2(Math.sin(bearing - heading), Math.cos(bearing - heading));
  // A robot that has stopped by itself, as after a pause of a busy machine, wants a hand at rest first.
  const forward = control.armed && Math.abs(off) < 0.5 ? 0.5 : 0;
  const turn = control.armed ? Math.max(-0.6, Math.min(0.6, 1.5 * off)) : 0;
  if (!byJoystick) {
    commands.publish(new Message({ linear: { x: forward, y: 0, z: 0 }, angular: { x: 0, y: 0, z: turn } }));
    return;
  }
  const stamp = { sec: Math.floor(Date.now() / 1000), nanosec: (Date.now() % 1000) * 1e6 };
  const axes = [turn / 1.2, forward / 0.5];
  commands.publish(new Message({ header: { stamp, frame_id: "" }, axes, buttons: [0, 0, 0, 0, 1, 0] }));
});

ros.on("error", (error) => { console.error(String(error)); process.exit(2); });
