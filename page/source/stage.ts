/** The moving part: a drawing for each configuration, the gait phases where there are any, and the time they show. */

import { colour } from "./colours";
import { channelNamed, type Content, programNamed } from "./content";
import { Drawing } from "./drawing";
import { element, say } from "./dom";
import type { Run } from "./engine";
import { atmosphereOf, type Values } from "./settings";
import { plain, shownText } from "./shown";

export interface Acted {
  readonly name: string;
  readonly program: string;
  readonly look: number;
  readonly run: Run;
  readonly values: Values;
}

const PHASES = ["swing", "landing", "mid-stance", "push-off"] as const;

export class Stage {
  private readonly drawings = element("div", { class: "drawings" });
  private readonly strip = element("canvas", { class: "strip", height: 28, hidden: true, role: "img", "aria-label": "Phases of the gait over time, as the controller takes them" });
  private readonly key = element("p", { class: "strip-key", hidden: true });
  private readonly slider = element("input", { type: "range", min: 0, max: 1000, value: 0, "aria-label": "Time" });
  private readonly clock = element("output", { class: "clock" });
  private readonly play = element("button", { type: "button", class: "play", "aria-label": "Play" }, "▶");
  private drawn: { drawing: Drawing; caption: HTMLElement }[] = [];
  private acted: readonly Acted[] = [];
  private layout = "";
  private time: number | null = null;
  private frame = 0;

  constructor(
    host: HTMLElement,
    private readonly content: Content,
    private readonly pointed: (time: number) => void,
  ) {
    host.append(this.drawings, this.strip, this.key, element("div", { class: "transport" }, this.play, this.slider, this.clock));
    this.slider.addEventListener("input", () => this.goTo((Number(this.slider.value) / 1000) * this.end, true));
    this.play.addEventListener("click", () => this.toggle());
  }

  private get end(): number {
    return this.acted.reduce((end, { run }) => Math.max(end, run.time.at(-1) ?? 0), 0);
  }

  show(acted: readonly Acted[]): void {
    this.acted = acted;
    const layout = JSON.stringify(acted.map(({ name, look, program }) => [name, look, program]));
    if (layout !== this.layout) {
      this.layout = layout;
      this.drawn = acted.map(({ name, look, program }) => ({
        drawing: new Drawing(name, programNamed(this.content, program).actuator, this.content.joint),
        caption: element("figcaption", { class: `run-${look}` }, name),
      }));
      this.drawings.replaceChildren(...this.drawn.map(({ drawing, caption }) => element("figure", {}, caption, drawing.root)));
    }
    this.time ??= 0.3 * this.end;
    this.drawStrip();
    this.goTo(Math.min(this.time, this.end), false);
  }

  /** Show all as they are at a time [s]. */
  goTo(time: number, isOwn: boolean): void {
    this.time = time;
    this.acted.forEach(({ run, values }, place) => {
      const at = nearestSample(run.time, time);
      const value = (key: string, other: number) => values.get(key) ?? other;
      const frame = {
        lowest: value("actuator.angle_min", 0.35),
        highest: value("actuator.angle_max", 2.27),
        atmosphere: atmosphereOf(values),
        supply: Math.max(value("supply.pressure", 446000), value("supply.dorsiflexion_pressure", 0)),
        text: (name: string, given: number) => shownText(this.content, channelNamed(this.content, name), given, 3, atmosphereOf(values)),
      };
      if (run.time.length > 0) this.drawn[place]?.drawing.show(run, frame, at);
    });
    if (document.activeElement !== this.slider || !isOwn) this.slider.value = String(this.end > 0 ? (time / this.end) * 1000 : 0);
    this.slider.setAttribute("aria-valuetext", `${plain(time, 3)} s`);
    say(this.clock, `${time.toFixed(2)} s`);
    if (isOwn) this.pointed(time);
  }

  private toggle(): void {
    if (this.frame !== 0) {
      this.stop();
      return;
    }
    this.play.textContent = "❚❚";
    this.play.setAttribute("aria-label", "Pause");
    let before = performance.now();
    const advance = (now: number) => {
      const next = (this.time ?? 0) + (now - before) / 1000;
      before = now;
      this.goTo(next > this.end ? 0 : next, true);
      this.frame = requestAnimationFrame(advance);
    };
    if ((this.time ?? 0) >= this.end - 1e-9) this.time = 0;
    this.frame = requestAnimationFrame(advance);
  }

  private stop(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.play.textContent = "▶";
    this.play.setAttribute("aria-label", "Play");
  }

  /** The paper's strip of gait phases, of the first configuration that walks. */
  private drawStrip(): void {
    const walking = this.acted.find(({ run }) => run.channels.has("controller_phase"));
    this.strip.hidden = walking === undefined;
    this.key.hidden = walking === undefined;
    const phases = walking?.run.channels.get("controller_phase");
    if (walking === undefined || phases === undefined) return;
    this.strip.width = this.strip.clientWidth * devicePixelRatio;
    this.strip.height = 28 * devicePixelRatio;
    const context = this.strip.getContext("2d");
    const inks = [colour("run-1"), colour("run-3"), colour("line"), colour("run-2")];
    if (this.key.childElementCount === 0) {
      this.key.append(...PHASES.map((name, place) => element("span", { class: `phase-${place}` }, name)));
    }
    // As wide as its run is long beside the longest one, so that it goes with the slider below.
    const share = this.end > 0 ? (walking.run.time.at(-1) ?? 0) / this.end : 1;
    let from = 0;
    for (let place = 1; context !== null && place <= phases.length; place += 1) {
      if (place < phases.length && phases[place] === phases[from]) continue;
      context.fillStyle = inks[phases[from] ?? 0] ?? "#888";
      const [left, right] = [from, place].map((sample) => (sample / phases.length) * share * this.strip.width);
      context.fillRect(left ?? 0, 0, (right ?? 0) - (left ?? 0) + 1, this.strip.height);
      from = place;
    }
  }
}

function nearestSample(times: Float64Array, time: number): number {
  const end = times.at(-1) ?? 0;
  if (times.length < 2 || end <= 0) return 0;
  return Math.min(times.length - 1, Math.max(0, Math.round((time / end) * (times.length - 1))));
}
