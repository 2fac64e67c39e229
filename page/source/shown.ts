/** Numbers as a person is shown them: digits, units and zero by the rules of `ppafo.units.shown` and `without_exponent`. */

import { type Content, scalesOf } from "./content";
import { fromSi, readableUnit, scaleOf } from "./units";

/** What a number is: its unit in SI, and the one in which it is shown. */
export interface Kind {
  readonly unit: string;
  readonly shown: string;
}

/** Where gauge pressures count from while nothing else is said [Pa absolute]. */
export const STANDARD_ATMOSPHERE = 101325;
const LARGEST_WITHOUT_EXPONENT = 1e6;
/** Decimals that tell a number halfway between two of fewer digits from its neighbours. */
const EXACT = 60;

/** A number with some significant digits, without an exponent where that is readable; a dash where there is none. */
export function plain(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const [mantissa, exponent] = rounded(Math.abs(value), digits);
  const sign = value < 0 ? "-" : "";
  if (exponent < -4 || (exponent >= digits && Math.abs(value) >= LARGEST_WITHOUT_EXPONENT)) {
    const power = String(Math.abs(exponent)).padStart(2, "0");
    return `${sign}${trimmed(mantissa)}e${exponent < 0 ? "-" : "+"}${power}`;
  }
  return sign + trimmed(Number(`${mantissa}e${exponent}`).toFixed(Math.max(0, digits - 1 - exponent)));
}

/** Mantissa and power of ten; of two as near a half goes to the even digit, as in Python, and not away from 0. */
function rounded(size: number, digits: number): readonly [string, number] {
  const [exact = "", power = ""] = size.toExponential(EXACT).split("e");
  const all = exact.replace(".", "");
  const [kept, rest] = [all.slice(0, digits), all.slice(digits)];
  if (/^50*$/.test(rest) && Number(kept.at(-1)) % 2 === 0) return [`${kept.slice(0, 1)}.${kept.slice(1)}`, Number(power)];
  const [mantissa = "", raised = ""] = size.toExponential(digits - 1).split("e");
  return [mantissa, Number(raised)];
}

function trimmed(text: string): string {
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

/** A value in SI in the unit in which it is shown; what is zero within the accuracy of a run is 0. */
export function shownValue(content: Content, { unit, shown }: Kind, value: number, atmosphere = STANDARD_ATMOSPHERE): number {
  const scale = scaleOf(shown, scalesOf(content, unit));
  const [found, further] = [value, value + (content.zeros[unit] ?? 0)].map((each) => fromSi(each, scale, atmosphere));
  return Math.abs(found ?? NaN) <= Math.abs((further ?? NaN) - (found ?? NaN)) ? 0 : (found ?? NaN);
}

/** The same as text, with its unit. */
export function shownText(content: Content, kind: Kind, value: number, digits = 4, atmosphere = STANDARD_ATMOSPHERE): string {
  return `${plain(shownValue(content, kind, value, atmosphere), digits)} ${readableUnit(kind.shown)}`.trim();
}
