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
/** The longest step, up to one that is given, that divides a sample of the controller. */
export const dividingStep = (period: number, step: number) => period / Math.max(1, Math.ceil((period / step) * (1 - RELATIVE)));

const UNIVERSAL_GAS_CONSTANT = 8.314;
const REFERENCE_DENSITY = 1.185;
const REFERENCE_TEMPERATURE = 293.15;
const AIR_CONSTANT = 1e5 / (REFERENCE_DENSITY * REFERENCE_TEMPERATURE);

/** e^x and ln x as `ppafo.model.elementary` has them: those of a browser differ from each other in the last bits. */
function exponential(exponent: number): number {
  if (Number.isNaN(exponent)) return exponent;
  const inside = Math.max(-709, Math.min(exponent, 709));
  const doublings = Math.trunc(inside / 0.6931471805599453 + (inside >= 0 ? 0.5 : -0.5));
  let rest = inside - doublings * UPPER_PART;
  rest = rest - doublings * LOWER_PART;
  let series = 0;
  for (let term = 14; term > 0; term--) series = ((series + 1) * rest) / term;
  let value = 1 + series;
  for (let turn = 0; turn < Math.abs(doublings); turn++) value *= doublings > 0 ? 2 : 0.5;
  return value;
}

const UPPER_PART = 0.693147180369123816490;
const LOWER_PART = 1.90821492927058770002e-10;
const ROOT_OF_HALF = 0.7071067811865476;

function logarithm(number: number): number {
  let [doublings, mantissa] = [0, number];
  for (; mantissa >= 2 * ROOT_OF_HALF && doublings < 1100; doublings++) mantissa *= 0.5;
  for (; mantissa < ROOT_OF_HALF && doublings > -1100; doublings--) mantissa *= 2;
  const share = (mantissa - 1) / (mantissa + 1);
  const square = share * share;
  let series = 0;
  for (let term = 12; term > 0; term--) series = (series + 1 / (2 * term + 1)) * square;
  const small = 2 * share + (2 * share * series + doublings * LOWER_PART);
  return doublings * UPPER_PART + small;
}

const power = (base: number, exponent: number) => exponential(exponent * logarithm(base));
const gasConstant = (mass: number) => UNIVERSAL_GAS_CONSTANT / mass;
const criticalRatio = (k: number) => power(2 / (k + 1), k / (k - 1));

/** R T times the conductance Cd A C1 of an area. The order of operations is the package's: the same bits. */
function flowOfArea(mass: number, k: number, temperature: number, area: number, discharge: number): number {
  const constant = gasConstant(mass);
  const choked = Math.sqrt((k / (constant * temperature)) * power(2 / (k + 1), (k + 1) / (k - 1)));
  return constant * temperature * (discharge * area * choked);
}

/** R T times a sonic conductance of ISO 6358, for a gas other than air too. */
function flowOfSonic(mass: number, temperature: number, sonic: number): number {
  const constant = gasConstant(mass);
  const sameGas = sonic * REFERENCE_DENSITY * Math.sqrt(REFERENCE_TEMPERATURE / temperature);
  return constant * temperature * (sameGas * Math.sqrt(AIR_CONSTANT / constant));
}

const lagOfBandwidth = (bandwidth: number) => (bandwidth > 0 ? 1 / (TURN * bandwidth) : 0);

/** How long a spool follows a command, at the slew limit too. */
const spoolLag = (frequency: number, damping: number, slew: number) =>
  (frequency > 0 ? (2 * damping) / (TURN * frequency) : 0) + (slew > 0 ? 1 / slew : 0);

const RULES: Readonly<Record<string, (...given: number[]) => number>> = {
  "clock.step_unless_given": (duration = 0, period = 0) => stepUnlessGiven(duration, period),
  "clock.step_with_output": (duration = 0, period = 0, output = 0) => Math.min(stepUnlessGiven(duration, period), output),
  "clock.output_unless_given": (duration = 0, period = 0, step = 0) => duration / Math.max(1, nearestWhole(duration / dividingStep(period, step))),
  "motion.record_interval": (seconds = 0) => (seconds <= 61 ? 1e-3 : seconds <= 601 ? 5e-3 : 2e-2),
  "graph.itself": (number = 0) => number,
  "gas.critical_pressure_ratio": (k = 0) => criticalRatio(k),
  "nominal.always_zero": () => 0,
  "wearer.shank_length_of": (stature = 0) => 0.246 * stature,
  "wearer.shank_mass_centre_of": (stature = 0) => 0.10642173913043478 * stature,
  "wearer.foot_mass_centre_of": (stature = 0) => 0.048130434782608686 * stature,
  "wearer.heel_lever_of": (stature = 0) => 0.02673913043478261 * stature,
  "wearer.toe_lever_of": (stature = 0) => 0.09626086956521737 * stature,
  "wearer.shank_mass_of": (_stature = 0, mass = 0) => 0.06206896551724138 * mass,
  "wearer.foot_mass_of": (_stature = 0, mass = 0) => 0.013793103448275862 * mass,
  "wearer.shank_inertia_of": (stature = 0, mass = 0) => 0.0003944723290528648 * mass * stature * stature,
  "wearer.foot_inertia_of": (stature = 0, mass = 0) => 3.944723290528648e-6 * mass * stature * stature,
};

const RIGHT_ANGLE = 1.5707963267948966;
const INSIDE = 0.2;
const SAMPLES_LATE = 1.5;
const LEAST_TORQUE = 5e-4;
const LARGEST_OPENING = 0.77;

/** What a rule of the torque loop may ask: a number of the device by its path, and whether it has one. */
interface Numbers {
  readonly at: (path: string) => number;
  readonly has: (path: string) => boolean;
  /** The setting of the law that the rule takes beside the device. */
  readonly setting: number;
}

interface TorqueLoop {
  /** Torque rate at full opening, N m/s. */
  readonly rate: number;
  /** Dead time, s. */
  readonly late: number;
}

/** The torque loop of a vane, as `ppafo.simulation.default_gains` has it. The order of operations is the package's. */
function torqueLoop({ at, has }: Numbers): TorqueLoop {
  const [lowest, highest] = [at("actuator.angle_min"), at("actuator.angle_max")];
  const inside = Math.min(Math.max(RIGHT_ANGLE, lowest + INSIDE), highest - INSIDE);
  const angle = highest - lowest > 2 * INSIDE ? inside : 0.5 * (lowest + highest);
  const [torque, growth] = [at("actuator.torque_constant"), at("actuator.displacement_per_radian")];
  const volume1 = at("actuator.dead_volume_1") + growth * (angle - lowest);
  const volume2 = at("actuator.dead_volume_2") + growth * (highest - angle);
  const perFlow = Math.max((torque * at("supply.pressure")) / volume1, (torque * at("supply.dorsiflexion_pressure")) / volume2);
  const [mass, temperature, period] = [at("gas.molar_mass"), at("gas.temperature"), at("controller.period")];
  const flow = has("valve.sonic_conductance")
    ? flowOfSonic(mass, temperature, at("valve.sonic_conductance"))
    : flowOfArea(mass, at("gas.heat_capacity_ratio"), temperature, at("valve.area"), at("valve.discharge_coefficient"));
  const valve = has("valve.switching_interval")
    ? Math.max(at("valve.opening_delay"), at("valve.closing_delay")) + Math.max(SAMPLES_LATE * period, at("valve.switching_interval"))
    : at("valve.delay") + spoolLag(at("valve.spool_frequency"), at("valve.spool_damping_ratio"), at("valve.slew_limit")) + SAMPLES_LATE * period;
  const signals = (has("sensors.delay") ? at("sensors.delay") : 0) + lagOfBandwidth(at("sensors.pressure_bandwidth"));
  return { rate: flow * perFlow, late: valve + signals };
}

const torqueInDeadTime = ({ rate, late }: TorqueLoop) => Math.max(rate * late, LEAST_TORQUE);

/** Gains that follow the torque loop of a vane; of another actuator the page knows none, and they stay as they are. */
const LOOP_RULES: Readonly<Record<string, (loop: TorqueLoop, numbers: Numbers) => number>> = {
  "default_gains.proportional_gain_of_device": (loop) => 0.5 / torqueInDeadTime(loop),
  "default_gains.integral_rate_of_device": ({ late }) => 0.125 / late,
  "default_gains.integral_gain_of_device": ({ late }, { setting }) => setting * (0.125 / late),
  "default_gains.boundary_layer_of_device": (loop) => 2 * torqueInDeadTime(loop),
  "default_gains.convergence_rate_of_device": ({ late }) => 0.5 / late,
  "default_gains.torque_rate_of_device": ({ rate }) => rate,
  "default_gains.dead_time_of_device": ({ late }) => late,
  "default_gains.dead_zone_opening_of_device": (loop, { at, has, setting }) => {
    const opening = Math.min(LARGEST_OPENING, setting / torqueInDeadTime(loop));
    return has("valve.dead_band") ? at("valve.dead_band") + (1 - at("valve.dead_band")) * opening : opening;
  },
};

function numberOfLoop(rule: string, sources: readonly string[], valueOf: (key: string) => number): number | null {
  const known = LOOP_RULES[rule];
  if (known === undefined || !sources.includes("actuator.torque_constant")) return null;
  const numbers = { at: valueOf, has: (path: string) => sources.includes(path), setting: valueOf(sources.at(-1) ?? "") };
  return known(torqueLoop(numbers), numbers);
}

/** A number that is the sum of what some rules make of other settings, and a gap. */
export interface Made {
  readonly terms: readonly { readonly rule: string; readonly sources: readonly string[] }[];
  readonly gap: number;
  /** Only once its first source is given itself. */
  readonly when_set: boolean;
}

/** What a setting is made to by others; null for a rule that the page does not know: then it stays as it is. */
export function madeOf({ terms, gap }: Made, valueOf: (key: string) => number): number | null {
  const found: number[] = [];
  for (const { rule, sources } of terms) {
    const known = RULES[rule];
    const number = known === undefined ? numberOfLoop(rule, sources, valueOf) : known(...sources.map(valueOf));
    if (number === null) return null;
    found.push(number);
  }
  return found.reduce((sum, term) => sum + term) + gap;
}
