/** Watches the robot's state and raises the alarms: words, sound, vibration. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type { LinkStatisticsSignal, RobotState } from "../robot/robot_state";
import { rememberedSwitch, type Keeper } from "../scene/stored_signals";
import type { Alarm } from "./alarm";
import { AlarmBell, alarmEdges } from "./alarm_edges";
import { alarmFacts } from "./alarm_facts";
import { alarmsOf } from "./alarm_rules";
import { AlarmSound, VIBRATIONS, type SoundState } from "./alarm_sound";

/** What the alarms need of the browser. */
export interface AlarmEnvironment {
  readonly now: () => number;
  /** Call again and again [ms]; the returned function ends it. */
  readonly every: (period: number, callback: () => void) => () => void;
  readonly sound: AlarmSound;
  readonly vibrate: (pattern: readonly number[]) => void;
  /** Where "muted" is kept; undefined where the browser keeps nothing. */
  readonly keeper: Keeper | undefined;
  /** Call once at each gesture until the returned function ends it. */
  readonly onGesture: (callback: () => void) => () => void;
}

/** How often the alarms are looked at [ms]; stale data must be said within 0.5 s of becoming so. */
const PERIOD = 100;

export class Alarms {
  private readonly current = signal<readonly Alarm[]>([]);
  private readonly spoken = signal<readonly Alarm[]>([]);
  private readonly sounding: Signal<SoundState>;
  private readonly bell = new AlarmBell();
  private readonly ends: (() => void)[] = [];
  private heardAt: number | undefined;
  private wasConnected = false;

  /** Whether the operator switched the sound off; kept by the browser. Words and vibration stay. */
  readonly muted: Signal<boolean>;

  /**
   * @param link Quality of the link; undefined before it is known.
   * @param tell Is told of each alarm that begins and ends, for the event list.
   */
  constructor(
    private readonly state: RobotState,
    private readonly link: LinkStatisticsSignal | undefined,
    private readonly tell: (alarm: Alarm, ended: boolean) => void,
    private readonly environment: AlarmEnvironment,
  ) {
    const { keeper, sound } = environment;
    this.muted = rememberedSwitch("farsteer.muted", false, keeper);
    this.sounding = signal(sound.state);
    this.ends.push(
      this.watchArrivals(),
      environment.every(PERIOD, () => { this.look(); }),
      environment.onGesture(() => {
        if (sound.state === "locked") {
          void sound.unlock().then((now) => { this.sounding.value = now; });
        }
      }),
    );
  }

  /** The alarms now, the gravest first. */
  get active(): ReadonlySignal<readonly Alarm[]> {
    return this.current;
  }

  /** The alarms with the words that they began with: for screen readers, which would read each new figure aloud. */
  get announced(): ReadonlySignal<readonly Alarm[]> {
    return this.spoken;
  }

  /** Whether the browser lets the page sound. */
  get sound(): ReadonlySignal<SoundState> {
    return this.sounding;
  }

  dispose(): void {
    for (const end of this.ends.splice(0)) {
      end();
    }
    void this.environment.sound.close();
  }

  private look(): void {
    const now = this.environment.now();
    this.wasConnected ||= this.state.connection.peek().phase === "open";
    const before = this.current.peek();
    const facts = alarmFacts(this.state, this.link?.peek(), now, this.heardAt, this.wasConnected);
    const after = alarmsOf(facts, new Set(before.map((alarm) => alarm.kind)));
    const edges = alarmEdges(before, after);
    if (!sameAlarms(before, after)) {
      this.current.value = after;
    }
    if (edges.raised.length + edges.ended.length > 0) {
      const known = this.spoken.peek();
      this.spoken.value = after.map((alarm) => known.find(({ kind }) => kind === alarm.kind) ?? alarm);
    }
    for (const alarm of edges.ended) {
      this.tell(alarm, true);
    }
    for (const alarm of edges.raised) {
      this.tell(alarm, false);
    }
    const due = this.bell.due(edges, after, now);
    if (due !== undefined) {
      this.environment.vibrate(VIBRATIONS[due]);
      if (!this.muted.peek()) {
        this.environment.sound.play(due);
      }
    }
    this.sounding.value = this.environment.sound.state;
  }

  /** Note when anything of the robot arrives; a change of any of these is an arrival. */
  private watchArrivals(): () => void {
    const { control, status, mapFromBase, odomFromBase, cloud, scan, attitude } = this.state;
    return effect(() => {
      const known = [control, status, mapFromBase, odomFromBase, cloud, scan, attitude].map((part) => part.value);
      if (known.some((value) => value !== undefined)) {
        this.heardAt = this.environment.now();
      }
    });
  }
}

function sameAlarms(a: readonly Alarm[], b: readonly Alarm[]): boolean {
  return a.length === b.length && a.every((alarm, i) => alarm.kind === b[i]?.kind && alarm.words === b[i].words);
}
