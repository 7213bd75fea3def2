// The run: its state, its progress, pause, resume, reset; who holds the rig.

import { html, useState } from "./preact.js";
import { command, commands, token } from "./commands.js";
import { clock, duration, lab } from "./lab.js";

/** A covering that a run waits for, as its message names it. */
const COVERING = /([0-9.]+) mm covering/;

/** Why a command cannot be given now; empty if it can. */
export function obstacle() {
  if (!token()) return "This page can look and stop only: open it with the address that tactus-web names at its start.";
  if (lab.silent || lab.view.problem || !lab.view.health) return "There is no service.";
  return "";
}

/** The state of the run in words. */
function inWords(run) {
  if (!run?.run_id) return "none since the service started";
  const ended = run.phase === "finished" ? `: ${run.exit_status}` : "";
  const left = run.is_running && run.remaining_s !== null ? `, ${duration(run.remaining_s)} left` : "";
  const who = run.who ? ` by ${run.who}` : "";
  return `${run.run_id}${who} ${run.phase}${ended}, ${run.presses} of ${run.presses_planned} presses, ` +
    `${run.frames} frames, ${run.frames_lost} lost${left}. ${run.message}`;
}

/** Safety news; of a run that is over it is marked as past. */
function Safety() {
  const { safety } = lab.view;
  if (!safety) return html`<dd id="safety">nothing happened</dd>`;
  const text = `${safety.verdict} by ${safety.rule}: ${safety.detail}`;
  return safety.is_past
    ? html`<dd id="safety" class="past">past, ${clock(safety.t_wall_ms)}${safety.run_id && `, run ${safety.run_id}`}: ${text}</dd>`
    : html`<dd id="safety" class="now">${clock(safety.t_wall_ms)}: ${text}</dd>`;
}

/** Asks before a reset, in the page: a window over it would hide STOP. */
function Sure({ close }) {
  const yes = () => { close(); command("reset", "reset", { patience_s: 130 }); };
  return html`<div id="sure" class="ask" role="alertdialog" aria-label="Reset" onKeyDown=${(event) => event.key === "Escape" && close()}>
    <p>A reset clears the stage's alarm, homes it and raises the tip. Is the tip free to move?</p>
    <button type="button" onClick=${yes}>Yes, reset</button>
    <button type="button" ref=${(node) => node && !node.dataset.seen && (node.dataset.seen = "1", node.focus())} onClick=${close}>No</button>
  </div>`;
}

/** Another client holds the lease. */
function Taken() {
  const [reason, setReason] = useState("");
  if (!commands.taken) return null;
  const { holder, again } = commands.taken;
  const take = (event) => { event.preventDefault(); if (reason.trim()) again(reason.trim()); setReason(""); };
  const leave = () => { commands.taken = null; setReason(""); };
  return html`<form id="taken" class="ask" onSubmit=${take}>
    <p id="holder">${holder}</p>
    <label>Take it over, because <input id="reason" type="text" maxlength="200" required value=${reason} onInput=${(event) => setReason(event.target.value)}/></label>
    <button type="submit">Take over</button> <button type="button" onClick=${leave}>No</button>
  </form>`;
}

/** A run that waits for another covering goes on when its thickness is confirmed. */
function Resume({ run, isOff }) {
  const [typed, setTyped] = useState("");
  const wanted = run?.phase === "paused" ? COVERING.exec(run.message)?.[1] : undefined;
  const covering_mm = Number(typed);
  const body = wanted ? { covering_mm } : undefined;
  const isReady = !wanted || (typed !== "" && Number.isFinite(covering_mm));
  return html`
    ${wanted && html`<label>Covering in place <input id="covering" type="number" step="any" min="0" value=${typed}
      onInput=${(event) => setTyped(event.target.value)}/> mm</label>`}
    <button id="resume" type="button" disabled=${isOff || run?.phase !== "paused" || !isReady}
      onClick=${() => { command("resume", "resume", { body }); setTyped(""); }}>Resume</button>`;
}

export function Run() {
  const [isAsking, setAsking] = useState(false);
  const { run, health } = lab.view;
  const why = obstacle();
  const isOff = why !== "" || commands.busy !== "";
  const isRunning = run?.is_running === true;
  const share = run ? Math.min(run.presses / Math.max(run.presses_planned, 1), 1) : 0;
  const holder = health?.lease_holder;
  return html`
    ${run?.fault && html`<p id="fault" class="banner fault" role="alert">${run.fault}: nothing moves before a reset</p>`}
    <p id="run" role="status">${inWords(run)}</p>
    ${isRunning && html`<progress id="progress" max="1" value=${share} aria-label="Presses done">${Math.round(100 * share)} %</progress>`}
    <div class="buttons">
      <button id="pause" type="button" disabled=${isOff || run?.phase !== "running"} onClick=${() => command("pause", "pause")}>Pause</button>
      <${Resume} run=${run} isOff=${isOff}/>
      <button id="reset" type="button" disabled=${isOff || isRunning} onClick=${() => setAsking(true)}>Reset, home</button>
    </div>
    ${isAsking && html`<${Sure} close=${() => setAsking(false)}/>`}
    <${Taken}/>
    <p id="answer" role="status" class=${commands.failed ? "failed" : ""}>${commands.answer}</p>
    ${why && html`<p id="obstacle" class="note">${why}</p>`}
    <dl>
      <dt>Held by</dt><dd id="lease">${!health ? "?" : holder ? holder : isRunning ? "nobody: the run goes on by itself" : "nobody"}</dd>
      <dt>Safety</dt><${Safety}/>
      <dt>Recording</dt><dd id="recording">${run?.recording}</dd>
    </dl>`;
}
