/** Decimal numbers as Python's `decimal` has them, with 28 digits: so a typed value becomes the same bits here and there. */

export interface Decimal {
  readonly digits: bigint;
  readonly exponent: number;
}

const PRECISION = 28;
const NUMBER = /^([+-]?)(\d+\.?\d*|\.\d+)(?:[eE]([+-]?\d+))?$/;

/** The decimal that a text such as `-12.6e-3` writes; null for any other text. */
export function parseDecimal(text: string): Decimal | null {
  const match = NUMBER.exec(text);
  if (match === null) return null;
  const [whole = "", fraction = ""] = (match[2] ?? "").split(".");
  const digits = BigInt(whole + fraction || "0");
  return { digits: match[1] === "-" ? -digits : digits, exponent: Number(match[3] ?? "0") - fraction.length };
}

/** The shortest decimal that is read back as this number. */
export function decimalOf(value: number): Decimal {
  const found = parseDecimal(String(value));
  if (found === null) throw new RangeError(`${value} is not a finite number`);
  return found;
}

export function multiply(a: Decimal, b: Decimal): Decimal {
  return rounded({ digits: a.digits * b.digits, exponent: a.exponent + b.exponent });
}

export function add(a: Decimal, b: Decimal): Decimal {
  if (a.digits === 0n) return rounded(b);
  if (b.digits === 0n) return rounded(a);
  const exponent = Math.min(a.exponent, b.exponent);
  return rounded({ digits: scaled(a, exponent) + scaled(b, exponent), exponent });
}

/** The nearest number. */
export function numberOf(value: Decimal): number {
  return Number(`${value.digits}e${value.exponent}`);
}

function scaled(value: Decimal, exponent: number): bigint {
  return value.digits * 10n ** BigInt(value.exponent - exponent);
}

/** With no more digits than a decimal has; a half goes to the even digit. */
function rounded(value: Decimal): Decimal {
  const isNegative = value.digits < 0n;
  const size = isNegative ? -value.digits : value.digits;
  const excess = size.toString().length - PRECISION;
  if (excess <= 0) return value;
  const unit = 10n ** BigInt(excess);
  const rest = (size % unit) * 2n;
  let kept = size / unit;
  if (rest > unit || (rest === unit && kept % 2n === 1n)) kept += 1n;
  return rounded({ digits: isNegative ? -kept : kept, exponent: value.exponent + excess });
}
