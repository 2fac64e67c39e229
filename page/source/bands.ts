/** Bands of uncertainty of the configurations: made when the page has come to rest, and kept. */

import type { Page } from "./page";
import type { Band } from "./panels";
import type { Configuration } from "./settings";
import { bandOf } from "./variation";

type BandsOfChannels = ReadonlyMap<string, Band>;

export class Bands {
  isShown = false;
  private readonly kept = new WeakMap<Configuration, BandsOfChannels>();
  /** The last bands, by the place of their configuration: those stand until the next ones are there. */
  private readonly latest = new Map<number, BandsOfChannels>();
  private readonly underWay = new Set<Configuration>();

  constructor(private readonly app: Page) {}

  /** The bands of the configuration at a place, or those that were there before. */
  of(configuration: Configuration, place: number): BandsOfChannels | null {
    return this.isShown ? (this.kept.get(configuration) ?? this.latest.get(place) ?? null) : null;
  }

  /** Forget which bands were where. */
  forget(): void {
    this.latest.clear();
  }

  /** Make the bands that are missing. */
  async settle(): Promise<void> {
    if (!this.isShown) this.forget();
    else await Promise.all(this.app.bench.map((configuration) => this.make(configuration)));
  }

  private async make(configuration: Configuration): Promise<void> {
    const { app } = this;
    const run = app.runOf(configuration);
    if (run === null || run.time.length < 2 || this.kept.has(configuration) || this.underWay.has(configuration)) return;
    const isWanted = () => this.isShown && app.bench.includes(configuration);
    this.underWay.add(configuration);
    const bands = await bandOf(app.content, app.workers, configuration, run, isWanted).finally(() => this.underWay.delete(configuration));
    if (!isWanted()) return;
    // Given up, and wanted again since.
    if (bands === null) return this.make(configuration);
    this.kept.set(configuration, bands);
    this.latest.set(app.bench.indexOf(configuration), bands);
    app.schedule();
  }
}
