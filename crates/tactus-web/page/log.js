// The log of events and safety news, the newest first; and the state of the frames.

import { html, useState } from "./preact.js";
import { clock, lab } from "./lab.js";

/** Entries that are shown at once. */
const SHOWN_MAX = 100;
/** Frames over which intervals are taken: ten seconds. */
const INTERVAL_FRAMES = 300;
/** Frames that a look at the zeros averages. */
const DRIFT_FRAMES = 30;

export function Log() {
  const [isSafetyOnly, setSafetyOnly] = useState(false);
  const present = lab.view.run?.is_running ? lab.view.run.run_id : "";
  const isWanted = (entry) => !isSafetyOnly || entry.weight === "stop" || entry.kind === "safety";
  const entries = lab.log.filter(isWanted).slice(-SHOWN_MAX).reverse();
  return html`
    <div class="controls"><label><input id="safety-only" type="checkbox" checked=${isSafetyOnly}
      onChange=${(event) => setSafetyOnly(event.target.checked)}/> safety and failures only</label></div>
    <div class="scroll" tabindex="0" role="log" aria-label="Events, the newest first">
      <table id="log"><thead><tr><th>time</th><th>run</th><th>of</th><th>what</th></tr></thead>
      <tbody>${entries.map((entry) => {
        const isPast = entry.run_id !== "" && entry.run_id !== present;
        return html`<tr key=${entry.number} class=${`${entry.weight} ${isPast ? "past" : ""}`}>
          <td>${clock(entry.t_wall_ms)}</td><td>${entry.run_id}${isPast && html`<span class="past-mark"> past</span>`}</td>
          <td>${entry.kind}</td><td>${entry.text}</td></tr>`;
      })}</tbody></table>
      ${entries.length === 0 && html`<p class="note">Nothing happened yet.</p>`}
    </div>`;
}

/** Mean and greatest interval of the last frames without losses, in ms. */
function intervals() {
  const frames = lab.frames.slice(-INTERVAL_FRAMES);
  const steps = [];
  for (let index = 1; index < frames.length; index += 1) {
    if (frames[index].seq === frames[index - 1].seq + 1) steps.push(1000 * (frames[index].t_s - frames[index - 1].t_s));
  }
  if (steps.length === 0) return null;
  return { mean_ms: steps.reduce((all, step) => all + step, 0) / steps.length, most_ms: Math.max(...steps) };
}

/** Mean of differences, and the greatest with its element. */
function drift(counts, from) {
  const unwatched = new Set(lab.rig.description?.unwatched_elements);
  let [sum, elements, most, at] = [0, 0, 0, 0];
  counts.forEach((count, element) => {
    if (unwatched.has(element)) return;
    const difference = count - from[element];
    sum += difference;
    elements += 1;
    if (Math.abs(difference) > Math.abs(most)) [most, at] = [difference, element];
  });
  return `mean ${(sum / Math.max(elements, 1)).toFixed(1)}, greatest ${most.toFixed(1)} counts at element ${at}`;
}

/** Of the sensor, now and over the frames that the page has. */
function temperature() {
  if (!lab.frame) return "?";
  if (lab.frame.temperature_c === null) return "this sensor tells none";
  const told = lab.frames.map((frame) => frame.temperature_c).filter((each) => each !== null && each !== undefined);
  const [least, most] = [Math.min(...told), Math.max(...told)].map((each) => each.toFixed(1));
  return `${lab.frame.temperature_c.toFixed(1)} °C, from ${least} to ${most} °C here`;
}

/** What the elements read at rest now; null while the tip may touch the covering. */
function atRest() {
  const { description } = lab.rig;
  const frames = lab.frames.slice(-DRIFT_FRAMES);
  const isUp = (frame) => frame.tip_mm && description && frame.tip_mm[2] >= description.approach_height_mm;
  if (frames.length < DRIFT_FRAMES || !frames.every(isUp)) return null;
  return Array.from(frames[0].counts, (_, element) => frames.reduce((all, frame) => all + frame.counts[element], 0) / frames.length);
}

export function Frames() {
  const { health } = lab.view;
  const { zero, description } = lab.rig;
  const step = intervals();
  const rest = atRest();
  const isMeasured = zero && zero.source !== "rig file";
  const source = zero && (zero.t_wall_ms === null
    ? "the rig file's baseline: nothing was measured yet"
    : `${zero.source}${zero.run_id && ` of ${zero.run_id}`}, ${clock(zero.t_wall_ms)}; the same for all viewers`);
  return html`<dl>
    <dt>Frames</dt><dd id="frames">${lab.frame ? `number ${lab.frame.seq}` : "none"}${health && `, ${health.frame_rate_hz.toFixed(1)} Hz`}</dd>
    <dt>Interval</dt><dd id="interval">${step ? `${step.mean_ms.toFixed(1)} ms, at most ${step.most_ms.toFixed(1)} ms in the last 10 s` : "?"}</dd>
    <dt>Lost</dt><dd id="losses">${health ? `${health.frames_lost} at the device, ${health.frames_dropped_on_bus} on the bus` : "?"}${`, ${lab.frame?.missed ?? 0} at the dashboard, ${lab.missed} at this page`}</dd>
    <dt>Temperature</dt><dd id="temperature">${temperature()}</dd>
    <dt>Zero</dt><dd id="zero">${source ?? "none yet"}</dd>
    <dt>Drift of zeros</dt><dd id="drift">
      ${isMeasured && description && html`<div>zero against the rig file: ${drift(zero.counts, description.baseline_counts)}; allowed ${description.baseline_band_counts}</div>`}
      ${rest && zero ? html`<div>at rest now against the zero: ${drift(rest, zero.counts)}</div>` : html`<div>at rest now: the tip is not up</div>`}
    </dd>
  </dl>`;
}
