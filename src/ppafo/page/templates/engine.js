// @ts-check

/**
 * Worker in which a scenario runs: each message with settings gives one with a run; the first has the module.
 * @typedef {{memory: WebAssembly.Memory, defaults: () => number, used: () => number, bad: () => number, cause: () => number,
 *   run: () => number, found: () => number, reached?: (angle: number, torque: number) => number}} Module
 */

/** @type {Module} */ let wasm;
/** @type {{bytes: Uint8Array, outputs: string[], compared: string[], settings: number, metrics: number}} */ let opened;
let placeOfChosen = 0;

const TABLE = Int32Array.from({length: 256}, (_, byte) => {
    for (let bit = 0; bit < 8; ++bit) {
        byte = (byte >>> 1) ^ (byte & 1 ? 0xedb88320 : 0);
    }
    return byte;
});

/** CRC-32 of samples, as of Python's zlib. @param {Float64Array[]} columns */
function checksum(columns) {
    let found = -1;
    for (const column of columns) {
        // A sum with 0 has no negative zero.
        for (const byte of new Uint8Array(column.map((value) => value + 0).buffer)) {
            found = TABLE[(found ^ byte) & 255] ^ (found >>> 8);
        }
    }
    return ~found >>> 0;
}

/** Numbers in the memory of the module, which may move when it grows. @param {number} place @param {number} count */
function numbers(place, count) {
    return new Float64Array(wasm.memory.buffer, place, count);
}

/** Simulate with settings in SI. @param {Float64Array} settings */
function simulate(settings) {
    const begin = performance.now();
    numbers(placeOfChosen, opened.settings).set(settings);
    const cause = wasm.cause();
    if (cause > 0) {
        const bytes = new Uint8Array(wasm.memory.buffer, wasm.bad());
        return {cause, name: new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)))};
    }
    const status = wasm.run(), width = opened.outputs.length + 1;
    const [count, samples, metrics] = new Int32Array(wasm.memory.buffer, wasm.found(), 3), rows = numbers(samples, count * width);
    const column = (/** @type {number} */ place) => new Float64Array(count).map((_, sample) => rows[sample * width + place]);
    /** @type {Record<string, Float64Array>} */
    const columns = Object.fromEntries(opened.outputs.map((name, place) => [name, column(place + 1)]));
    const check = checksum(opened.compared.map((name) => columns[name])), {reached} = wasm;
    if (reached) {
        const within = columns.reference.map((torque, sample) => reached(columns.angle[sample], torque));
        if (within.some((torque, sample) => torque !== columns.reference[sample])) {
            columns.within_reach = within;
        }
    }
    return {
        cause, status, time: column(0), columns, check, metrics: numbers(metrics, opened.metrics).slice(),
        used: numbers(wasm.used(), opened.settings).slice(), milliseconds: performance.now() - begin,
    };
}

onmessage = ({data}) => {
    if (data instanceof Float64Array) {
        return postMessage(simulate(data));
    }
    opened = data;
    wasm = /** @type {any} */ (new WebAssembly.Instance(new WebAssembly.Module(opened.bytes), {}).exports);
    placeOfChosen = wasm.defaults();
};
