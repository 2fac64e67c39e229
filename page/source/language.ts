/** WebKit on Linux may call its language `C`, which is none, and uPlot asks for the numbers of that language as it loads. */

try {
  new Intl.NumberFormat(navigator.language);
} catch (error) {
  if (!(error instanceof RangeError)) throw error;
  Object.defineProperty(navigator, "language", { value: "en" });
}

export {};
