// Prints as JSON how long a WebAssembly module takes: one run (median of 50) and ensembles, in ms
// of the processor, which other work on the machine does not lengthen as it does those of the clock.
//
//   node time_module.mjs module.wasm job.json
import { readFileSync } from "node:fs";

const [wasm, job] = process.argv.slice(2);
const { settings, channels, metrics, runs } = JSON.parse(readFileSync(job, "utf8"));
const start = performance.now();
const module = new WebAssembly.Instance(new WebAssembly.Module(readFileSync(wasm)), {}).exports;
const ready = performance.now() - start;
const count = settings.length;
const place = module.reserve(8 * count * runs.length);
new Float64Array(module.memory.buffer, place).set(runs.flat());
const timed = (times, work) => {
  const found = Array.from({ length: times }, () => {
    const begin = process.cpuUsage();
    work();
    const used = process.cpuUsage(begin);
    return (used.user + used.system) / 1e3;
  });
  return found.sort((a, b) => a - b)[times >> 1];
};
const samples = module.samples(place);
const [columns, found, good] = [8 * samples * channels, 8 * metrics * runs.length, 8].map(module.reserve);
const statuses = module.reserve(4 * runs.length);
const first = timed(1, () => module.run(place, columns, found, good));
const run = timed(50, () => module.run(place, columns, found, good));
const ensemble = timed(5, () => module.ensemble(place, runs.length, found, statuses, -1, 1, 0, 0));
process.stdout.write(JSON.stringify({ ready, first, run, ensemble, samples }));
