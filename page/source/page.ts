/** What the parts of the page know of it: its state, its runs, and what they may ask it to do. */

import type { Overlay } from "./agreement";
import type { Content, Tab } from "./content";
import type { Run } from "./engine";
import type { Workers } from "./jobs";
import type { Panels } from "./panels";
import type { Configuration } from "./settings";
import type { State } from "./state";

/** A configuration with a name that tells it from the others, its place among them, and the number of its colour. */
export interface Named {
  readonly name: string;
  readonly place: number;
  readonly look: number;
  readonly configuration: Configuration;
}

export interface Page {
  readonly content: Content;
  readonly state: State;
  readonly overlay: Overlay | null;
  readonly workers: Workers;
  readonly panels: Panels;
  readonly tab: Tab;
  readonly bench: readonly Configuration[];
  readonly named: readonly Named[];
  readonly told: string;
  readonly refused: string;
  runOf(configuration: Configuration): Run | null;
  become(state: State): void;
  changeOne(place: number, texts: readonly (readonly [string, string])[]): void;
  addConfiguration(program: string): void;
  removeConfiguration(place: number): void;
  choose(target: number | null): void;
  openTab(tab: number): void;
  arrange(isBeside: boolean): void;
  band(isWanted: boolean): void;
  overlayWith(overlay: Overlay | null): void;
  undo(): void;
  redo(): void;
  resetAll(): void;
  schedule(): void;
  tell(text: string): void;
}
