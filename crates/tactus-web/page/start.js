// Starting a run: the experiments, a form of their parameters, what the dry run says; and moving the tip.

import { html, useEffect, useState } from "./preact.js";
import { ask, command, commands } from "./commands.js";
import { duration, lab } from "./lab.js";
import { toRobot, toSensor } from "./place.js";
import { obstacle } from "./run.js";

/** The form and its dry run. */
const form = { experiments: null, listing: null, error: "", name: "", texts: {}, seed: "", who: localStorage.getItem("who") ?? "" };
const check = { key: "", state: "none", plan: null, message: "", stop: null };
const NUMBERS = ["int", "float"];
const LISTS = ["list-of-int", "list-of-float"];
/** Two dashboards at once are in each other's way at each attempt. */
const ATTEMPTS = 4;
const AGAIN_MS = 500;
const NOT_NOW = 503;

/** What a field shows of a value. */
function asText(value) {
  return Array.isArray(value) ? value.join(", ") : String(value);
}

/** The value of a field; undefined if the text is none. */
function parse(parameter, text) {
  if (parameter.kind === "bool") return text === "true";
  if (parameter.choices.length > 0) return parameter.choices.find((choice) => asText(choice) === text);
  if (parameter.kind === "string") return text;
  const numbers = text.split(/[\s,;]+/).filter(Boolean).map(Number);
  if (numbers.length === 0 || !numbers.every(Number.isFinite)) return undefined;
  if (LISTS.includes(parameter.kind)) return numbers;
  return numbers.length === 1 ? numbers[0] : undefined;
}

function experiment() {
  return form.experiments?.find((each) => each.name === form.name);
}

/** The values that differ from the defaults, and the names of fields that cannot be read. */
function values() {
  const [given, wrong] = [{}, []];
  for (const parameter of experiment()?.parameters ?? []) {
    const text = form.texts[parameter.name];
    if (text === undefined || text === asText(parameter.default)) continue;
    const value = parse(parameter, text);
    if (value === undefined) wrong.push(parameter.name);
    else given[parameter.name] = value;
  }
  return { given, wrong };
}

/** What a dry run holds for: another form or another covering wants another one. */
function key() {
  return JSON.stringify([form.name, values(), form.seed, lab.rig.description?.covering_mm, lab.view.rig]);
}

/** Keeps the list of experiments; an older question, perhaps to a service that has ended since, is given up. */
async function loadExperiments(draw) {
  form.listing?.abort();
  const stop = new AbortController();
  Object.assign(form, { listing: stop, error: "" });
  draw();
  try {
    const found = await askUntilNow("experiments", undefined, { patience_s: 60, signal: stop.signal });
    if (form.listing === stop) form.experiments = found;
  } catch (error) {
    if (form.listing === stop) form.error = error.message;
  }
  draw();
}

/** Asks again while the service says "not now": for a list that somebody else is getting, and for a dry run that a newer one has ended,
 * also one that was asked for before and comes later, or somebody else's. */
async function askUntilNow(path, body, options) {
  for (let left = ATTEMPTS; ; left -= 1) {
    try {
      return JSON.parse(await ask(path, body, options));
    } catch (error) {
      if (error.status !== NOT_NOW || left === 1) throw error;
    }
    await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS); });
  }
}

/** Keeps the dry run of the form; an older one is given up. */
async function plan(draw) {
  check.stop?.abort();
  const { given, wrong } = values();
  if (!form.name || wrong.length > 0) {
    Object.assign(check, { key: "", state: "none", plan: null, message: "", stop: null });
    draw();
    return;
  }
  const stop = new AbortController();
  Object.assign(check, { key: key(), state: "checking", plan: null, message: "", stop });
  draw();
  try {
    const body = { experiment: form.name, parameters: given, seed: form.seed };
    const found = await askUntilNow("plan", body, { patience_s: 310, signal: stop.signal });
    if (check.stop === stop) Object.assign(check, { state: "done", plan: found });
  } catch (error) {
    if (check.stop === stop) Object.assign(check, { state: "failed", message: error.message });
  }
  draw();
}

function Field({ parameter, onChange }) {
  const { name, kind, unit, doc, min, max, choices } = parameter;
  const text = form.texts[name] ?? asText(parameter.default);
  const value = parse(parameter, text);
  // The page is drawn at each frame: what is typed is kept at once, and counts when the field is left.
  const type = (event) => { form.texts[name] = event.target.value; };
  const change = (typed) => { form.texts[name] = typed; onChange(); };
  const id = `parameter-${name}`;
  const says = `${doc}${unit ? `, ${unit}` : ""}`;
  let input;
  if (kind === "bool") {
    input = html`<input id=${id} type="checkbox" checked=${text === "true"} onChange=${(event) => change(String(event.target.checked))}/>`;
  } else if (choices.length > 0 && !LISTS.includes(kind)) {
    input = html`<select id=${id} value=${text} onChange=${(event) => change(event.target.value)}>
      ${choices.map((choice) => html`<option value=${asText(choice)}>${asText(choice)}</option>`)}</select>`;
  } else if (NUMBERS.includes(kind)) {
    input = html`<input id=${id} type="number" step=${kind === "int" ? 1 : "any"} min=${min ?? undefined} max=${max ?? undefined} value=${text}
      onInput=${type} onChange=${(event) => change(event.target.value)}/>`;
  } else {
    input = html`<input id=${id} type="text" value=${text} onInput=${type} onChange=${(event) => change(event.target.value)}/>`;
  }
  return html`<label for=${id}>${name}${unit && html` <span class="unit">${unit}</span>`}</label>
    <span>${input}${value === undefined && html`<span class="wrong" role="alert"> ${LISTS.includes(kind) ? "numbers with commas" : "a number"}, please</span>`}
    <span class="doc">${says}</span></span>`;
}

/** What the dry run says of this form. */
function Verdict() {
  if (!form.name) return null;
  const rig = `rig ${lab.view.rig}${lab.rig.description ? `, covering ${lab.rig.description.covering_mm} mm` : ""}`;
  if (values().wrong.length > 0) return html`<p id="verdict" class="note">The dry run waits for the fields above.</p>`;
  if (check.state === "checking") return html`<p id="verdict" role="status" class="note">Dry run on the twin of ${rig} ...</p>`;
  if (check.key !== key()) return html`<p id="verdict" role="status" class="note">Not checked yet.</p>`;
  if (check.state === "failed") return html`<p id="verdict" role="status" class="refused">REFUSED: ${check.message}</p>`;
  const { plan: found } = check;
  if (!found) return null;
  if (!found.possible) return html`<p id="verdict" role="status" class="refused">REFUSED on ${rig}: ${found.message}</p>`;
  const [x0, x1, y0, y1, z0, z1] = found.travel_mm.map((bound) => bound.toFixed(2));
  return html`<div id="verdict" role="status" class="possible"><p>Possible on ${rig} (dry run on its twin).</p><dl>
    <dt>Presses</dt><dd>${found.presses}, ${found.dwells} dwells</dd>
    <dt>Duration</dt><dd>about ${duration(found.duration_s)}</dd>
    <dt>Deepest</dt><dd>${found.deepest_mm.toFixed(3)} of ${found.depth_max_mm.toFixed(3)} mm allowed</dd>
    ${found.travel_mm.length === 6 && html`<dt>Travel</dt><dd>x ${x0} to ${x1}, y ${y0} to ${y1}, z ${z0} to ${z1} mm</dd>`}
    <dt>Seed</dt><dd>${found.seed}</dd></dl></div>`;
}

export function Start({ draw }) {
  const why = obstacle();
  useEffect(() => { if (!why) loadExperiments(draw); }, [why, lab.view.rig]);
  if (why) return html`<p class="note">${why}</p>`;
  if (form.error) return html`<p class="note">${form.error} <button type="button" onClick=${() => loadExperiments(draw)}>Again</button></p>`;
  if (!form.experiments) return html`<p class="note">The service lists its experiments ...</p>`;
  const chosen = experiment();
  const run = lab.view.run;
  const isChecked = check.state === "done" && check.key === key() && check.plan?.possible;
  const reason = run?.is_running ? "a run is in progress" : run?.fault ? "a reset is needed first" : !isChecked ? "the dry run comes first" : "";
  const choose = (event) => { Object.assign(form, { name: event.target.value, texts: {} }); plan(draw); };
  const start = (event) => {
    event.preventDefault();
    // The order that was checked is the order that runs.
    const body = { experiment: form.name, parameters: values().given, seed: check.plan.seed, who: form.who };
    command("run", `start ${form.name}`, { body, patience_s: 310 });
  };
  return html`<form id="start-form" onSubmit=${start}>
    <div class="fields">
      <label for="experiment">Experiment</label>
      <select id="experiment" value=${form.name} onChange=${choose}>
        <option value="">choose ...</option>
        ${form.experiments.map((each) => html`<option value=${each.name} disabled=${each.error !== ""}>${each.name}</option>`)}
      </select>
    </div>
    ${chosen && html`<p id="doc" class="note">${chosen.doc.split("\n")[0]}</p>
      <div class="fields">
        ${chosen.parameters.map((parameter) => html`<${Field} key=${`${form.name} ${parameter.name}`} parameter=${parameter} onChange=${() => plan(draw)}/>`)}
        <label for="seed">seed</label><span><input id="seed" type="text" inputmode="numeric" value=${form.seed}
          onInput=${(event) => { form.seed = event.target.value.trim(); }} onChange=${() => plan(draw)}/><span class="doc">of the random order; empty: a new one</span></span>
        <label for="who">your name</label><span><input id="who" type="text" maxlength="60" value=${form.who}
          onInput=${(event) => { form.who = event.target.value; localStorage.setItem("who", form.who); }}/><span class="doc">for the record of the run</span></span>
      </div>
      <${Verdict}/>
      <button id="start" type="submit" disabled=${reason !== "" || commands.busy !== ""}>Start ${form.name}</button>
      ${reason && html` <span class="note">${reason}</span>`}`}
    ${form.experiments.filter((each) => each.error).map((each) => html`<p class="note">${each.name}: ${each.error}</p>`)}
  </form>`;
}

/** Moves of the tip at the safe height and above. Each is a short run of its own: checked, permitted and recorded like any other. */
export function Move({ draw }) {
  const [step_mm, setStep] = useState(1);
  const [element, setElement] = useState("0");
  const { stage, run } = lab.view;
  const rig = lab.rig.description;
  const why = obstacle();
  if (why || !rig || !stage) return html`<p class="note">${why || "The place of the tip is not known."}</p>`;
  const isOff = commands.busy !== "" || run?.is_running || run?.fault || stage.status !== "idle";
  const go = (robot_mm, words, height_mm) => {
    const [x_mm, y_mm] = toSensor(robot_mm, rig);
    command("move", words, { body: { x_mm, y_mm, height_mm }, patience_s: 310 });
  };
  const isInside = ([x, y]) => x >= rig.x_mm[0] && x <= rig.x_mm[1] && y >= rig.y_mm[0] && y <= rig.y_mm[1];
  const button = (id, sign, words, isPossible, move) =>
    html`<button id=${id} type="button" class="jog" aria-label=${words} title=${words} disabled=${isOff || !isPossible} onClick=${move}>${sign}</button>`;
  const jog = (id, dx, dy, sign, words) => {
    const to = [stage.x_mm + dx * step_mm, stage.y_mm + dy * step_mm];
    return button(id, sign, words, isInside(to), () => go(to, `move ${words}`));
  };
  // Every run ends at the safe height or above it. What is left of a step is taken.
  const jogZ = (id, dz, sign, words) => {
    const height_mm = Math.min(Math.max(stage.z_mm + dz * step_mm, rig.safe_height_mm), rig.z_max_mm);
    const here = [stage.x_mm, stage.y_mm];
    return button(id, sign, words, isInside(here) && Math.abs(height_mm - stage.z_mm) > 0.0005, () => go(here, `move ${words}`, height_mm));
  };
  const cols = rig.col_centres_mm.length;
  const elements = cols * rig.row_centres_mm.length;
  const isElement = /^[0-9]+$/.test(element) && Number(element) < elements;
  const above = () => toRobot([rig.col_centres_mm[Number(element) % cols], rig.row_centres_mm[Math.floor(Number(element) / cols)]], rig);
  return html`<div id="move">
    <div class="pad">${jog("jog-y-up", 0, 1, "↑", "y up")}${jog("jog-x-down", -1, 0, "←", "x down")}${jog("jog-x-up", 1, 0, "→", "x up")}${jog("jog-y-down", 0, -1, "↓", "y down")}${jogZ("jog-z-up", 1, "⤒", "tip up")}${jogZ("jog-z-down", -1, "⤓", "tip down")}</div>
    <div class="controls">
      <label>Step <select id="step" value=${step_mm} onChange=${(event) => { setStep(Number(event.target.value)); draw(); }}>
        ${[0.1, 1, 5].map((step) => html`<option value=${step}>${step} mm</option>`)}</select></label>
      <label>Above element <input id="above-element" type="number" min="0" max=${elements - 1} value=${element}
        onInput=${(event) => setElement(event.target.value)}/></label>
      <button id="go" type="button" disabled=${isOff || !isElement} onClick=${() => go(above(), `move above element ${element}`)}>Go</button>
    </div>
    <div class="controls"><button id="take-zero" type="button" disabled=${isOff} onClick=${() => command("zero", "take zero")}>Take zero</button>
      <span class="note">for all viewers, from the last half second</span></div>
    <p class="note">⤒ and ⤓ move the tip between the safe height, ${rig.safe_height_mm} mm, where sideways moves end, and ${rig.z_max_mm} mm. Each move is a short run with a dry run and
      a recording. Below the safe height the tip goes only in a press of an experiment, and every run ends above it.</p>
  </div>`;
}
