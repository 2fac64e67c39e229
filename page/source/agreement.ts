/** How far a run is from a recording, by the rules of `ppafo validate`: common delay, weights by time, full ranges. */

import { ATMOSPHERE, atmosphereOf, type Values } from "./settings";
import { InputError } from "./units";

/** Samples over time; channels in SI. */
export interface Samples {
  readonly time: Float64Array;
  readonly channels: ReadonlyMap<string, Float64Array>;
}

/** A recording. */
export interface Overlay extends Samples {
  /** Channels that were recorded in gauge, and are: beside each run they count from its atmosphere. */
  readonly gauges: ReadonlySet<string>;
}

/** A column of a table, the channel that it is, and the way of its numbers to SI. */
export interface RecordedColumn {
  readonly place: number;
  readonly channel: string;
  readonly factor: number;
  readonly offset: number;
  readonly isGauge: boolean;
}

export interface ChannelError {
  readonly channel: string;
  readonly rms: number;
  readonly bias: number;
  readonly fraction: number;
  readonly delay: number;
  /** Whether the best delay is the longest that is tried; none is taken out then. */
  readonly isAtLimit: boolean;
  /** Time [s] up to which the recording is compared, where it goes on after the run; else null. */
  readonly cutAt: number | null;
}

/** One channel of both: measured values at their times, the model's at its own, and the full range. */
interface Curve {
  readonly times: Float64Array;
  readonly values: Float64Array;
  readonly modelTimes: Float64Array;
  readonly modelValues: Float64Array;
  readonly fullRange: number;
}

interface Delay {
  readonly value: number;
  readonly isAtLimit: boolean;
}

interface ChannelAgreement {
  readonly rms: number;
  readonly bias: number;
  readonly largest: number;
  readonly fraction: number;
}

export const LONGEST_DELAY = 0.02;
export const ACCEPTABLE_FRACTION = 0.1;
const SHIFTS = 81;
const MOST_SAMPLES = 4000;
const LEAST_GAIN = 25;
const SMALLEST_GAIN = 1e-12;
const RESOLUTION = 0.02;
const GOLDEN = 0.6180339887498949;
const REFINEMENTS = 30;
const AT_LIMIT = 0.99;
const LONGEST_WEIGHT = 3;
const MOST_DRAWN = 8000;
const ALONE = ["angle", "pressure_1", "pressure_2"];
const COMPARED = ["angle", "pressure_1", "pressure_2", "pressure_difference", "torque"] as const;

/** The recording of a table. Throws InputError, with one line, where its clock does not go on. */
export function recordingOf(table: readonly Float64Array[], columns: readonly RecordedColumn[]): Overlay {
  const channels = new Map(
    columns.map(({ place, channel, factor, offset }) => [channel, (table[place] ?? new Float64Array()).map((value) => value * factor + offset)]),
  );
  const time = channels.get("time") ?? new Float64Array();
  for (let place = 1; place < time.length; place += 1) {
    if (!((time[place] ?? 0) > (time[place - 1] ?? 0))) throw new InputError(`row ${place + 1}: the clock stands still or goes backwards`);
  }
  channels.delete("time");
  return { time, channels, gauges: new Set(columns.filter(({ isGauge }) => isGauge).map(({ channel }) => channel)) };
}

/** As much of a recording as a plot can show. */
export function drawnOf({ time, channels, gauges }: Overlay): Overlay {
  const step = Math.max(1, Math.floor(time.length / MOST_DRAWN));
  const kept = (values: Float64Array) => Float64Array.from({ length: Math.ceil(values.length / step) }, (_, place) => values[place * step] ?? 0);
  return { time: kept(time), channels: new Map([...channels].map(([name, values]) => [name, kept(values)])), gauges };
}

/** Errors of one run against a recording, channel by channel. */
export function compare(whole: Overlay, run: Samples, values: Values, isHeld: boolean): ChannelError[] {
  const end = run.time.at(-1) ?? 0;
  const recorded = absolute(upTo(whole, end), whole.gauges, atmosphereOf(values));
  if (run.time.length < 2 || recorded.time.length < 2) return [];
  const cutAt = recorded.time.length < whole.time.length ? end : null;
  const measured = withDifference(recorded.channels);
  const model = withDifference(run.channels);
  const ranges = fullRanges(recorded, values);
  const names = COMPARED.filter((name) => measured.has(name) && model.has(name) && !(name === "angle" && isHeld));
  const curves = new Map(
    names.map((name): [string, Curve] => [
      name,
      { times: recorded.time, values: measured.get(name)!, modelTimes: run.time, modelValues: model.get(name)!, fullRange: ranges[name] ?? 1 },
    ]),
  );
  const chosen = names.filter((name) => ALONE.includes(name));
  const together = (chosen.length > 0 ? chosen : names.slice(0, 1)).map((name) => curves.get(name)!);
  const delay = estimateDelay(together);
  const correction = delay.isAtLimit ? 0 : delay.value;
  const weights = sampleWeights(recorded.time);
  return names.map((name) => ({ channel: name, delay: correction, isAtLimit: delay.isAtLimit, cutAt, ...channelAgreement(curves.get(name)!, correction, weights) }));
}

/** A recording up to a time [s], with what rounding adds to it. */
function upTo({ time, channels }: Samples, end: number): Samples {
  const after = time.findIndex((at) => at > end + 1e-9);
  if (after < 0) return { time, channels };
  return { time: time.subarray(0, after), channels: new Map([...channels].map(([name, values]) => [name, values.subarray(0, after)])) };
}

/** Gauge pressures as absolute ones. */
function absolute({ time, channels }: Samples, gauges: ReadonlySet<string>, atmosphere: number): Samples {
  return { time, channels: new Map([...channels].map(([name, values]) => [name, gauges.has(name) ? values.map((value) => value + atmosphere) : values])) };
}

function fullRanges(recorded: Samples, values: Values): Readonly<Record<string, number>> {
  const value = (key: string) => values.get(key) ?? 0;
  const supply = recorded.channels.get("supply_pressure");
  const gauge = (supply === undefined ? Math.max(value("supply.pressure"), value("supply.dorsiflexion_pressure")) : median(supply)) - value(ATMOSPHERE);
  return {
    angle: value("actuator.angle_max") - value("actuator.angle_min"),
    pressure_1: gauge,
    pressure_2: gauge,
    pressure_difference: 2 * gauge,
    torque: 2 * gauge * value("actuator.torque_constant"),
  };
}

function withDifference(channels: ReadonlyMap<string, Float64Array>): ReadonlyMap<string, Float64Array> {
  const [first, second] = [channels.get("pressure_1"), channels.get("pressure_2")];
  if (first === undefined || second === undefined) return channels;
  return new Map([...channels, ["pressure_difference", first.map((value, place) => value - (second[place] ?? 0))]]);
}

/** Errors with the model shifted by a delay [s]. */
function channelAgreement(curve: Curve, delay: number, weights: Float64Array): ChannelAgreement {
  const model = shifted(curve, delay);
  let [squares, bias, largest] = [0, 0, 0];
  for (let place = 0; place < model.length; place += 1) {
    const error = (model[place] ?? 0) - (curve.values[place] ?? 0);
    squares += (weights[place] ?? 0) * error * error;
    bias += (weights[place] ?? 0) * error;
    if (Math.abs(error) > Math.abs(largest)) largest = error;
  }
  const rms = Math.sqrt(squares);
  return { rms, bias, largest, fraction: rms / curve.fullRange };
}

/** The delay [s] that brings the channels together best; 0 where none can be seen. */
function estimateDelay(curves: readonly Curve[], limit = LONGEST_DELAY): Delay {
  const first = curves[0];
  if (limit <= 0 || first === undefined) return { value: 0, isAtLimit: false };
  const thinned = curves.map(thin);
  const shifts = Array.from({ length: SHIFTS }, (_, place) => -limit + (2 * limit * place) / (SHIFTS - 1));
  const costs = shifts.map((shift) => cost(thinned, shift));
  const best = costs.indexOf(Math.min(...costs));
  const value = minimum(thinned, shifts[Math.max(0, best - 1)] ?? 0, shifts[Math.min(SHIFTS - 1, best + 1)] ?? 0);
  if (Math.abs(value) < RESOLUTION * median(differences(first.times)) || !isSignificant(thinned, value)) {
    return { value: 0, isAtLimit: false };
  }
  return { value, isAtLimit: Math.abs(value) > AT_LIMIT * limit };
}

function isSignificant(curves: readonly Curve[], delay: number): boolean {
  const later = cost(curves, delay);
  const gain = cost(curves, 0) - later;
  const samples = curves.reduce((sum, curve) => sum + curve.times.length, 0);
  return gain > SMALLEST_GAIN && gain * samples > LEAST_GAIN * later;
}

function minimum(curves: readonly Curve[], from: number, to: number): number {
  let [low, high] = [from, to];
  let [left, right] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
  let [costLeft, costRight] = [cost(curves, left), cost(curves, right)];
  for (let round = 0; round < REFINEMENTS; round += 1) {
    if (costLeft <= costRight) {
      [high, right, costRight] = [right, left, costLeft];
      left = high - GOLDEN * (high - low);
      costLeft = cost(curves, left);
    } else {
      [low, left, costLeft] = [left, right, costRight];
      right = low + GOLDEN * (high - low);
      costRight = cost(curves, right);
    }
  }
  return 0.5 * (low + high);
}

function cost(curves: readonly Curve[], delay: number): number {
  let sum = 0;
  for (const curve of curves) {
    const model = shifted(curve, delay);
    let squares = 0;
    for (let place = 0; place < model.length; place += 1) {
      const error = ((model[place] ?? 0) - (curve.values[place] ?? 0)) / curve.fullRange;
      squares += error * error;
    }
    sum += squares / model.length;
  }
  return sum / curves.length;
}

function thin(curve: Curve): Curve {
  const step = Math.ceil(curve.times.length / MOST_SAMPLES);
  const kept = (values: Float64Array) => values.filter((_, place) => place % step === 0);
  return { ...curve, times: kept(curve.times), values: kept(curve.values) };
}

/** The model, a delay [s] later, at the times of the measurement; before and after its own it stands still. */
function shifted(curve: Curve, delay: number): Float64Array {
  return interpolated(curve.times, delay, curve.modelTimes, curve.modelValues);
}

/** Values of a curve at `times - delay`, which grow, by straight lines. */
export function interpolated(times: Float64Array, delay: number, knots: Float64Array, values: Float64Array): Float64Array {
  const found = new Float64Array(times.length);
  const last = knots.length - 1;
  let below = 0;
  for (let place = 0; place < times.length; place += 1) {
    const time = (times[place] ?? 0) - delay;
    while (below < last - 1 && (knots[below + 1] ?? 0) <= time) below += 1;
    const [x0, x1] = [knots[below] ?? 0, knots[below + 1] ?? 0];
    const [y0, y1] = [values[below] ?? 0, values[below + 1] ?? 0];
    if (time <= (knots[0] ?? 0)) found[place] = values[0] ?? 0;
    else if (time >= (knots[last] ?? 0)) found[place] = values[last] ?? 0;
    else found[place] = ((y1 - y0) / (x1 - x0)) * (time - x0) + y0;
  }
  return found;
}

/** Fraction of the time for which each sample speaks, by the trapezoidal rule; gaps are not counted. */
function sampleWeights(times: Float64Array): Float64Array {
  const intervals = differences(times);
  const most = LONGEST_WEIGHT * median(intervals);
  const weights = new Float64Array(times.length);
  let sum = 0;
  intervals.forEach((interval, place) => {
    const counted = Math.min(interval, most);
    weights[place] = (weights[place] ?? 0) + 0.5 * counted;
    weights[place + 1] = (weights[place + 1] ?? 0) + 0.5 * counted;
    sum += counted;
  });
  return weights.map((weight) => weight / sum);
}

function differences(times: Float64Array): Float64Array {
  return times.subarray(1).map((time, place) => time - (times[place] ?? 0));
}

function median(values: Float64Array): number {
  const sorted = values.slice().sort();
  const middle = sorted.length >> 1;
  return sorted.length % 2 === 1 ? (sorted[middle] ?? 0) : 0.5 * ((sorted[middle - 1] ?? 0) + (sorted[middle] ?? 0));
}
