/** What the page offers beside the plots: sharing, the map, a recording of one's own, and what each assumption does. */

import { programNamed } from "./content";
import { element, say } from "./dom";
import type { PageFrame } from "./frame";
import { refuseFile } from "./jobs";
import { MapView } from "./map";
import type { Named, Page } from "./page";
import { agreementTable, askForColumns, columnsOf, type ColumnMap, mapOfHeader } from "./recording";
import { scenarioFile } from "./scenario_file";
import { atmosphereOf, type Configuration, valuesOf } from "./settings";
import { samplesText, savePicture, saveState, saveText } from "./sharing";
import { addressOf, stateOfFile } from "./state";
import { plain, shownText, shownValue } from "./shown";
import { InputError, readableUnit, telling } from "./units";
import { type Effect, effectsOf } from "./variation";

const TOLD_METRICS = 3;
const TOLD_EFFECTS = 12;

export class Extras {
  private readonly map: MapView;
  private readonly errors = element("div");
  private readonly asked = element("div");
  private readonly effects = element("div");
  /** Configurations of which the effects of assumptions are shown. */
  private moved: readonly Configuration[] = [];
  /** How many recordings were to be read: only the last one counts. */
  private readings = 0;
  /** How many states were to be loaded, of which the same holds. */
  private loadings = 0;
  private readonly files = element("div", { class: "buttons files" });

  constructor(
    private readonly frame: PageFrame,
    private readonly app: Page,
  ) {
    this.map = new MapView(frame.map, app.content, app.workers, (configuration) => app.runOf(configuration), (place, texts) => app.changeOne(place, texts));
    frame.map.closest("details")?.addEventListener("toggle", () => this.follow(app.named));
    this.makeShare();
    this.makeRecording();
    this.makeAssumptions();
  }

  /** Follow the configurations, frame by frame. */
  follow(named: readonly Named[]): void {
    if (named.length !== this.moved.length || named.some(({ configuration }, place) => configuration !== this.moved[place])) {
      this.effects.replaceChildren();
      this.moved = [];
    }
    if (this.map.isOpen && this.app.content.form === "page") this.map.refresh(named.map(({ configuration }) => configuration), named.map(({ name }) => name));
    const layout = JSON.stringify(named.map(({ name }) => name));
    if (this.files.dataset["layout"] === layout) return;
    this.files.dataset["layout"] = layout;
    this.files.replaceChildren(
      ...named.flatMap(({ name, place }) => [
        element("button", { type: "button", onclick: () => this.saveScenario(place) }, `Scenario of ${name} (TOML)`),
        element("button", { type: "button", onclick: () => this.saveSamples(place) }, `Samples of ${name} (CSV)`),
      ]),
    );
  }

  /** What waits until a drag is over. */
  settle(): void {
    if (this.app.overlay !== null) void this.showErrors().catch(telling((words) => this.app.tell(words)));
  }

  private makeShare(): void {
    const { app } = this;
    const chooser = element("input", { type: "file", accept: ".json,application/json", class: "unseen", tabindex: -1, "aria-hidden": "true", "aria-label": "State to load" });
    chooser.addEventListener("change", () => {
      const file = chooser.files?.[0];
      chooser.value = "";
      if (file !== undefined) void this.loadState(file);
    });
    const link = element("input", { type: "text", readonly: true, hidden: true, "aria-label": "Address of this state" });
    /** Do what hands the state on, unless it is one that would be refused where it is opened. */
    const sharing = (work: () => void) => () => (app.refused === "" ? work() : app.tell(`Nothing is shared: ${app.refused}.`));
    const copy = () => {
      const address = `${location.href.split("#")[0]}#${addressOf(app.content, app.state)}`;
      link.value = address;
      link.hidden = false;
      link.select();
      navigator.clipboard?.writeText(address).then(
        () => app.tell("The address is in the clipboard."),
        () => app.tell("Copy the address from the field."),
      );
    };
    const button = (words: string, work: () => void) => element("button", { type: "button", onclick: work }, words);
    const own =
      app.content.form === "page"
        ? [button("Copy address", sharing(copy)), button("Save state", sharing(() => saveState(app.content, app.state))), button("Load state", () => chooser.click()), chooser, link]
        : [];
    const menu = element(
      "details",
      { class: "menu" },
      element("summary", {}, "Share and export"),
      element("div", { class: "menu-body" }, element("div", { class: "buttons" }, ...own, button("Picture of the plots (PNG)", () => savePicture(app.panels, app.named))), this.files),
    );
    this.frame.share.append(menu);
    addEventListener("keydown", (event) => {
      if (event.key === "Escape") menu.open = false;
    });
  }

  /** Load a state, unless another one is to be loaded, or the page was changed, before it is read. */
  private async loadState(file: Blob): Promise<void> {
    const { app } = this;
    this.loadings += 1;
    const [mine, before] = [this.loadings, app.state];
    try {
      const text = await file.text().catch(refuseFile);
      if (mine !== this.loadings) return;
      if (app.state !== before) throw new InputError("the page was changed before it was read; load it again");
      app.become(stateOfFile(app.content, text));
      app.tell("");
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      if (mine === this.loadings) app.tell(`The file could not be loaded: ${error.message}.`);
    }
  }

  private saveScenario(place: number): void {
    const configuration = this.app.bench[place];
    if (configuration !== undefined) saveText(`${configuration.program}.toml`, scenarioFile(this.app.content, configuration));
  }

  private saveSamples(place: number): void {
    const configuration = this.app.bench[place];
    const run = configuration === undefined ? null : this.app.runOf(configuration);
    if (configuration === undefined || run === null) return;
    saveText(`${configuration.program}.csv`, samplesText(programNamed(this.app.content, configuration.program), run));
  }

  private makeRecording(): void {
    const { app } = this;
    const chooser = element("input", { type: "file", accept: ".csv,text/csv,.txt", "aria-label": "Recording as CSV" });
    const clear = element("button", { type: "button", onclick: () => this.clear() }, "Remove recording");
    chooser.addEventListener("change", () => {
      const file = chooser.files?.[0];
      chooser.value = "";
      if (file !== undefined) void this.read(file);
    });
    this.frame.recording.append(
      element("p", {}, "Drop a CSV file anywhere on this page, or choose one: a header such as ", element("code", {}, "time [s],torque [N m],pressure_1 [psi_g]"), ", then one line a sample. It stays in this page."),
      element("div", { class: "buttons" }, chooser, clear),
      this.asked,
      this.errors,
    );
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      const [file, ...others] = event.dataTransfer?.files ?? [];
      if (file === undefined) return;
      const read = file.name.endsWith(".json") ? this.loadState(file) : this.read(file);
      // One at a time: the others are named, so that nobody thinks that they are in the picture.
      if (others.length > 0) void read.then(() => app.tell(`${app.told} Not opened, as one file is read at a time: ${others.map(({ name }) => name).join(", ")}.`.trim()));
    });
  }

  private clear(): void {
    this.readings += 1;
    this.asked.replaceChildren();
    this.errors.replaceChildren();
    this.app.tell("");
    this.app.overlayWith(null);
  }

  /** Read a file in a worker, so that the page goes on, and show it. */
  async read(file: File): Promise<void> {
    this.app.tell(`Reading ${file.name} ...`);
    this.readings += 1;
    const mine = this.readings;
    const isLast = () => mine === this.readings;
    try {
      const read = await this.app.workers.readTable(file, isLast);
      if (read === null || !isLast()) return;
      const { reading, heads } = read;
      const map = mapOfHeader(heads);
      if (map !== null) await this.take(file.name, reading, map, isLast);
      else {
        this.app.tell(`${file.name}: say below what its columns are.`);
        const details = this.frame.recording.closest("details");
        if (details !== null) details.open = true;
        this.asked.replaceChildren(askForColumns(heads, (given) => void this.take(file.name, reading, given, isLast)));
      }
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      if (isLast()) this.app.tell(`${file.name}: ${error.message}.`);
    }
  }

  private async take(name: string, reading: number, map: readonly ColumnMap[], isLast: () => boolean): Promise<void> {
    try {
      const recorded = await this.app.workers.takeRecording(reading, columnsOf(this.app.content, map));
      if (!isLast()) return;
      this.app.overlayWith(recorded);
      this.asked.replaceChildren();
      this.app.tell(`${name} is overlaid on the runs; the errors are listed below.`);
      const details = this.frame.recording.closest("details");
      if (details !== null) details.open = true;
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      this.app.tell(`${name}: ${error.message}.`);
    }
  }

  private async showErrors(): Promise<void> {
    const { app } = this;
    const { overlay, state } = app;
    const asked = app.named.map(async ({ name, configuration }) => {
      const run = app.runOf(configuration);
      const isHeld = JSON.stringify(programNamed(app.content, configuration.program).document["motion"] ?? "").includes('"locked"');
      return { name, errors: run === null ? [] : await app.workers.agreement(run, valuesOf(app.content, configuration), isHeld) };
    });
    const found = await Promise.all(asked);
    if (app.overlay === overlay && app.state === state) this.errors.replaceChildren(agreementTable(app.content, found));
  }

  private makeAssumptions(): void {
    const { app } = this;
    const run = element("button", { type: "button", onclick: () => void this.showEffects().catch(telling((words) => app.tell(words))) }, "Move each assumption");
    this.frame.assumptions.append(
      element("p", {}, "Some values are unpublished. Each is varied on its own over its interval, or by ±20 %; the others stay."),
      element("div", { class: "buttons" }, run),
      this.effects,
    );
  }

  private async showEffects(): Promise<void> {
    const { bench } = this.app;
    const isWanted = () => this.app.bench === bench;
    const found = await Promise.all(this.app.named.map(async (item) => ({ item, effects: await effectsOf(this.app.content, this.app.workers, item.configuration, isWanted) })));
    if (!isWanted()) return;
    this.moved = bench;
    this.effects.replaceChildren(...found.flatMap(({ item, effects }) => this.effectsTable(item, effects)));
  }

  private effectsTable({ name, configuration }: Named, effects: readonly Effect[]): HTMLElement[] {
    const { content } = this.app;
    const program = programNamed(content, configuration.program);
    const run = this.app.runOf(configuration);
    const wanted = this.app.tab.claims.length > 0 ? this.app.tab.claims : program.metrics.slice(0, TOLD_METRICS).map((metric) => metric.name);
    const metrics = program.metrics.filter((metric) => wanted.includes(metric.name));
    const change = (effect: Effect, metric: string, end: 0 | 1) => {
      const [usual, moved] = [run?.metrics.get(metric) ?? NaN, effect.metrics[end].get(metric) ?? NaN];
      return usual === 0 ? NaN : ((moved - usual) / Math.abs(usual)) * 100;
    };
    const size = (effect: Effect) => Math.max(...metrics.flatMap((metric) => ([0, 1] as const).map((end) => Math.abs(change(effect, metric.name, end)) || 0)));
    const ranked = [...effects].sort((a, b) => size(b) - size(a)).slice(0, TOLD_EFFECTS);
    const signed = (percent: number) => (Number.isFinite(percent) ? `${percent < 0 ? "−" : "+"}${plain(Math.abs(percent), 2)} %` : "–");
    const atmosphere = atmosphereOf(valuesOf(content, configuration));
    const rows = ranked.map((effect) => {
      const text = (value: number) => plain(shownValue(content, effect.setting, value, atmosphere), 3);
      const words = `${effect.setting.label}: ${text(effect.ends[0])} to ${text(effect.ends[1])} ${readableUnit(effect.setting.shown)}`;
      return element(
        "tr",
        {},
        element("th", { scope: "row" }, words),
        ...metrics.map((metric) => element("td", { class: "number" }, `${signed(change(effect, metric.name, 0))} / ${signed(change(effect, metric.name, 1))}`)),
      );
    });
    const heads = metrics.map((metric) => {
      const value = run?.metrics.get(metric.name);
      const now = value === undefined ? "" : ` (${shownText(content, metric, value, 3)})`;
      return element("th", { scope: "col", class: "number" }, `${metric.label}${now}`);
    });
    const title = element("h3");
    say(title, name);
    const table = element("table", { class: "outcome" }, element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "Assumption"), ...heads)), element("tbody", {}, ...rows));
    return [title, element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": `Effects of assumptions, ${name}` }, table)];
  }
}
