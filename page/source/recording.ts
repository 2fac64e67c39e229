/** A recording of one's own: its columns become channels, and each run is compared with it. */

import { ACCEPTABLE_FRACTION, channelAgreement, type Curve, estimateDelay } from "./agreement";
import { type Content, scalesOf } from "./content";
import { element, say } from "./dom";
import type { Run } from "./engine";
import type { Overlay } from "./panels";
import { ATMOSPHERE, type Values } from "./settings";
import type { RecordedTable } from "./table";
import { InputError, plain, scaleOf } from "./units";
import { nearest } from "./state";

/** Channels that a recording may have, with their units in SI; a level of pressure is absolute. */
const RECORDED: Readonly<Record<string, string>> = {
  time: "s",
  torque: "N m",
  reference: "N m",
  pressure_1: "Pa_a",
  pressure_2: "Pa_a",
  angle: "rad",
  command: "",
  supplied_mass: "kg",
  supply_pressure: "Pa_a",
};
const ALONE = ["angle", "pressure_1", "pressure_2"];
const COMPARED = ["angle", "pressure_1", "pressure_2", "pressure_difference", "torque"] as const;

/** Which channel each column is, and its unit. */
export interface ColumnMap {
  readonly channel: string;
  readonly unit: string;
}

/** The map that the header of a table gives by itself; null where it leaves something open. */
export function mapOfHeader(table: RecordedTable): readonly ColumnMap[] | null {
  const map = table.heads.map(({ name, unit }) => ({ channel: Object.hasOwn(RECORDED, name) ? name : "", unit: unit === "-" ? "" : unit }));
  const isGood = map[0]?.channel === "time" && map.some(({ channel }) => channel !== "" && channel !== "time");
  return isGood && map.every(({ channel, unit }) => channel === "" || channel === "command" || unit !== "") ? map : null;
}

/** The recording of a table. Throws InputError, with one line, for one that cannot be. */
export function recordingOf(content: Content, table: RecordedTable, map: readonly ColumnMap[], atmosphere: number): Overlay {
  const used = map.filter(({ channel }) => channel !== "");
  const twice = used.find(({ channel }, place) => used.findIndex((other) => other.channel === channel) !== place);
  if (twice !== undefined) throw new InputError(`two columns are '${twice.channel}'`);
  const found = new Map<string, Float64Array>();
  map.forEach(({ channel, unit }, place) => {
    const si = RECORDED[channel];
    if (channel === "") return;
    if (si === undefined) throw new InputError(`there is no channel '${channel}'${nearest(channel, Object.keys(RECORDED))}`);
    const scale = scaleOf(si === "Pa_a" && unit === "Pa" ? "Pa_a" : unit, scalesOf(content, si));
    const [factor, offset] = [Number(scale.scale), Number(scale.offset) + (scale.isGauge ? atmosphere : 0)];
    found.set(channel, (table.columns[place] ?? new Float64Array()).map((value) => value * factor + offset));
  });
  const time = found.get("time");
  if (time === undefined) throw new InputError("no column is 'time'");
  if (found.size < 2) throw new InputError(`no column is a channel of this page: ${Object.keys(RECORDED).slice(1).join(", ")}`);
  for (let place = 1; place < time.length; place += 1) {
    if (!((time[place] ?? 0) > (time[place - 1] ?? 0))) throw new InputError(`row ${place + 1}: the clock stands still or goes backwards`);
  }
  found.delete("time");
  return { time, channels: found };
}

/** A form that asks what the columns are. */
export function askForColumns(table: RecordedTable, given: (map: readonly ColumnMap[]) => void): HTMLElement {
  const fields = table.heads.map(({ name, unit }) => {
    const options = ["", ...Object.keys(RECORDED)].map((channel) =>
      element("option", { value: channel, selected: channel === guess(name) }, channel === "" ? "leave out" : channel),
    );
    const channel = element("select", { "aria-label": `Column ${name} is` }, ...options);
    const units = element("input", { type: "text", value: unit, size: 8, placeholder: "unit", "aria-label": `Unit of column ${name}` });
    return { row: element("div", { class: "fields" }, element("span", { class: "column-name" }, name), channel, units), channel, units };
  });
  const use = element("button", { type: "button", onclick: () => given(fields.map(({ channel, units }) => ({ channel: channel.value, unit: units.value }))) }, "Use these columns");
  return element("div", { class: "columns" }, element("p", {}, "What are the columns of this file? Units as in psi_g, kPa_a, deg, ms."), ...fields.map(({ row }) => row), use);
}

function guess(name: string): string {
  const plainName = name.toLowerCase().replace(/[^a-z0-9]+/g, "_");
  const known: readonly (readonly [RegExp, string])[] = [
    [/^(t|time|zeit)/, "time"],
    [/pressure.*1|^p_?1/, "pressure_1"],
    [/pressure.*2|^p_?2/, "pressure_2"],
    [/torque|moment/, "torque"],
    [/angle|theta|position/, "angle"],
    [/command|valve|^u$/, "command"],
  ];
  return known.find(([pattern]) => pattern.test(plainName))?.[1] ?? "";
}

/** Errors of one run against a recording, as lines of a table. */
export function compare(overlay: Overlay, run: Run, values: Values, isHeld: boolean): { channel: string; rms: number; bias: number; fraction: number; delay: number }[] {
  if (run.time.length < 2) return [];
  const measured = withDifference(overlay.channels);
  const model = withDifference(run.channels);
  const value = (key: string) => values.get(key) ?? 0;
  const atmosphere = value(ATMOSPHERE);
  const recorded = overlay.channels.get("supply_pressure");
  const gauge = (recorded === undefined ? Math.max(value("supply.pressure"), value("supply.dorsiflexion_pressure")) : middle(recorded)) - atmosphere;
  const ranges: Readonly<Record<string, number>> = {
    angle: value("actuator.angle_max") - value("actuator.angle_min"),
    pressure_1: gauge,
    pressure_2: gauge,
    pressure_difference: 2 * gauge,
    torque: 2 * gauge * value("actuator.torque_constant"),
  };
  const names = COMPARED.filter((name) => measured.has(name) && model.has(name) && !(name === "angle" && isHeld));
  const curves = new Map(
    names.map((name): [string, Curve] => [
      name,
      { times: overlay.time, values: measured.get(name)!, modelTimes: run.time, modelValues: model.get(name)!, fullRange: ranges[name] ?? 1 },
    ]),
  );
  const chosen = names.filter((name) => ALONE.includes(name));
  const together = (chosen.length > 0 ? chosen : names.slice(0, 1)).map((name) => curves.get(name)!);
  const delay = estimateDelay(together);
  const correction = delay.isAtLimit ? 0 : delay.value;
  return names.map((name) => ({ channel: name, delay: correction, ...channelAgreement(curves.get(name)!, correction) }));
}

function withDifference(channels: ReadonlyMap<string, Float64Array>): ReadonlyMap<string, Float64Array> {
  const [first, second] = [channels.get("pressure_1"), channels.get("pressure_2")];
  if (first === undefined || second === undefined) return channels;
  return new Map([...channels, ["pressure_difference", first.map((value, place) => value - (second[place] ?? 0))]]);
}

function middle(values: Float64Array): number {
  const sorted = values.slice().sort();
  const half = sorted.length >> 1;
  return sorted.length % 2 === 1 ? (sorted[half] ?? 0) : 0.5 * ((sorted[half - 1] ?? 0) + (sorted[half] ?? 0));
}

const PSI = 6894.757293168361;
const SHOWN: Readonly<Record<string, readonly [number, string]>> = {
  angle: [180 / Math.PI, "deg"],
  pressure_1: [1 / PSI, "psi"],
  pressure_2: [1 / PSI, "psi"],
  pressure_difference: [1 / PSI, "psi"],
  torque: [1, "N m"],
};

/** The table of errors, as a person reads it. */
export function agreementTable(found: readonly { readonly name: string; readonly errors: ReturnType<typeof compare> }[]): HTMLElement {
  const rows = found.flatMap(({ name, errors }) =>
    errors.map(({ channel, rms, bias, fraction }) => {
      const [factor, unit] = SHOWN[channel] ?? [1, ""];
      const cells = [`${plain(rms * factor, 3)} ${unit}`, `${plain(bias * factor, 3)} ${unit}`, `${plain(fraction * 100, 3)} %`];
      const verdict = fraction <= ACCEPTABLE_FRACTION ? "within 10 %" : "beyond 10 %";
      return element(
        "tr",
        {},
        element("th", { scope: "row" }, `${name}: ${channel.replace(/_/g, " ")}`),
        ...[...cells, verdict].map((text) => element("td", { class: "number" }, text)),
      );
    }),
  );
  const head = ["Channel", "RMS error", "Bias", "of full range", ""].map((text, place) => element("th", { scope: "col", class: place === 0 ? "" : "number" }, text));
  const delay = found[0]?.errors[0]?.delay ?? 0;
  const note = element("p", { class: "note" });
  say(note, `A delay of ${plain(delay * 1000, 3)} ms is taken out, as 'ppafo validate' does. The runs follow the controller of the scenario, not the recorded command.`);
  return element("div", { class: "wide" }, element("table", { class: "outcome" }, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows)), note);
}
