/** Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008), on light and on dark. */

export const DASHES: readonly number[][] = [[], [7, 4], [2, 3], [9, 3, 2, 3]];

const known = new Map<string, string>();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => known.clear());

/** The value of a custom property of the page's style. To ask for it makes the browser work out its styles: once will do. */
export function colour(name: string): string {
  const found = known.get(name) ?? getComputedStyle(document.querySelector(".workbench") ?? document.body).getPropertyValue(`--${name}`).trim();
  if (found !== "") known.set(name, found);
  return found;
}

/** The colour in which a configuration is named, by its number: dark enough for words. */
export function colourOf(look: number): string {
  return colour(`run-${look}`);
}

/** The colour of the curves of a configuration: that of the figures. */
export function lineColourOf(look: number): string {
  return colour(`line-${look}`);
}

/** Numbers of colours: the first configuration with a valve has that of the valve in every figure, others what is left. */
export function looksOf(wanted: readonly number[]): readonly number[] {
  const free = new Set([1, 2, 3, 4].filter((look) => !wanted.includes(look)));
  return wanted.map((look, place) => {
    if (look > 0 && wanted.indexOf(look) === place) return look;
    const found = [...free][0] ?? (place % 4) + 1;
    free.delete(found);
    return found;
  });
}

/** From pale to deep: lightness alone says how much. Ends of a map of one metric, and of the pressure in a chamber. */
const RAMP: readonly (readonly [number, number, number])[] = [
  [253, 231, 37],
  [159, 218, 58],
  [74, 193, 109],
  [31, 161, 135],
  [39, 127, 142],
  [54, 92, 141],
  [70, 50, 127],
  [68, 1, 84],
];

/** The colour of a share from 0 (pale) to 1 (deep): the scale viridis, from its light end. */
export function shade(share: number): readonly [number, number, number] {
  const place = Math.min(1, Math.max(0, share)) * (RAMP.length - 1);
  const below = Math.min(RAMP.length - 2, Math.floor(place));
  const [from, to] = [RAMP[below] ?? [0, 0, 0], RAMP[below + 1] ?? [0, 0, 0]];
  const rest = place - below;
  return [0, 1, 2].map((band) => Math.round((from[band] ?? 0) + ((to[band] ?? 0) - (from[band] ?? 0)) * rest)) as [number, number, number];
}
