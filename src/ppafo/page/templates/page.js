// @ts-check

/**
 * How a number is shown: SI value = offset + scale * shown value, for a gauge pressure plus the atmosphere.
 * Magnitudes up to ``zero`` [SI] are rounding errors.
 * @typedef {{unit: string, typed: string, scale: string, offset: string, gauge: boolean, zero: number}} Shown
 * @typedef {Shown & {path: string, name: string, label: string, summary: string, si: string, value: number, first: number,
 *   from: number, to: number, step: number, hidden: boolean, longest: boolean, ends: number[], least: string, rules: string}} Setting
 * @typedef {Shown & {name: string, label: string, short: string}} Entry channel or metric
 * @typedef {{title: string, channels: string[]}} Panel
 * @typedef {{name: string, description: string, command: string, settings: Setting[], channels: Entry[], panels: Panel[],
 *   metrics: Entry[], headlines: string[], outputs: string[], compared: string[], samples: number, checksum: number,
 *   wasm: string}} Simulation
 * @typedef {{label: string, look: string, address: string, cause: number, name: string, status: number, time: Float64Array,
 *   columns: Record<string, Float64Array>, metrics: Record<string, number>, used: Float64Array, check: number,
 *   milliseconds: number}} Run
 */

const ENDINGS = ["there is no more memory", "", "the state became unphysical: try other masses, volumes or areas",
    "a step was cut into too many parts"];
const LOOKS = ["kept-1", "kept-2", "kept-3"];
/** @type {Record<string, string>} */ const LABELS = {reference: "required", within: "required, within reach"};
/** Number of results that are always shown, and length of the end of a long run that may be drawn alone [s]. */
const RESULTS = 10, END = 4, FINISHED = 1;

/** @type {Simulation[]} */
const simulations = JSON.parse(byId("content").textContent ?? "").simulations;
const engine = URL.createObjectURL(new Blob([byId("engine").textContent ?? ""], {type: "text/javascript"}));
let simulation = simulations[0];
/** @type {Worker} */ let worker;
let chosen = new Float64Array();
/** @type {Run} */ let written;
/** @type {Run} */ let last;
/** @type {Run[]} */ let kept = [];
let cursor = NaN, isBusy = false, isAsked = false, timer = 0, unknown = "";

/** @param {string} id @returns {HTMLElement & {value: string, checked: boolean}} */
function byId(id) {
    return /** @type {any} */ (document.getElementById(id));
}

/** An element, of SVG after "svg:". @param {Record<string, string | number>} attributes @param {(Node | string)[]} children */
function make(/** @type {string} */ tag, attributes = {}, ...children) {
    const made = tag.startsWith("svg:")
        ? document.createElementNS("http://www.w3.org/2000/svg", tag.slice(4)) : document.createElement(tag);
    Object.entries(attributes).forEach(([name, value]) => made.setAttribute(name, String(value)));
    made.append(...children);
    return /** @type {any} */ (made);
}

/* ---- Numbers: as exact as in Python, where texts become numbers by decimals. ---- */

/** @param {string} text @returns {[bigint, number]} digits and power of ten */
function decimal(text) {
    const [digits, power] = text.toLowerCase().split("e"), [whole, part = ""] = digits.split(".");
    return [BigInt(whole + part), Number(power ?? 0) - part.length];
}

/** @param {number} value @param {Shown} shown @returns {number} value in SI */
function toSi(value, shown) {
    const [[digits, power], [scale, more], [offset, own]] = [String(value), shown.scale, shown.offset].map(decimal);
    const least = Math.min(power + more, own);
    const sum = digits * scale * 10n ** BigInt(power + more - least) + offset * 10n ** BigInt(own - least);
    return Number(`${sum}e${least}`) + (shown.gauge ? atmosphere() : 0);
}

/** @param {Shown} shown @returns {(value: number) => number} conversion from SI */
function converter(shown) {
    const zero = Number(shown.offset) + (shown.gauge ? atmosphere() : 0), scale = Number(shown.scale);
    return (value) => Math.abs(value) <= shown.zero ? -zero / scale : (value - zero) / scale;
}

/** @param {number} value @param {number} digits @returns {string} */
function text(value, digits = 4) {
    return Number.isFinite(value) ? String(Number(value.toPrecision(digits))).replace("-", "−") : "none";
}

/** @param {number} value in SI @param {Shown} shown */
function said(value, shown) {
    return `${text(converter(shown)(value))} ${shown.unit}`.trim();
}

/** Atmosphere of the last run [Pa]. */
function atmosphere() {
    const place = simulation.settings.findIndex(({path}) => path === "supply.atmospheric_pressure");
    return last ? last.used[place] : simulation.settings[place].value;
}

/* ---- Runs. ---- */

/** Settings that are not as written. @returns {[Setting, number][]} */
function changes() {
    return simulation.settings.flatMap((setting, place) =>
        chosen[place] === setting.value ? [] : [/** @type {[Setting, number]} */ ([setting, chosen[place]])]);
}

/** The chosen settings as an address in this page, such as "step-response&valve.area=2e-05". */
function address() {
    return [byId("scenario").value, ...changes().map(([{path}, value]) => `${path}=${value}`)].join("&");
}

/** Simulate the chosen settings in the worker. @returns {Promise<Run>} */
function simulate() {
    const run = {label: "now", look: "now", address: address()}, {metrics} = simulation;
    return new Promise((resolve) => {
        worker.onmessage = ({data}) => resolve({...data, ...run, metrics: Object.fromEntries(
            metrics.map(({name}, place) => [name, data.status === FINISHED ? data.metrics[place] : NaN]))});
        worker.postMessage(chosen.slice());
    });
}

/** Why there is no run, in words; empty if there is one. @param {Run} run @returns {string} */
function fault({cause, name}) {
    const place = simulation.settings.findIndex((one) => one.name === name), setting = simulation.settings[place];
    const value = cause ? `${setting.label} = ${Number.isNaN(chosen[place]) ? "nothing" : said(chosen[place], setting)}` : "";
    const limits = setting?.ends.map((end, side) => Math.abs(end) < 1e300 ? `${side ? "at most" : setting.least} ${said(end, setting)}` : "");
    return ["", `${value} is out of range: it must be ${limits?.filter(Boolean).join(" and ")}`,
        `${value} contradicts another setting${setting?.rules && `: ${setting.rules}`}`,
        `${value} needs functions that this page has not: write a page with --set "${setting?.path}=..."`,
        `${value} is too long: a page runs up to ${setting?.to} ${setting?.unit}`][cause];
}

/** Run, and run again as long as settings changed meanwhile. */
async function refresh() {
    isAsked = true;
    if (isBusy) {
        return;
    }
    isBusy = true;
    const slow = setTimeout(() => (byId("said").textContent = "Simulating ..."), 300);
    while (isAsked) {
        isAsked = false;
        clearTimeout(timer);
        delete byId("command").dataset.checksum;
        const tooLong = simulation.settings.find(({longest, to}, place) => longest && chosen[place] > to);
        const run = tooLong ? /** @type {any} */ ({cause: 4, name: tooLong.name}) : await simulate();
        clearTimeout(slow);
        accept(run);
    }
    isBusy = false;
}

/** Show a run, or say why there is none. @param {Run} run */
function accept(run) {
    if (run.cause) {
        byId("said").textContent = `${unknown}Not simulated: ${fault(run)}. The curves are those ${last === written ? "as written" : "of the last run"}.`;
        return;
    }
    last = run;
    showSettings();
    draw();
    const words = changes().map(([setting, value]) => {
        // As it is shown, where this is read as the same number.
        const short = Number(converter(setting)(value).toPrecision(12)), isSame = toSi(short, setting) === value;
        return ` --set "${setting.path}=${(isSame ? `${short} ${setting.typed}` : `${value} ${setting.si}`).trim()}"`;
    });
    byId("command").textContent = simulation.command + words.join("");
    history.replaceState(null, "", `#${[...kept, last].map((one) => one.address).join("|")}`);
    // Once for a whole drag: a screen reader would fall behind.
    timer = setTimeout(say, 400);
}

/** Say the results that matter. */
function say() {
    const found = simulation.metrics.filter(({name}) => simulation.headlines.includes(name)).map((metric) => {
        const [now, before] = [last, written].map((run) => said(run.metrics[metric.name], metric));
        return `${metric.short} ${now}${now === before ? "" : ` (as written ${before})`}`;
    });
    const {reference, within_reach} = last.columns, entry = simulation.channels.find(({name}) => name === "within_reach");
    const most = within_reach?.reduce((found, torque, place) => Math.max(found, Math.abs(reference[place] - torque)), 0);
    const reach = entry && most ? `The reference is beyond the reach of the actuator by up to ${said(most, entry)}. ` : "";
    const ending = last.status === FINISHED ? "" : `The run ended at ${text(last.time.at(-1) ?? 0)} s: ${ENDINGS[last.status]}. `;
    byId("said").textContent = `${unknown}${reach}${ending}${found.join("; ")}. Simulated in ${text(last.milliseconds, 2)} ms.`;
    byId("command").dataset.checksum = String(last.check);
}

/* ---- Settings. ---- */

function fillSettings() {
    const shown = simulation.settings.map((setting, place) => ({setting, place})).filter(({setting}) => !setting.hidden);
    const first = shown.filter(({setting}) => setting.first >= 0).sort((one, other) => one.setting.first - other.setting.first);
    const form = byId("settings");
    form.replaceChildren(make("h2", {}, "Settings"), ...first.map(({setting, place}) => control(setting, place)));
    /** @type {Record<string, HTMLElement>} */
    const groups = {};
    for (const {setting, place} of shown.filter((one) => !first.includes(one))) {
        const group = setting.path.split(".")[0];
        groups[group] ??= form.appendChild(make("details", {}, make("summary", {}, group.replaceAll("_", " "))));
        groups[group].append(control(setting, place));
    }
}

/** Number and slider of a setting. @param {Setting} setting @param {number} place */
function control(setting, place) {
    const {label, unit, from, to, step, summary, path} = setting, id = `setting-${place}`;
    const number = make("input", {type: "number", step: "any", id, title: `${summary} (${path})`});
    const slider = make("input", {type: "range", min: from, max: to, step, "aria-label": `${label}${unit && `, ${unit}`}`});
    for (const input of [number, slider]) {
        input.addEventListener("input", () => {
            chosen[place] = input.value === "" ? NaN : toSi(Number(input.value), setting);
            refresh();
        });
    }
    return make("div", {class: "setting"}, make("label", {for: id}, label, " ", make("small", {}, unit)), number, slider);
}

/** Show the settings of the last run, of which some follow others. */
function showSettings() {
    simulation.settings.forEach((setting, place) => {
        const whole = document.getElementById(`setting-${place}`)?.parentElement, isChanged = last.used[place] !== written.used[place];
        if (whole) {
            const value = Number(converter(setting)(last.used[place]).toPrecision(12)), inputs = [...whole.querySelectorAll("input")];
            inputs.filter((input) => input !== document.activeElement).forEach((input) => (input.value = Math.abs(value) < 1e-3 && value ? value.toExponential() : String(value)));
            inputs[1].setAttribute("aria-valuetext", said(last.used[place], setting));
            whole.classList.toggle("changed", isChanged);
            whole.setAttribute("data-written", isChanged ? `as written ${said(written.used[place], setting)}` : "");
        }
    });
}

/* ---- Curves and results. ---- */

/** Round numbers from one end to the other. @param {number} low @param {number} high @param {number} most */
function ticks(low, high, most) {
    const decade = 10 ** Math.floor(Math.log10((high - low) / most));
    const step = [1, 2, 5, 10].map((times) => times * decade).find((size) => (high - low) / size <= most) ?? high - low;
    const first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first;
    return Array.from({length: count + 1}, (_, place) => (first + place) * step);
}

/** Points of a curve as an SVG path, of many points the extremes. @param {Float64Array} times @param {Float64Array} values */
function path(times, values, /** @type {(x: number) => number} */ x, /** @type {(y: number) => number} */ y) {
    const bucket = Math.max(1, Math.floor(values.length / 400)), points = [];
    for (let begin = 0; begin < values.length; begin += bucket) {
        let low = begin, high = begin;
        for (let place = begin; place < Math.min(begin + bucket, values.length); ++place) {
            low = values[place] < values[low] ? place : low;
            high = values[place] > values[high] ? place : high;
        }
        points.push(...(low === high ? [low] : [Math.min(low, high), Math.max(low, high)]));
    }
    return `M${points.map((place) => `${x(times[place]).toFixed(1)} ${y(values[place]).toFixed(1)}`).join("L")}`;
}

/** Look of a curve that is required and not of a run. @param {string} name */
function lookOf(name) {
    return name.startsWith("reference") ? "reference" : name === "within_reach" ? "within" : "";
}

/** Draw a panel; a sentence for one in which nothing moves. @param {Panel} panel @param {Run[]} runs */
function figure({title, channels}, runs, /** @type {number} */ width, /** @type {number} */ height) {
    const end = Math.max(...runs.map((run) => run.time.at(-1) ?? 0)), begin = byId("end").checked ? Math.max(0, end - END) : 0;
    const entries = channels.map((name) => /** @type {Entry} */ (simulation.channels.find((entry) => entry.name === name)));
    const curves = runs.flatMap((run) => entries.map((entry, place) => {
        const first = run.time.findIndex((time) => time >= begin), required = lookOf(entry.name);
        const values = first < 0 ? [] : (run.columns[entry.name] ?? new Float64Array()).subarray(first).map(converter(entry));
        const of = entry === entries[0] ? "" : `, ${entry.name.replace("_", " ")}`, time = run.time.subarray(first);
        return {run, entry, required, of: LABELS[required] ?? run.look.replace("-", " ") + of, dash: place ? "5 4" : "none", time, values};
    })).filter(({run, required, values}) => values.length && (run.look === "now" || !required));
    const [low, high] = [Math.min, Math.max].map((one) => one(...curves.map(({values}) => values.reduce((sum, value) => one(sum, value)))));
    const {unit} = entries[0], room = (high - low) / 20;
    if (!(high - low > 1e-9 * Math.max(1, Math.abs(high)))) {
        return make("p", {class: "still"}, `${title}: ${text(high)} ${unit}, constant.`);
    }
    const [left, top, right, bottom] = [46, 6, width - 8, height - 34];
    const x = (/** @type {number} */ time) => left + (right - left) * (time - begin) / (end - begin);
    const y = (/** @type {number} */ value) => bottom - (bottom - top) * (value - low + room) / (high - low + 2 * room);
    const svg = make("svg:svg", {viewBox: `0 0 ${width} ${height}`, role: "img", tabindex: 0, "aria-label": `${title}. ${
        curves.map(({run, entry, values}) => `${run.label}, ${entry.label}: from ${text(values[0])} to ${text(values.at(-1) ?? NaN)} ${unit}`).join("; ")}`});
    for (const value of ticks(low - room, high + room, 6)) {
        svg.append(make("svg:path", {class: "grid", d: `M${left} ${y(value)}H${right}`}),
            make("svg:text", {x: left - 5, y: y(value) + 4, "text-anchor": "end"}, text(value)));
    }
    for (const value of ticks(begin, end, width > 500 ? 8 : 4)) {
        svg.append(make("svg:path", {class: "grid", d: `M${x(value)} ${top}V${bottom}`}),
            make("svg:text", {x: x(value), y: bottom + 15, "text-anchor": "middle"}, text(value)));
    }
    svg.append(make("svg:text", {x: right, y: height - 4, "text-anchor": "end"}, "Time (s)"));
    for (const {run, required, dash, time, values} of curves) {
        svg.append(make("svg:path", {class: `curve ${required || run.look}`, "stroke-dasharray": dash, d: path(time, values, x, y)}));
    }
    const line = svg.appendChild(make("svg:path", {class: "cursor"})), readout = make("output");
    const place = () => {
        const isShown = cursor >= begin && cursor <= end;
        line.setAttribute("d", isShown ? `M${x(cursor)} ${top}V${bottom}` : "");
        const words = curves.map(({of, time, values}) => `${of} ${text(values[time.findIndex((one) => one >= cursor)] ?? NaN)}`);
        readout.textContent = isShown ? `${text(cursor)} s: ${words.join("; ")}` : "";
    };
    const move = (/** @type {number} */ time) => {
        cursor = Math.min(end, Math.max(begin, time));
        document.querySelectorAll("figure").forEach((one) => /** @type {any} */ (one).place());
    };
    svg.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
        const box = svg.getBoundingClientRect();
        move(begin + ((event.clientX - box.left) * width / box.width - left) / (right - left) * (end - begin));
    });
    svg.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
        const step = {ArrowLeft: -0.01, ArrowRight: 0.01}[event.key];
        if (step) {
            event.preventDefault();
            move((Number.isNaN(cursor) ? begin : cursor) + step * (end - begin));
        }
    });
    const made = make("figure", {}, make("figcaption", {}, `${title}${unit && `, ${unit}`} `, readout), svg);
    made.place = place;
    place();
    return made;
}

/** Table of metrics, one column per run. @param {Entry[]} metrics @param {Run[]} runs */
function results(metrics, runs) {
    const head = make("tr", {}, make("th", {scope: "col"}, "Result"), ...runs.map(({label}) => make("th", {scope: "col"}, label)));
    return make("table", {}, make("thead", {}, head), make("tbody", {}, ...metrics.map((metric) =>
        make("tr", {}, make("th", {scope: "row", title: metric.label}, `${metric.short}${metric.unit && ` (${metric.unit})`}`),
            ...runs.map((run) => make("td", {}, text(converter(metric)(run.metrics[metric.name] ?? NaN))))))));
}

function draw() {
    const runs = [written, ...kept, last], [lead, ...rest] = simulation.panels;
    byId("end").parentElement?.toggleAttribute("hidden", !runs.some((run) => (run.time.at(-1) ?? 0) > 2 * END));
    const focused = [...document.querySelectorAll("svg")].indexOf(/** @type {any} */ (document.activeElement));
    byId("lead").replaceChildren(figure(lead, runs, Math.max(280, byId("lead").clientWidth), 250));
    const room = byId("panels").clientWidth, width = room > 700 ? (room - 16) / 2 : Math.max(280, room);
    const made = rest.map((panel) => figure(panel, runs, width, 190));
    const [curves, still] = [true, false].map((moves) => made.filter(({tagName}) => moves === (tagName === "FIGURE")));
    if (curves.length % 2) {
        // One that is left over has the whole row.
        curves.push(figure(rest[made.indexOf(curves.pop())], runs, Math.max(280, room), 190));
        curves.at(-1).classList.add("wide");
    }
    byId("panels").replaceChildren(...curves, ...still);
    document.querySelectorAll("svg")[focused]?.focus();
    const required = Object.keys(LABELS).filter((look) => Object.keys(last.columns).some((name) => lookOf(name) === look));
    byId("legend").replaceChildren(...[...runs, ...required.map((look) => ({label: LABELS[look], look}))].map(({label, look}) => make("li", {},
        make("svg:svg", {viewBox: "0 0 24 8", "aria-hidden": "true"}, make("svg:path", {class: `curve ${look}`, d: "M0 4H24"})), label)));
    // Those that no run has, or that are 0 in all, say nothing.
    const found = simulation.metrics.filter(({name, zero}) => runs.some((run) => Math.abs(run.metrics[name]) > zero));
    byId("results").replaceChildren(results(found.slice(0, RESULTS), runs));
    byId("more").replaceChildren(make("summary", {}, `Results: ${found.length - RESULTS} more`), results(found.slice(RESULTS), runs));
    byId("more").hidden = found.length <= RESULTS;
}

/* ---- The page. ---- */

/** Open a scenario with changes. @param {string} wanted address */
async function openScenario(wanted) {
    const [name, ...changed] = wanted.split("&");
    worker?.terminate();
    clearTimeout(timer);
    byId("settings").replaceChildren();
    delete byId("command").dataset.checksum;
    simulation = simulations.find((one) => one.name === name) ?? simulations[0];
    unknown = !name || name === simulation.name ? "" : `This page has no scenario "${name}". `;
    const {outputs, compared, settings, metrics, samples, checksum} = simulation, own = worker = new Worker(engine);
    const bytes = Uint8Array.from(atob(simulation.wasm), (letter) => letter.charCodeAt(0));
    worker.postMessage({bytes, outputs, compared, settings: settings.length, metrics: metrics.length});
    chosen = Float64Array.from(settings, ({value}) => value);
    byId("scenario").value = simulation.name;
    byId("description").textContent = simulation.description;
    isBusy = true;
    const asWritten = simulate();
    for (const change of changed) {
        const [path, value] = change.split("="), place = settings.findIndex((setting) => setting.path === path);
        unknown += place < 0 ? `${simulation.name} has no setting "${path}". ` : "";
        chosen[place] = value ? Number(value) : NaN;
    }
    const run = await asWritten;
    if (own !== worker) {
        return;
    }
    written = last = {...run, label: "as written", look: "written"};
    const isSame = run.check === checksum && run.time.length === samples;
    byId("check").textContent = isSame
        ? `Checked in this browser: as written, all ${samples} samples of ${compared.length} channels are those of Python, to the last bit.`
        : "Warning: as written, this browser computes other numbers than Python did. Do not trust this page.";
    byId("check").classList.toggle("warning", !isSame);
    fillSettings();
    showSettings();
    isBusy = false;
    await refresh();
}

/** Keep the curves of the last run beside those that follow. */
function keep() {
    const label = [simulation.name, ...changes().map(([setting, value]) => `${setting.label} ${said(value, setting)}`)].join(", ");
    kept = [...kept, {...last, label}].slice(-LOOKS.length).map((run, place) => ({...run, look: LOOKS[place]}));
}

byId("scenario").replaceChildren(...simulations.map(({name}) => make("option", {}, name)));
byId("scenario").addEventListener("change", () => openScenario(address()));
byId("settings").addEventListener("submit", (event) => event.preventDefault());
byId("end").addEventListener("change", draw);
byId("reset").addEventListener("click", () => {
    chosen.set(simulation.settings.map(({value}) => value));
    kept = [];
    refresh();
});
byId("keep").addEventListener("click", () => {
    keep();
    refresh();
});
new ResizeObserver(() => last && draw()).observe(document.body);
const addresses = decodeURIComponent(location.hash.slice(1)).split("|");
for (const one of addresses.slice(0, -1)) {
    await openScenario(one);
    keep();
}
await openScenario(addresses.at(-1) ?? "");
