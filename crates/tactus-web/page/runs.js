// The recorded runs: found, marked, compared, made again; their reports and data.

import { html, useEffect, useState } from "./preact.js";
import { ask, command, commands } from "./commands.js";
import { duration, lab } from "./lab.js";
import { obstacle } from "./run.js";

/** Rows that are shown at once. */
const SHOWN_MAX = 200;
const FORMATS = [["parquet", "Parquet"], ["csv", "CSV"], ["npz", "NumPy"], ["mcap", "MCAP"]];

/** What the server said of the folder, and what is done with it here. */
const shelf = { runs: null, unreadable: [], error: "", words: "", chosen: [], open: "", comparison: null, isWaiting: false };

async function get(path) {
  const reply = await fetch(path, { signal: AbortSignal.timeout(120_000) });
  if (!reply.ok) throw new Error(await reply.text());
  return reply.json();
}

async function load(draw) {
  try {
    Object.assign(shelf, await get("runs"), { error: "" });
    shelf.chosen = shelf.chosen.filter((id) => shelf.runs.some((run) => run.run_id === id));
  } catch (error) {
    shelf.error = error.message;
  }
  draw();
}

async function compare(draw) {
  shelf.isWaiting = true;
  draw();
  try {
    shelf.comparison = await get(`runs/compare/${shelf.chosen.join(",")}`);
    shelf.error = "";
  } catch (error) {
    shelf.error = error.message;
  }
  shelf.isWaiting = false;
  draw();
}

/** Anything that is known of a run. */
function text(run) {
  return [run.run_id, run.experiment, run.rig, run.who, run.started, run.message, run.exit_status ?? "open", run.note, ...run.tags].join("\n").toLowerCase();
}

function found() {
  const words = shelf.words.toLowerCase().split(/\s+/).filter(Boolean);
  return (shelf.runs ?? []).filter((run) => words.every((word) => text(run).includes(word)));
}

function when(started) {
  const at = new Date(started);
  return Number.isNaN(at.getTime()) ? started : at.toLocaleString([], { dateStyle: "short", timeStyle: "short" });
}

/** Tags and note, to be changed. */
function Notes({ run, draw }) {
  const [tags, setTags] = useState(run.tags.join(" "));
  const [note, setNote] = useState(run.note);
  const [said, setSaid] = useState("");
  const save = async (event) => {
    event.preventDefault();
    try {
      const kept = JSON.parse(await ask(`runs/${run.run_id}/notes`, { tags: tags.split(/[\s,]+/).filter(Boolean), note }));
      Object.assign(run, kept);
      setSaid("kept");
    } catch (error) {
      setSaid(`NOT KEPT: ${error.message}`);
    }
    draw();
  };
  return html`<form class="notes" onSubmit=${save}>
    <label>Tags <input class="tags" value=${tags} placeholder="words" onInput=${(event) => setTags(event.target.value)}/></label>
    <label>Note <textarea class="note-text" rows="2" value=${note} onInput=${(event) => setNote(event.target.value)}></textarea></label>
    <div class="controls"><button class="keep" type="submit">Keep</button><span class="said" role="status">${said}</span></div>
  </form>`;
}

/** What can be done with one run. */
function Details({ run, draw }) {
  const isOff = obstacle() !== "" || commands.busy !== "" || lab.view.run?.is_running;
  const again = () => command(`runs/${run.run_id}/again`, `again ${run.run_id}`, { body: { who: localStorage.getItem("who") ?? "" }, patience_s: 310 });
  const at = (what) => `runs/${run.run_id}/${what}`;
  return html`<div class="details">
    <dl>
      <dt>Id</dt><dd>${run.run_id}</dd>
      <dt>Rig</dt><dd>${run.rig}${run.simulated && " (SIMULATED)"}</dd>
      <dt>By</dt><dd>${run.who}</dd>
      <dt>Ended</dt><dd>${run.exit_status ?? "open"}${run.message && `: ${run.message}`}</dd>
      <dt>Frames</dt><dd>${run.frames}, ${run.frames_lost + run.frames_missing} lost${!run.is_whole && ", the file is cut off or damaged"}</dd>
      ${run.continues && html`<dt>Goes on with</dt><dd>${run.continues}</dd>`}
    </dl>
    <div class="buttons">
      <a class="button report" href=${at("report")} target="_blank">Report</a>
      ${FORMATS.map(([format, name]) => html`<a class=${`button ${format}`} href=${at(format)} download>${name}</a>`)}
      <button class="again" type="button" disabled=${isOff} title="with its script, parameters and seed" onClick=${again}>Make it again</button>
    </div>
    ${commands.answer && html`<p class=${commands.failed ? "failed" : ""} role="status">${commands.answer}</p>`}
    <${Notes} key=${run.run_id} run=${run} draw=${draw}/>
  </div>`;
}

function Row({ run, draw }) {
  const isOpen = shelf.open === run.run_id;
  const isChosen = shelf.chosen.includes(run.run_id);
  const choose = () => {
    shelf.chosen = isChosen ? shelf.chosen.filter((id) => id !== run.run_id) : [...shelf.chosen, run.run_id];
    shelf.comparison = null;
    draw();
  };
  const open = () => { shelf.open = isOpen ? "" : run.run_id; draw(); };
  const status = run.exit_status ?? "open";
  return html`
    <tr class=${`run ${isOpen ? "open" : ""}`} data-run=${run.run_id}>
      <td><input type="checkbox" aria-label=${`compare ${run.run_id}`} checked=${isChosen} onChange=${choose}/></td>
      <td class="when">${when(run.started)}</td>
      <td><button class="name" type="button" aria-expanded=${isOpen} onClick=${open}>${run.experiment}</button></td>
      <td class=${status === "done" ? "" : "not-done"}>${status}</td>
      <td class="number">${run.presses}</td>
      <td class="number">${duration(run.duration_s)}</td>
      <td>${run.tags.map((tag) => html`<span class="tag">${tag}</span> `)}</td>
      <td class="first-line">${run.note.split("\n")[0]}</td>
    </tr>
    ${isOpen && html`<tr class="more"><td colspan="8"><${Details} run=${run} draw=${draw}/></td></tr>`}`;
}

function Comparison({ of }) {
  const [isAll, setAll] = useState(false);
  const facts = of.facts.filter((fact) => isAll || fact.differs);
  return html`<section id="comparison" aria-labelledby="comparison-title"><h2 id="comparison-title">Comparison</h2>
    <div class="controls"><label><input id="all-facts" type="checkbox" checked=${isAll} onChange=${(event) => setAll(event.target.checked)}/> also what is the same</label></div>
    <div class="wide-table" tabindex="0"><table><thead><tr><th></th>${of.runs.map((id) => html`<th>${id}</th>`)}</tr></thead>
      <tbody>${facts.map((fact) => html`<tr class=${fact.differs ? "differs" : ""}><th>${fact.name}</th>${fact.values.map((value) => html`<td>${value}</td>`)}</tr>`)}</tbody></table></div>
    ${facts.length === 0 && html`<p class="note">They differ in nothing that is compared.</p>`}
  </section>`;
}

export function Runs({ draw }) {
  useEffect(() => { load(draw); }, []);
  const all = shelf.runs ?? [];
  const rows = found();
  return html`<div class="runs">
    <section aria-labelledby="runs-title"><h2 id="runs-title">Runs</h2>
      <div class="controls">
        <label class="grow">Search <input id="words" type="search" value=${shelf.words} placeholder="experiment, rig, person, date, status, tag, note"
          onInput=${(event) => { shelf.words = event.target.value; draw(); }}/></label>
        <button id="compare" type="button" disabled=${shelf.chosen.length < 2 || shelf.isWaiting} onClick=${() => compare(draw)}>Compare ${shelf.chosen.length > 1 ? shelf.chosen.length : ""}</button>
        <button id="reload" type="button" onClick=${() => load(draw)}>Reload</button>
      </div>
      ${shelf.error && html`<p id="runs-error" class="failed" role="alert">${shelf.error}</p>`}
      <p id="found" class="note" role="status">${shelf.runs === null && !shelf.error ? "reading the recordings ..." : `${rows.length} of ${all.length} runs`}</p>
      ${shelf.comparison && html`<${Comparison} of=${shelf.comparison}/>`}
      ${rows.length > 0 && html`<table id="runs"><thead><tr><th></th><th>started</th><th>experiment</th><th>ended</th><th>presses</th><th>time</th><th>tags</th><th>note</th></tr></thead>
        <tbody>${rows.slice(0, SHOWN_MAX).map((run) => html`<${Row} key=${run.run_id} run=${run} draw=${draw}/>`)}</tbody></table>`}
      ${rows.length > SHOWN_MAX && html`<p class="note">The newest ${SHOWN_MAX} are shown: search for the others.</p>`}
      ${shelf.unreadable.map((error) => html`<p class="note">${error}</p>`)}
    </section>
  </div>`;
}
