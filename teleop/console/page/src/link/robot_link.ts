/** The page's link to a robot: brings its state in, takes commands out, and comes back by itself. */

import { batch, signal, type ReadonlySignal } from "@preact/signals";
import type { CameraCommands, StepCommands } from "../robot/robot_actions";
import type { RobotCommands } from "../robot/robot_commands";
import { betterReading, forgetRun, type LinkStatistics, type RobotState } from "../robot/robot_state";
import { linkTexts } from "../texts/link";
import type { MapInfo, Severity } from "../values";
import { CameraPictures } from "./camera_pictures";
import { Complaints } from "./complaints";
import { connectionReporter } from "./connection_events";
import { httpAddress } from "./diagnosis";
import { browserParts, type LinkParts } from "./link_parts";
import { LinkProbe } from "./link_probe";
import { LinkRecorder } from "./link_statistics";
import { PlaceLoader } from "./place_loader";
import { messageKinds, type MessageKinds } from "./message_kinds";
import { MessageIntake } from "./message_intake";
import { plainStreams } from "./plain_streams";
import { RobotCommander } from "./robot_commander";
import { RobotPicture } from "./robot_picture";
import { ARM_TOPIC, robotStreams } from "./robot_streams";
import { robotWire, type RobotWire } from "./robot_wire";
import { RosbridgeConnection } from "./rosbridge_connection";
import type { RosbridgeClient } from "./rosbridge_client";
import { type NewRun, RunWatch } from "./run_watch";
import { ServiceCalls } from "./service_calls";
import { Subscriptions } from "./subscriptions";
import { TopicList } from "./topic_list";

/** Without a pose for so long, the scan is shown instead [ms]. */
const POSE_MISSING = 1000;
const TICK = 500;
/** When a lost connection is worth another attempt at once. */
const AWAKE = ["online", "pageshow", "focus"] as const;

export class RobotLink {
  /** What the page can ask of the robot. */
  readonly commands: RobotCommands & StepCommands & CameraCommands;
  /** The robot by the names of its topics, for parts that are loaded later. */
  readonly wire: RobotWire;
  readonly #statistics = signal<LinkStatistics>(new LinkRecorder(0).snapshot([], 0, 0));
  readonly #state: RobotState;
  readonly #events: (severity: Severity, words: string) => void;
  readonly #parts: LinkParts;
  readonly #calls = new ServiceCalls();
  readonly #subscriptions = new Subscriptions();
  readonly #recorder: LinkRecorder;
  readonly #runs = new RunWatch();
  readonly #picture: RobotPicture;
  readonly #pictures = new CameraPictures();
  readonly #intake: MessageIntake;
  readonly #kinds: MessageKinds;
  readonly #place: PlaceLoader;
  readonly #commander: RobotCommander;
  readonly #connection: RosbridgeConnection;
  readonly #probe: LinkProbe;
  readonly #topics: TopicList;
  #token: string;
  readonly #cameras: boolean;
  #lean: boolean;
  #wantsScan = true;
  #runsSeen = 0;
  #timer: ReturnType<typeof setInterval> | undefined;
  readonly #hurry = (): void => {
    this.#connection.hurry();
  };

  /**
   * @param address Address of the robot, such as `ws://192.168.1.7:9090`.
   * @param options Token to log in with, the person's name, whether to begin with the lean picture, and whether cameras are shown.
   * @param state Filled with what is known of the robot.
   * @param events Takes lines for the event list.
   * @param parts The browser's own, unless a test gives others.
   */
  constructor(
    address: string,
    options: { readonly token?: string; readonly lean?: boolean; readonly name?: () => string; readonly pictures?: boolean },
    state: RobotState,
    events: (severity: Severity, words: string) => void,
    parts: LinkParts = browserParts(address),
  ) {
    this.#state = state;
    this.#events = events;
    this.#parts = parts;
    this.#token = options.token ?? "";
    [this.#lean, this.#cameras] = [options.lean ?? false, options.pictures ?? true];
    this.#recorder = new LinkRecorder(parts.now());
    this.#picture = new RobotPicture(state);
    const complaints = new Complaints((source, complaint, count) => {
      const { complaint: first, repeated } = linkTexts.events;
      events("warning", count === 0 ? first(source, complaint) : repeated(source, complaint, count));
    }, parts.now);
    const complain = (source: string, complaint: string): void => {
      complaints.add(source, complaint);
    };
    this.#intake = new MessageIntake({
      now: parts.now,
      complaints,
      counted: (topic, now) => {
        this.#recorder.message(topic, now);
      },
      stamped: (topic, stamp) => {
        this.#begin(this.#runs.stamp(topic, stamp));
        this.#recorder.saw(topic, stamp, parts);
        state.time.value = betterReading(state.time.peek(), { stamp, receivedAt: parts.now() });
      },
    });
    this.#kinds = messageKinds({
      state,
      picture: this.#picture,
      pictures: this.#pictures,
      mapInfo: (info) => {
        this.#mapInfo(info);
      },
      control: () => {
        this.#topics.isRobot();
      },
      complain,
    });
    this.#place = new PlaceLoader({
      ...parts,
      http: httpAddress(address),
      read: parts.readMap,
      token: () => this.#token,
      state,
      events,
    });
    this.#topics = new TopicList(this.#calls, complain, () => {
      this.#want();
    });
    const report = connectionReporter(address, events);
    this.#connection = new RosbridgeConnection(address, this.#token, parts, {
      opened: (client) => {
        this.#opened(client);
      },
      closed: () => {
        this.#closed();
      },
      changed: (connection) => {
        report(connection);
        state.connection.value = connection;
      },
      received: (bytes) => {
        this.#recorder.frame(bytes, parts.now());
      },
      status: (level, words) => {
        if (level === "error") {
          complain("robot", words);
        }
      },
      unreadable: () => {
        complain("robot", linkTexts.events.unreadable);
      },
    });
    this.#commander = new RobotCommander({
      calls: this.#calls,
      state,
      flows: () => this.#connection.flows,
      authenticate: (token) => {
        this.#authenticate(token);
      },
      typeOf: (topic) => this.#topics.types?.get(topic),
      epoch: parts.epoch,
    });
    this.commands = this.#commander;
    this.wire = robotWire(this.#intake, this.#subscriptions, this.#calls, this.#commander);
    this.#probe = new LinkProbe(this.#calls, this.#recorder, state, parts.now, complain, options.name);
  }

  /** How good the connection is, renewed twice a second. */
  get statistics(): ReadonlySignal<LinkStatistics> {
    return this.#statistics;
  }

  /** Connect, and stay connected. */
  start(): void {
    this.#connection.start();
    this.#timer = setInterval(() => {
      this.#tick();
    }, TICK);
    for (const event of AWAKE) {
      this.#parts.awake.addEventListener(event, this.#hurry);
    }
  }

  stop(): void {
    clearInterval(this.#timer);
    for (const event of AWAKE) {
      this.#parts.awake.removeEventListener(event, this.#hurry);
    }
    this.#place.stop();
    this.#pictures.clear();
    this.#connection.stop();
  }

  /** Take the lean picture, of at most 256 kbit/s, or the whole one. */
  setLean(lean: boolean): void {
    this.#lean = lean;
    this.#want();
  }

  #opened(client: RosbridgeClient): void {
    this.#recorder.reset(this.#parts.now());
    this.#calls.attach(client);
    this.#commander.attach(client);
    this.#subscriptions.attach(client);
    this.#probe.reset();
    void this.#topics.ask();
    this.#probe.tick(this.#parts.now());
    this.#place.again();
  }

  /** Show the map's points as well as its surfaces. */
  wantPoints(): void {
    this.#place.wantPoints();
  }

  #closed(): void {
    this.#calls.detach();
    this.#commander.detach();
    this.#subscriptions.detach();
    this.#state.session.value = undefined;
  }

  #authenticate(token: string): void {
    this.#token = token;
    this.#connection.authenticate(token);
  }

  #mapInfo(info: MapInfo): void {
    const news = this.#runs.mapInfo(info);
    this.#begin(news, info);
    this.#state.mapInfo.value = info;
    this.#place.load(info);
  }

  /** Forget what is void, and say so. */
  #begin(news: NewRun | undefined, info = this.#state.mapInfo.peek()): void {
    if (news === undefined) {
      return;
    }
    this.#runsSeen += 1;
    const identity = `${info?.run ?? ""}:${this.#runsSeen}`;
    batch(() => {
      if (news !== "first") {
        this.#picture.clear();
        forgetRun(this.#state);
        const { newRun, otherMap, clockBack } = linkTexts.events;
        const words = { run: newRun, map: otherMap(info?.name ?? ""), clock: clockBack }[news];
        this.#events("warning", words);
      }
      this.#state.run.value = identity;
    });
    if (news !== "first") {
      this.#subscriptions.renewLatched();
    }
  }

  /** Listen to what the robot is known to have. */
  #want(): void {
    const { dialect, types } = this.#topics;
    if (dialect === "unknown") {
      return;
    }
    if (this.#state.dialect.peek() !== dialect) {
      if (this.#state.dialect.peek() !== "unknown") {
        this.#runs.clear();
        this.#picture.clear();
        forgetRun(this.#state);
      }
      this.#state.dialect.value = dialect;
      if (dialect === "plain") {
        this.#events("warning", linkTexts.events.plain);
      }
    }
    this.#state.arm.value = dialect === "farsteer" && types?.has(ARM_TOPIC) === true;
    this.#subscriptions.want(
      dialect === "farsteer"
        ? robotStreams(this.#intake, this.#kinds, { lean: this.#lean, scan: this.#wantsScan, topics: types })
        : plainStreams(this.#intake, this.#kinds, types, this.#cameras),
    );
  }

  #tick(): void {
    const now = this.#parts.now();
    this.#recorder.ticked(TICK, now);
    const pose = this.#state.mapFromBase.peek();
    const wantsScan = pose === undefined || now - pose.receivedAt > POSE_MISSING;
    if (wantsScan !== this.#wantsScan) {
      this.#wantsScan = wantsScan;
      this.#want();
    }
    if (this.#calls.connected) {
      this.#probe.tick(now);
      this.#topics.tick(now);
    }
    this.#statistics.value = this.#recorder.snapshot(this.#subscriptions.topics, this.#connection.silence, now);
  }
}
