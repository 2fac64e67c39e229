/**
 * What uPlot asks of the browser's language as it loads: numbers and the time zone, 60 ms on a phone, and WebKit on
 * Linux may call its language `C`, which is none. The page writes its own numbers on the axes; the build puts these there.
 */

export class PlainNumbers {
  format(value: number): string {
    return String(value);
  }
}

export class NoCalendar {
  resolvedOptions(): { timeZone: string } {
    return { timeZone: "" };
  }
}
