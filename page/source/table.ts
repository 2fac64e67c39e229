/** Tables of numbers from a file of text, read in pieces so that a large one does not hold anything up. */

import { InputError, short } from "./units";

/** Names of columns with their units, empty where the header names none. */
export type Heads = readonly { readonly name: string; readonly unit: string }[];

export interface RecordedTable {
  readonly heads: Heads;
  readonly columns: readonly Float64Array[];
}

const MOST_COLUMNS = 200;
const MOST_ROWS = 20_000_000;
const LONGEST_LINE = 100_000;
/** A longer cell names no unit: the pattern of one that does takes its time. */
const LONGEST_HEAD = 200;
const HEAD = /^\s*(.+?)\s*[[(]\s*([^\])]*?)\s*[\])]\s*$/;

type Mark = "," | ";" | "\t";

function decoded(decoder: TextDecoder, bytes: ArrayBuffer, isLast: boolean): string {
  try {
    const text = decoder.decode(bytes, { stream: !isLast });
    if (text.includes("\0")) throw new InputError("the file is not a text file");
    return text;
  } catch (error) {
    if (error instanceof TypeError) throw new InputError("the file is not a text file in UTF-8");
    throw error;
  }
}

/** A table that comes in pieces. Throws InputError with the line for what is no table of numbers. */
export class TableReading {
  private readonly decoder = new TextDecoder("utf-8", { fatal: true });
  private rest = "";
  private line = 0;
  private mark: Mark = ",";
  private heads: { name: string; unit: string }[] = [];
  private columns: Float64Array[] = [];
  private rows = 0;
  private blank = 0;

  take(bytes: ArrayBuffer, isLast: boolean): void {
    const lines = (this.rest + decoded(this.decoder, bytes, isLast)).split(/\r\n|\n|\r(?!$)/);
    this.rest = lines.pop() ?? "";
    if (this.rest.length > LONGEST_LINE) throw new InputError(`line ${this.line + 1} is too long for a row of numbers`);
    for (const line of lines) this.takeLine(line);
  }

  end(): RecordedTable {
    if (this.rest.trim() !== "") this.takeLine(this.rest.replace(/\r$/, ""));
    if (this.heads.length === 0) throw new InputError("the file has no header");
    if (this.rows < 2) throw new InputError("the file has a header but fewer than two rows of numbers");
    return { heads: this.heads, columns: this.columns.map((column) => column.slice(0, this.rows)) };
  }

  private takeLine(line: string): void {
    this.line += 1;
    if (this.heads.length === 0) {
      if (!line.startsWith("#")) this.takeHeader(line);
      return;
    }
    if (line.trim() === "") {
      this.blank ||= this.line;
      return;
    }
    if (this.blank > 0) throw new InputError(`line ${this.blank} is empty, and more follows`);
    this.takeRow(line);
  }

  private takeHeader(line: string): void {
    if (line.trim() === "") throw new InputError(`line ${this.line} is empty; the header must come first`);
    const marks: Mark[] = ["\t", ";", ","];
    this.mark = marks.find((mark) => line.includes(mark)) ?? ",";
    const cells = line.replace(/^\uFEFF/, "").split(this.mark).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
    if (cells.length < 2) throw new InputError("the header names one column only; a recording has time and a channel");
    if (cells.length > MOST_COLUMNS) throw new InputError(`the header has ${cells.length} columns, at most ${MOST_COLUMNS} are read`);
    this.heads = cells.map((cell, place) => {
      const match = cell.length > LONGEST_HEAD ? null : HEAD.exec(cell);
      return { name: short(match?.[1] ?? (cell || `column ${place + 1}`)), unit: (match?.[2] ?? "").trim() };
    });
    this.columns = cells.map(() => new Float64Array(1024));
  }

  private takeRow(line: string): void {
    const cells = line.split(this.mark);
    if (cells.length !== this.heads.length) {
      throw new InputError(`line ${this.line} has ${cells.length} values for ${this.heads.length} columns`);
    }
    if (this.rows === MOST_ROWS) throw new InputError(`the file has more than ${MOST_ROWS} rows`);
    if (this.rows === this.columns[0]?.length) this.columns = this.columns.map(doubled);
    for (let place = 0; place < cells.length; place += 1) {
      const text = cells[place] ?? "";
      const value = numberIn(this.mark === ";" ? text.replace(",", ".") : text);
      const column = this.columns[place];
      if (Number.isNaN(value) || column === undefined) {
        const name = this.heads[place]?.name ?? "";
        throw new InputError(`line ${this.line}, column '${name}': '${short(text)}' is not a number, or not a finite one`);
      }
      column[this.rows] = value;
    }
    this.rows += 1;
  }
}

/** The number that a cell writes, NaN for anything else: no hexadecimal, nothing empty, nothing without end. */
function numberIn(cell: string): number {
  const value = Number(cell);
  const isPlain = Number.isFinite(value) && !/^\s*$|[xXoObB]/.test(cell);
  return isPlain ? value : NaN;
}

function doubled(column: Float64Array): Float64Array {
  const longer = new Float64Array(column.length * 2);
  longer.set(column);
  return longer;
}
