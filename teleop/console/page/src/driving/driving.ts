/** Drives the robot by whatever the person holds, and stops it whenever that cannot be known. */

import { signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type { Gear } from "../operating_data";
import type { RobotCommands } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import { drivingTexts as texts } from "../texts/driving";
import { blockage, type Blockage, type RobotView } from "./blockage";
import { joyChannel, velocityChannel, type DriveChannel } from "./drive_channel";
import { DriveLoop, type Sending } from "./drive_loop";
import type { DriveSource, SourceName, SourceReading } from "./drive_source";
import type { DrivingEnvironment, Joined } from "./driving_environment";
import { drivingStatus, handsIn, type DrivingStatus } from "./driving_status";
import { EmergencyStop } from "./emergency_stop";
import { MappingStore } from "./gamepad_mapping";
import { GamepadSource } from "./gamepad_source";
import { dialogOpen } from "./key_bindings";
import { KeyboardSource } from "./keyboard_source";
import { SleepWatch, watchPage, type Loss } from "./page_watch";
import { inOurWords } from "./robot_reasons";
import { setIfChanged } from "./set_if_changed";
import type { StepMotion } from "./step_motion";
import { StickSource } from "./stick_source";
import { TurnTaking } from "./turn_taking";

/** Why everything counts as released, and since when by the page's clock [ms]. */
export interface Stopped { readonly words: string; readonly at: number }

/** Period at which inputs are looked at [ms]; that of the browser's own gamepad polling. */
const LOOK = 16;

export class Driving {
  readonly gear: Signal<Gear>;
  readonly sending: ReadonlySignal<Sending | undefined>;
  readonly stoppedBecause: ReadonlySignal<Stopped | undefined>;
  readonly status: ReadonlySignal<DrivingStatus>;
  readonly plainConfirmed: ReadonlySignal<boolean>;
  /** Set while something else on the page uses the driving keys; they count as released then. */
  readonly keysElsewhere = signal(false);
  readonly estop: EmergencyStop;
  readonly turns: TurnTaking;
  readonly stick: StickSource;
  readonly pads: GamepadSource;
  /** Close what is open in front of the page; returns whether there was something, so that Escape does not stop. */
  onEscape: () => boolean = () => false;
  /** Steps that the robot drives by itself; they end with everything else. */
  steps: StepMotion | undefined;

  private readonly sent = signal<Sending | undefined>(undefined);
  private readonly stopped = signal<Stopped | undefined>(undefined);
  private readonly confirmed = signal(false);
  private readonly shown: Signal<DrivingStatus>;
  private readonly keyboard: KeyboardSource;
  private readonly loop: DriveLoop;
  private readonly sleep: SleepWatch;
  private readonly undo: (() => void)[] = [];
  private plainChannel: "velocity" | "joy" = "velocity";
  private focused = true;
  /** Whether a headset is worn: then it does not matter which window has the keys. */
  private worn = false;
  private checking = false;
  private controlAt = 0;

  constructor(
    private readonly commands: RobotCommands,
    private readonly state: RobotState,
    private readonly environment: DrivingEnvironment,
  ) {
    const { window, document } = environment;
    this.gear = environment.gear ?? signal<Gear>("normal");
    const [now, check] = [() => environment.now(), () => { this.check(); }];
    this.estop = new EmergencyStop(commands, state, now);
    this.turns = new TurnTaking(commands, state);
    this.sleep = new SleepWatch(now, () => environment.wallNow?.() ?? Date.now());
    this.keyboard = new KeyboardSource(window, document, now, {
      changed: check,
      lost: () => { this.lose("menu"); },
      stop: () => { this.stop(); },
      gear: (gear) => { this.gear.value = gear; },
      escape: () => { this.escape(); },
      driving: () => this.loop.driving || this.steps?.moves === true,
    });
    this.stick = new StickSource({ changed: check, lost: () => { this.lose("touch"); } });
    this.pads = new GamepadSource(environment.navigator, new MappingStore(() => window.localStorage), {
      lost: (why) => { this.lose(why); },
      estop: () => { this.emergencyStop(); },
      takeOver: () => {
        if (this.turns.turns.peek().driver !== "me") {
          void this.turns.request("takeOver");
        }
      },
    });
    this.loop = new DriveLoop([this.keyboard, this.stick, this.pads]);
    this.shown = signal(drivingStatus(this.view(), this.own(new Map())));
    [this.sending, this.stoppedBecause, this.plainConfirmed, this.status] = [this.sent, this.stopped, this.confirmed, this.shown];
    this.watch();
  }

  /** The page's clock [ms]. */
  now(): number {
    return this.environment.now();
  }

  /** Whether the deadman is held as far as the robot knows. */
  get held(): boolean { return this.loop.driving; }

  /** Drive a robot that nothing guards, as the person has confirmed. */
  confirmPlain(channel: "velocity" | "joy" = "velocity"): void {
    this.plainChannel = channel;
    this.releaseAll();
    this.confirmed.value = true;
  }

  /** Let something else drive as well: by default a headset, for as long as it is worn. */
  join(source: DriveSource, worn = true): Joined {
    const leave = this.loop.join(source);
    [this.worn, this.focused] = [this.worn || worn, this.focused || worn];
    return {
      lose: (loss) => { this.steps?.stop(); this.lose(loss); },
      leave: () => { this.worn = false; this.focused = this.environment.document.hasFocus(); this.lose("headset-left"); leave(); },
    };
  }

  /** Stop by a zero at once; whatever is held counts as released. */
  stop(): void {
    this.stopped.value = undefined;
    this.steps?.stop();
    this.releaseAll();
  }

  /** Stop, and latch the robot's e-stop; a robot without one is driven no more until that is confirmed again. */
  emergencyStop(): void {
    this.stop();
    if (this.state.dialect.peek() === "plain") {
      this.confirmed.value = false;
      this.stopped.value = { words: texts.plainStopped, at: this.environment.now() };
    } else {
      this.loop.fallSilent();
      this.estop.press();
    }
  }

  dispose(): void {
    this.releaseAll();
    for (const undo of this.undo) {
      undo();
    }
    this.keyboard.dispose();
    this.estop.dispose();
  }

  private watch(): void {
    const { window, document } = this.environment;
    const check = () => { this.check(); };
    const timer = setInterval(check, LOOK);
    const listening = new AbortController();
    const options = { signal: listening.signal, capture: true };
    for (const name of ["focus", "keydown", "pointerdown"]) {
      window.addEventListener(name, () => { this.focused = true; }, options);
    }
    window.addEventListener("gamepaddisconnected", check, options);
    this.undo.push(
      () => { clearInterval(timer); listening.abort(); },
      watchPage(window, document, (loss) => {
        this.focused = this.focused && (this.worn || loss !== "blurred");
        this.lose(loss);
      }),
      this.state.control.subscribe(() => { this.controlAt = this.environment.now(); check(); }),
      this.state.connection.subscribe(check),
      this.state.session.subscribe(check),
      this.state.dialect.subscribe((dialect) => {
        this.confirmed.value = this.confirmed.peek() && dialect !== "farsteer";
        check();
      }),
      this.state.run.subscribe(() => { this.confirmed.value = false; }),
    );
  }

  private escape(): void {
    if (this.onEscape() || dialogOpen(this.environment.document)) {
      return; // the browser itself closes a dialog
    }
    if (this.estop.resetAsked.peek()) {
      this.estop.cancelReset();
    } else {
      this.emergencyStop();
    }
  }

  /** Look at everything, and send what is due. */
  private check(): void {
    if (this.checking) {
      return;
    }
    this.checking = true;
    try {
      this.look(this.environment.now());
    } finally {
      this.checking = false;
    }
  }

  private look(now: number): void {
    if (this.sleep.slept()) {
      this.lose("slept");
    }
    if (this.environment.document.visibilityState === "hidden") {
      this.lose("hidden");
    }
    this.loop.poll(now);
    if (this.keysElsewhere.peek()) {
      this.keyboard.release();
    }
    if (!this.focused) {
      this.releaseAll();
    }
    const blocked = blockage(this.view());
    if (blocked !== undefined) {
      this.block(blocked);
    }
    this.command(now);
    this.show();
  }

  private command(now: number): void {
    const control = this.state.dialect.peek() === "farsteer" ? this.state.control.peek() : undefined;
    const result = this.loop.step(now, this.channel(), this.gear.peek(), control);
    if (result === "unsent") {
      this.lose("unsent");
    } else if (result === "refused") {
      this.lose("not-listening", inOurWords(control?.reason ?? "", this.state.session.peek()?.name));
    } else if (result === "began") {
      this.stopped.value = undefined;
    }
  }

  private channel(): DriveChannel {
    const plain = this.state.dialect.peek() === "plain" && this.plainChannel === "velocity";
    return plain ? velocityChannel(this.commands) : joyChannel(this.commands);
  }

  /** Count what is held as released, since the robot cannot be driven. */
  private block(blocked: Blockage): void {
    const losses: Partial<Record<Blockage, Loss>> = { connecting: "connection", lost: "connection", refusedConnection: "connection", silent: "silent", others: "taken" };
    const loss = losses[blocked];
    if (this.loop.driving && loss !== undefined) {
      this.lose(loss);
    } else {
      this.releaseAll();
    }
    if (blocked === "estop") {
      this.loop.fallSilent();
    }
  }

  /** Count everything as released, and say why if something was held. */
  private lose(loss: Loss, reason = ""): void {
    const held = this.loop.driving || [...this.loop.read().values()].some((reading) => reading.active);
    this.releaseAll();
    if (held) {
      this.stopped.value = { words: texts.lostWords(loss, reason), at: this.environment.now() };
    }
    this.show();
  }

  private releaseAll(): void {
    this.loop.releaseAll(this.environment.now());
  }

  private show(): void {
    setIfChanged(this.sent, this.loop.sending);
    setIfChanged(this.shown, drivingStatus(this.view(), this.own(this.loop.read())));
  }

  private view(): RobotView {
    const { connection, dialect, session, control } = this.state;
    return {
      connection: connection.peek(),
      dialect: dialect.peek(),
      session: session.peek(),
      control: control.peek(),
      controlAge: this.environment.now() - this.controlAt,
      plainConfirmed: this.confirmed.peek(),
    };
  }

  private own(readings: ReadonlyMap<SourceName, SourceReading>) {
    const pads = this.pads.pads.peek();
    return {
      driving: this.loop.driving,
      ...handsIn([...readings.values()]),
      unmapped: pads.length > 0 && !pads.some(({ mapped }) => mapped),
      focused: this.focused,
      elsewhere: this.keysElsewhere.peek(),
      thumbs: this.environment.thumbs?.() ?? false,
      moving: this.steps?.moves ?? false,
      stopped: this.stopped.peek()?.words,
    };
  }
}
