/** The WebAssembly module of a program: from settings in SI to samples and metrics. */

import type { Program } from "./content";
import type { Values } from "./settings";
import { plain } from "./shown";

/** What a module exports: see `ppafo.page.wasm`. */
interface Exports extends WebAssembly.Exports {
  readonly memory: WebAssembly.Memory;
  readonly reserve: (bytes: number) => number;
  readonly release: (from: number) => void;
  readonly check: (settings: number) => number;
  readonly samples: (settings: number) => number;
  readonly run: (settings: number, columns: number, metrics: number, good: number) => number;
  readonly ensemble: (
    settings: number,
    runs: number,
    metrics: number,
    ended: number,
    channel: number,
    every: number,
    places: number,
    traces: number,
  ) => number;
}

export type Ending = "completed" | "diverged" | "too many parts" | "refused" | "no memory";
const ENDINGS: readonly Ending[] = ["completed", "diverged", "too many parts", "refused", "no memory"];

export interface Run {
  readonly ending: Ending;
  /** Time [s] and channels of the program in SI, as long as the run went. */
  readonly time: Float64Array;
  readonly channels: ReadonlyMap<string, Float64Array>;
  readonly metrics: ReadonlyMap<string, number>;
  /** What is wrong with the settings, in one line; empty where nothing is. */
  readonly fault: string;
}

export interface Ensemble {
  /** Metrics of the program, run after run. */
  readonly metrics: Float64Array;
  /** 0 where a run was completed. */
  readonly ended: Int32Array;
  /** Samples of all channels, run after run, one channel after the other; empty where none were wanted. */
  readonly traces: Float64Array;
}

const NUMBER = 8;
/** What a module takes in the place of a channel. */
const [NO_CHANNEL, ALL_CHANNELS] = [-1, -2];
/** What a module can be asked for at once. */
const MOST_BYTES = 2 ** 31 - 1;
/** Angle [rad] by which a vane may be beyond a stop, as in Python. */
const SLACK = 1e-9;

/** Whether the browser has the 128-bit vectors that the modules are made of. */
export function hasVectors(): boolean {
  return (
    typeof WebAssembly === "object" &&
    WebAssembly.validate(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11]))
  );
}

export class Engine {
  private constructor(
    private readonly program: Program,
    private readonly exports: Exports,
  ) {}

  static async of(program: Program, bytes: ArrayBuffer): Promise<Engine> {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Engine(program, instance.exports as Exports);
  }

  /** One run with all its samples. */
  run(values: Values): Run {
    return this.aside(() => {
      const settings = this.written(Float64Array.from(this.program.settings, (setting) => values.get(setting.key) ?? setting.value));
      const fault = this.faultOf(settings);
      if (fault !== "") return failedRun("refused", fault);
      const { exports, program } = this;
      const count = exports.samples(settings);
      const rows = program.channels.length + 1;
      if (count === 0 || count * rows * NUMBER > MOST_BYTES) return failedRun("no memory", ENDING_TEXTS["no memory"]);
      const columns = exports.reserve(count * rows * NUMBER);
      const metrics = exports.reserve(program.metrics.length * NUMBER);
      const good = exports.reserve(NUMBER);
      if (columns === 0 || metrics === 0 || good === 0) return failedRun("no memory", ENDING_TEXTS["no memory"]);
      const ending = ENDINGS[exports.run(settings, columns, metrics, good)] ?? "refused";
      const { buffer } = exports.memory;
      const done = new Int32Array(buffer, good, 1)[0] ?? 0;
      const table = new Float64Array(buffer, columns, count * rows).slice();
      const found = new Float64Array(buffer, metrics, program.metrics.length);
      const read = new Map(program.metrics.map((metric, place) => [metric.name, found[place] ?? NaN]));
      // What comes after a fall is not counted.
      const fallen = table.subarray(0, done).findIndex((at) => at >= (read.get("fall_time") ?? NaN));
      const length = fallen > 0 ? fallen : done;
      const column = (place: number) => table.subarray(place * count, place * count + length);
      const beyond = beyondStops(program, values, column(0), column(1 + program.channels.findIndex(({ name }) => name === "angle")));
      if (beyond !== "") return failedRun("refused", beyond);
      return {
        ending,
        time: column(0),
        channels: new Map(program.channels.map((channel, place) => [channel.name, column(place + 1)])),
        metrics: read,
        fault: ENDING_TEXTS[ending],
      };
    });
  }

  /** Many runs, settings run after run, with their metrics, and of each so many samples of all channels. */
  runMany(rows: Float64Array, every: number, places: number): Ensemble {
    return this.aside(() => {
      const { exports, program } = this;
      const runs = rows.length / program.settings.length;
      const settings = this.written(rows);
      const wanted = runs * program.channels.length * places;
      const metrics = exports.reserve(runs * program.metrics.length * NUMBER);
      const ended = exports.reserve(runs * 4);
      const traces = exports.reserve(Math.max(1, wanted) * NUMBER);
      const channel = places > 0 ? ALL_CHANNELS : NO_CHANNEL;
      const isDone = traces !== 0 && exports.ensemble(settings, runs, metrics, ended, channel, every, places, traces) === 0;
      if (!isDone) throw new RangeError("these runs need more memory than this page has");
      const { buffer } = exports.memory;
      return {
        metrics: new Float64Array(buffer, metrics, runs * program.metrics.length).slice(),
        ended: new Int32Array(buffer, ended, runs).slice(),
        traces: new Float64Array(buffer, traces, wanted).slice(),
      };
    });
  }

  private written(numbers: Float64Array): number {
    const place = this.exports.reserve(numbers.length * NUMBER);
    new Float64Array(this.exports.memory.buffer, place, numbers.length).set(numbers);
    return place;
  }

  private faultOf(settings: number): string {
    const found = this.exports.check(settings);
    if (found < 0) return "";
    const known = this.program.settings;
    const key = known[found % known.length]?.key ?? "";
    if (found < known.length) return `${key} is out of range, or contradicts another setting`;
    return `${key} needs a different compiled program, which this page does not contain: a setting that is 0 there has to stay 0, one that is not has to stay above 0, and samples have to fall on steps (run.output_interval, run.step, controller.period)`;
  }

  /** Memory that is taken meanwhile is given back. */
  private aside<T>(work: () => T): T {
    const before = this.exports.reserve(0);
    try {
      return work();
    } finally {
      this.exports.release(before);
    }
  }
}

/** What a scenario file may not have: a vane that is led beyond its stops. */
function beyondStops({ document }: Program, values: Values, time: Float64Array, angle: Float64Array): string {
  const { motion } = document;
  if (typeof motion !== "object" || motion === null || !("kind" in motion) || motion.kind !== "prescribed") return "";
  const [low, high] = [values.get("actuator.angle_min") ?? -Infinity, values.get("actuator.angle_max") ?? Infinity];
  const place = angle.findIndex((at) => at < low - SLACK || at > high + SLACK);
  return place < 0 ? "" : `motion.profile leaves the stops of the device at ${plain(time[place] ?? 0)} s`;
}

const ENDING_TEXTS: Readonly<Record<Ending, string>> = {
  completed: "",
  diverged: "the run diverged: try a smaller step; check inertia, volumes and areas",
  "too many parts": "a step was cut into 100,000 parts and was still not done: check inertia, volumes and areas",
  refused: "the settings were refused",
  "no memory": "the run has too many samples for this page",
};

/** A run that did not come about, and why. */
export function failedRun(ending: Ending, fault: string): Run {
  return { ending, time: new Float64Array(), channels: new Map(), metrics: new Map(), fault };
}
