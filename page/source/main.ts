/** Where the page begins: its content is unpacked, and the workbench is put in its place. */

import { App } from "./app";
import type { Content } from "./content";
import { element } from "./dom";
import { hasVectors } from "./engine";
import { scenarioFile } from "./scenario_file";
import { settingsByKey, valuesOf } from "./settings";
import { addressOf, stateOfAddress, stateOfFile, fileOf } from "./state";
import { programNamed } from "./content";
import { InputError } from "./units";
import { unpacked } from "./unpacking";

const TOO_OLD = "This page needs a browser with 128-bit vectors in WebAssembly: Chrome 91, Firefox 89, Safari 16.4 or newer.";

async function begin(host: HTMLElement): Promise<void> {
  if (!hasVectors() || typeof DecompressionStream !== "function") {
    host.replaceChildren(element("p", { class: "notice" }, TOO_OLD));
    return;
  }
  const packed = document.getElementById("workbench-content")?.textContent ?? "";
  const content = JSON.parse(new TextDecoder().decode(await unpacked(packed))) as Content;
  const app = new App(host, content);
  Object.assign(globalThis, { workbench: interfaceOf(app) });
}

/** What a script, or a person at the console, may ask: texts and numbers in, texts and numbers out. */
function interfaceOf(app: App) {
  const { content } = app;
  const configuration = (place: number) => app.bench[place]!;
  return {
    content,
    address: () => addressOf(content, app.state),
    open: (address: string) => refusal(() => app.become(stateOfAddress(content, address))),
    file: () => fileOf(content, app.state),
    openFile: (text: string) => refusal(() => app.become(stateOfFile(content, text))),
    values: (place: number) => Object.fromEntries(valuesOf(content, configuration(place))),
    settings: (place: number) => [...settingsByKey(programNamed(content, configuration(place).program)).values()],
    scenario: (place: number) => scenarioFile(content, configuration(place)),
    read: async (name: string, text: string | Blob) => {
      await app.extras.read(new File([text], name));
      return app.told;
    },
    run: (place: number) => {
      const run = app.runOf(configuration(place));
      return run === null ? null : { ...run, channels: Object.fromEntries(run.channels), metrics: Object.fromEntries(run.metrics) };
    },
  };
}

/** What is wrong with an input, in one line; empty where nothing is. */
function refusal(work: () => void): string {
  try {
    work();
    return "";
  } catch (error) {
    if (error instanceof InputError) return error.message;
    throw error;
  }
}

const host = document.getElementById("workbench");
if (host !== null) void begin(host);
