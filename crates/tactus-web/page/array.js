// The pressure image: each element at its place, with its number, and a colour bar.

import { html, useState } from "./preact.js";
import { colour, COLOURS, inkOn, TRACE_COLOURS } from "./colour.js";
import { isStale, lab, rises } from "./lab.js";

/** Least span of a free scale, in counts: noise must not look like a press. */
const SPAN_MIN_COUNTS = 50;
/** Traces of elements at most. */
const SELECTED_MAX = TRACE_COLOURS.length;

const kept = JSON.parse(localStorage.getItem("scale") ?? "null") ?? {};

/** How counts become colours: `unit` is counts or share, a fixed scale ends at `max_counts`. */
export const scale = {
  unit: kept.unit === "share" ? "share" : "counts",
  isFixed: kept.isFixed === true,
  max_counts: kept.max_counts > 0 ? kept.max_counts : 500,
};

/** Elements whose traces are shown, in the order of their colours. */
export const selected = [];

export function toggle(element) {
  const at = selected.indexOf(element);
  if (at >= 0) selected.splice(at, 1);
  else {
    if (selected.length === SELECTED_MAX) selected.shift();
    selected.push(element);
  }
}

/** What 100 % is: the envelope's limit of one element. */
function limit_counts() {
  return lab.rig.description?.element_max_counts || 0;
}

function inUnit(counts) {
  const limit = limit_counts();
  if (scale.unit === "share" && limit > 0) return `${(100 * counts / limit).toFixed(1)}`;
  return `${Math.round(counts)}`;
}

function unitName() {
  return scale.unit === "share" && limit_counts() > 0 ? "% of the limit" : "counts";
}

/** Places in mm: true ones if the rig is described, else a plain grid. */
function layout(sensor, description) {
  const isDescribed = description?.col_centres_mm.length === sensor.cols && description?.row_centres_mm.length === sensor.rows;
  const centres = (count) => Array.from({ length: count }, (_, index) => index);
  return isDescribed
    ? { cols: description.col_centres_mm, rows: description.row_centres_mm, size: description.element_mm }
    : { cols: centres(sensor.cols), rows: centres(sensor.rows), size: [0.92, 0.92] };
}

function ColourBar({ span, greatest }) {
  const marks = [0, 0.25, 0.5, 0.75, 1];
  const at = Math.min(Math.max(greatest / span, 0), 1);
  return html`<svg id="colour-bar" class="bar" viewBox="0 0 400 46" role="img"
      aria-label=${`Colour bar from 0 to ${inUnit(span)} ${unitName()}`}>
    <defs><linearGradient id="viridis">
      ${COLOURS.map((rgb, index) => html`<stop offset=${index / (COLOURS.length - 1)} stop-color=${`rgb(${rgb})`}/>`)}
    </linearGradient></defs>
    <rect x="20" y="10" width="360" height="14" fill="url(#viridis)"/>
    <path d=${`M${20 + 360 * at} 10 l-5 -8 h10 z`} fill="currentColor"/>
    ${marks.map((mark) => html`<text x=${20 + 360 * mark} y="40" text-anchor="middle">${inUnit(mark * span)}</text>`)}
  </svg>`;
}

function ScaleControls({ draw }) {
  // The page is drawn at each frame: what is typed is kept until it counts.
  const [typed, setTyped] = useState(null);
  const keep = (change) => {
    Object.assign(scale, change);
    localStorage.setItem("scale", JSON.stringify(scale));
    draw();
  };
  return html`<div class="controls">
    <label>Show <select id="unit" value=${scale.unit} onChange=${(event) => keep({ unit: event.target.value })}>
      <option value="counts">counts</option>
      <option value="share" disabled=${limit_counts() === 0}>share of the limit</option>
    </select></label>
    <label>Scale <select id="scale" value=${scale.isFixed ? "fixed" : "free"}
        onChange=${(event) => keep({ isFixed: event.target.value === "fixed" })}>
      <option value="free">free</option>
      <option value="fixed">fixed</option>
    </select></label>
    ${scale.isFixed && html`<label>up to <input id="scale-max" type="number" min="1" step="any" value=${typed ?? scale.max_counts}
        onInput=${(event) => setTyped(event.target.value)}
        onChange=${(event) => { const max = Number(event.target.value); setTyped(null); if (max > 0) keep({ max_counts: max }); }}/> counts</label>`}
    ${selected.length > 0 && html`<button id="no-traces" type="button"
        onClick=${() => { selected.length = 0; draw(); }}>No traces</button>`}
  </div>`;
}

function Element({ element, place, rise, span, isBad, isUnwatched, isFocus, onToggle, onKey }) {
  const trace = selected.indexOf(element);
  const rgb = colour(rise / span);
  const [width, height] = place.size;
  const classes = ["element", isBad && "bad", isUnwatched && "unwatched", trace >= 0 && "selected"].filter(Boolean).join(" ");
  const state = `${isBad ? ", not read" : ""}${isUnwatched ? ", listed as faulty" : ""}`;
  const label = `element ${element}, row ${place.row}, column ${place.col}, ${inUnit(rise)} ${unitName()}${state}`;
  return html`<g class=${classes} data-element=${element} role="button" tabindex=${isFocus ? 0 : -1} aria-pressed=${trace >= 0}
      aria-label=${label} onClick=${() => onToggle(element)} onKeyDown=${(event) => onKey(event, element)}>
    <title>${label}</title>
    <rect x=${place.x} y=${place.y} width=${width} height=${height} rx=${width / 16} fill=${`rgb(${rgb})`}
      stroke=${trace >= 0 ? TRACE_COLOURS[trace] : "none"} stroke-width=${trace >= 0 ? width / 9 : 0}/>
    <text class="number" x=${place.x + 0.09 * width} y=${place.y + 0.27 * height} font-size=${height / 4.6} style=${{ fill: inkOn(rgb) }}>${element}</text>
    <text class="rise" x=${place.x + width / 2} y=${place.y + 0.72 * height} font-size=${height / 3.1} text-anchor="middle"
      style=${{ fill: inkOn(rgb) }}>${inUnit(rise)}</text>
  </g>`;
}

/** The image with its controls. Arrow keys go from element to element, Enter or Space shows an element's trace. */
export function ArrayImage({ draw }) {
  const [focus, setFocus] = useState(0);
  const { sensor, description, zero } = lab.rig;
  const values = rises(lab.frame);
  if (!sensor || !values || values.length !== sensor.rows * sensor.cols) {
    const why = lab.frame && !zero ? "there is no zero yet" : "no frames";
    return html`<div id="array" class="empty">${why}</div>`;
  }
  const { cols, rows, size: [width, height] } = layout(sensor, description);
  const [left, right] = [cols[0] - width / 2, cols.at(-1) + width / 2];
  const [bottom, top] = [rows[0] - height / 2, rows.at(-1) + height / 2];
  const margin = width / 6;
  // The picture says itself that it is simulated.
  const strip = lab.view.simulated ? 0.62 * height : 0;
  const greatest = Math.max(...values);
  const span = scale.isFixed ? scale.max_counts : Math.max(SPAN_MIN_COUNTS, greatest);
  const bad = new Set(lab.frame.bad_elements);
  const unwatched = new Set(description?.unwatched_elements);
  const onToggle = (element) => { toggle(element); setFocus(element); draw(); };
  const onKey = (event, element) => {
    const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: sensor.cols, ArrowDown: -sensor.cols }[event.key];
    if (event.key === "Enter" || event.key === " ") onToggle(element);
    else if (step !== undefined && element + step >= 0 && element + step < values.length) {
      setFocus(element + step);
      event.currentTarget.parentNode.querySelector(`[data-element="${element + step}"]`).focus();
    } else return;
    event.preventDefault();
  };
  const hottest = values.indexOf(greatest);
  // Row 0 is at the bottom, where the origin is.
  return html`
    <svg id="array" class=${isStale() ? "stale" : ""} role="group"
        viewBox=${`${left - margin} ${-strip} ${right - left + 2 * margin} ${top - bottom + 2 * margin + strip}`}
        aria-label=${`Pressure image of ${values.length} elements; greatest rise ${inUnit(greatest)} ${unitName()} at element ${hottest}`}>
      ${values.map((rise, element) => {
        const row = Math.floor(element / sensor.cols);
        const col = element % sensor.cols;
        const place = { row, col, size: [width, height], x: cols[col] - width / 2, y: margin + top - rows[row] - height / 2 };
        return html`<${Element} key=${element} element=${element} place=${place} rise=${rise} span=${span} isBad=${bad.has(element)}
          isUnwatched=${unwatched.has(element)} isFocus=${element === focus} onToggle=${onToggle} onKey=${onKey}/>`;
      })}
      ${lab.view.simulated && html`<text class="simulated-mark" x=${(left + right) / 2} y=${-0.1 * height}
        font-size=${0.5 * height} text-anchor="middle">SIMULATED</text>`}
    </svg>
    <${ColourBar} span=${span} greatest=${greatest}/>
    <${ScaleControls} draw=${draw}/>`;
}
