/** Texts with a unit into SI and back, by the arithmetic of `ppafo.units`. */

import type { UnitScale } from "./content";
import { add, decimalOf, multiply, numberOf, parseDecimal } from "./decimals";

const QUANTITY = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)$/;
const SPELLINGS: ReadonlyArray<readonly [RegExp, string]> = [
  [/²/g, "^2"],
  [/³/g, "^3"],
  [/\*\*/g, "^"],
  [/[·*]/g, " "],
  [/°/g, "deg"],
  [/[μu](?=[A-Za-z])/g, "µ"],
  [/%/g, "percent"],
  [/ *([/()^]) */g, "$1"],
  [/ +/g, " "],
];

/** What can be wrong with what somebody typed: one line for them to read. */
export class InputError extends Error {}

/** What is to be done with an error that came late: tell the person what they can mend, and let all others be seen. */
export function telling(tell: (words: string) => void): (error: unknown) => void {
  return (error) => {
    if (!(error instanceof InputError)) throw error;
    tell(`${error.message.slice(0, 1).toUpperCase()}${error.message.slice(1)}.`);
  };
}

/** A unit as the tables spell it. */
export function normalUnit(unit: string): string {
  return SPELLINGS.reduce((text, [pattern, other]) => text.replace(pattern, other), unit.trim());
}

/** Scales by unit, of the lists that were asked: the page asks some hundred times a frame. */
const known = new WeakMap<readonly UnitScale[], Map<string, UnitScale>>();

export interface Quantity {
  readonly number: number;
  readonly unit: string;
}

/** Number and unit of a text such as `12.6mm^2`; the unit may be empty. */
export function splitQuantity(text: string): Quantity {
  const match = QUANTITY.exec(text.trim());
  if (match === null) throw new InputError(`'${short(text)}' does not start with a number`);
  const number = Number(match[1]);
  if (!Number.isFinite(number)) throw new InputError(`'${short(text)}' is not a finite number`);
  return { number, unit: match[2] ?? "" };
}

/** The scale of a unit among those that fit, or an error that names them. */
export function scaleOf(unit: string, scales: readonly UnitScale[]): UnitScale {
  let byUnit = known.get(scales);
  if (byUnit === undefined) {
    byUnit = new Map([...scales].reverse().flatMap((scale) => [[normalUnit(scale.unit), scale] as const, [scale.unit, scale] as const]));
    known.set(scales, byUnit);
  }
  const found = byUnit.get(unit) ?? byUnit.get(normalUnit(unit));
  if (found !== undefined) return found;
  const names = scales.map((scale) => scale.unit || "a plain number").join(", ");
  throw new InputError(`unit '${short(unit)}' does not fit here; known: ${names}`);
}

/** A number of some unit in SI; gauge pressure counts from the atmosphere (Pa absolute). */
export function toSi(value: number, scale: UnitScale, atmosphere: number): number {
  const factor = parseDecimal(scale.scale);
  const offset = parseDecimal(scale.offset);
  if (factor === null || offset === null) throw new InputError(`unit '${scale.unit}' has no scale`);
  return numberOf(add(multiply(decimalOf(value), factor), offset)) + (scale.isGauge ? atmosphere : 0);
}

/** A number in SI in some unit, to show it: right to some 14 digits. */
export function fromSi(value: number, scale: UnitScale, atmosphere: number): number {
  return (value - (scale.isGauge ? atmosphere : 0) - Number(scale.offset)) / Number(scale.scale);
}

/** A unit as a person reads it. */
export function readableUnit(unit: string): string {
  return unit
    .replace(/_g$/, " gauge")
    .replace(/_[ad]$/, (kind) => (kind === "_a" ? " abs" : ""))
    .replace(/\^2/g, "²")
    .replace(/\^3/g, "³")
    .replace(/degC/, "°C")
    .replace(/^percent$/, "%")
    .replace(/ /g, "\u00a0");
}

/** What somebody typed, short enough for a line. */
export function short(text: string): string {
  const line = text.replace(/\s+/g, " ");
  return line.length <= 40 ? line : `${line.slice(0, 36)} ...`;
}
