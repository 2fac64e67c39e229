/** A moving drawing of the device: actuator, chambers coloured by pressure, valve, and the joint with its two limbs. */

import { colour, shade } from "./colours";
import { say, shape } from "./dom";
import type { Run } from "./engine";

const RADIUS = 62;
const CENTRE = [92, 92] as const;
const ANKLE = [292, 118] as const;
const SHANK = 84;

/** The box of an actuator that is no vane: its ends, and its upper and lower edge. */
const [LEFT, RIGHT, TOP, BOTTOM] = [44, 140, 60, 110];
const [LEAST, STROKE, ROD] = [68, 48, 78];

/** What does not move: stops of the vane [rad], and pressures [Pa absolute]. */
export interface Frame {
  readonly lowest: number;
  readonly highest: number;
  readonly atmosphere: number;
  readonly supply: number;
  /** A value of a channel as it is shown, with three digits at most and its unit. */
  readonly text: (channel: string, value: number) => string;
}

export class Drawing {
  readonly root: SVGSVGElement;
  private readonly chambers = [shape("path", { class: "chamber" }), shape("path", { class: "chamber" })];
  private readonly vane = shape("line", { class: "vane" });
  /** Beside the chambers and not in them, where a narrow one has no room for a number. */
  private readonly texts = [shape("text", { class: "words", x: 2, y: 14 }), shape("text", { class: "words", x: 182, y: 14, "text-anchor": "end" })];
  private readonly spool = shape("rect", { class: "spool", y: 167, width: 26, height: 14, rx: 2 });
  private readonly ways = [shape("path", { class: "way" }), shape("path", { class: "way" })];
  private readonly leg = shape("g");
  private readonly foot = shape("g");
  private readonly arc = shape("path", { class: "effort" });
  private readonly words = shape("text", { class: "words", x: ANKLE[0], y: 196, "text-anchor": "middle" });

  /** `actuator` is its kind; all but a vane and a cylinder are drawn as bladders. */
  constructor(name: string, private readonly actuator: string, joint: string) {
    this.root = shape(
      "svg",
      { viewBox: "0 0 384 204", role: "img", class: "drawing" },
      shape("title", {}, `${name}: ${actuator === "table" ? "actuator" : actuator.replace(/_/g, " ")}, valve and ${joint}`),
      ...this.chambers,
      ...this.ways,
      this.vane,
      ...(actuator === "vane" ? [shape("circle", { class: "hub", cx: CENTRE[0], cy: CENTRE[1], r: 7 })] : []),
      ...this.texts,
      shape("rect", { class: "valve", x: 46, y: 164, width: 92, height: 20, rx: 4 }),
      this.spool,
      shape("text", { class: "words", x: 92, y: 198, "text-anchor": "middle" }, "valve"),
      this.leg,
      this.arc,
      this.words,
    );
    this.leg.append(
      shape("path", { class: "limb", d: `M0 0V${-SHANK}` }),
      shape("circle", { class: "joint", cy: -SHANK, r: 5 }),
      this.foot,
      shape("circle", { class: "joint", r: 6 }),
    );
    this.vane.toggleAttribute("hidden", actuator !== "vane" && actuator !== "cylinder");
    this.foot.append(shape("path", { class: "limb", d: joint !== "ankle" ? `M0 0H${SHANK}` : "M-16 22Q-20 24 -14 25L52 25Q58 24 52 20L8 2L-8 2Z" }));
  }

  /** Show a run as it is at a sample. */
  show(run: Run, frame: Frame, at: number): void {
    const value = (name: string, other = 0) => run.channels.get(name)?.[at] ?? other;
    const angle = value("angle", Math.PI / 2);
    const pressures = ["pressure_1", "pressure_2"].map((name) => run.channels.get(name)?.[at] ?? null);
    this.showChambers(angle, pressures, frame);
    this.showValve(value("command"));
    this.showLeg(angle, value("shank_angle"), value("torque"), run.channels.has("shank_angle"));
    say(this.words, `${frame.text("angle", angle).replace(/ deg$/, "°")} · ${frame.text("torque", value("torque"))}`);
  }

  private showChambers(angle: number, pressures: readonly (number | null)[], frame: Frame): void {
    const middle = (frame.lowest + frame.highest) / 2;
    const edge = 0.17;
    const at = (given: number) => given - middle - Math.PI / 2;
    const way = Math.min(1, Math.max(0, (angle - frame.lowest) / (frame.highest - frame.lowest)));
    const piston = LEAST + STROKE * way;
    const paths = this.actuator === "vane"
      ? [sector(at(frame.lowest - edge), at(angle)), sector(at(angle), at(frame.highest + edge))]
      : [boxed(LEFT, piston, this.actuator === "cylinder"), boxed(piston, RIGHT, this.actuator === "cylinder")];
    paths.forEach((path, place) => {
      const pressure = pressures[place] ?? null;
      for (const drawn of [this.chambers[place], this.ways[place], this.texts[place]]) drawn?.toggleAttribute("hidden", pressure === null);
      // A device of one chamber has no other one.
      if (pressure === null) return;
      const share = (pressure - frame.atmosphere) / Math.max(1, frame.supply - frame.atmosphere);
      this.chambers[place]?.setAttribute("d", path);
      this.chambers[place]?.setAttribute("fill", `rgb(${shade(0.12 + 0.8 * share).join()})`);
      const text = this.texts[place];
      if (text !== undefined) say(text, `${place + 1}: ${frame.text(`pressure_${place + 1}`, pressure).replace(/\u00a0gauge$| gauge$/, "")}`);
    });
    const rod = (TOP + BOTTOM) / 2;
    const ends = this.actuator === "vane" ? [...CENTRE, ...onCircle(at(angle), RADIUS + 3)] : [piston, rod, piston + ROD, rod];
    ["x1", "y1", "x2", "y2"].forEach((name, place) => this.vane.setAttribute(name, (ends[place] ?? 0).toFixed(1)));
  }

  /** The spool goes with the command; the way to a chamber is open to the supply, or to the outside. */
  private showValve(command: number): void {
    const isVenting = command > 1.5;
    const share = isVenting ? 0 : Math.min(1, Math.max(-1, command));
    this.spool.setAttribute("x", (79 + 30 * share).toFixed(1));
    const lines = this.actuator === "vane" ? ["M62 164C62 138 10 150 10 112S22 76 34 72", "M122 164C122 138 174 150 174 112S162 76 150 72"] : [62, 122].map((x) => `M${x} 164V${BOTTOM}`);
    lines.forEach((line, place) => {
      const towards = place === 0 ? share : -share;
      const way = this.ways[place];
      way?.setAttribute("d", line);
      way?.setAttribute("stroke", isVenting || towards < 0 ? colour("soft") : towards > 0 ? colour("ink") : colour("line"));
      way?.setAttribute("stroke-dasharray", isVenting || towards < 0 ? "4 4" : "none");
      way?.setAttribute("stroke-width", (1.5 + 3.5 * Math.abs(isVenting ? 1 : towards)).toFixed(2));
    });
  }

  private showLeg(angle: number, shank: number, torque: number, isWalking: boolean): void {
    const tilt = isWalking ? degrees(shank) : -degrees(angle - Math.PI / 2);
    const turn = isWalking ? degrees(angle - Math.PI / 2) : 0;
    this.leg.setAttribute("transform", `translate(${ANKLE[0]} ${ANKLE[1]}) rotate(${(isWalking ? -tilt : tilt).toFixed(2)})`);
    this.foot.setAttribute("transform", `rotate(${(isWalking ? turn : -tilt).toFixed(2)})`);
    const size = Math.min(1.4, Math.abs(torque) / 8);
    const [x, y] = [ANKLE[0] + 44 * Math.cos(0.5), ANKLE[1] + 44 * Math.sin(0.5)];
    const end = 0.5 + size * Math.sign(torque);
    this.arc.setAttribute(
      "d",
      `M${x.toFixed(1)} ${y.toFixed(1)}A44 44 0 0 ${torque > 0 ? 1 : 0} ${(ANKLE[0] + 44 * Math.cos(end)).toFixed(1)} ${(ANKLE[1] + 44 * Math.sin(end)).toFixed(1)}`,
    );
  }
}

function onCircle(angle: number, radius: number): readonly [number, number] {
  return [CENTRE[0] + radius * Math.cos(angle), CENTRE[1] + radius * Math.sin(angle)];
}

function sector(from: number, to: number): string {
  const [x0, y0] = onCircle(from, RADIUS);
  const [x1, y1] = onCircle(to, RADIUS);
  const isLarge = to - from > Math.PI ? 1 : 0;
  const ends = [x0, y0, x1, y1].map((number) => number.toFixed(1));
  return `M${CENTRE[0]} ${CENTRE[1]}L${ends[0]} ${ends[1]}A${RADIUS} ${RADIUS} 0 ${isLarge} 1 ${ends[2]} ${ends[3]}Z`;
}

/** A chamber from left to right: square in a cylinder, else a bladder. */
function boxed(from: number, to: number, isSquare: boolean): string {
  const [left, right] = [from.toFixed(1), to.toFixed(1)];
  if (isSquare) return `M${left} ${TOP}H${right}V${BOTTOM}H${left}Z`;
  const [middle, high, low] = [(TOP + BOTTOM) / 2, TOP - 8, BOTTOM + 8];
  return `M${left} ${middle}C${left} ${high} ${right} ${high} ${right} ${middle}C${right} ${low} ${left} ${low} ${left} ${middle}Z`;
}

function degrees(angle: number): number {
  return (angle * 180) / Math.PI;
}
