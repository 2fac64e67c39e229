/** A worker: many runs of one program, or a recording that is read, while the page goes on. */

import { Engine } from "./engine";
import type { Program } from "./content";
import { type Job, type Reply, RunsJob } from "./jobs";
import { TableReading } from "./table";
import { InputError } from "./units";

const engines = new Map<string, Promise<Engine>>();
const readings = new Map<number, TableReading>();

self.onmessage = async (event: MessageEvent<Job>) => {
  const job = event.data;
  try {
    if (job.kind === "program") engines.set(job.program.name, engineOf(job.program, job.bytes));
    else if (job.kind === "runs") await runMany(job);
    else read(job);
  } catch (error) {
    if (!(error instanceof InputError || error instanceof RangeError)) throw error;
    if (job.kind === "table") readings.delete(job.reading);
    answer({ number: job.kind === "program" ? -1 : job.number, fault: error.message }, []);
  }
};

async function engineOf(program: Program, bytes: ArrayBuffer): Promise<Engine> {
  return Engine.of(program, bytes);
}

function read({ number, reading, bytes, isLast }: Job & { kind: "table" }): void {
  const table = readings.get(reading) ?? new TableReading();
  readings.set(reading, table);
  table.take(bytes, isLast);
  if (isLast) readings.delete(reading);
  answer(isLast ? { number, table: table.end() } : { number }, []);
}

async function runMany(job: RunsJob): Promise<void> {
  const engine = await engines.get(job.program);
  if (engine === undefined) throw new RangeError(`there is no program '${job.program}'`);
  const runs = engine.runMany(job.rows, job.channel, job.every, job.places);
  answer({ number: job.number, runs }, [runs.metrics.buffer, runs.ended.buffer, runs.traces.buffer]);
}

function answer(reply: Reply, handed: ArrayBufferLike[]): void {
  (self as unknown as { postMessage: (message: Reply, handed: ArrayBufferLike[]) => void }).postMessage(reply, handed);
}
