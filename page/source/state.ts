/** The state of the page: which tab, which configurations; as an address, as a file, and the states before it. */

import { type Content, programNamed } from "./content";
import { type Configuration, contradiction, settingsByKey, valuesOf } from "./settings";
import { InputError, short } from "./units";

export const MOST_CONFIGURATIONS = 4;
const LONGEST_STATE = 200_000;
const FORMAT = "ppafo workbench";

export interface State {
  readonly tab: number;
  /** Configurations of each tab. */
  readonly benches: readonly (readonly Configuration[])[];
}

export function firstState(content: Content): State {
  return { tab: 0, benches: content.tabs.map((tab) => tab.start.map(({ program, changes }) => ({ program, changes }))) };
}

/** The state as the part of an address behind `#`; empty for that which the page opens with. */
export function addressOf(content: Content, state: State): string {
  const parts = state.tab === 0 ? [] : [`tab=${state.tab + 1}`];
  const usual = firstState(content).benches;
  state.benches.forEach((bench, place) => {
    if (JSON.stringify(bench) === JSON.stringify(usual[place])) return;
    for (const { program, changes } of bench) {
      const texts = Object.entries(changes).map(([key, text]) => `${key}=${text}`);
      parts.push(`${place + 1}=${encoded([program, ...texts].join(";"))}`);
    }
  });
  return parts.join("&");
}

/** Readable where an address may be: only what would end or split it is written with a percent sign. */
function encoded(text: string): string {
  return encodeURIComponent(text).replace(/%3B/g, ";").replace(/%3D/g, "=").replace(/%20/g, "+").replace(/%2F/g, "/");
}

/** The state that an address holds. Throws InputError, with one line, for a damaged one. */
export function stateOfAddress(content: Content, address: string): State {
  if (address.length > LONGEST_STATE) throw new InputError("it is too long");
  const usual = firstState(content);
  const benches = new Map<number, Configuration[]>();
  let tab = 0;
  for (const part of address.replace(/^#/, "").split("&").filter(Boolean)) {
    const equals = part.indexOf("=");
    const name = equals < 0 ? part : part.slice(0, equals);
    const text = decoded(part.slice(equals + 1));
    if (name === "tab") tab = placeOf(content, text);
    else {
      const place = placeOf(content, name);
      benches.set(place, [...(benches.get(place) ?? []), configurationOf(text)]);
    }
  }
  const state = { tab, benches: usual.benches.map((bench, place) => benches.get(place) ?? bench) };
  checkState(content, state);
  return state;
}

function decoded(text: string): string {
  try {
    return decodeURIComponent(text.replace(/\+/g, " "));
  } catch (error) {
    if (error instanceof URIError) throw new InputError(`'${short(text)}' is cut off or damaged`);
    throw error;
  }
}

function placeOf(content: Content, text: string): number {
  const place = /^\d{1,3}$/.test(text) ? Number(text) - 1 : -1;
  if (place >= 0 && place < content.tabs.length) return place;
  throw new InputError(`'${short(text)}' is no tab of this page; it has ${content.tabs.length}`);
}

function configurationOf(text: string): Configuration {
  const [program = "", ...texts] = text.split(";");
  const changes = texts.map((one) => {
    const equals = one.indexOf("=");
    if (equals < 1) throw new InputError(`'${short(one)}' is not of the form KEY=VALUE`);
    return [one.slice(0, equals), one.slice(equals + 1)] as const;
  });
  return { program, changes: Object.fromEntries(changes) };
}

/** Refuse what this page does not have, or numbers that are none. */
export function checkState(content: Content, state: State): void {
  state.benches.forEach((bench, place) => {
    const known = content.tabs[place]?.programs ?? [];
    if (bench.length < 1 || bench.length > MOST_CONFIGURATIONS) {
      throw new InputError(`a tab has 1 to ${MOST_CONFIGURATIONS} configurations, not ${bench.length}`);
    }
    for (const configuration of bench) {
      if (!known.includes(configuration.program)) {
        throw new InputError(`there is no scenario '${short(configuration.program)}'${nearest(configuration.program, known)}`);
      }
      const keys = [...settingsByKey(programNamed(content, configuration.program)).keys()];
      for (const key of Object.keys(configuration.changes)) {
        if (!keys.includes(key)) throw new InputError(`there is no setting '${short(key)}'${nearest(key, keys)}`);
      }
      valuesOf(content, configuration);
    }
  });
  const wrong = contradictionIn(content, state);
  if (wrong !== "") throw new InputError(wrong);
}

/** The first pair of settings of a state that contradict each other, as one line; empty where there is none. */
export function contradictionIn(content: Content, { benches }: State): string {
  const found = benches.flat().map((one) => contradiction(programNamed(content, one.program), valuesOf(content, one)));
  return found.find((wrong) => wrong !== "") ?? "";
}

/** A question after the nearest name, as the package asks it; empty where none is near. */
export function nearest(name: string, known: readonly string[]): string {
  if (name.length > 100) return "";
  const ranked = known.map((other) => [distance(name, other), other] as const).sort((a, b) => a[0] - b[0]);
  const best = ranked[0];
  return best !== undefined && best[0] <= Math.max(2, name.length / 3) ? `, did you mean '${best[1]}'?` : "";
}

function distance(a: string, b: string): number {
  let row = Array.from({ length: b.length + 1 }, (_, place) => place);
  for (let i = 1; i <= a.length; i += 1) {
    const next = [i];
    for (let j = 1; j <= b.length; j += 1) {
      const swap = (row[j - 1] ?? 0) + (a[i - 1] === b[j - 1] ? 0 : 1);
      next.push(Math.min(swap, (row[j] ?? 0) + 1, (next[j - 1] ?? 0) + 1));
    }
    row = next;
  }
  return row[b.length] ?? 0;
}

/** The state as a file. */
export function fileOf(content: Content, state: State): string {
  return `${JSON.stringify({ format: FORMAT, version: content.version, ...state }, null, 2)}\n`;
}

/** The state in a file. Throws InputError, with one line, for any other file. */
export function stateOfFile(content: Content, text: string): State {
  if (text.length > LONGEST_STATE) throw new InputError("the file is too large for a state of this page");
  const parsed = parsedJson(text);
  if (!isTable(parsed) || parsed["format"] !== FORMAT) throw new InputError("the file is no state of this page");
  const { tab, benches } = parsed;
  if (!Number.isInteger(tab) || !Array.isArray(benches) || benches.length !== content.tabs.length) {
    throw new InputError("the file is a state of a page with other tabs");
  }
  const state: State = { tab: placeOf(content, String(Number(tab) + 1)), benches: benches.map(benchOfFile) };
  checkState(content, state);
  return state;
}

function parsedJson(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch (error) {
    if (error instanceof SyntaxError) throw new InputError("the file is not JSON");
    throw error;
  }
}

function isTable(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function benchOfFile(bench: unknown): Configuration[] {
  if (!Array.isArray(bench)) throw new InputError("the file has a tab without configurations");
  return bench.map((item: unknown) => {
    const changes = isTable(item) ? item["changes"] : undefined;
    if (!isTable(item) || typeof item["program"] !== "string" || !isTable(changes)) {
      throw new InputError("the file has a configuration without 'program' and 'changes'");
    }
    const texts = Object.entries(changes).map(([key, text]) => {
      if (typeof text !== "string" || /[;\n]/.test(text)) throw new InputError(`the file has no text at '${short(key)}'`);
      return [key, text] as const;
    });
    return { program: item["program"], changes: Object.fromEntries(texts) };
  });
}

/** States before and after the present one. */
export class History {
  private past: State[] = [];
  private future: State[] = [];

  /** Keep the state that a change starts from. */
  keep(state: State): void {
    if (this.past.at(-1) === state) return;
    this.past = [...this.past.slice(-199), state];
    this.future = [];
  }

  undo(present: State): State | null {
    const found = this.past.pop();
    if (found === undefined) return null;
    this.future.push(present);
    return found;
  }

  redo(present: State): State | null {
    const found = this.future.pop();
    if (found === undefined) return null;
    this.past.push(present);
    return found;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }
}
