const DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";

/** The bytes of a text in base 85 (that of Python's `base64.b85encode`) that gzip has packed. */
export async function unpacked(text: string): Promise<ArrayBuffer> {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** Five letters are four bytes; what is missing at the end counts as the last digit. */
function bytesOf(text: string): Uint8Array<ArrayBuffer> {
  const worth = new Uint8Array(128);
  for (let place = 0; place < DIGITS.length; place += 1) worth[DIGITS.charCodeAt(place)] = place;
  const groups = Math.ceil(text.length / 5);
  const view = new DataView(new ArrayBuffer(groups * 4));
  for (let group = 0; group < groups; group += 1) {
    let value = 0;
    for (let place = 5 * group; place < 5 * group + 5; place += 1) {
      value = value * 85 + (place < text.length ? (worth[text.charCodeAt(place)] ?? 0) : DIGITS.length - 1);
    }
    view.setUint32(4 * group, value);
  }
  return new Uint8Array(view.buffer, 0, groups * 4 - (groups * 5 - text.length));
}
