/** The page as a whole: its state, what is simulated again when it changes, and what shows it. */

import type { Overlay } from "./agreement";
import { Bands } from "./bands";
import { looksOf } from "./colours";
import { type Content, programNamed, type Program, type Tab } from "./content";
import { Controls } from "./controls";
import { say, whenQuiet } from "./dom";
import { Engine, failedRun, type Run } from "./engine";
import { Extras } from "./extras";
import { factsOf } from "./facts";
import { Workers } from "./jobs";
import { OutcomeTable } from "./outcome";
import type { Named, Page } from "./page";
import { Panels } from "./panels";
import { changed, type Configuration, contradiction, normalText, settingsByKey, valuesOf } from "./settings";
import { Stage } from "./stage";
import { addressOf, contradictionIn, firstState, History, MOST_CONFIGURATIONS, type State, stateOfAddress } from "./state";
import { InputError, telling } from "./units";
import { unpacked } from "./unpacking";
import { makeFrame, type PageFrame } from "./frame";

const MOST_RUNS = 4 * MOST_CONFIGURATIONS;

export class App implements Page {
  state: State;
  overlay: Overlay | null = null;
  readonly workers: Workers;
  private readonly history = new History();
  private readonly engines = new Map<string, Engine>();
  private readonly bytes = new Map<string, Promise<ArrayBuffer>>();
  private readonly runs = new Map<Configuration, Run>();
  private readonly bands = new Bands(this);
  private readonly frame: PageFrame;
  private readonly controls: Controls;
  readonly panels: Panels;
  private readonly outcome: OutcomeTable;
  private readonly stage: Stage;
  readonly extras: Extras;
  private target: number | null = null;
  private isBeside = false;
  private isDue = false;
  private dragged: State | null = null;
  private readonly settle = whenQuiet(250, () => this.settled());

  constructor(
    host: HTMLElement,
    readonly content: Content,
  ) {
    const [state, wrong] = this.opened();
    this.state = state;
    // Programs are made ready while the page is put together; both are shown at once.
    void Promise.all(this.bench.map(({ program }) => this.load(programNamed(content, program)))).then(() => {
      this.schedule();
      this.settle();
    });
    this.workers = new Workers((program) => this.bytesOf(program));
    this.frame = makeFrame(host, content, this);
    this.controls = new Controls(this.frame.controls, content, { change: (key, text, isDragging) => this.change(key, text, isDragging) });
    this.panels = new Panels(this.frame.panels, content, (time) => time !== null && this.stage.goTo(time, false));
    this.stage = new Stage(this.frame.stage, content, (time) => this.panels.point(time));
    this.outcome = new OutcomeTable(this.frame.outcome, content);
    this.extras = new Extras(this.frame, this);
    this.tell(wrong);
    addEventListener("hashchange", () => this.readAddress());
  }

  get tab(): Tab {
    return this.content.tabs[this.state.tab]!;
  }

  get bench(): readonly Configuration[] {
    return this.state.benches[this.state.tab] ?? [];
  }

  /** The configurations of the tab with names that tell them apart. */
  get named(): readonly Named[] {
    const programs = this.bench.map(({ program }) => programNamed(this.content, program));
    const labels = programs.map(({ label }) => label);
    const looks = looksOf(programs.map(({ look }) => look));
    return this.bench.map((configuration, place) => {
      const label = labels[place] ?? "";
      const earlier = labels.slice(0, place).filter((other) => other === label).length;
      return { name: earlier > 0 ? `${label} ${earlier + 1}` : label, place, look: looks[place] ?? 1, configuration };
    });
  }

  /** The run of a configuration, simulated where it was not before; null while its module is not there yet. */
  runOf(configuration: Configuration): Run | null {
    const known = this.runs.get(configuration);
    if (known !== undefined) return known;
    const program = programNamed(this.content, configuration.program);
    const engine = this.engines.get(program.name);
    if (engine === undefined) {
      void this.load(program).then(() => {
        this.schedule();
        this.settle();
      });
      return null;
    }
    const values = valuesOf(this.content, configuration);
    const wrong = contradiction(program, values);
    const run = wrong === "" ? engine.run(values) : failedRun("refused", wrong);
    this.keep(configuration, run);
    return run;
  }

  /** Keep a run, but not those of all states that undo could come back to: each is half a megabyte. */
  private keep(configuration: Configuration, run: Run): void {
    this.runs.set(configuration, run);
    for (const oldest of this.runs.keys()) {
      if (this.runs.size <= MOST_RUNS) break;
      this.runs.delete(oldest);
    }
  }

  private bytesOf(program: Program): Promise<ArrayBuffer> {
    const known = this.bytes.get(program.module) ?? unpacked(document.getElementById(program.module)?.textContent ?? "");
    this.bytes.set(program.module, known);
    return known;
  }

  private async load(program: Program): Promise<void> {
    const bytes = await this.bytesOf(program);
    if (this.engines.has(program.name)) return;
    this.engines.set(program.name, await Engine.of(program, bytes));
  }

  /** Make a state the present one. What was before can be come back to, but for what is on the way. */
  become(state: State, isOnTheWay = false): void {
    if (!isOnTheWay) this.history.keep(this.dragged ?? this.state);
    else this.dragged ??= this.state;
    if (!isOnTheWay) this.dragged = null;
    this.enter(state);
  }

  /** Show a state; what belongs to another tab, or to a configuration that is gone, is forgotten. */
  private enter(state: State): void {
    const [before, after] = [this.bench.length, state.benches[state.tab]?.length ?? 0];
    if (state.tab !== this.state.tab || after !== before) this.bands.forget();
    if (state.tab !== this.state.tab || (this.target ?? 0) >= after) this.target = null;
    this.state = state;
    this.schedule();
    this.settle();
  }

  /** Change a setting of all configurations of the tab, or of the chosen one. Returns what is wrong, or an empty text. */
  private change(key: string, text: string | null, isDragging: boolean): string {
    try {
      const bench = this.bench.map((configuration, place) => {
        if (this.target !== null && place !== this.target) return configuration;
        const setting = settingsByKey(programNamed(this.content, configuration.program)).get(key);
        if (setting === undefined) return configuration;
        const next = changed(configuration, key, text === null ? (programNamed(this.content, configuration.program).usual[key] ?? null) : normalText(setting, text));
        valuesOf(this.content, next);
        return next;
      });
      this.becomeBench(bench, isDragging);
      return "";
    } catch (error) {
      if (error instanceof InputError) return error.message;
      throw error;
    }
  }

  becomeBench(bench: readonly Configuration[], isOnTheWay = false): void {
    const benches = this.state.benches.map((other, place) => (place === this.state.tab ? bench : other));
    this.become({ ...this.state, benches }, isOnTheWay);
  }

  /** Change some settings of one configuration. */
  changeOne(place: number, texts: readonly (readonly [string, string])[]): void {
    const configuration = this.bench[place];
    if (configuration === undefined) return;
    const known = settingsByKey(programNamed(this.content, configuration.program));
    const next = texts.filter(([key]) => known.has(key)).reduce((all, [key, text]) => changed(all, key, text), configuration);
    try {
      valuesOf(this.content, next);
    } catch (error) {
      telling((words) => this.tell(words))(error);
      return;
    }
    this.becomeBench(this.bench.map((other, number) => (number === place ? next : other)));
  }

  addConfiguration(program: string): void {
    if (this.bench.length >= MOST_CONFIGURATIONS) return;
    const begun = this.tab.start.find((one) => one.program === program)?.changes;
    this.becomeBench([...this.bench, { program, changes: begun ?? programNamed(this.content, program).usual }]);
  }

  removeConfiguration(place: number): void {
    if (this.bench.length < 2) return;
    this.target = null;
    this.becomeBench(this.bench.filter((_, number) => number !== place));
  }

  choose(target: number | null): void {
    this.target = target;
    this.schedule();
  }

  openTab(tab: number): void {
    this.become({ ...this.state, tab });
  }

  arrange(isBeside: boolean): void {
    this.isBeside = isBeside;
    this.schedule();
  }

  band(isWanted: boolean): void {
    this.bands.isShown = isWanted;
    this.schedule();
    this.settle();
  }

  undo(): void {
    // While a slider is still held, what its drag began from is wanted back.
    if (this.dragged !== null) this.history.keep(this.dragged);
    this.dragged = null;
    const state = this.history.undo(this.state);
    if (state !== null) this.restore(state);
  }

  redo(): void {
    const state = this.history.redo(this.state);
    if (state !== null) this.restore(state);
  }

  resetAll(): void {
    const benches = firstState(this.content).benches;
    this.become({ ...this.state, benches: this.state.benches.map((bench, place) => (place === this.state.tab ? (benches[place] ?? bench) : bench)) });
  }

  private restore(state: State): void {
    this.target = null;
    this.enter(state);
  }

  overlayWith(overlay: Overlay | null): void {
    this.overlay = overlay;
    this.schedule();
    this.settle();
  }

  /** One line for the person; empty to take it away. */
  tell(text: string): void {
    say(this.frame.notice, text);
    this.frame.notice.hidden = text === "";
  }

  get told(): string {
    return this.frame.notice.textContent ?? "";
  }

  private readAddress(): void {
    const address = location.hash;
    if (this.content.form !== "page" || address.length < 2 || address.slice(1) === addressOf(this.content, this.state)) return;
    const [state, wrong] = this.opened();
    this.tell(wrong);
    this.become(state);
  }

  /** The state in the address, else the first one, and what is wrong with the address. */
  private opened(): readonly [State, string] {
    const first = firstState(this.content);
    if (this.content.form !== "page" || location.hash.length < 2) return [first, ""];
    try {
      return [stateOfAddress(this.content, location.hash), ""];
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      return [first, `The address holds no state of this page: ${error.message}. The default state is shown.`];
    }
  }

  /** Which settings of the page contradict each other, in one line; empty where it can be run. */
  get refused(): string {
    return contradictionIn(this.content, this.state);
  }

  /** Draw with the next frame. */
  schedule(): void {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.draw();
    });
  }

  private draw(): void {
    const { named } = this;
    const began = performance.now();
    const runs = named.map(({ configuration }) => this.runOf(configuration));
    const taken = performance.now() - began;
    const done = named.flatMap((item, place) => {
      const run = runs[place];
      return run === null || run === undefined ? [] : [{ ...item, run, program: item.configuration.program, values: valuesOf(this.content, item.configuration) }];
    });
    const programs = [...new Set(this.bench.map(({ program }) => program))].map((name) => programNamed(this.content, name));
    this.frame.follow(this.state, named, this.target, this.isBeside, this.history.canUndo || this.dragged !== null, this.history.canRedo);
    this.controls.show(programs, this.tab.first, this.target === null ? this.bench : this.bench.filter((_, place) => place === this.target));
    if (done.length < named.length) return;
    const faults = done.filter(({ run }) => run.fault !== "").map(({ name, run }) => `${name}: ${run.fault}.`);
    say(this.frame.fault, faults.join(" "));
    this.frame.fault.hidden = faults.length === 0;
    say(this.frame.facts, factsOf(this.content, done));
    const shown = done.filter(({ run }) => run.time.length > 1);
    this.outcome.show(done);
    this.extras.follow(named);
    // Plots come last: they ask how wide they may be, and then all else is in its place.
    for (const part of [this.frame.stage, this.frame.panels]) part.classList.toggle("absent", shown.length === 0);
    if (shown.length > 0) {
      this.stage.show(shown);
      this.panels.show(shown.map((item) => ({ ...item, band: this.bands.of(item.configuration, item.place) })), this.isBeside, this.overlay);
    }
    this.frame.root.dataset["milliseconds"] = taken.toFixed(2);
    this.frame.root.dataset["ready"] = "true";
  }

  /** What waits until a drag is over: the address, bands, errors against a recording. */
  private settled(): void {
    if (this.content.form === "page") {
      const address = addressOf(this.content, this.state);
      // What is refused is not shared: the address keeps the last state that can be run.
      if (this.refused === "" && address !== location.hash.slice(1)) history.replaceState(null, "", `#${address}`);
    }
    this.workers.rest();
    this.extras.settle();
    void this.bands.settle().catch(telling((words) => this.tell(words)));
  }
}
