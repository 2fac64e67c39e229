/** Times of several runs on one axis. */

import { interpolated } from "./agreement";

/** What rounding may put between two times [s] that are the same. */
const ROUNDING = 1e-9;

/** One clock for several runs: the finest as far as that goes, then the next one, to the end of the longest. */
export function clockOf(clocks: readonly Float64Array[]): Float64Array {
  const step = (time: Float64Array) => (time[1] ?? Infinity) - (time[0] ?? 0);
  return [...clocks].sort((a, b) => step(a) - step(b)).reduce((all, time) => {
    const rest = time.subarray(firstAfter(time, (all.at(-1) ?? -Infinity) + ROUNDING));
    if (rest.length === 0) return all;
    const both = new Float64Array(all.length + rest.length);
    both.set(all);
    both.set(rest, all.length);
    return both;
  });
}

/** Values of a run at the times of a clock; none after its end. */
export function onClock(clock: Float64Array, time: Float64Array, values: Float64Array): Float64Array {
  if (sameClock(time, clock)) return values;
  const end = time.at(-1) ?? 0;
  return interpolated(clock, 0, time, values).map((value, place) => ((clock[place] ?? 0) > end + ROUNDING ? NaN : value));
}

/** The place of the first time after another one. */
export function firstAfter(times: Float64Array, time: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? 0) <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

function sameClock(a: Float64Array, b: Float64Array): boolean {
  return a === b || (a.length === b.length && a[1] === b[1] && a.at(-1) === b.at(-1));
}
