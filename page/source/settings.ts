/** From what is typed to the numbers that the engine is given: one configuration at a time. */

import { type Content, programNamed, type Program, type Relation, scalesOf, type Setting } from "./content";
import { dividingStep, madeOf } from "./following";
import { plain, shownValue, STANDARD_ATMOSPHERE } from "./shown";
import { fromSi, InputError, readableUnit, scaleOf, short, splitQuantity, toSi } from "./units";

export const ATMOSPHERE = "supply.atmospheric_pressure";
const RELATIVE = 1e-9;
const MOST_PARTS = 50;
/** Digits of a number that is written by hand. */
const MOST_WRITTEN = 8;
/** Below this an end of a range is none that anybody has in mind, in the unit that is shown. */
const LEAST_NAMED = 1e-9;
const RAISED: Readonly<Record<string, string>> = { ...Object.fromEntries([..."⁰¹²³⁴⁵⁶⁷⁸⁹"].map((sign, digit) => [String(digit), sign])), "−": "⁻" };

/** The pressure [Pa] from which the gauge pressures of a configuration count. */
export function atmosphereOf(values: Values): number {
  return values.get(ATMOSPHERE) ?? STANDARD_ATMOSPHERE;
}

export interface Configuration {
  readonly program: string;
  /** Texts by key, of what is not as the scenario has it. */
  readonly changes: Readonly<Record<string, string>>;
}

export type Values = ReadonlyMap<string, number>;

const indices = new WeakMap<Program, ReadonlyMap<string, Setting>>();

export function settingsByKey(program: Program): ReadonlyMap<string, Setting> {
  let found = indices.get(program);
  if (found === undefined) {
    found = new Map(program.settings.map((setting) => [setting.key, setting]));
    indices.set(program, found);
  }
  return found;
}

const reckoned = new WeakMap<Configuration, Values>();

/** All numbers of a configuration in SI, in the order of the program. Throws InputError for a text that is no such number. */
export function valuesOf(content: Content, configuration: Configuration): Values {
  const known = reckoned.get(configuration);
  if (known !== undefined) return known;
  const values = valuesFrom(content, configuration);
  reckoned.set(configuration, values);
  return values;
}

function valuesFrom(content: Content, configuration: Configuration): Values {
  const program = programNamed(content, configuration.program);
  const { changes } = configuration;
  const settings = settingsByKey(program);
  const values = new Map(program.settings.map((setting) => [setting.key, setting.value]));
  const first = settings.get(ATMOSPHERE);
  const other = changes[ATMOSPHERE];
  if (first !== undefined && other !== undefined) values.set(ATMOSPHERE, numberFrom(content, first, other, STANDARD_ATMOSPHERE));
  const atmosphere = values.get(ATMOSPHERE) ?? STANDARD_ATMOSPHERE;
  const followers: Setting[] = [];
  for (const setting of program.settings) {
    const typed = changes[setting.key];
    if (setting.key === ATMOSPHERE) continue;
    if (typed === undefined ? setting.follows !== "" : Object.hasOwn(setting.words, typed)) followers.push(setting);
    else if (typed !== undefined) values.set(setting.key, numberFrom(content, setting, typed, atmosphere));
    else if (setting.text !== "" && other !== undefined) values.set(setting.key, numberFrom(content, setting, setting.text, atmosphere));
  }
  for (const setting of [...followers, ...followers]) {
    const followed = setting.words[changes[setting.key] ?? ""] ?? setting.follows;
    values.set(setting.key, values.get(followed) ?? setting.value);
  }
  for (const [key, value] of madeFrom(program, configuration, values)) values.set(key, value);
  return values;
}

/** What is made of other settings that stand at some values, in the order in which one is made of another. */
export function madeFrom(program: Program, { changes }: Configuration, values: Values): ReadonlyMap<string, number> {
  const found = new Map<string, number>();
  for (const { key, made } of program.settings) {
    if (made === null || changes[key] !== undefined) continue;
    const source = made.terms[0]?.sources[0] ?? "";
    if (made.when_set && changes[source] === undefined && values.get(source) === firstOf(program, source)) continue;
    const value = madeOf(made, (source) => found.get(source) ?? values.get(source) ?? NaN);
    if (value !== null) found.set(key, value);
  }
  if (changes["run.step"] === undefined && isRecordedOnSteps(program)) {
    const at = (key: string) => found.get(key) ?? values.get(key) ?? NaN;
    found.set("run.step", stepOnSamples(at("controller.period"), firstOf(program, "run.step"), at("run.output_interval")));
  }
  return found;
}

const firstOf = (program: Program, key: string) => settingsByKey(program).get(key)?.value ?? NaN;

/** Whether the samples of a run are recorded at the beginnings of steps: they have to, in programs that are compiled so. */
function isRecordedOnSteps(program: Program): boolean {
  const step = settingsByKey(program).get("run.step");
  const isGiven = program.kind === "scenario" && step !== undefined && step.made === null;
  return isGiven && isOnSteps(firstOf(program, "controller.period"), step.value, firstOf(program, "run.output_interval"));
}

function isOnSteps(period: number, step: number, interval: number): boolean {
  const count = interval / dividingStep(period, step);
  return count > 0.5 && Math.abs(count - Math.round(count)) <= RELATIVE * count;
}

/** The longest step, up to one that is given, with which samples of a controller and of the recording fall on steps; that one itself where none does, or where it is longer than they are: that is refused. */
function stepOnSamples(period: number, step: number, interval: number): number {
  if (step > Math.min(period, interval) * (1 + RELATIVE)) return step;
  for (let parts = 1; parts <= MOST_PARTS; parts += 1) {
    const part = step / parts;
    const isPart = Math.abs(dividingStep(period, part) - part) <= RELATIVE * part;
    if (isPart && isOnSteps(period, part, interval)) return part;
  }
  return step;
}

/** A typed number with its unit in SI, within its range. A bare number has the unit that is shown. */
export function numberFrom(content: Content, setting: Setting, text: string, atmosphere: number): number {
  const { number, unit } = splitQuantity(text);
  // The controller of a walk knows no weather: what it is told in gauge counts from the standard atmosphere.
  const zero = setting.key.startsWith("controller.") ? STANDARD_ATMOSPHERE : atmosphere;
  const value = toSi(number, scaleOf(unit === "" ? setting.shown : unit, scalesOf(content, setting.unit)), zero);
  if (!isInside(setting, value)) {
    throw new InputError(`${setting.key}: '${short(text)}' is outside of its range, ${rangeText(content, setting, atmosphere, true)}`);
  }
  if (setting.kept !== "" && (setting.kept === "zero") !== (value === 0)) {
    throw new InputError(`${setting.key}: must stay ${setting.kept === "zero" ? "0" : "above 0"} on this page; another value needs a different compiled program`);
  }
  if (setting.key.endsWith(".seed") && !Number.isInteger(value)) throw new InputError(`${setting.key}: must be a whole number`);
  return value;
}

/** Whether a value in SI is within the range of a setting. */
export function isInside(setting: Setting, value: number): boolean {
  const { low, high, isLowAllowed } = setting;
  const isBelow = low !== null && (isLowAllowed ? value < low : value <= low);
  return Number.isFinite(value) && !isBelow && !(high !== null && value > high);
}

/** What is typed, in the spelling that files have: a number with its unit, or a word. */
export function normalText(setting: Setting, text: string): string {
  const trimmed = text.trim().replace(/\s+/g, " ");
  if (Object.hasOwn(setting.words, trimmed)) return trimmed;
  const { number, unit } = splitQuantity(trimmed);
  // What a control shows may be edited and given back: `50 psi gauge`.
  const isShown = unit === "" || unit === readableUnit(setting.shown).replace(/\u00a0/g, " ");
  return `${String(number)} ${isShown ? setting.shown : unit}`.trim();
}

/** What a setting may be, in words. A lowest value that nobody would come near is above 0, unless the text has to be `exact`. */
export function rangeText(content: Content, setting: Setting, atmosphere: number, exact = false): string {
  const { high } = setting;
  const scale = scaleOf(setting.shown, scalesOf(content, setting.unit));
  const lowest = setting.low === null ? null : fromSi(setting.low, scale, atmosphere);
  const isTiny = !exact && lowest !== null && lowest > 0 && lowest < LEAST_NAMED;
  const [low, isLowAllowed] = isTiny ? [0, false] : [setting.low, setting.isLowAllowed];
  const end = (value: number | null, isLow: boolean) => (value === null ? null : written(fromSi(value, scale, atmosphere), isLow));
  const [least, most] = [end(low, true), end(high, false)];
  const unit = ` ${readableUnit(setting.shown)}`.trimEnd();
  if (least === null) return most === null ? "any number" : `at most ${most}${unit}`;
  if (most === null) return `${isLowAllowed ? "at least" : "more than"} ${least}${unit}`;
  return isLowAllowed ? `${least} to ${most}${unit}` : `more than ${least}, at most ${most}${unit}`;
}

/** An end of a range as people write it, with three digits: rounded inwards, so that it is allowed itself. */
function written(value: number, isLow: boolean): string {
  const unit = value === 0 ? 1 : 10 ** (Math.floor(Math.log10(Math.abs(value)) + 1e-12) - 2);
  const share = value / unit;
  const whole = isLow ? Math.ceil(share - 1e-6) : Math.floor(share + 1e-6);
  const text = Math.abs(value) < 1e-4 && value !== 0 ? `${plain(whole / 100, 3)} × 10^${Math.round(Math.log10(unit)) + 2}` : String(Number((whole * unit).toPrecision(3)));
  return text.replace(/^1 × /, "").replace(/-/g, "−").replace(/\^−?\d+/, (power) => [...power.slice(1)].map((sign) => RAISED[sign] ?? "").join(""))
    .replace(/\B(?=(\d{3})+(?!\d)(?<!\.\d*))/g, ",");
}

/** A value as a control shows it, without its unit: all digits where somebody may have written so many, else four. */
export function shownNumber(content: Content, setting: Setting, value: number, atmosphere: number): string {
  const shown = shownValue(content, setting, value, atmosphere);
  const isWritten = Math.abs(Number(shown.toPrecision(MOST_WRITTEN)) - shown) <= RELATIVE * 1e-3 * Math.abs(shown);
  return plain(shown, isWritten ? MOST_WRITTEN : 4);
}

/** The first pair of settings that contradict each other, as one line; empty where there is none. */
export function contradiction(program: Program, values: Values): string {
  for (const { key, relation, other, factor, slack } of program.relations) {
    const [left, right] = [values.get(key), values.get(other)];
    if (left === undefined || right === undefined) continue;
    if (!holds(relation, left, factor * right, slack)) return `${key} must be ${relation} ${factor < 1.01 ? "" : `${factor} times `}${other}`;
  }
  return program.kind === "walk" ? contradictionOfProfile(values) : contradictionOfTimes(values);
}

/** A torque over the stride must have ended with it. */
function contradictionOfProfile(values: Values): string {
  const [peak, fall] = [values.get("controller.peak_time") ?? 0, values.get("controller.fall_time") ?? 0];
  return peak + fall > 1 ? "controller.peak_time: with controller.fall_time the torque would end after the stride" : "";
}

/** What a scenario file may not have either: samples that do not divide the run, a step longer than a sample of the controller. */
function contradictionOfTimes(values: Values): string {
  const [duration, interval, step, period] = ["run.duration", "run.output_interval", "run.step", "controller.period"].map((key) => values.get(key));
  if (duration !== undefined && interval !== undefined) {
    const count = duration / interval;
    if (Math.abs(count - Math.round(count)) > RELATIVE * count) return `run.output_interval must divide run.duration; it fits ${plain(count, 6)} times`;
  }
  if (step !== undefined && period !== undefined && step > period * (1 + RELATIVE)) return "run.step must be at most controller.period";
  return "";
}

function holds(relation: Relation["relation"], left: number, right: number, slack: number): boolean {
  if (relation === "at least") return left >= right - slack;
  if (relation === "at most") return left <= right + slack;
  return relation === "below" ? left < right + slack : left > right - slack;
}

/** The configuration with a key changed, or put back where the text is null. */
export function changed(configuration: Configuration, key: string, text: string | null): Configuration {
  const { [key]: _, ...others } = configuration.changes;
  return { program: configuration.program, changes: text === null ? others : { ...others, [key]: text } };
}
