/** What `ppafo workbench` puts into a page: programs with their settings, channels and metrics, and how they are grouped. */

import type { Made } from "./following";

export interface UnitScale {
  readonly unit: string;
  /** SI = number * scale + offset, in decimals; a gauge pressure counts from the atmosphere. */
  readonly scale: string;
  readonly offset: string;
  readonly isGauge: boolean;
}

export interface Setting {
  readonly key: string;
  readonly label: string;
  readonly unit: string;
  readonly shown: string;
  readonly low: number | null;
  readonly high: number | null;
  readonly isLowAllowed: boolean;
  /** The value in SI that a run starts from. */
  readonly value: number;
  /** How the value is written where it counts from the atmosphere, as `50 psi_g`; else empty. */
  readonly text: string;
  /** The setting whose value this one has until somebody changes it; else empty. */
  readonly follows: string;
  /** What others make of it until somebody changes it; null where it stands for itself. */
  readonly made: Made | null;
  /** Words that may stand for the value of another setting. */
  readonly words: Readonly<Record<string, string>>;
  /** Why this one cannot be changed here: it has to stay `zero`, or `above zero`; else empty. */
  readonly kept: string;
  readonly slider: readonly [number, number];
  readonly summary: string;
  readonly origin: string;
  readonly source: string;
  readonly note: string;
  /** Ends of a 95 % interval in SI, where something is known of it. */
  readonly interval: readonly [number, number] | null;
}

export interface Channel {
  readonly name: string;
  readonly unit: string;
  readonly shown: string;
  readonly label: string;
}

export interface Metric {
  readonly name: string;
  readonly unit: string;
  readonly shown: string;
  readonly label: string;
}

export type Json = string | number | boolean | null | readonly Json[] | { readonly [key: string]: Json };
export type Table = { readonly [key: string]: Json };

export interface Relation {
  readonly key: string;
  readonly relation: string;
  /** A setting, times a factor, is what it must be above or below. */
  readonly other: string;
  readonly factor: number;
  readonly slack: number;
}

export interface Program {
  readonly name: string;
  readonly kind: "scenario" | "walk";
  /** The kind of its actuator, as `vane` or `cylinder`. */
  readonly actuator: string;
  readonly label: string;
  /** The number of the colour that its valve has in every figure, 0 where it has none. */
  readonly look: number;
  readonly description: string;
  readonly document: Table;
  /** Texts by key that a configuration begins with, and to which a setting is put back. */
  readonly usual: Readonly<Record<string, string>>;
  readonly deviceSections: readonly string[];
  readonly settings: readonly Setting[];
  readonly relations: readonly Relation[];
  readonly channels: readonly Channel[];
  readonly metrics: readonly Metric[];
  /** The torque that the supplies sustain is the value of `factor` times `raised` or `lowered` above `zero`; null where it is no such product. */
  readonly sustained: Readonly<Record<"factor" | "raised" | "lowered" | "zero", string>> | null;
  /** Which of the modules of the page it is. */
  readonly module: string;
}

export interface Tab {
  readonly title: string;
  readonly summary: string;
  readonly programs: readonly string[];
  /** Configurations that it opens with, each a program and changes of it. */
  readonly start: readonly { readonly program: string; readonly changes: Readonly<Record<string, string>> }[];
  /** Keys of the settings that matter most. */
  readonly first: readonly string[];
  /** Metrics that claims are about. */
  readonly claims: readonly string[];
  /** What somebody may ask, and the texts by key that answer it. */
  readonly questions: readonly { readonly text: string; readonly changes: Readonly<Record<string, string>> }[];
}

/** How many minutes a full bottle lasts, by the mean flow [kg/s] that is taken from it. */
export interface Bottle {
  readonly name: string;
  /** Molar mass of its gas [kg/mol]. */
  readonly molarMass: number;
  readonly flows: readonly number[];
  readonly minutes: readonly number[];
}

export interface Content {
  readonly version: string;
  readonly title: string;
  /** The joint that the devices turn. */
  readonly joint: string;
  readonly form: "page" | "block";
  readonly tabs: readonly Tab[];
  readonly bottle: Bottle;
  readonly programs: readonly Program[];
  readonly units: Readonly<Record<string, readonly UnitScale[]>>;
  /** What a run computes nothing up to, in SI by unit: what is not larger is rounding. */
  readonly zeros: Readonly<Record<string, number>>;
}

export function programNamed(content: Content, name: string): Program {
  const found = content.programs.find((program) => program.name === name);
  if (found === undefined) throw new RangeError(`there is no scenario '${name}'`);
  return found;
}

/** A channel by its name; a plain number where no program has it. */
export function channelNamed(content: Content, name: string): Channel {
  const all = content.programs.flatMap(({ channels }) => channels);
  return all.find((channel) => channel.name === name) ?? { name, unit: "", shown: "", label: name };
}

export function scalesOf(content: Content, unit: string): readonly UnitScale[] {
  return content.units[unit] ?? [{ unit, scale: "1", offset: "0", isGauge: false }];
}
