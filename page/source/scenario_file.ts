/** A configuration as a scenario file that `ppafo simulate` runs to the same bits. */

import { type Content, type Json, programNamed, type Setting, type Table } from "./content";
import { madeOf } from "./following";
import { type Configuration, normalText, valuesOf } from "./settings";

const SI_PRESSURE = "Pa_a";
const HOW_TO_RUN = { scenario: "simulate THIS-FILE.toml", walk: "walk THIS-FILE.toml --minutes " };
/** A walk is as long as its command says. */
const NOT_OF_WALKS = ["run.duration", "run.output_interval"];
const SECOND_NAMES: Readonly<Record<string, string>> = { "controller.period": "rate" };

/** TOML of a configuration. What was typed stands there with the unit it was typed in; a bare number has that which is shown. */
export function scenarioFile(content: Content, configuration: Configuration): string {
  const program = programNamed(content, configuration.program);
  const texts = writtenTexts(content, configuration);
  const document = structuredClone(program.document) as Record<string, Json>;
  const device = { ...(document["device"] as Table) };
  const overrides = (Array.isArray(device["overrides"]) ? device["overrides"] : []).filter(
    (override) => !texts.some(([setting]) => String(override).startsWith(`${setting.key}=`)),
  );
  for (const [setting, text] of texts) {
    if (program.deviceSections.includes(setting.key.split(".")[0] ?? "")) overrides.push(`${setting.key}=${text}`);
    else put(document, setting, text);
  }
  document["device"] = overrides.length > 0 ? { ...device, overrides } : device;
  const minutes = program.kind === "walk" ? String((valuesOf(content, configuration).get("run.duration") ?? 60) / 60) : "";
  return `# ${program.name}, as it was set on the page of ppafo ${content.version}\n#\n#   ppafo ${HOW_TO_RUN[program.kind]}${minutes}\n\n${tables(document)}`;
}

/** The settings that are not those of the scenario, and how a file writes them. */
function writtenTexts(content: Content, configuration: Configuration): [Setting, string][] {
  const program = programNamed(content, configuration.program);
  const values = valuesOf(content, configuration);
  const isLevelChanged = program.settings.some(({ key, unit, value }) => unit === SI_PRESSURE && values.get(key) !== value);
  // What nobody gave a controller of walks may come from other settings: all of it is written, so that nothing moves.
  const isOfWalk = ({ key, origin }: Setting) => program.kind === "walk" && origin === "default" && key.startsWith("controller.");
  // By a rule that the page does not know a setting stays as it is here, and would follow in Python.
  const isUnknown = ({ made }: Setting) => made !== null && madeOf(made, (key) => values.get(key) ?? NaN) === null;
  const isPinned = (setting: Setting) => isOfWalk(setting) || isUnknown(setting);
  const found: [Setting, string][] = [];
  for (const setting of program.settings) {
    if (program.kind === "walk" && NOT_OF_WALKS.includes(setting.key)) continue;
    // What has to stay 0 is 0 in the scenario too, and a file may not say so.
    if (setting.kept === "zero") continue;
    const value = values.get(setting.key) ?? setting.value;
    const typed = configuration.changes[setting.key];
    if (typed !== undefined) found.push([setting, setting.unit === "" ? String(value) : normalText(setting, typed)]);
    else if (isPinned(setting) || value !== setting.value || (isLevelChanged && setting.unit === SI_PRESSURE)) {
      found.push([setting, `${String(value)} ${setting.unit}`.trim()]);
    }
  }
  return found;
}

function put(document: Record<string, Json>, setting: Setting, text: string): void {
  const parts = setting.key.split(".");
  const name = parts.pop() ?? "";
  let table: Record<string, Json> = document;
  for (const part of parts) {
    const inner = { ...((table[part] ?? {}) as Table) };
    table[part] = inner;
    table = inner;
  }
  const second = SECOND_NAMES[setting.key];
  if (second !== undefined) delete table[second];
  forget(document, [setting.key, `${parts.join(".")}.${second ?? ""}`]);
  table[name] = setting.unit === "" || name === "seed" ? Number(text) : text;
}

/** Why a value was assumed is not said of another one. */
function forget(document: Record<string, Json>, keys: readonly string[]): void {
  const assumed = document["assumed"];
  if (assumed === undefined || !isTable(assumed)) return;
  document["assumed"] = Object.fromEntries(Object.entries(assumed).filter(([key]) => !keys.includes(key)));
}

function tables(document: Table, path: readonly string[] = []): string {
  const own = Object.entries(document).filter(([, value]) => !isTable(value));
  const inner = Object.entries(document).filter((entry): entry is [string, Table] => isTable(entry[1]));
  const lines = own.map(([name, value]) => `${keyText(name)} = ${valueText(value)}`);
  const head = path.length > 0 && (lines.length > 0 || inner.length === 0) ? `[${path.map(keyText).join(".")}]\n` : "";
  const body = lines.length > 0 || head ? `${head}${lines.join("\n")}\n` : "";
  return [body, ...inner.map(([name, table]) => tables(table, [...path, name]))].filter(Boolean).join("\n");
}

function isTable(value: Json): value is Table {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function keyText(name: string): string {
  return /^[A-Za-z0-9_-]+$/.test(name) ? name : JSON.stringify(name);
}

function valueText(value: Json): string {
  if (Array.isArray(value)) return value.length === 0 ? "[]" : `[\n${value.map((item) => `  ${valueText(item)},\n`).join("")}]`;
  if (typeof value === "string") return quoted(value);
  return String(value);
}

function quoted(text: string): string {
  return JSON.stringify(text).replace(/\u007f/g, "\\u007f");
}
