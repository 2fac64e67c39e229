/** The table of metrics: one column a configuration, differences from the first one, told to a screen reader too. */

import { type Content, type Metric, programNamed } from "./content";
import { element, say, whenQuiet } from "./dom";
import type { Run } from "./engine";
import { minutesOfBottle } from "./facts";
import type { Values } from "./settings";
import { plain, shownText, shownValue } from "./shown";
import { readableUnit } from "./units";

export interface Column {
  readonly name: string;
  readonly look: number;
  readonly program: string;
  readonly run: Run;
  readonly values: Values;
}

interface Row {
  readonly metric: Metric;
  readonly row: HTMLElement;
  readonly cells: readonly HTMLElement[];
  readonly changes: readonly HTMLElement[];
}

const GAS = ["gas_supplied", "gas"];
const MINUTES: Metric = { name: "minutes", unit: "s", shown: "min", label: "How long a full bottle lasts" };
const TOLD = ["rms_error", "gas_supplied", "switchings", "gas", "positive_push_off_work", "toe_clearance"];

export class OutcomeTable {
  private rows: Row[] = [];
  private layout = "";
  private columns: readonly Column[] = [];
  private readonly told = element("p", { class: "told", "aria-live": "polite", role: "status" });
  private readonly nothing = element("p", { class: "note" });
  /** Metrics that have not been zero in all configurations since these are shown: only they have a row. */
  private readonly seen = new Set<string>();
  private readonly table = element("table", { class: "outcome" });
  private readonly tell = whenQuiet(700, () => say(this.told, this.summary()));

  constructor(
    host: HTMLElement,
    private readonly content: Content,
  ) {
    host.append(element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "Metrics" }, this.table), this.nothing, this.told);
  }

  show(columns: readonly Column[]): void {
    this.columns = columns;
    const layout = JSON.stringify(columns.map(({ name, program }) => [name, program]));
    if (layout !== this.layout) {
      this.layout = layout;
      this.build();
    }
    for (const { metric, row, cells, changes } of this.rows) {
      const values = columns.map((column) => this.valueOf(metric, column));
      const zero = this.content.zeros[metric.unit] ?? 0;
      if (values.some((value) => !isNothing(value, zero))) this.seen.add(metric.name);
      row.hidden = !this.seen.has(metric.name);
      cells.forEach((cell, place) => say(cell, this.text(metric, values[place])));
      changes.forEach((cell, place) => say(cell, changeText(values[0], values[place + 1], zero)));
    }
    const nothing = this.rows.filter(({ row }) => row.hidden).map(({ metric }) => metric.label);
    say(this.nothing, nothing.length === 0 ? "" : `Zero, or without a value, in all: ${nothing.map((label) => label.slice(0, 1).toLowerCase() + label.slice(1)).join("; ")}.`);
    this.tell();
  }

  /** A metric of a run; the minutes of the bottle are made of its gas. */
  private valueOf(metric: Metric, { run, values }: Column): number | undefined {
    return metric === MINUTES ? 60 * minutesOfBottle(this.content.bottle, run, values) : run.metrics.get(metric.name);
  }

  private build(): void {
    const metrics = new Map<string, Metric>();
    for (const { program } of this.columns) for (const metric of programNamed(this.content, program).metrics) metrics.set(metric.name, metric);
    const others = this.columns.slice(1);
    const head = element(
      "tr",
      {},
      element("th", { scope: "col" }, "Metric"),
      ...this.columns.map(({ name, look }) => element("th", { scope: "col", class: `number run-${look}` }, name)),
      ...others.map(({ name }) => element("th", { scope: "col", class: "number change" }, `${others.length > 1 ? `${name} ` : ""}vs first`)),
    );
    const listed = [...metrics.values()];
    const gas = listed.findIndex(({ name }) => GAS.includes(name));
    if (gas >= 0) listed.splice(gas + 1, 0, MINUTES);
    this.seen.clear();
    this.rows = listed.map((metric) => ({
      metric,
      row: element("tr"),
      cells: this.columns.map(() => element("td", { class: "number" })),
      changes: others.map(() => element("td", { class: "number change" })),
    }));
    const body = this.rows.map(({ metric, row, cells, changes }) => {
      const unit = readableUnit(metric.shown);
      const words = unit === "" || unit === "-" ? metric.label : `${metric.label} (${unit})`;
      row.append(element("th", { scope: "row" }, metric === MINUTES ? `How long ${this.content.bottle.name} lasts (min)` : words), ...cells, ...changes);
      return row;
    });
    this.table.replaceChildren(
      element("caption", { class: "unseen" }, "Metrics of each configuration"),
      element("thead", {}, head),
      element("tbody", {}, ...body),
    );
  }

  private text(metric: Metric, value: number | undefined): string {
    return plain(shownValue(this.content, metric, value ?? NaN));
  }

  private summary(): string {
    return this.columns
      .map(({ name, program, run }) => {
        if (run.fault !== "") return `${name}: ${run.fault}.`;
        const metrics = programNamed(this.content, program).metrics.filter((metric) => TOLD.includes(metric.name));
        const texts = metrics.map((metric) => `${metric.label} ${shownText(this.content, metric, run.metrics.get(metric.name) ?? NaN)}`);
        return `${name}: ${texts.join(", ")}.`;
      })
      .join(" ");
  }
}

/** Whether a metric says nothing: there is none, or what rounding leaves of zero. */
function isNothing(value: number | undefined, zero: number): boolean {
  return value === undefined || !Number.isFinite(value) || Math.abs(value) <= zero;
}

function changeText(first: number | undefined, other: number | undefined, zero: number): string {
  if (first === undefined || other === undefined || !Number.isFinite(first - other)) return "–";
  if (first === other) return "0";
  if (isNothing(first, zero) && isNothing(other, zero)) return "–";
  if (first === 0) return "–";
  const percent = ((other - first) / Math.abs(first)) * 100;
  return `${percent > 0 ? "+" : "−"}${plain(Math.abs(percent), 3)}\u00a0%`;
}
