/** A worker: many runs of one program, or a recording that is read, while the page goes on. */

import { Engine } from "./engine";
import type { Program } from "./content";
import { compare, drawnOf, type Overlay, recordingOf } from "./agreement";
import { type Job, type Reply, RunsJob } from "./jobs";
import { type RecordedTable, TableReading } from "./table";
import { InputError } from "./units";

const engines = new Map<string, Promise<Engine>>();
const readings = new Map<number, TableReading>();
/** The last table that was read, until it is a recording, and the last recording. */
let table: { readonly reading: number; readonly columns: RecordedTable["columns"] } | null = null;
let recorded: Overlay | null = null;

self.onmessage = async (event: MessageEvent<Job>) => {
  const job = event.data;
  try {
    if (job.kind === "program") engines.set(job.program.name, engineOf(job.program, job.bytes));
    else if (job.kind === "runs") await runMany(job);
    else if (job.kind === "table") read(job);
    else if (job.kind === "recording") answer({ number: job.number, drawn: take(job) }, []);
    else answer({ number: job.number, errors: recorded === null ? [] : compare(recorded, job.run, job.values, job.isHeld) }, []);
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
  const begun = readings.get(reading) ?? new TableReading();
  // A reading that another one overtook is never ended.
  readings.clear();
  readings.set(reading, begun);
  begun.take(bytes, isLast);
  if (!isLast) {
    answer({ number }, []);
    return;
  }
  readings.delete(reading);
  const { heads, columns } = begun.end();
  table = { reading, columns };
  answer({ number, heads }, []);
}

function take({ reading, columns }: Job & { kind: "recording" }): Overlay {
  if (table?.reading !== reading) throw new InputError("another file was read meanwhile; choose it again");
  recorded = recordingOf(table.columns, columns);
  table = null;
  return drawnOf(recorded);
}

async function runMany(job: RunsJob): Promise<void> {
  const engine = await engines.get(job.program);
  if (engine === undefined) throw new RangeError(`there is no program '${job.program}'`);
  const runs = engine.runMany(job.rows, job.every, job.places);
  answer({ number: job.number, runs }, [runs.metrics.buffer, runs.ended.buffer, runs.traces.buffer]);
}

function answer(reply: Reply, handed: ArrayBufferLike[]): void {
  (self as unknown as { postMessage: (message: Reply, handed: ArrayBufferLike[]) => void }).postMessage(reply, handed);
}
