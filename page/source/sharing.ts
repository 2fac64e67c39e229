/** What a person takes along: files of a state, a scenario, samples, a picture. */

import { colour, colourOf } from "./colours";
import type { Content, Program } from "./content";
import { download } from "./dom";
import type { Run } from "./engine";
import type { Panels } from "./panels";
import type { State } from "./state";
import { fileOf } from "./state";

export function saveState(content: Content, state: State): void {
  download("workbench.json", new Blob([fileOf(content, state)], { type: "application/json" }));
}

export function saveText(name: string, text: string): void {
  download(name, new Blob([text], { type: "text/plain" }));
}

/** The samples of a run as `ppafo` writes and reads a recording: SI units, exact to the last bit. */
export function samplesText(program: Program, run: Run): string {
  const heads = ["time [s]", ...program.channels.map(({ name, unit }) => `${name} [${bareUnit(unit)}]`)];
  const columns = [run.time, ...program.channels.map(({ name }) => run.channels.get(name) ?? new Float64Array())];
  const lines = Array.from(run.time, (_, place) => columns.map((column) => String(column[place])).join(","));
  return `# simulated: a model's own output, not measured\n${heads.join(",")}\n${lines.join("\n")}\n`;
}

function bareUnit(unit: string): string {
  return unit === "" ? "-" : unit === "Pa_a" ? "Pa" : unit;
}

/** All plots in one picture, with their names and those of the configurations. */
export function savePicture(panels: Panels, names: readonly { readonly name: string; readonly look: number }[]): void {
  const pictures = panels.pictures();
  const scale = devicePixelRatio || 1;
  const left = Math.min(...pictures.map(({ box }) => box.left));
  const top = Math.min(...pictures.map(({ box }) => box.top));
  const right = Math.max(...pictures.map(({ box }) => box.right));
  const bottom = Math.max(...pictures.map(({ box }) => box.bottom));
  const canvas = document.createElement("canvas");
  canvas.width = (right - left + 32) * scale;
  canvas.height = (bottom - top + 64) * scale;
  const context = canvas.getContext("2d");
  if (context === null) return;
  context.scale(scale, scale);
  context.fillStyle = colour("paper");
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.font = "600 15px system-ui, sans-serif";
  let across = 16;
  for (const { name, look } of names) {
    context.fillStyle = colourOf(look);
    context.fillText(name, across, 26);
    across += context.measureText(name).width + 24;
  }
  for (const { title, canvas: plot, box } of pictures) {
    const [x, y] = [box.left - left + 16, box.top - top + 44];
    context.fillStyle = colour("ink");
    context.font = "13px system-ui, sans-serif";
    context.fillText(title, x, y + 14);
    const height = plot.height / scale;
    context.drawImage(plot, x, y + box.height - height, plot.width / scale, height);
  }
  canvas.toBlob((blob) => {
    if (blob !== null) download("workbench.png", blob);
  });
}
