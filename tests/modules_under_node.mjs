// Runs a WebAssembly module for settings from a file, each alone and all together; refuses one that imports anything.
//
//   node modules_under_node.mjs module.wasm job.json settings.bin out.bin
import { readFileSync, writeFileSync } from "node:fs";

const [wasm, job, given, out] = process.argv.slice(2);
const { settings, channels, metrics, runs, traced } = JSON.parse(readFileSync(job, "utf8"));
const program = new WebAssembly.Module(readFileSync(wasm));
if (WebAssembly.Module.imports(program).length > 0) throw new Error("the module imports something");
const module = new WebAssembly.Instance(program, {}).exports;
const floats = (place, count) => new Float64Array(module.memory.buffer, place, count);
const integers = (place, count) => new Int32Array(module.memory.buffer, place, count);

const numbers = new Float64Array(new Uint8Array(readFileSync(given)).buffer);
const place = module.reserve(8 * settings * runs);
floats(place, settings * runs).set(numbers);
const pieces = [];
const put = (values) => pieces.push(Buffer.from(values.slice().buffer));

for (let run = 0; run < runs; ++run) {
  const own = place + 8 * settings * run;
  const count = module.samples(own);
  const columns = module.reserve(8 * Math.max(1, count) * channels);
  const found = module.reserve(8 * metrics);
  const good = module.reserve(4);
  const checked = module.check(own);
  const status = module.run(own, columns, found, good);
  put(new Float64Array([checked, count, status, integers(good, 1)[0]]));
  put(floats(found, metrics));
  put(floats(columns, count * channels));
  module.release(columns);
}
const found = module.reserve(8 * metrics * runs);
const statuses = module.reserve(4 * runs);
const traces = module.reserve(8 * Math.max(1, traced.places) * runs);
const ended = module.ensemble(place, runs, found, statuses, traced.channel, traced.every, traced.places, traces);
put(new Float64Array([ended, ...integers(statuses, runs)]));
put(floats(found, metrics * runs));
put(floats(traces, traced.places * runs));
// All channels at once, of the same runs.
const count = traced.places * runs * (channels - 1);
const all = module.reserve(8 * Math.max(1, count));
module.ensemble(place, runs, found, statuses, -2, traced.every, traced.places, all);
put(floats(all, count));
writeFileSync(out, Buffer.concat(pieces));
