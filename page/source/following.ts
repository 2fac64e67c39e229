/** Defaults that are made of other settings, by the rules of the package's graph of settings, under the names that it has for them. */

const TURN = 2 * Math.PI;
const LONGEST_STEP = 1e-3;
const RELATIVE = 1e-9;

/** The nearest whole number, the even one of two that are as near. */
function nearestWhole(value: number): number {
  const up = Math.trunc(value + 0.5);
  return up - value === 0.5 && up % 2 !== 0 ? up - 1 : up;
}

const stepUnlessGiven = (duration: number, period: number) => Math.min(duration, period, LONGEST_STEP);
const dividingStep = (period: number, step: number) => period / Math.max(1, Math.ceil((period / step) * (1 - RELATIVE)));

const RULES: Readonly<Record<string, (...given: number[]) => number>> = {
  "clock.step_unless_given": (duration = 0, period = 0) => stepUnlessGiven(duration, period),
  "clock.step_with_output": (duration = 0, period = 0, output = 0) => Math.min(stepUnlessGiven(duration, period), output),
  "clock.output_unless_given": (duration = 0, period = 0, step = 0) => duration / Math.max(1, nearestWhole(duration / dividingStep(period, step))),
  "walk.record_interval": (seconds = 0) => (seconds <= 61 ? 1e-3 : seconds <= 601 ? 5e-3 : 2e-2),
  "loading.lag_of_bandwidth": (bandwidth = 0) => (bandwidth > 0 ? 1 / (TURN * bandwidth) : 0),
  "solenoid.lag": (_opening = 0, closing = 0, interval = 0) => closing + interval,
  "solenoid.no_dead_time": () => 0,
  "proportional.lag": (_band = 0, delay = 0, frequency = 0, damping = 0, slew = 0) =>
    delay + (frequency > 0 ? (2 * damping) / (TURN * frequency) : 0) + (slew > 0 ? 1 / slew : 0),
  "proportional.dead_time": (_band = 0, delay = 0) => delay,
};

/** A number that is the sum of what some rules make of other settings, and a gap. */
export interface Made {
  readonly terms: readonly { readonly rule: string; readonly sources: readonly string[] }[];
  readonly gap: number;
}

/** What a setting is made to by others; null for a rule that the page does not know: then it stays as it is. */
export function madeOf({ terms, gap }: Made, valueOf: (key: string) => number): number | null {
  const found: number[] = [];
  for (const { rule, sources } of terms) {
    const known = RULES[rule];
    if (known === undefined) return null;
    found.push(known(...sources.map(valueOf)));
  }
  return found.reduce((sum, term) => sum + term) + gap;
}
