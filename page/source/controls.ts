/** A control for every number: a slider, a value with its unit, where it comes from, and the way back. */

import { type Content, type Program, programNamed, type Setting } from "./content";
import { element, say } from "./dom";
import { atmosphereOf, type Configuration, rangeText, settingsByKey, shownNumber, valuesOf } from "./settings";
import { readableUnit } from "./units";

const GROUPS: Readonly<Record<string, string>> = {
  supply: "Supply",
  supply_line: "Regulators and lines",
  valve: "Valve",
  wearer: "Wearer",
  reference: "Task",
  motion: "Motion",
  controller: "Controller",
  actuator: "Actuator",
  friction: "Friction",
  foot_plate: "Foot plate",
  gas: "Gas",
  gas_model: "Gas model",
  flow: "Flow",
  sensors: "Sensors",
  faults: "Faults",
  initial: "Start",
  run: "Run",
};
const STEPS = 400;

interface Control {
  readonly setting: Setting;
  readonly row: HTMLElement;
  readonly slider: HTMLInputElement;
  readonly value: HTMLInputElement;
  readonly back: HTMLButtonElement;
  readonly fault: HTMLElement;
  /** Whether somebody is typing: the text is theirs until they are done. */
  isTyped: boolean;
}

/** What the controls tell the page. */
export interface Wishes {
  /** A text for a key, in all configurations that are changed; null puts it back. `isDragging` while more will follow. */
  readonly change: (key: string, text: string | null, isDragging: boolean) => string;
}

export class Controls {
  /** Those that can be seen; a group is made when it is opened for the first time. */
  private groups: { readonly isOpen: () => boolean; readonly controls: Control[] }[] = [];
  private configurations: readonly Configuration[] = [];
  private programs = "";

  constructor(
    private readonly host: HTMLElement,
    private readonly content: Content,
    private readonly wishes: Wishes,
  ) {}

  /** Controls of the settings of some configurations, those that matter most first. */
  show(programs: readonly Program[], first: readonly string[], configurations: readonly Configuration[]): void {
    const names = JSON.stringify([programs.map((program) => program.name), first]);
    if (names !== this.programs) {
      this.programs = names;
      this.build(programs, first);
    }
    const isSame = configurations.length === this.configurations.length && configurations.every((one, place) => one === this.configurations[place]);
    this.configurations = configurations;
    this.update(isSame);
  }

  private build(programs: readonly Program[], first: readonly string[]): void {
    const focused = this.host.contains(document.activeElement) ? document.activeElement : null;
    const all = new Map(programs.flatMap((program) => [...settingsByKey(program)]));
    const leading = first.filter((key) => all.has(key));
    const groups = new Map<string, Setting[]>();
    for (const setting of all.values()) {
      if (leading.includes(setting.key) || setting.kept === "zero") continue;
      const group = setting.key.split(".")[0] ?? "";
      groups.set(group, [...(groups.get(group) ?? []), setting]);
    }
    const order = [...groups.keys()].sort((a, b) => rank(a) - rank(b));
    const controls = leading.map((key) => all.get(key)).flatMap((setting) => (setting === undefined ? [] : [this.made(setting)]));
    this.groups = [{ isOpen: () => true, controls }];
    const open = element("div", { class: "group first" }, ...controls.map(({ row }) => row));
    this.host.replaceChildren(open, ...(this.content.form === "block" ? [] : order.map((name) => this.folded(name, groups.get(name) ?? []))));
    if (focused !== null) this.focusAs(focused);
  }

  /** Put the focus where it was before the controls were made anew, else on the first of them. */
  private focusAs(former: Element): void {
    const row = former.closest("[data-key]");
    const same = this.groups[0]?.controls.find(({ setting }) => setting.key === row?.getAttribute("data-key"));
    const place = row === null ? -1 : [...row.children].indexOf(former);
    const next = same?.row.children[place] ?? this.groups[0]?.controls[0]?.value;
    if (next instanceof HTMLElement) next.focus();
  }

  private folded(name: string, settings: readonly Setting[]): HTMLElement {
    const controls: Control[] = [];
    const group = element("details", { class: "group" }, element("summary", {}, GROUPS[name] ?? name, element("span", { class: "count" }, ` ${settings.length}`)));
    group.addEventListener("toggle", () => {
      if (controls.length === 0) {
        controls.push(...settings.map((setting) => this.made(setting)));
        group.append(...controls.map(({ row }) => row));
      }
      this.update(true);
    });
    this.groups.push({ isOpen: () => group.open, controls });
    return group;
  }

  private made(setting: Setting): Control {
    const { key, label } = setting;
    const end = label.lastIndexOf(" ") + 1;
    const about = element("p", { class: "about", id: `about-${key}`, hidden: true });
    const describe = () => (name.title = this.words(setting).join("\n"));
    const name: HTMLButtonElement = element(
      "button",
      {
        type: "button",
        class: "name",
        "aria-expanded": "false",
        "aria-controls": `about-${key}`,
        onpointerenter: describe,
        onfocus: describe,
        onclick: () => {
          about.hidden = !about.hidden;
          name.setAttribute("aria-expanded", String(!about.hidden));
          about.replaceChildren(...this.words(setting).map((line) => element("span", {}, line)));
        },
      },
      label.slice(0, end),
      // The mark stays with the last word.
      element("span", { class: "end" }, label.slice(end), element("span", { class: `origin ${setting.origin}`, "aria-hidden": "true" })),
    );
    const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${label}, slider` });
    const value = element("input", { type: "text", inputmode: "text", autocomplete: "off", spellcheck: "false", "aria-label": label });
    const back = element("button", { type: "button", class: "back", title: "Put back", "aria-label": `Put ${label} back` }, "↺");
    const fault = element("p", { class: "fault", role: "alert", hidden: true });
    const row = element("div", { class: "control", "data-key": key }, name, value, slider, back, fault, about);
    const control = { setting, row, slider, value, back, fault, isTyped: false };
    this.listen(control);
    return control;
  }

  private listen(control: Control): void {
    const { setting, slider, value, back } = control;
    const wish = (text: string | null, isDragging: boolean) => blame(control, this.wishes.change(setting.key, text, isDragging));
    slider.addEventListener("input", () => wish(this.textAt(setting, Number(slider.value)), true));
    slider.addEventListener("change", () => wish(this.textAt(setting, Number(slider.value)), false));
    value.addEventListener("input", () => (control.isTyped = true));
    value.addEventListener("change", () => {
      if (!control.isTyped) return;
      control.isTyped = false;
      wish(value.value.trim() === "" ? null : value.value, false);
    });
    value.addEventListener("blur", () => (control.isTyped = false));
    value.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      control.isTyped = false;
      blame(control, "");
      this.update(true);
      value.blur();
    });
    back.addEventListener("click", () => wish(null, false));
  }

  /** What is known of a setting, line by line. */
  private words(setting: Setting): string[] {
    const having = this.configurations.map((one) => valuesOf(this.content, one)).find((values) => values.has(setting.key));
    const origin = setting.origin === "" ? [] : [`${capital(setting.origin)}${setting.source === "" ? "." : `: ${setting.source}.`}`];
    return [
      `${capital(setting.summary)}.`,
      `${capital(rangeText(this.content, setting, atmosphereOf(having ?? new Map())))}. ${setting.key}`,
      ...origin,
      ...(setting.note === "" ? [] : [setting.note]),
    ];
  }

  /** Show the values. What was refused stays to be read, with its fault, until a configuration is another one. */
  private update(isSame: boolean): void {
    const { configurations } = this;
    const values = configurations.map((configuration) => valuesOf(this.content, configuration));
    const usual = configurations.map(({ program }) => programNamed(this.content, program).usual);
    for (const control of this.groups.flatMap(({ isOpen, controls }) => (isOpen() ? controls : []))) {
      const { setting, row, slider, value, back, fault } = control;
      const { key } = setting;
      const having = configurations.map((_, place) => place).filter((place) => values[place]?.has(key));
      row.hidden = having.length === 0;
      if (row.hidden) continue;
      const texts = having.map((place) => shownNumber(this.content, setting, values[place]?.get(key) ?? 0, atmosphereOf(values[place] ?? new Map())));
      const different = [...new Set(texts)];
      const unit = readableUnit(setting.shown);
      if (!control.isTyped && (fault.hidden || !isSame)) {
        blame(control, "");
        const text = `${different.join(" | ")}${unit === "" || unit === "-" || different.length > 2 ? "" : ` ${unit}`}`;
        if (value.value !== text) {
          // Who has come to the field by keyboard has all of it selected, and what is typed next replaces it whole.
          const isSelected = document.activeElement === value && value.selectionStart === 0 && value.selectionEnd === value.value.length;
          value.value = text;
          if (isSelected) value.select();
        }
      }
      const place = String(placeOf(setting, Number(texts[0])));
      if (document.activeElement !== slider && slider.value !== place) slider.value = place;
      if (slider.getAttribute("aria-valuetext") !== value.value) slider.setAttribute("aria-valuetext", value.value);
      const isChanged = having.some((place) => configurations[place]?.changes[key] !== usual[place]?.[key]);
      row.classList.toggle("changed", isChanged);
      back.disabled = !isChanged;
    }
  }

  /** The text that a place of a slider stands for: round decimals, so that no arithmetic of the browser is in it. */
  private textAt(setting: Setting, place: number): string {
    return textOnSlider(setting, place / STEPS);
  }
}

function rank(group: string): number {
  const place = Object.keys(GROUPS).indexOf(group);
  return place < 0 ? 99 : place;
}

function placeOf(setting: Setting, shown: number): number {
  const [from, to] = setting.slider;
  return Math.round(((shown - from) / (to - from)) * STEPS);
}

/** Say what is wrong with what was wanted of a setting; nothing, where the text is empty. */
function blame({ fault, value }: Control, wrong: string): void {
  say(fault, wrong);
  fault.hidden = wrong === "";
  value.setAttribute("aria-invalid", String(wrong !== ""));
}

/** A text somewhere on a slider, from 0 to 1, with the decimals that tell two neighbouring places apart; never beyond its ends. */
export function textOnSlider({ key, slider: [from, to], shown }: Setting, share: number): string {
  const decimals = key.endsWith(".seed") ? 0 : decimalsOf((to - from) / STEPS);
  const unit = 10 ** -decimals;
  const value = from + (to - from) * share;
  const rounded = Number(value.toFixed(decimals));
  const inside = rounded < from ? rounded + unit : rounded > to ? rounded - unit : rounded;
  return `${plainFixed(inside, decimals)} ${shown}`.trim();
}

function decimalsOf(step: number): number {
  let decimals = 0;
  for (let edge = 1; step < edge && decimals < 12; edge /= 10) decimals += 1;
  return decimals;
}

function plainFixed(value: number, decimals: number): string {
  const text = value.toFixed(decimals);
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

function capital(text: string): string {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}
