/** A map of one metric over two settings: 1,024 runs, the line of the present value, and a click that goes there. */

import { colour, shade } from "./colours";
import { type Content, type Metric, programNamed, type Setting } from "./content";
import { textOnSlider } from "./controls";
import { element, say } from "./dom";
import type { Run } from "./engine";
import type { Workers } from "./jobs";
import { ATMOSPHERE, type Configuration, settingsByKey, shownNumber, valuesOf } from "./settings";
import { plain, shownValue } from "./shown";
import { readableUnit, telling } from "./units";
import { type Axes, type Landscape, landscapeOf, SIDE } from "./variation";

const SIZE = 320;

export class MapView {
  private readonly across = element("select", { "aria-label": "Across" });
  private readonly up = element("select", { "aria-label": "Up" });
  private readonly metric = element("select", { "aria-label": "Metric of the map" });
  private readonly of = element("select", { "aria-label": "Configuration of the map" });
  private readonly canvas = element("canvas", { width: SIZE * 2, height: SIZE * 2, tabindex: 0, role: "application", class: "map" });
  private readonly words = element("p", { class: "note", "aria-live": "polite" });
  private readonly axes = [element("span", { class: "axis across" }), element("span", { class: "axis up" })] as const;
  private readonly scale = element("p", { class: "scale" });
  private configurations: readonly Configuration[] = [];
  private program = "";
  private landscape: Landscape | null = null;
  private readonly cells = element("canvas");
  /** What the map is of that is shown or under way; where the page stands on it is not part of that. */
  private wish = "";
  private isBusy = false;
  private isDue = false;

  constructor(
    private readonly host: HTMLElement,
    private readonly content: Content,
    private readonly workers: Workers,
    private readonly runOf: (configuration: Configuration) => Run | null,
    private readonly go: (place: number, texts: readonly (readonly [string, string])[]) => void,
  ) {
    const field = (words: string, select: HTMLElement) => element("label", {}, words, select);
    const plate = element("div", { class: "plate" }, this.axes[1], this.canvas, this.axes[0]);
    host.append(
      element("div", { class: "fields" }, field("Of", this.of), field("Show", this.metric), field("across", this.across), field("up", this.up)),
      plate,
      this.scale,
      this.words,
    );
    for (const select of [this.across, this.up, this.metric]) select.addEventListener("change", () => this.update());
    this.of.addEventListener("change", () => this.refresh(this.configurations, [...this.of.options].map((option) => option.text)));
    this.canvas.addEventListener("click", (event) => this.clicked(event));
    this.canvas.addEventListener("keydown", (event) => this.keyed(event));
  }

  get isOpen(): boolean {
    return this.host.closest("details")?.open ?? true;
  }

  /** Follow the configurations of the page. */
  refresh(configurations: readonly Configuration[], names: readonly string[]): void {
    this.configurations = configurations;
    const chosen = Math.min(Math.max(0, this.of.selectedIndex), configurations.length - 1);
    if ([...this.of.options].map((option) => option.text).join("\n") !== names.join("\n")) {
      this.of.replaceChildren(...names.map((name, place) => element("option", { value: place, selected: place === chosen }, name)));
    }
    const configuration = configurations[chosen];
    if (configuration === undefined || !this.isOpen) return;
    if (configuration.program !== this.program) this.fill(configuration.program);
    this.update();
  }

  private fill(name: string): void {
    this.program = name;
    const program = programNamed(this.content, name);
    const tab = this.content.tabs.find((item) => item.programs.includes(name));
    const first = (tab?.first ?? []).filter((key) => (settingsByKey(program).get(key)?.kept ?? "zero") !== "zero");
    const free = program.settings.filter(({ key, kept }) => kept !== "zero" && !key.endsWith(".seed"));
    const keys = [...new Set([...first, ...free.map((setting) => setting.key)])];
    const fillIn = (select: HTMLSelectElement, entries: readonly (readonly [string, string])[], chosen: string | undefined) =>
      select.replaceChildren(...entries.map(([value, words]) => element("option", { value, selected: value === chosen }, words)));
    const settings = keys.map((key) => [key, settingsByKey(program).get(key)?.label ?? key] as const);
    fillIn(this.across, settings, first[0]);
    fillIn(this.up, settings, first[1]);
    fillIn(this.metric, program.metrics.map((metric) => [metric.name, metric.label] as const), program.metrics[0]?.name);
  }

  private get chosen(): (Axes & { configuration: Configuration }) | null {
    const configuration = this.configurations[Math.max(0, this.of.selectedIndex)];
    if (configuration === undefined) return null;
    const program = programNamed(this.content, configuration.program);
    const settings = settingsByKey(program);
    const [across, up] = [settings.get(this.across.value), settings.get(this.up.value)];
    const metric = program.metrics.find((item) => item.name === this.metric.value);
    return across === undefined || up === undefined || metric === undefined ? null : { configuration, across, up, metric };
  }

  /** Run the map anew where it has to be; while one is under way only the last wish counts. */
  private update(): void {
    const { chosen } = this;
    if (chosen === null) return;
    if (chosen.across === chosen.up) {
      say(this.words, "Choose two different settings.");
      return;
    }
    say(this.words, "");
    const wish = wishOf(chosen);
    this.isDue = this.isBusy && wish !== this.wish;
    if (wish === this.wish && this.landscape !== null) this.draw(this.landscape);
    if (wish === this.wish || this.isBusy) return;
    this.isBusy = true;
    this.wish = wish;
    const began = performance.now();
    const show = (landscape: Landscape) => {
      this.landscape = landscape;
      this.draw(landscape);
      if (landscape.side === SIDE) this.canvas.dataset["milliseconds"] = String(Math.round(performance.now() - began));
      else this.canvas.dataset["first"] = String(Math.round(performance.now() - began));
    };
    const end = () => {
      this.isBusy = false;
      if (!this.isDue) return;
      this.isDue = false;
      this.update();
    };
    const isWanted = () => {
      const isCurrent = this.isOpen && !this.isDue;
      if (!isCurrent) this.wish = "";
      return isCurrent;
    };
    const fail = telling((words) => {
      this.wish = "";
      say(this.words, words);
    });
    void landscapeOf(this.content, this.workers, chosen.configuration, chosen, show, isWanted).catch(fail).then(end);
  }

  private draw({ across, up, metric, side, values }: Landscape): void {
    const context = this.canvas.getContext("2d");
    const configuration = this.configurations[Math.max(0, this.of.selectedIndex)];
    if (context === null || configuration === undefined) return;
    const good = values.filter((value) => Number.isFinite(value));
    const [low, high] = [good.reduce((a, b) => Math.min(a, b), Infinity), good.reduce((a, b) => Math.max(a, b), -Infinity)];
    this.paint(context, values, side, low, high);
    const here = this.present(configuration, across, up);
    const cell = this.canvas.width / SIDE;
    const level = this.runOf(configuration)?.metrics.get(metric.name) ?? NaN;
    contour(context, values, side, level, cell);
    const [x, y] = [(here[0] + 0.5) * cell, (SIDE - 0.5 - here[1]) * cell];
    for (const [width, stroke] of [[7, "#000"], [3, "#fff"]] as const) {
      context.lineWidth = width;
      context.strokeStyle = stroke;
      context.beginPath();
      context.arc(x, y, 12, 0, 7);
      context.stroke();
    }
    this.label(across, up, metric, low, high, level);
  }

  /** Fill the map with colours, one dot a run on a small canvas that is then enlarged. */
  private paint(context: CanvasRenderingContext2D, values: Float64Array, side: number, low: number, high: number): void {
    const small = this.cells.getContext("2d");
    if (small === null) return;
    if (this.cells.width !== side) this.cells.width = this.cells.height = side;
    const dots = small.createImageData(side, side);
    values.forEach((value, place) => {
      const at = 4 * ((side - 1 - Math.floor(place / side)) * side + (place % side));
      if (Number.isFinite(value)) dots.data.set([...shade(high > low ? (value - low) / (high - low) : 0), 255], at);
    });
    small.putImageData(dots, 0, 0);
    context.fillStyle = colour("line");
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    context.imageSmoothingEnabled = false;
    context.drawImage(this.cells, 0, 0, this.canvas.width, this.canvas.height);
  }

  private label(across: Setting, up: Setting, metric: Metric, low: number, high: number, level: number): void {
    const ends = ({ label, slider, shown }: Setting) => `${label}: ${plain(slider[0])} to ${plain(slider[1])} ${readableUnit(shown)}`;
    say(this.axes[0], `${ends(across)} →`);
    say(this.axes[1], `${ends(up)} →`);
    const text = (value: number) => plain(shownValue(this.content, metric, value), 3);
    const unit = readableUnit(metric.shown);
    say(this.scale, `${metric.label}: from ${text(low)} (yellow) to ${text(high)} ${unit} (violet). White line: current value, ${text(level)} ${unit}.`);
    this.canvas.setAttribute(
      "aria-label",
      `Map of ${metric.label} over ${across.label} and ${up.label}, ${text(low)} to ${text(high)} ${unit}, here ${text(level)}. Arrow keys move.`,
    );
  }

  /** Where the configuration stands on the map, in cells from the lower left. */
  private present(configuration: Configuration, across: Setting, up: Setting): readonly [number, number] {
    const values = valuesOf(this.content, configuration);
    const [x, y] = [across, up].map((setting) => {
      const shown = Number(shownNumber(this.content, setting, values.get(setting.key) ?? 0, values.get(ATMOSPHERE) ?? 101325));
      const [from, to] = setting.slider;
      return Math.min(SIDE - 1, Math.max(0, ((shown - from) / (to - from)) * (SIDE - 1)));
    });
    return [x ?? 0, y ?? 0];
  }

  private clicked(event: MouseEvent): void {
    const box = this.canvas.getBoundingClientRect();
    const cell = box.width / SIDE;
    this.goTo((event.clientX - box.left) / cell - 0.5, SIDE - 0.5 - (event.clientY - box.top) / cell);
  }

  private keyed(event: KeyboardEvent): void {
    const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const { chosen } = this;
    if (move === undefined || chosen === null) return;
    event.preventDefault();
    const here = this.present(chosen.configuration, chosen.across, chosen.up);
    this.goTo(Math.round(here[0]) + (move[0] ?? 0), Math.round(here[1]) + (move[1] ?? 0));
  }

  private goTo(x: number, y: number): void {
    if (this.landscape === null) return;
    const { across, up } = this.landscape;
    const text = (setting: Setting, place: number) => textOnSlider(setting, Math.min(SIDE - 1, Math.max(0, place)) / (SIDE - 1));
    this.go(Math.max(0, this.of.selectedIndex), [[across.key, text(across, x)], [up.key, text(up, y)]]);
  }
}

/** What decides the runs of a map: the configuration, but for the two settings that the map goes over. */
function wishOf({ configuration, across, up, metric }: Axes & { configuration: Configuration }): string {
  const { [across.key]: _, [up.key]: __, ...others } = configuration.changes;
  return JSON.stringify([configuration.program, across.key, up.key, metric.name, others]);
}

/** The line of one value, by marching squares; `cell` is the size of one of a full map. */
function contour(context: CanvasRenderingContext2D, values: Float64Array, side: number, level: number, cell: number): void {
  const apart = SIDE / side;
  const at = (column: number, row: number) => (values[row * side + column] ?? NaN) - level;
  const point = (column: number, row: number) => [(apart * column + 0.5) * cell, (SIDE - 0.5 - apart * row) * cell] as const;
  context.beginPath();
  for (let row = 0; row < side - 1; row += 1) {
    for (let column = 0; column < side - 1; column += 1) {
      // Most cells have all their corners on one side of the line.
      const above = +(at(column, row) >= 0) + +(at(column + 1, row) >= 0) + +(at(column + 1, row + 1) >= 0) + +(at(column, row + 1) >= 0);
      if (above === 0 || above === 4) continue;
      const corners = [[column, row], [column + 1, row], [column + 1, row + 1], [column, row + 1]] as const;
      const crossed = corners.flatMap(([x0, y0], place) => {
        const [x1, y1] = corners[(place + 1) % 4] ?? [0, 0];
        const [a, b] = [at(x0, y0), at(x1, y1)];
        return a < 0 !== b < 0 && Number.isFinite(a - b) ? [point(x0 + (x1 - x0) * (a / (a - b)), y0 + (y1 - y0) * (a / (a - b)))] : [];
      });
      for (let place = 0; place + 1 < crossed.length; place += 2) {
        context.moveTo(...(crossed[place] ?? [0, 0]));
        context.lineTo(...(crossed[place + 1] ?? [0, 0]));
      }
    }
  }
  for (const [width, stroke] of [[6, "rgb(0 0 0 / 45%)"], [2.5, "#fff"]] as const) {
    context.lineWidth = width;
    context.strokeStyle = stroke;
    context.stroke();
  }
}
