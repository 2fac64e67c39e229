/** Many runs around a configuration: a map of two settings, a band over what is uncertain, and what each assumption does. */

import type { Content, Metric, Program, Setting } from "./content";
import { programNamed, scalesOf } from "./content";
import type { Ensemble, Run } from "./engine";
import { NO_TRACE, together, type Workers } from "./jobs";
import type { Band } from "./panels";
import { ATMOSPHERE, changed, type Configuration, isInside, madeFrom, settingsByKey, type Values, valuesOf } from "./settings";
import { scaleOf, toSi } from "./units";

/** Values of each of both settings of a map. */
export const SIDE = 32;
/** A map is run on every second line and column first, which shows where it goes while the others are under way. */
const COARSE = 2;
const isOfFirst = (cell: number) => cell % COARSE === 0 && Math.floor(cell / SIDE) % COARSE === 0;
const CELLS = Array.from({ length: SIDE * SIDE }, (_, cell) => cell);
/** Cells of a map in the order in which they are run. */
const ORDER = [...CELLS.filter(isOfFirst), ...CELLS.filter((cell) => !isOfFirst(cell))];
const FIRST = CELLS.filter(isOfFirst).length;
const DRAWS = 200;
const BAND_PLACES = 300;
/** Of so many draws one is left out at either end; with fewer there is no band. */
const ONE_OF = 40;
const BANDED = ["torque", "pressure_1", "pressure_2", "supplied_mass", "angle"];

/** Settings of a run by key that are not those of a configuration. */
type Differences = readonly (readonly [string, number])[];

/** What a map shows over what. */
export interface Axes {
  readonly across: Setting;
  readonly up: Setting;
  readonly metric: Metric;
}

/** A metric over two settings, line by line from the lowest of the second, `side` values each; NaN where a run failed. */
export interface Landscape extends Axes {
  readonly side: number;
  readonly values: Float64Array;
}

/** Run a map; it is shown when a quarter of its runs is done, and if it is still wanted then, when all are. Once the page rests only one that is wanted goes on. */
export async function landscapeOf(
  content: Content,
  workers: Workers,
  configuration: Configuration,
  axes: Axes,
  show: (landscape: Landscape) => void,
  isWanted: () => boolean,
): Promise<void> {
  // What the present frame shows is drawn first.
  await new Promise((resolve) => setTimeout(resolve, 0));
  const program = programNamed(content, configuration.program);
  const base = valuesOf(content, configuration);
  const rows = rowsOf(program, base, differencesOnMap(content, configuration, axes));
  const width = program.metrics.length;
  const at = program.metrics.indexOf(axes.metric);
  const valuesOfRuns = (runs: Ensemble) => Float64Array.from(runs.ended, (ended, place) => (ended === 0 ? (runs.metrics[place * width + at] ?? NaN) : NaN));
  let isShown = false;
  const goesOn = (first: readonly Ensemble[]) => {
    if (!isShown && first.reduce((count, { ended }) => count + ended.length, 0) < FIRST) return true;
    if (!isShown) show({ ...axes, side: SIDE / COARSE, values: valuesOfRuns(together(first)).slice(0, FIRST) });
    isShown = true;
    return isWanted();
  };
  const all = await workers.runMany(program, rows, NO_TRACE, { goesOn, isWanted });
  if (all.ended.length < ORDER.length) return;
  const values = new Float64Array(ORDER.length);
  valuesOfRuns(all).forEach((value, place) => (values[ORDER[place] ?? 0] = value));
  show({ ...axes, side: SIDE, values });
}

/** The numbers of a slider's range in the unit that is shown, from left to right. */
export function placesOf(setting: Setting): number[] {
  const [from, to] = setting.slider;
  return Array.from({ length: SIDE }, (_, place) => from + ((to - from) * place) / (SIDE - 1));
}

/** What changes from run to run of a map, in their order. A gauge pressure counts from the atmosphere, wherever a map has that. */
function differencesOnMap(content: Content, configuration: Configuration, { across, up }: Axes): Differences[] {
  const [outer, inner] = up.key === ATMOSPHERE ? [up, across] : [across, up];
  const along = (setting: Setting, from: Configuration) => placesOf(setting).map((place) => differences(content, from, setting, place));
  const usual = along(inner, configuration);
  const each = along(outer, configuration);
  const within = placesOf(outer).map((place) => (outer.key === ATMOSPHERE ? along(inner, moved(configuration, outer, place)) : usual));
  return ORDER.map((cell) => {
    const [column, line] = [cell % SIDE, Math.floor(cell / SIDE)];
    const [first, second] = outer === across ? [column, line] : [line, column];
    return [...(each[first] ?? []), ...(within[first]?.[second] ?? [])];
  });
}

function moved(configuration: Configuration, setting: Setting, shown: number): Configuration {
  return changed(configuration, setting.key, `${String(shown)} ${setting.shown}`.trim());
}

/** What changes with a setting, that which follows it included. */
function differences(content: Content, configuration: Configuration, setting: Setting, shown: number): Differences {
  const base = valuesOf(content, configuration);
  const value = toSi(shown, scaleOf(setting.shown, scalesOf(content, setting.unit)), base.get(ATMOSPHERE) ?? 101325);
  if (!isInside(setting, value)) return [[setting.key, NaN]];
  const other = valuesOf(content, moved(configuration, setting, shown));
  return [...other].filter(([key, number]) => number !== base.get(key));
}

/** What differs in a run, with the settings that have the value of another one as long as nobody changes them. */
function withFollowers(program: Program, configuration: Configuration, base: Values, given: Differences): Differences {
  const found = new Map(given);
  const own = new Set(found.keys());
  // A follower may be followed in its turn.
  for (const { key, follows, words } of [...program.settings, ...program.settings]) {
    const typed = configuration.changes[key];
    const value = found.get(typed === undefined ? follows : (words[typed] ?? ""));
    if (value !== undefined && !own.has(key)) found.set(key, value);
  }
  const made = madeFrom(program, configuration, new Map([...base, ...found]));
  return [...found, ...[...made].filter(([key, value]) => !own.has(key) && value !== base.get(key))];
}

/** The settings of many runs, one after the other: those of a configuration but for what differs in each. */
function rowsOf(program: Program, base: Values, differing: readonly Differences[]): Float64Array<ArrayBuffer> {
  const usual = Float64Array.from(program.settings, (setting) => base.get(setting.key) ?? setting.value);
  const places = new Map(program.settings.map((setting, place) => [setting.key, place]));
  const rows = new Float64Array(differing.length * usual.length);
  differing.forEach((changes, number) => {
    rows.set(usual, number * usual.length);
    for (const [key, value] of changes) rows[number * usual.length + (places.get(key) ?? NaN)] = value;
  });
  return rows;
}

/** Settings of a program of which the set says how well they are known. */
export function uncertainSettings(program: Program): Setting[] {
  return program.settings.filter((setting) => setting.interval !== null);
}

/** Between which values 95 % of 200 draws lie, channel by channel; each number is drawn evenly from its interval. Null where no longer wanted. */
export async function bandOf(
  content: Content,
  workers: Workers,
  configuration: Configuration,
  run: Run,
  isWanted: () => boolean,
): Promise<ReadonlyMap<string, Band> | null> {
  const program = programNamed(content, configuration.program);
  const base = valuesOf(content, configuration);
  const draw = evenly();
  const free = uncertainSettings(program).filter((setting) => configuration.changes[setting.key] === undefined);
  const drawn = Array.from({ length: DRAWS }, () =>
    free.map(({ key, interval }): [string, number] => [key, (interval?.[0] ?? 0) + ((interval?.[1] ?? 0) - (interval?.[0] ?? 0)) * draw()]),
  );
  const rows = rowsOf(program, base, drawn.map((changes) => withFollowers(program, configuration, base, changes)));
  const every = Math.max(1, Math.floor(run.time.length / BAND_PLACES));
  const places = Math.floor((run.time.length - 1) / every) + 1;
  const time = Float64Array.from({ length: places }, (_, place) => run.time[place * every] ?? 0);
  const found = await workers.runMany(program, rows, { every, places }, { goesOn: isWanted, isWanted });
  if (found.ended.length < DRAWS) return null;
  const all = program.channels.map(({ name }) => name);
  const channels = BANDED.filter((name) => all.includes(name));
  return new Map(channels.map((name) => [name, { time, ...ends(found, places, all.indexOf(name), all.length) }]));
}

/** Between which values most runs lie in one of so many channels, place by place. */
function ends({ traces, ended }: Ensemble, places: number, channel: number, channels: number): { low: Float64Array; high: Float64Array } {
  const [low, high] = [new Float64Array(places), new Float64Array(places)];
  const good = [...ended.keys()].filter((run) => ended[run] === 0);
  const outside = Math.floor(good.length / ONE_OF);
  if (outside === 0) return { low: low.fill(NaN), high: high.fill(NaN) };
  for (let place = 0; place < places; place += 1) {
    const column = Float64Array.from(good, (run) => traces[(run * channels + channel) * places + place] ?? 0).sort();
    low[place] = column[outside] ?? 0;
    high[place] = column[column.length - 1 - outside] ?? 0;
  }
  return { low, high };
}

/** Numbers from 0 to 1, the same at every start: by whole numbers, a product and a sum. */
function evenly(): () => number {
  let state = 2011n;
  return () => {
    state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffffffffffffffffn;
    return Number(state >> 11n) / 9007199254740992;
  };
}

/** What a metric becomes where one setting that nobody printed goes to either end. */
export interface Effect {
  readonly setting: Setting;
  readonly ends: readonly [number, number];
  readonly metrics: readonly [ReadonlyMap<string, number>, ReadonlyMap<string, number>];
}

/** The interval of a setting, else a fifth less and more; of a pressure what it is above the atmosphere. */
function endsOf({ key, unit, interval }: Setting, base: Values): readonly [number, number] {
  if (interval !== null) return interval;
  const value = base.get(key) ?? 0;
  const size = 0.2 * (unit === "Pa_a" ? value - (base.get(ATMOSPHERE) ?? 0) : value);
  return [value - size, value + size];
}

/** Effects of all settings of a program that are assumed: over their ends. Of no use where no longer wanted. */
export async function effectsOf(content: Content, workers: Workers, configuration: Configuration, isWanted: () => boolean): Promise<Effect[]> {
  const program = programNamed(content, configuration.program);
  const base = valuesOf(content, configuration);
  const found = [...settingsByKey(program).values()].map((setting): [Setting, readonly [number, number]] => [setting, endsOf(setting, base)]);
  const isMoved = ([setting, ends]: (typeof found)[number]) => setting.origin === "assumed" && ends[0] !== ends[1] && ends.every((end) => isInside(setting, end));
  const moved = found.filter(isMoved);
  const assumed = moved.map(([setting]) => setting);
  const ends = moved.map(([, both]) => both);
  const differing = assumed.flatMap(({ key }, place) => (ends[place] ?? [0, 0]).map((end) => withFollowers(program, configuration, base, [[key, end]])));
  if (differing.length === 0) return [];
  const runs = await workers.runMany(program, rowsOf(program, base, differing), NO_TRACE, { goesOn: isWanted, isWanted });
  const width = program.metrics.length;
  const metricsOf = (row: number) =>
    new Map(program.metrics.map((metric, place) => [metric.name, runs.ended[row] === 0 ? (runs.metrics[row * width + place] ?? NaN) : NaN]));
  return assumed.map((setting, place) => ({ setting, ends: ends[place] ?? [0, 0], metrics: [metricsOf(2 * place), metricsOf(2 * place + 1)] }));
}
