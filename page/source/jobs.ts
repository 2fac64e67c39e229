/** What page and workers say to each other, and the workers of a page. */

import type { Program } from "./content";
import type { Ensemble } from "./engine";
import type { ChannelError, Overlay, RecordedColumn } from "./agreement";
import type { Values } from "./settings";
import type { Heads } from "./table";
import { InputError } from "./units";

declare const WORKER_SCRIPT: string;

/** Samples that are wanted of many runs: of one channel, or of none, each so many-th, and how many. */
export interface Trace {
  readonly channel: string | null;
  readonly every: number;
  readonly places: number;
}

export const NO_TRACE: Trace = { channel: null, every: 1, places: 0 };

export interface RunsJob extends Trace {
  readonly kind: "runs";
  readonly number: number;
  readonly program: string;
  /** Settings of the program, run after run. */
  readonly rows: Float64Array<ArrayBuffer>;
}

export type Job =
  | { readonly kind: "program"; readonly program: Program; readonly bytes: ArrayBuffer }
  | { readonly kind: "table"; readonly number: number; readonly reading: number; readonly bytes: ArrayBuffer; readonly isLast: boolean }
  | { readonly kind: "recording"; readonly number: number; readonly reading: number; readonly columns: readonly RecordedColumn[] }
  | { readonly kind: "agreement"; readonly number: number; readonly run: Overlay; readonly values: Values; readonly isHeld: boolean }
  | RunsJob;

export interface Reply {
  readonly number: number;
  readonly runs?: Ensemble;
  readonly heads?: Heads;
  readonly drawn?: Overlay;
  readonly errors?: readonly ChannelError[];
  readonly fault?: string;
}

const MOST_WORKERS = 4;
/** Bytes of a file that are read at once. */
const PIECE = 4_000_000;
/** Pieces of work for each worker: some runs take longer than others, who is done takes the next piece, and what is no longer wanted ends with one. */
const PIECES = 16;
/** Runs that a program does side by side. */
const TOGETHER = 8;

/** A few workers that share work; they start when they are first wanted. */
export class Workers {
  private readonly crew: { worker: Worker; known: Set<string> }[] = [];
  private readonly waiting = new Map<number, (reply: Reply) => void>();
  private next = 0;

  constructor(private readonly bytesOf: (program: Program) => Promise<ArrayBuffer>) {}

  get count(): number {
    this.start();
    return this.crew.length;
  }

  /**
   * Many runs of a program, settings run after run, shared out among the workers. `goesOn` is told of the first runs, all of
   * which are done, whenever there are more of them, and may end it: then only those are given.
   */
  async runMany(program: Program, rows: Float64Array<ArrayBuffer>, trace: Trace = NO_TRACE, goesOn: (first: readonly Ensemble[]) => boolean = () => true): Promise<Ensemble> {
    this.start();
    const bytes = await this.bytesOf(program);
    const width = program.settings.length;
    const size = Math.ceil(rows.length / width / this.crew.length / PIECES / TOGETHER) * TOGETHER * width;
    const found: Ensemble[] = [];
    let [next, done, isWanted] = [0, 0, true];
    const work = async (place: number) => {
      this.introduce(place, program, bytes);
      while (isWanted && next * size < rows.length) {
        const piece = next;
        next += 1;
        const part = rows.slice(piece * size, (piece + 1) * size);
        const { runs } = await this.ask(place, (number) => ({ kind: "runs", number, program: program.name, rows: part, ...trace }), [part.buffer]);
        if (runs !== undefined) found[piece] = runs;
        const before = done;
        while (found[done] !== undefined) done += 1;
        if (done > before && isWanted) isWanted = goesOn(found.slice(0, done));
      }
    };
    // Two pieces wait at each worker, so that it does not wait for a page that is drawing.
    await Promise.all([...this.crew.keys(), ...this.crew.keys()].map(work));
    return together(found.slice(0, done));
  }

  /** Read the table in a file, which a worker keeps. The page reads it, piece by piece: in WebKit a worker of a page from a file may not. Null where no longer wanted. */
  async readTable(file: Blob, isWanted: () => boolean): Promise<{ readonly reading: number; readonly heads: Heads } | null> {
    this.start();
    const reading = this.next;
    this.next += 1;
    for (let place = 0; ; place += PIECE) {
      const bytes = await file.slice(place, place + PIECE).arrayBuffer().catch(refuseFile);
      if (!isWanted()) return null;
      const isLast = place + PIECE >= file.size;
      const { heads } = await this.ask(this.crew.length - 1, (number) => ({ kind: "table", number, reading, bytes, isLast }), [bytes]);
      if (heads !== undefined) return { reading, heads };
      if (isLast) throw new InputError("the file could not be read");
    }
  }

  /** Make a recording of a table that was read; the worker keeps it, and gives as much of it as can be drawn. */
  async takeRecording(reading: number, columns: readonly RecordedColumn[]): Promise<Overlay> {
    const { drawn } = await this.ask(this.crew.length - 1, (number) => ({ kind: "recording", number, reading, columns }));
    if (drawn === undefined) throw new RangeError("a worker gave no recording");
    return drawn;
  }

  /** Errors of a run against the recording, of which millions of samples may be compared. */
  async agreement({ time, channels }: Overlay, values: Values, isHeld: boolean): Promise<readonly ChannelError[]> {
    const { errors } = await this.ask(this.crew.length - 1, (number) => ({ kind: "agreement", number, run: { time, channels }, values, isHeld }));
    return errors ?? [];
  }

  private start(): void {
    if (this.crew.length > 0) return;
    const address = URL.createObjectURL(new Blob([WORKER_SCRIPT], { type: "text/javascript" }));
    const count = Math.max(1, Math.min(MOST_WORKERS, navigator.hardwareConcurrency || 2));
    for (let place = 0; place < count; place += 1) {
      const worker = new Worker(address);
      worker.onmessage = (event: MessageEvent<Reply>) => {
        this.waiting.get(event.data.number)?.(event.data);
        this.waiting.delete(event.data.number);
      };
      this.crew.push({ worker, known: new Set() });
    }
  }

  private introduce(place: number, program: Program, bytes: ArrayBuffer): void {
    const member = this.crew[place];
    if (member === undefined || member.known.has(program.name)) return;
    member.known.add(program.name);
    const job: Job = { kind: "program", program: { ...program, module: "" }, bytes };
    member.worker.postMessage(job);
  }

  private ask(place: number, job: (number: number) => Job, handed: ArrayBuffer[] = []): Promise<Reply> {
    const number = this.next;
    this.next += 1;
    return new Promise((resolve, reject) => {
      this.waiting.set(number, (reply) => {
        if (reply.fault === undefined) resolve(reply);
        else reject(new InputError(reply.fault));
      });
      this.crew[place]?.worker.postMessage(job(number), handed);
    });
  }
}

/** What a browser says of a file that is gone, or is a folder. */
export function refuseFile(error: unknown): never {
  if (error instanceof DOMException) throw new InputError("the file could not be read");
  throw error;
}

/** Runs of several ensembles as one. */
export function together(parts: readonly Ensemble[]): Ensemble {
  return {
    metrics: joined(parts.map(({ metrics }) => metrics)),
    ended: Int32Array.from(parts.flatMap(({ ended }) => [...ended])),
    traces: joined(parts.map(({ traces }) => traces)),
  };
}

function joined(parts: readonly Float64Array[]): Float64Array {
  const all = new Float64Array(parts.reduce((sum, part) => sum + part.length, 0));
  let place = 0;
  for (const part of parts) {
    all.set(part, place);
    place += part.length;
  }
  return all;
}
