/** Plots over time with one cursor: torque, pressures, command, angle, gas, with bands and recordings behind the curves. */

import uPlot from "../vendor/uplot/uPlot.esm.js";
import type { Overlay } from "./agreement";
import { clockOf, firstAfter, onClock } from "./clock";
import { colour, DASHES, lineColourOf } from "./colours";
import { channelNamed, type Content, scalesOf } from "./content";
import { element, say, whenQuiet } from "./dom";
import type { Run } from "./engine";
import { sustainedTorque } from "./facts";
import { lineOn, pathsOf } from "./paths";
import { atmosphereOf, type Values } from "./settings";
import { plain, shownValue } from "./shown";
import { fromSi, readableUnit, scaleOf } from "./units";

export interface Panel {
  readonly title: string;
  /** What its vertical axis is called, before the unit. */
  readonly axis: string;
  readonly channels: readonly string[];
  /** Channels of which the one that there is is drawn once, in ink: what was asked for. */
  readonly wanted?: readonly string[];
  /** What the title says after its name. */
  readonly note?: string;
}

export const PANELS: readonly Panel[] = [
  { title: "Torque", axis: "Torque", channels: ["torque"], wanted: ["reference"] },
  { title: "Pressures", axis: "Pressure", channels: ["pressure_1", "pressure_2"], wanted: ["reference_pressure_1", "reference_pressure_2"], note: ", chamber 2 dashed" },
  { title: "Command to the valve", axis: "Command", channels: ["command"] },
  { title: "Gas taken from the supply", axis: "Gas", channels: ["supplied_mass"] },
  { title: "Angle of the ankle", axis: "Angle", channels: ["angle"], wanted: ["healthy_angle", "reference_angle"] },
  { title: "Torque on the wearer", axis: "Torque", channels: ["external_torque"] },
];

/** What a run is called, and what came of it. */
export interface Shown {
  readonly name: string;
  readonly program: string;
  readonly place: number;
  readonly look: number;
  readonly run: Run;
  /** Settings of the run: its gauge pressures count from its own atmosphere. */
  readonly values: Values;
  readonly band: ReadonlyMap<string, Band> | null;
}

export interface Band {
  readonly time: Float64Array;
  readonly low: Float64Array;
  readonly high: Float64Array;
}

interface Drawn {
  readonly panel: Panel;
  readonly readout: HTMLElement;
  readonly shown: readonly number[];
  readonly figure: HTMLElement;
  readonly host: HTMLElement;
  /** Made when it first comes into sight, and drawn anew only while it is there: on a phone most plots never are. */
  plot: uPlot | null;
  isInSight: boolean;
  isStale: boolean;
}

/** Factor and offset from SI to what is shown. */
type Scaling = readonly [number, number];

interface Line {
  readonly place: number;
  readonly channel: string;
  readonly isWanted: boolean;
}

const AXIS_SIZE = 46;
const LABEL_SIZE = 18;
/** Plots this near to the window are drawn too, so that they are there when somebody scrolls. */
const NEAR = "100px";
/** Milliseconds without a change after which the other plots are drawn too. */
const UNHURRIED = 1500;
/** Channels that keep a value until the next sample. */

export class Panels {
  private drawn: Drawn[] = [];
  private shown: readonly Shown[] = [];
  private overlay: Overlay | null = null;
  private layout = "";
  /** The time [s] of the cursor, null where there is none. */
  private time: number | null = null;
  private first: Panel | null = null;
  private programs = "";
  private readonly moving = new Set<Panel>();
  private readonly still = element("p", { class: "note still", hidden: true });
  private ranges = new Map<Panel, readonly [number, number]>();
  private readonly watcher = new ResizeObserver(() => this.fit());
  private readonly rest = whenQuiet(UNHURRIED, () => this.drawRest());
  private readonly sight = new IntersectionObserver((entries) => this.look(entries), { rootMargin: NEAR });

  constructor(
    private readonly host: HTMLElement,
    private readonly content: Content,
    private readonly pointed: (time: number | null) => void,
  ) {
    this.watcher.observe(host);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rebuild());
    addEventListener("beforeprint", () => this.drawAll());
  }

  /** Draw runs, over each other or side by side. */
  show(shown: readonly Shown[], isBeside: boolean, overlay: Overlay | null): void {
    this.shown = shown;
    this.overlay = overlay;
    const layout = JSON.stringify([isBeside, [...this.moving].map(({ title }) => title), shown.map((item) => [item.name, item.look, ...item.run.channels.keys()])]);
    const present = PANELS.filter((panel) => shown.some(({ run }) => panel.channels.some((name) => run.channels.has(name))));
    // What is asked for comes first, else how the vane moves.
    const asked = present.find((panel) => panel.wanted?.some((name) => name.startsWith("reference") && shown.some(({ run }) => run.channels.has(name))));
    const leads = (panel: Panel) => panel === (asked ?? present.find(({ channels }) => channels[0] === "angle"));
    this.rememberMoving(present);
    const moving = present.filter((panel) => this.moving.has(panel) || leads(panel));
    const panels = [...moving.filter(leads), ...moving.filter((panel) => !leads(panel))];
    this.sayStill(present.filter((panel) => !panels.includes(panel)));
    this.ranges.clear();
    if (layout !== this.layout || this.drawn.length === 0) {
      this.layout = layout;
      this.build(panels, isBeside);
    } else {
      for (const item of this.drawn) item.isStale = true;
      for (const item of this.drawn) if (item.isInSight) this.draw(item);
      if (this.time !== null) this.read(this.time);
    }
    this.rest();
  }

  /** Put the cursor of all plots to a time [s], or take it away. */
  point(time: number | null): void {
    for (const { plot } of this.drawn) {
      const left = time === null || plot === null ? -10 : plot.valToPos(time, "x");
      plot?.setCursor({ left, top: time === null ? -10 : 10 }, false);
    }
    this.read(time);
  }

  /** Names and canvases, from top to bottom, for a picture. */
  pictures(): { title: string; canvas: HTMLCanvasElement; box: DOMRect }[] {
    this.drawAll();
    return this.drawn.flatMap(({ panel, plot, figure }) =>
      plot === null ? [] : [{ title: this.titleOf(panel), canvas: plot.ctx.canvas, box: figure.getBoundingClientRect() }],
    );
  }

  /** Which panels have had a line that is not flat since these programs are shown: only they are drawn. */
  private rememberMoving(present: readonly Panel[]): void {
    const programs = JSON.stringify(this.shown.map(({ program }) => program));
    if (programs !== this.programs) this.moving.clear();
    this.programs = programs;
    const isFlat = (values: Float64Array | undefined) => values === undefined || values.every((value) => value === values[0]);
    for (const panel of present) {
      const names = [...panel.channels, ...(panel.wanted ?? [])];
      if (names.some((name) => this.overlay?.channels.has(name) || !this.shown.every(({ run }) => isFlat(run.channels.get(name))))) this.moving.add(panel);
    }
  }

  /** Say of each panel that is left out at which value it stays. */
  private sayStill(panels: readonly Panel[]): void {
    const texts = panels.map((panel) => {
      const channel = panel.channels[0] ?? "";
      const kind = channelNamed(this.content, channel);
      const values = this.shown.flatMap((item) => {
        const value = item.run.channels.get(channel)?.[0];
        return value === undefined ? [] : [plain(shownValue(this.content, kind, value, atmosphereOf(item.values)), 3)];
      });
      return `${panel.axis} stays at ${`${[...new Set(values)].join(" and ")} ${readableUnit(kind.shown)}`.trim()}.`;
    });
    say(this.still, texts.join(" "));
    this.still.hidden = texts.length === 0;
  }

  private rebuild(): void {
    const isBeside = this.host.classList.contains("beside");
    this.layout = "";
    this.show(this.shown, isBeside, this.overlay);
  }

  private build(panels: readonly Panel[], isBeside: boolean): void {
    for (const { plot } of this.drawn) plot?.destroy();
    this.sight.disconnect();
    this.first = panels[0] ?? null;
    this.host.classList.toggle("beside", isBeside);
    this.host.style.setProperty("--columns", String(isBeside ? this.shown.length : 2));
    const groups = isBeside ? this.shown.map((_, place) => [place]) : [this.shown.map((_, place) => place)];
    const places = panels.flatMap((panel) => groups.map((shown) => ({ panel, shown })));
    const figures = places.map(({ panel, shown }) => {
      const readout = element("span", { class: "readout" });
      const name = isBeside ? `${this.shown[shown[0] ?? 0]?.name ?? ""}: ` : "";
      const title = element("figcaption", {}, element("span", { class: "title" }, `${name}${this.titleOf(panel)}`), readout);
      const host = element("div", { class: "plot", role: "img", "aria-label": `${name}${this.titleOf(panel)} over time; the table of metrics says it in numbers` });
      return { panel, shown, readout, host, figure: element("figure", { class: "panel" }, title, host), plot: null, isInSight: false, isStale: true };
    });
    this.host.replaceChildren(...figures.map(({ figure }) => figure), this.still);
    this.drawn = figures;
    for (const item of this.drawn) {
      if (item.panel === this.first) this.draw(item);
      this.sight.observe(item.figure);
    }
    this.read(null);
  }

  private look(entries: readonly IntersectionObserverEntry[]): void {
    for (const item of this.drawn) {
      const entry = entries.filter(({ target }) => target === item.figure).at(-1);
      if (entry === undefined) continue;
      item.isInSight = entry.isIntersecting;
      if (item.isInSight) this.draw(item, entry.boundingClientRect.width);
    }
  }

  /** Draw what is out of sight too, plot by plot, so that nothing waits for all of them. */
  private drawRest(): void {
    const next = this.drawn.find(({ isStale }) => isStale);
    if (next === undefined) return;
    this.draw(next);
    setTimeout(() => this.drawRest(), 0);
  }

  private drawAll(): void {
    for (const item of this.drawn) this.draw(item);
  }

  private draw(item: Drawn, width = 0): void {
    if (!item.isStale) return;
    item.isStale = false;
    if (item.plot === null) item.plot = this.plotOf(item, width || item.host.clientWidth);
    else item.plot.setData(this.dataOf(item.panel, item.shown));
  }

  private titleOf(panel: Panel): string {
    const isOneChamber = panel.title === "Pressures" && !this.shown.some(({ run }) => run.channels.has("pressure_2"));
    return `${panel.title.replace("ankle", this.content.joint)}${isOneChamber ? "" : (panel.note ?? "")}`;
  }

  private axisOf(panel: Panel): string {
    const unit = readableUnit(channelNamed(this.content, panel.channels[0] ?? "").shown);
    return `${panel.axis}${unit === "" || unit === "-" ? "" : ` (${unit})`}`;
  }

  private plotOf({ panel, shown, host }: Drawn, width: number): uPlot {
    const lines = this.linesOf(panel, shown);
    const ink = colour("ink");
    const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, ticks: { show: false }, font: "12px system-ui, sans-serif", labelSize: LABEL_SIZE, labelGap: 0, labelFont: "12px system-ui, sans-serif" };
    const series: uPlot.Series[] = lines.map((line) => ({
      stroke: line.isWanted ? ink : lineColourOf(this.shown[line.place]?.look ?? 1),
      width: line.isWanted ? 1.5 : 2,
      dash: line.isWanted ? [6, 4] : (DASHES[panel.channels.indexOf(line.channel)] ?? []),
      points: { show: false },
      paths: pathsOf(line.channel === "command"),
    }));
    const options: uPlot.Options = {
      ...sizeOf(width, panel === this.first),
      legend: { show: false },
      cursor: { sync: { key: "time" }, drag: { x: false, y: false }, points: { size: 7 } },
      scales: { x: { time: false, range: () => [...this.span] as [number, number] }, y: { range: () => [...this.rangeFor(panel)] as [number, number] } },
      axes: [
        { ...axis, label: "Time (s)", size: 24, space: 80, values: (_, ticks) => ticks.map((tick) => plain(tick)) },
        { ...axis, label: this.axisOf(panel), size: AXIS_SIZE, values: (_, ticks) => ticks.map((tick) => plain(tick)) },
      ],
      series: [{}, ...series],
      hooks: {
        drawAxes: [(plot) => this.drawBehind(plot, panel, shown)],
        setCursor: [(plot) => this.moved(plot)],
      },
    };
    return new uPlot(options, this.dataOf(panel, shown), host);
  }

  /** From the first to the last sample of all runs, so that plots beside each other have one axis. */
  private get span(): readonly [number, number] {
    const times = this.shown.map(({ run }) => run.time);
    return [Math.min(...times.map((time) => time[0] ?? 0)), Math.max(...times.map((time) => time.at(-1) ?? 0))];
  }

  private moved(plot: uPlot): void {
    if (plot.cursor.event === undefined || plot.cursor.event === null) return;
    const left = plot.cursor.left ?? -1;
    const time = left < 0 ? null : plot.posToVal(left, "x");
    this.read(time);
    this.pointed(time);
  }

  private read(time: number | null): void {
    this.time = time;
    for (const { panel, shown, readout } of this.drawn) {
      const values = this.linesOf(panel, shown).map((line) => {
        const item = this.shown[line.place];
        const values = item?.run.channels.get(line.channel);
        if (item === undefined || values === undefined || time === null) return null;
        const at = Math.min(values.length - 1, Math.max(0, firstAfter(item.run.time, time) - 1));
        const value = shownValue(this.content, channelNamed(this.content, line.channel), values[at] ?? NaN, atmosphereOf(item.values));
        return { line, text: plain(value, 3) };
      });
      readout.replaceChildren(
        ...values
          .filter((value) => value !== null)
          .map(({ line, text }) => element("b", { class: line.isWanted ? "wanted" : `run-${this.shown[line.place]?.look ?? 1}` }, text)),
      );
    }
  }

  private linesOf(panel: Panel, shown: readonly number[]): Line[] {
    const wanted = (panel.wanted ?? [])
      .map((channel) => ({ channel, place: shown.find((place) => this.shown[place]?.run.channels.has(channel)), isWanted: true }))
      .find(({ place }) => place !== undefined);
    const lines = shown.flatMap((place) =>
      panel.channels.filter((name) => this.shown[place]?.run.channels.has(name)).map((channel) => ({ place, channel, isWanted: false })),
    );
    return wanted?.place === undefined ? lines : [{ ...wanted, place: wanted.place }, ...lines];
  }

  private dataOf(panel: Panel, shown: readonly number[]): uPlot.AlignedData {
    const clock = clockOf(shown.map((place) => this.shown[place]?.run.time ?? new Float64Array()));
    const columns = this.linesOf(panel, shown).map(({ place, channel }) => {
      const item = this.shown[place];
      const values = item?.run.channels.get(channel) ?? new Float64Array();
      if (item === undefined || values.length === 0) return new Float64Array(clock.length).fill(NaN);
      return displayed(onClock(clock, item.run.time, values), this.lineOf(channel, item));
    });
    return [clock, ...columns];
  }

  /** Factor and offset from SI to what is shown of a run. */
  private lineOf(channel: string, { values }: Shown): Scaling {
    const { unit, shown } = channelNamed(this.content, channel);
    if (unit === shown) return [1, 0];
    const scale = scaleOf(shown, scalesOf(this.content, unit));
    return [1 / Number(scale.scale), fromSi(0, scale, atmosphereOf(values))];
  }

  /** The same of the recording beside a run: what was recorded in gauge is gauge beside every one. */
  private lineOfRecorded(channel: string, item: Shown): Scaling {
    const [factor, offset] = this.lineOf(channel, item);
    return [factor, this.overlay?.gauges.has(channel) ? offset + factor * atmosphereOf(item.values) : offset];
  }

  private rangeFor(panel: Panel): readonly [number, number] {
    const found = this.ranges.get(panel) ?? this.rangeOf(panel);
    this.ranges.set(panel, found);
    return found;
  }

  /** From least to largest of a panel over all that is shown in it, so that plots beside each other can be compared. */
  private rangeOf(panel: Panel): readonly [number, number] {
    let [low, high] = [Infinity, -Infinity];
    const include = (values: Float64Array | undefined, [factor, offset]: Scaling) => {
      if (values === undefined) return;
      let [least, most] = [Infinity, -Infinity];
      for (let place = 0; place < values.length; place += 1) {
        const value = values[place] ?? 0;
        if (value < least) least = value;
        if (value > most) most = value;
      }
      low = Math.min(low, least * factor + offset);
      high = Math.max(high, most * factor + offset);
    };
    for (const channel of [...panel.channels, ...(panel.wanted ?? [])]) {
      for (const item of this.shown) {
        const line = this.lineOf(channel, item);
        include(item.run.channels.get(channel), line);
        include(item.band?.get(channel)?.low, line);
        include(item.band?.get(channel)?.high, line);
        include(this.overlay?.channels.get(channel), this.lineOfRecorded(channel, item));
      }
    }
    if (!(high >= low)) return [0, 1];
    if (high - low < 1e-9 * Math.max(1, Math.abs(high))) return [low - 1, high + 1];
    const margin = 0.06 * (high - low);
    return [low === 0 ? 0 : low - margin, high + margin];
  }

  /** Bands and recordings, behind the curves. */
  private drawBehind(plot: uPlot, panel: Panel, shown: readonly number[]): void {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    if (panel.wanted?.includes("reference")) this.shadeUnreached(plot, shown);
    for (const channel of panel.channels) {
      for (const place of shown) {
        const item = this.shown[place];
        const band = item?.band?.get(channel);
        if (item !== undefined && band !== undefined) this.drawBand(plot, band, this.lineOf(channel, item), lineColourOf(item.look));
      }
      const recorded = this.overlay?.channels.get(channel);
      const first = this.shown[shown[0] ?? 0];
      if (this.overlay === null || recorded === undefined || first === undefined) continue;
      this.drawRecorded(plot, this.overlay.time, displayed(recorded, this.lineOfRecorded(channel, first)));
    }
    ctx.restore();
  }

  /** Shade where a torque is required that the supply does not sustain, with a line at what it does; once where all share it. */
  private shadeUnreached(plot: uPlot, shown: readonly number[]): void {
    const { ctx, bbox } = plot;
    const limits = new Map<number, Shown>();
    for (const place of shown) {
      const item = this.shown[place];
      const wanted = item?.run.channels.get("reference");
      const ends = item === undefined ? null : sustainedTorque(this.content, item);
      if (item === undefined || wanted === undefined || ends === null) continue;
      if (wanted.some((value) => value > ends[1])) limits.set(ends[1], item);
      if (wanted.some((value) => value < ends[0])) limits.set(ends[0], item);
    }
    for (const [limit, { run }] of limits) {
      const wanted = run.channels.get("reference") ?? new Float64Array();
      const edge = plot.valToPos(limit, "y", true);
      const right = bbox.left + bbox.width;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, limit > 0 ? bbox.top : edge, bbox.width, limit > 0 ? edge - bbox.top : bbox.top + bbox.height - edge);
      ctx.clip();
      ctx.beginPath();
      ctx.moveTo(bbox.left, edge);
      for (let place = 0; place < run.time.length; place += 1) ctx.lineTo(plot.valToPos(run.time[place] ?? 0, "x", true), plot.valToPos(wanted[place] ?? 0, "y", true));
      ctx.lineTo(plot.valToPos(run.time.at(-1) ?? 0, "x", true), edge);
      ctx.globalAlpha = 0.14;
      ctx.fillStyle = colour("ink");
      ctx.fill();
      ctx.restore();
      ctx.fillStyle = colour("soft");
      ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.textAlign = "right";
      ctx.textBaseline = "middle";
      const middle = plot.valToPos((limit + (wanted.at(-1) ?? limit)) / 2, "y", true);
      ctx.fillText("more than the supply sustains", right - 8 * devicePixelRatio, middle);
    }
  }

  private drawBand(plot: uPlot, band: Band, [factor, offset]: Scaling, fill: string): void {
    const { ctx } = plot;
    ctx.beginPath();
    const put = (place: number, value: number) =>
      ctx.lineTo(plot.valToPos(band.time[place] ?? 0, "x", true), plot.valToPos(value * factor + offset, "y", true));
    for (let place = 0; place < band.time.length; place += 1) put(place, band.low[place] ?? 0);
    for (let place = band.time.length - 1; place >= 0; place -= 1) put(place, band.high[place] ?? 0);
    ctx.globalAlpha = 0.22;
    ctx.fillStyle = fill;
    ctx.fill();
    ctx.globalAlpha = 1;
  }

  private drawRecorded(plot: uPlot, time: Float64Array, values: Float64Array): void {
    const { ctx } = plot;
    ctx.strokeStyle = colour("recorded");
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.stroke(lineOn(plot, time, values, false));
  }

  private fit(): void {
    const sizes = this.drawn.map(({ host, panel }) => sizeOf(host.clientWidth, panel === this.first));
    this.drawn.forEach(({ plot }, place) => {
      const size = sizes[place];
      if (plot !== null && size !== undefined && (size.width !== plot.width || size.height !== plot.height)) plot.setSize(size);
    });
  }
}

function sizeOf(hostWidth: number, isFirst: boolean): { width: number; height: number } {
  const width = Math.max(200, Math.round(hostWidth));
  return { width, height: isFirst ? Math.min(300, Math.max(190, width * 0.42)) : 170 };
}

function displayed(values: Float64Array, [factor, offset]: Scaling): Float64Array {
  if (factor === 1 && offset === 0) return values;
  const found = new Float64Array(values.length);
  for (let place = 0; place < values.length; place += 1) found[place] = (values[place] ?? 0) * factor + offset;
  return found;
}
