/** What a tab comes to in a sentence or two: what its task requires of the supply, and how long its gas would last. */

import { type Bottle, channelNamed, type Content, programNamed } from "./content";
import type { Run } from "./engine";
import type { Values } from "./settings";
import { plain, shownText } from "./shown";

interface Simulated {
  readonly name: string;
  readonly program: string;
  readonly run: Run;
  readonly values: Values;
}

/** The least and the largest torque [N m] that the supplies sustain; null where the actuator has no such limits. */
export function sustainedTorque(content: Content, { program, values }: Pick<Simulated, "program" | "values">): readonly [number, number] | null {
  const { sustained } = programNamed(content, program);
  if (sustained === null) return null;
  const at = (key: string) => values.get(key) ?? NaN;
  const above = (key: string) => (at(key) - at(sustained.zero)) * at(sustained.factor);
  // Chamber 1 at its supply, and chamber 2 at its own: with a vacuum the second one raises the torque.
  const [first, second] = [above(sustained.raised), -above(sustained.lowered)];
  return [Math.min(first, second), Math.max(first, second)];
}

/** Relative difference of two molar masses up to which they are of the same gas. */
const SAME_GAS = 0.01;

/** For how many minutes a full bottle lasts at the mean flow of a run, by the table of the package; NaN where it takes none, or another gas. */
export function minutesOfBottle({ flows, minutes, molarMass }: Bottle, { time, channels }: Run, values: Values): number {
  if (Math.abs((values.get("gas.molar_mass") ?? molarMass) / molarMass - 1) > SAME_GAS) return NaN;
  const flow = (channels.get("supplied_mass")?.at(-1) ?? 0) / (time.at(-1) ?? 0);
  const place = Math.min(flows.length - 1, Math.max(1, flows.findIndex((one) => one >= flow)));
  if (!(flow >= (flows[0] ?? 0)) || flow > (flows.at(-1) ?? 0)) return NaN;
  const [from, to] = [Math.log(flows[place - 1] ?? 1), Math.log(flows[place] ?? 1)];
  const [before, after] = [Math.log(minutes[place - 1] ?? 1), Math.log(minutes[place] ?? 1)];
  return Math.exp(before + ((after - before) * (Math.log(flow) - from)) / (to - from));
}

/** The main facts about what is simulated: one sentence about torques, one about gas. */
export function factsOf(content: Content, all: readonly Simulated[]): string {
  const done = all.filter(({ run }) => run.fault === "");
  return [torqueFacts(content, done), gasFacts(content, done)].filter(Boolean).join(" ");
}

function torqueFacts(content: Content, done: readonly Simulated[]): string {
  const facts = done.flatMap((item) => {
    const [limits, wanted] = [sustainedTorque(content, item), item.run.channels.get("reference")];
    if (limits === null || wanted === undefined) return [];
    const [least, most] = [wanted.reduce((a, b) => Math.min(a, b), 0), wanted.reduce((a, b) => Math.max(a, b), 0)];
    const [required, sustained] = -least > most ? [least, limits[0]] : [most, limits[1]];
    const short = Math.abs(required) > Math.abs(sustained) * (1 + 1e-9);
    const shown = (torque: number) => shownText(content, channelNamed(content, "reference"), torque, 3);
    const text = `the task requires ${shown(required)}; the supply sustains ${shown(sustained)}${short ? ", so the shaded part is out of reach" : ""}.`;
    return [[item.name, text] as const];
  });
  const texts = [...new Set(facts.map(([, text]) => text))];
  if (texts.length === 1) return texts.map((text) => text.slice(0, 1).toUpperCase() + text.slice(1)).join("");
  return facts.map(([name, text]) => `${name}: ${text}`).join(" ");
}

function gasFacts({ bottle }: Content, done: readonly Simulated[]): string {
  const lasting = done.flatMap(({ name, run, values }) => {
    const minutes = minutesOfBottle(bottle, run, values);
    return Number.isFinite(minutes) ? [`${plain(minutes, 2)} minutes${done.length > 1 ? ` (${name})` : ""}`] : [];
  });
  return lasting.length === 0 ? "" : `Without rest, ${bottle.name} lasts ${lasting.join(", ")}.`;
}
