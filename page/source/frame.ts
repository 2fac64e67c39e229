/** The places of the page: head, tabs, configurations, controls, plots, and what is folded away below. */

import { type Content, programNamed } from "./content";
import { element } from "./dom";
import type { Named, Page } from "./page";
import { settingsByKey } from "./settings";
import { addressOf, firstState, MOST_CONFIGURATIONS, type State } from "./state";

export interface PageFrame {
  readonly root: HTMLElement;
  readonly notice: HTMLElement;
  readonly fault: HTMLElement;
  readonly facts: HTMLElement;
  readonly controls: HTMLElement;
  readonly panels: HTMLElement;
  readonly stage: HTMLElement;
  readonly outcome: HTMLElement;
  readonly share: HTMLElement;
  readonly map: HTMLElement;
  readonly recording: HTMLElement;
  readonly assumptions: HTMLElement;
  readonly follow: (state: State, named: readonly Named[], target: number | null, isBeside: boolean, canUndo: boolean, canRedo: boolean) => void;
}

export function makeFrame(host: HTMLElement, content: Content, app: Page): PageFrame {
  const place = (name: string) => element("div", { class: name });
  const [controls, panels, stage, outcome] = [place("controls"), place("panels"), place("stage"), place("outcomes")];
  const [share, map, recording, assumptions] = [place("share"), place("map-place"), place("recording"), place("assumptions")];
  const notice = element("p", { class: "notice", role: "status", hidden: true });
  const fault = element("p", { class: "fault", role: "alert", hidden: true });
  const facts = element("p", { class: "facts" });
  const questions = element("p", { class: "questions" });
  const tabs = element("div", { class: "tabs", role: "tablist", "aria-label": "What is simulated" });
  const bench = element("div", { class: "bench" });
  const target = element("div", { class: "target", role: "radiogroup", "aria-label": "Which configuration the controls change" });
  const summary = element("p", { class: "summary" });
  const [undo, redo, reset] = [
    element("button", { type: "button", onclick: () => app.undo(), title: "Undo (Ctrl+Z)" }, "Undo"),
    element("button", { type: "button", onclick: () => app.redo(), title: "Redo (Ctrl+Shift+Z)" }, "Redo"),
    element("button", { type: "button", onclick: () => app.resetAll() }, "Reset all"),
  ];
  const beside = choice("Side by side", (isOn) => app.arrange(isOn));
  const band = choice("Uncertainty", (isOn) => app.band(isOn));
  band.label.title = "Where 95 % of 200 draws lie, each number drawn evenly from its interval";
  const side = element(
    "aside",
    { class: "side", "aria-label": "Settings" },
    element("div", { class: "side-head" }, element("h2", {}, "Settings"), element("div", { class: "buttons" }, undo, redo, reset)),
    target,
    controls,
    element("p", { class: "key" }, ...originKey()),
  );
  const isPage = content.form === "page";
  const panel = element(
    "div",
    { id: "panel", class: "content", tabindex: -1, ...(content.tabs.length > 1 ? { role: "tabpanel", "aria-label": "Simulation" } : {}) },
    fault,
    element("div", { class: "bench-line" }, bench, element("div", { class: "switches" }, band.label, beside.label)),
    facts,
    questions,
    stage,
    panels,
    element("h2", {}, "Results"),
    outcome,
  );
  const folded = (title: string, inner: HTMLElement) => element("details", { class: "folded" }, element("summary", {}, title), inner);
  const further = isPage ? [folded("Map of two settings", map), folded("Which assumption matters", assumptions), folded("Your own recording", recording)] : [folded("Which assumption moves which claim", assumptions)];
  const [heading, lead] = isPage ? [element("h1", {}, content.title), element("p", { class: "lead" }, LEAD)] : [element("span"), element("span")];
  panel.append(...further);
  const root = element(
    "div",
    { class: `workbench ${content.form}` },
    element("header", { class: "page-head" }, element("div", {}, heading, lead), share),
    notice,
    ...(content.tabs.length > 1 ? [tabs] : []),
    summary,
    // A report that the block is in has a main part of its own.
    element("div", { class: "columns-of-page" }, side, element(isPage ? "main" : "div", { class: "main" }, panel)),
    ...(isPage ? [element("footer", {}, ABOUT, ` ppafo ${content.version}.`)] : []),
  );
  host.replaceChildren(root);
  addEventListener("keydown", (event) => keyed(event, app));
  const follow: PageFrame["follow"] = (state, named, chosen, isBeside, canUndo, canRedo) => {
    undo.disabled = !canUndo;
    redo.disabled = !canRedo;
    beside.box.checked = isBeside;
    fillTabs(tabs, content, state, app);
    summary.textContent = content.tabs[state.tab]?.summary ?? "";
    const isChoosing = target.contains(document.activeElement);
    fillBench(bench, content, named, app);
    if (isPage) fillQuestions(questions, content, state);
    fillTarget(target, named, chosen, app);
    if (isChoosing && !target.contains(document.activeElement)) (target.hidden ? bench : target).querySelector<HTMLElement>("input:checked, select")?.focus();
  };
  return { root, notice, fault, facts, controls, panels, stage, outcome, share, map, recording, assumptions, follow };
}

const LEAD = "Drag a slider: the device is simulated again, here, in your browser. Nothing is fetched and nothing leaves this page.";
const ABOUT =
  "Every sample has the bits of the package's own simulation. Everything is simulated; nothing on this page was measured, and it is no medical device. Made with";

function originKey(): Node[] {
  const words: readonly (readonly [string, string])[] = [
    ["published", "published"],
    ["derived", "derived or identified"],
    ["assumed", "assumed"],
  ];
  return words.flatMap(([name, text]) => [element("span", {}, element("span", { class: `origin ${name}`, "aria-hidden": "true" }), text), document.createTextNode("   ")]);
}

function choice(words: string, change: (isOn: boolean) => void): { label: HTMLElement; box: HTMLInputElement } {
  const box = element("input", { type: "checkbox", onchange: () => change(box.checked) });
  return { label: element("label", { class: "switch" }, box, words), box };
}

function fillTabs(tabs: HTMLElement, content: Content, state: State, app: Page): void {
  if (tabs.childElementCount === 0) {
    tabs.append(
      ...content.tabs.map((tab, number) => element("button", { type: "button", role: "tab", "aria-controls": "panel", onclick: () => app.openTab(number) }, tab.title)),
    );
    tabs.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step === undefined) return;
      const next = (app.state.tab + step + content.tabs.length) % content.tabs.length;
      app.openTab(next);
      (tabs.children[next] as HTMLElement).focus();
    });
  }
  [...tabs.children].forEach((tab, number) => {
    tab.setAttribute("aria-selected", String(number === state.tab));
    tab.setAttribute("tabindex", number === state.tab ? "0" : "-1");
  });
}

function fillBench(bench: HTMLElement, content: Content, named: readonly Named[], app: Page): void {
  const layout = JSON.stringify(named.map(({ name }) => name)) + app.state.tab;
  if (bench.dataset["layout"] === layout) return;
  bench.dataset["layout"] = layout;
  const chips = named.map(({ name, place, look }) =>
    element(
      "span",
      { class: `chip run-${look}` },
      name,
      ...(named.length > 1 ? [element("button", { type: "button", "aria-label": `Remove ${name}`, onclick: () => app.removeConfiguration(place) }, "×")] : []),
    ),
  );
  const add = element("select", { "aria-label": "Add a configuration", onchange: () => add.value !== "" && app.addConfiguration(add.value) });
  add.append(
    element("option", { value: "" }, "+ Add"),
    ...app.tab.programs.map((name) => element("option", { value: name, title: programNamed(content, name).description }, programNamed(content, name).label)),
  );
  refill(bench, ...chips, ...(named.length < MOST_CONFIGURATIONS ? [add] : []));
}

/** Links that set the sliders of a tab: what it opens with, and what a question changes of that. */
function fillQuestions(host: HTMLElement, content: Content, state: State): void {
  const { questions } = content.tabs[state.tab]!;
  const links = questions.map(({ text, changes }) => {
    const bench = firstState(content).benches[state.tab]!.map(({ program, changes: usual }) => {
      const known = settingsByKey(programNamed(content, program));
      return { program, changes: Object.keys(changes).every((key) => known.has(key)) ? { ...usual, ...changes } : usual };
    });
    const asked = { ...state, benches: state.benches.map((other, place) => (place === state.tab ? bench : other)) };
    return [text, `#${addressOf(content, asked)}`] as const;
  });
  const layout = JSON.stringify(links);
  if (host.dataset["layout"] === layout) return;
  host.dataset["layout"] = layout;
  host.replaceChildren(...links.map(([text, href]) => element("a", { href }, text)));
  host.hidden = links.length === 0;
}

/** Fill a place anew. The focus stays with the control that comes to be in the same place, or is the last one as it was. */
function refill(host: HTMLElement, ...children: Node[]): void {
  const controls = () => [...host.querySelectorAll<HTMLElement>("button, select")];
  const before = controls();
  const at = before.findIndex((one) => one === document.activeElement);
  host.replaceChildren(...children);
  const after = controls();
  if (at >= 0) after[at === before.length - 1 ? after.length - 1 : Math.min(at, after.length - 1)]?.focus();
}

function fillTarget(target: HTMLElement, named: readonly Named[], chosen: number | null, app: Page): void {
  target.hidden = named.length < 2;
  const layout = JSON.stringify([named.map(({ name }) => name), app.state.tab]);
  if (target.dataset["layout"] !== layout) {
    target.dataset["layout"] = layout;
    const items: readonly (readonly [string, number | null, string])[] = [["All", null, ""], ...named.map(({ name, place, look }) => [name, place, `run-${look}`] as const)];
    target.replaceChildren(
      ...items.map(([name, place, look]) =>
        element("label", {}, element("input", { type: "radio", name: "target", value: String(place), onchange: () => app.choose(place) }), element("span", { class: look }, name)),
      ),
    );
  }
  for (const box of target.querySelectorAll("input")) box.checked = box.value === String(chosen);
}

function keyed(event: KeyboardEvent, app: Page): void {
  if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
  if (event.target instanceof HTMLInputElement && event.target.type === "text") return;
  event.preventDefault();
  if (event.shiftKey) app.redo();
  else app.undo();
}
