/** A recording of one's own: which channels its columns are, and what is said of the runs beside it. */

import { ACCEPTABLE_FRACTION, type ChannelError, LONGEST_DELAY, type RecordedColumn } from "./agreement";
import { channelNamed, type Content, scalesOf } from "./content";
import { element, say } from "./dom";
import type { Heads } from "./table";
import { plain } from "./shown";
import { InputError, readableUnit, scaleOf } from "./units";
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

/** Which channel each column is, and its unit. */
export interface ColumnMap {
  readonly channel: string;
  readonly unit: string;
}

/** The map that a header gives by itself; null where it leaves something open. */
export function mapOfHeader(heads: Heads): readonly ColumnMap[] | null {
  const map = heads.map(({ name, unit }) => ({ channel: Object.hasOwn(RECORDED, name) ? name : "", unit: unit === "-" ? "" : unit }));
  const isGood = map[0]?.channel === "time" && map.some(({ channel }) => channel !== "" && channel !== "time");
  return isGood && map.every(({ channel, unit }) => channel === "" || channel === "command" || unit !== "") ? map : null;
}

/** What is done with each column that is used. Throws InputError, with one line, where it cannot be. */
export function columnsOf(content: Content, map: readonly ColumnMap[]): RecordedColumn[] {
  const used = map.filter(({ channel }) => channel !== "");
  const twice = used.find(({ channel }, place) => used.findIndex((other) => other.channel === channel) !== place);
  if (twice !== undefined) throw new InputError(`two columns are '${twice.channel}'`);
  if (!used.some(({ channel }) => channel === "time")) throw new InputError("no column is 'time'");
  if (used.length < 2) throw new InputError(`no column is a channel of this page: ${Object.keys(RECORDED).slice(1).join(", ")}`);
  return map.flatMap(({ channel, unit }, place) => {
    if (channel === "") return [];
    const si = RECORDED[channel];
    if (si === undefined) throw new InputError(`there is no channel '${channel}'${nearest(channel, Object.keys(RECORDED))}`);
    const scale = scaleOf(si === "Pa_a" && unit === "Pa" ? "Pa_a" : unit, scalesOf(content, si));
    return [{ place, channel, factor: Number(scale.scale), offset: Number(scale.offset), isGauge: scale.isGauge }];
  });
}

/** A form that asks what the columns are. */
export function askForColumns(heads: Heads, given: (map: readonly ColumnMap[]) => void): HTMLElement {
  const fields = heads.map(({ name, unit }) => {
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

/** Factor and unit of a difference of two values of a channel: of pressures in psi, neither gauge nor absolute. */
function differenceOf(content: Content, channel: string): readonly [number, string] {
  const { unit, shown } = channelNamed(content, channel === "pressure_difference" ? "pressure_1" : channel);
  return [1 / Number(scaleOf(shown, scalesOf(content, unit)).scale), readableUnit(shown.replace(/_[ga]$/, ""))];
}

/** The table of errors, as a person reads it. */
export function agreementTable(content: Content, found: readonly { readonly name: string; readonly errors: readonly ChannelError[] }[]): HTMLElement {
  const rows = found.flatMap(({ name, errors }) =>
    errors.map(({ channel, rms, bias, fraction, delay, isAtLimit }) => {
      const [factor, unit] = differenceOf(content, channel);
      const cells = [`${plain(rms * factor, 3)} ${unit}`, `${plain(bias * factor, 3)} ${unit}`, `${plain(fraction * 100, 3)} %`, isAtLimit ? "none" : `${plain(delay * 1000, 3)} ms`];
      const verdict = fraction <= ACCEPTABLE_FRACTION ? "within 10 %" : "beyond 10 %";
      return element(
        "tr",
        {},
        element("th", { scope: "row" }, `${name}: ${channel.replace(/_/g, " ")}`),
        ...[...cells, verdict].map((text) => element("td", { class: "number" }, text)),
      );
    }),
  );
  const head = ["Channel", "RMS error", "Bias", "of full range", "Delay", ""].map((text, place) => element("th", { scope: "col", class: place === 0 ? "" : "number" }, text));
  const all = found.flatMap(({ errors }) => errors);
  const cutAt = Math.max(...all.map((error) => error.cutAt ?? 0));
  const cut = cutAt > 0 ? ` The recording is longer than the run and is compared up to ${plain(cutAt, 4)} s.` : "";
  const limit = all.some(({ isAtLimit }) => isAtLimit) ? ` Where it says none, the best delay is at the limit of ${LONGEST_DELAY * 1000} ms, and none could be taken out.` : "";
  const note = element("p", { class: "note" });
  say(note, `The common delay of all channels of a run is taken out, as 'ppafo validate' does.${limit}${cut} The runs follow the controller of the scenario, not the recorded command.`);
  return element("div", { class: "wide" }, element("table", { class: "outcome" }, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows)), note);
}
