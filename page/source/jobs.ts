/** What page and workers say to each other, and the workers of a page. */

import type { Program } from "./content";
import type { Ensemble } from "./engine";
import type { ChannelError, Overlay, RecordedColumn, Samples } from "./agreement";
import type { Values } from "./settings";
import type { Heads } from "./table";
import { InputError } from "./units";

declare const WORKER_SCRIPT: string;

/** Samples that are wanted of many runs: of all channels each so many-th, and how many; 0 for none. */
export interface Trace {
  readonly every: number;
  readonly places: number;
}

export const NO_TRACE: Trace = { every: 1, places: 0 };

/** Whoever wants many runs, while they are made. */
export interface Watch {
  /** Told of the first runs, all of which are done, whenever there are more of them; false ends it, and only those are given. */
  readonly goesOn: (first: readonly Ensemble[]) => boolean;
  /** Whether they are wanted yet; asked when the page has come to rest. */
  readonly isWanted: () => boolean;
}

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
  | { readonly kind: "agreement"; readonly number: number; readonly run: Samples; readonly values: Values; readonly isHeld: boolean }
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

/** What a worker was asked and has not answered. */
interface Asked {
  readonly job: Job;
  readonly isWanted: () => boolean;
  readonly answer: (reply: Reply) => void;
}

/** A worker, the programs that it was given, and what it is at, oldest first. */
interface Member {
  worker: Worker;
  readonly known: Map<string, Job>;
  readonly asked: Map<number, Asked>;
}

/** A few workers that share work; they start when they are first wanted. */
export class Workers {
  private readonly crew: Member[] = [];
  /** The one that keeps the recording, and is therefore never stopped. */
  private keeper: Member | null = null;
  private readonly address = URL.createObjectURL(new Blob([WORKER_SCRIPT], { type: "text/javascript" }));
  private next = 0;

  constructor(private readonly bytesOf: (program: Program) => Promise<ArrayBuffer>) {}

  /** Many runs of a program, settings run after run, shared out among the workers. */
  async runMany(program: Program, rows: Float64Array<ArrayBuffer>, trace: Trace, { goesOn, isWanted }: Watch): Promise<Ensemble> {
    this.start();
    const bytes = await this.bytesOf(program);
    const width = program.settings.length;
    const size = Math.ceil(rows.length / width / this.crew.length / PIECES / TOGETHER) * TOGETHER * width;
    const found: Ensemble[] = [];
    let [next, done, isOn] = [0, 0, true];
    const work = async (member: Member) => {
      introduce(member, program, bytes);
      while (isOn && next * size < rows.length) {
        const piece = next;
        next += 1;
        const part = rows.slice(piece * size, (piece + 1) * size);
        const { runs } = await this.ask(member, (number) => ({ kind: "runs", number, program: program.name, rows: part, ...trace }), [], isWanted);
        if (runs === undefined) isOn = false;
        else found[piece] = runs;
        const before = done;
        while (found[done] !== undefined) done += 1;
        if (done > before && isOn) isOn = goesOn(found.slice(0, done));
      }
    };
    // Two pieces wait at each worker, so that it does not wait for a page that is drawing.
    await Promise.all([...this.crew, ...this.crew].map(work));
    return together(found.slice(0, done));
  }

  /** Stop workers at what nobody wants any more: a piece of long runs lasts minutes. What else they were asked they begin anew. */
  rest(): void {
    for (const member of this.crew) {
      const unwanted = [...member.asked].filter(([, { isWanted }]) => !isWanted());
      if (unwanted.length === 0) continue;
      member.worker.terminate();
      member.worker = this.begun(member.asked);
      for (const [number, { answer }] of unwanted) {
        member.asked.delete(number);
        answer({ number });
      }
      const again = [...member.asked.values()].map(({ job }) => job);
      for (const job of [...member.known.values(), ...again]) member.worker.postMessage(job);
    }
  }

  /** Read the table in a file, which a worker keeps. The page reads it, piece by piece: in WebKit a worker of a page from a file may not. Null where no longer wanted. */
  async readTable(file: Blob, isWanted: () => boolean): Promise<{ readonly reading: number; readonly heads: Heads } | null> {
    const reading = this.next;
    this.next += 1;
    for (let place = 0; ; place += PIECE) {
      const bytes = await file.slice(place, place + PIECE).arrayBuffer().catch(refuseFile);
      if (!isWanted()) return null;
      const isLast = place + PIECE >= file.size;
      const { heads } = await this.ask(this.kept, (number) => ({ kind: "table", number, reading, bytes, isLast }), [bytes]);
      if (heads !== undefined) return { reading, heads };
      if (isLast) throw new InputError("the file could not be read");
    }
  }

  /** Make a recording of a table that was read; the worker keeps it, and gives as much of it as can be drawn. */
  async takeRecording(reading: number, columns: readonly RecordedColumn[]): Promise<Overlay> {
    const { drawn } = await this.ask(this.kept, (number) => ({ kind: "recording", number, reading, columns }));
    if (drawn === undefined) throw new RangeError("a worker gave no recording");
    return drawn;
  }

  /** Errors of a run against the recording, of which millions of samples may be compared. */
  async agreement({ time, channels }: Samples, values: Values, isHeld: boolean): Promise<readonly ChannelError[]> {
    const { errors } = await this.ask(this.kept, (number) => ({ kind: "agreement", number, run: { time, channels }, values, isHeld }));
    return errors ?? [];
  }

  private start(): void {
    const count = Math.max(1, Math.min(MOST_WORKERS, navigator.hardwareConcurrency || 2));
    while (this.crew.length < count) this.crew.push(this.member());
  }

  private get kept(): Member {
    this.keeper ??= this.member();
    return this.keeper;
  }

  private member(): Member {
    const asked = new Map<number, Asked>();
    return { worker: this.begun(asked), known: new Map(), asked };
  }

  private begun(asked: Map<number, Asked>): Worker {
    const worker = new Worker(this.address);
    worker.onmessage = (event: MessageEvent<Reply>) => {
      const { number } = event.data;
      const found = asked.get(number);
      asked.delete(number);
      found?.answer(event.data);
    };
    return worker;
  }

  private ask(member: Member, jobOf: (number: number) => Job, handed: ArrayBuffer[] = [], isWanted = () => true): Promise<Reply> {
    const number = this.next;
    this.next += 1;
    const job = jobOf(number);
    return new Promise((resolve, reject) => {
      const answer = (reply: Reply) => {
        if (reply.fault === undefined) resolve(reply);
        else reject(new InputError(reply.fault));
      };
      member.asked.set(number, { job, isWanted, answer });
      member.worker.postMessage(job, handed);
    });
  }
}

function introduce({ worker, known }: Member, program: Program, bytes: ArrayBuffer): void {
  if (known.has(program.name)) return;
  const job: Job = { kind: "program", program: { ...program, module: "" }, bytes };
  known.set(program.name, job);
  worker.postMessage(job);
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
