// Traces over the last minutes: the sum of rises with the depth, and the elements that were clicked.

import uPlot from "./vendor/uPlot.esm.js";
import { html, useEffect, useRef, useState } from "./preact.js";
import { selected } from "./array.js";
import { TRACE_COLOURS } from "./colour.js";
import { lab, rises } from "./lab.js";

/** Time between two drawings of the charts. */
const PERIOD_MS = 100;
/** Least span of an axis of counts. */
const SPAN_MIN_COUNTS = 50;
/** Least span of the depth's axis. */
const DEPTH_MIN_MM = 0.1;
const HEIGHT_PX = 210;

/** A colour of the style sheet as a canvas takes it; variables with two schemes are resolved on an element only. */
function style(name) {
  const probe = document.getElementById("app");
  probe.style.setProperty("outline-color", `var(${name})`);
  return getComputedStyle(probe).outlineColor;
}

/** First index of the frames within the last `window_s`. */
function since(window_s) {
  const { frames } = lab;
  const from_s = (frames.at(-1)?.t_s ?? 0) - window_s;
  let [low, high] = [0, frames.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (frames[middle].t_s < from_s) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The sum of a frame's rises, kept with the frame as long as the zero is the same. */
function sumOf(frame, zero) {
  if (frame.sumZero !== zero) {
    let sum = 0;
    for (let element = 0; element < zero.length; element += 1) sum += frame.counts[element] - zero[element];
    frame.sum = sum;
    frame.sumZero = zero;
  }
  return frame.sum;
}

/** Columns of a chart: seconds before now, then one of values for each of `of`. A lost frame is a gap. */
function columns(window_s, of) {
  const { frames } = lab;
  const now_s = frames.at(-1)?.t_s ?? 0;
  const data = [[], ...of.map(() => [])];
  let before = null;
  for (let index = since(window_s); index < frames.length; index += 1) {
    const frame = frames[index];
    if (before !== null && frame.seq !== before + 1) {
      data[0].push(frame.t_s - now_s - 1e-3);
      of.forEach((_, column) => data[column + 1].push(null));
    }
    before = frame.seq;
    data[0].push(frame.t_s - now_s);
    of.forEach((value, column) => data[column + 1].push(value(frame)));
  }
  return data;
}

/** Marks a chart as simulated, in the picture itself. */
function markSimulated(chart) {
  if (!lab.view.simulated) return;
  const pen = chart.ctx;
  pen.save();
  pen.globalAlpha = 0.35;
  pen.fillStyle = style("--simulated");
  pen.font = `700 ${Math.round(20 * devicePixelRatio)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.fillText("SIMULATED", chart.bbox.left + chart.bbox.width / 2, chart.bbox.top + chart.bbox.height / 2);
  pen.restore();
}

function axis(scale, label, side, colour) {
  const ink = style("--soft");
  return {
    scale, label, side, size: 54, labelSize: 18, stroke: colour ?? ink, labelFont: "12px system-ui, sans-serif", font: "11px system-ui, sans-serif",
    grid: { show: side !== 1, stroke: style("--line"), width: 1 }, ticks: { stroke: style("--line"), width: 1 },
  };
}

function options(width, window_s, series, scales, axes) {
  return {
    width, height: HEIGHT_PX, series: [{ label: "s before now" }, ...series],
    scales: { x: { time: false, range: [-window_s, 0] }, ...scales },
    axes: [{ ...axis("x", "s before now", 2), size: 34 }, ...axes],
    legend: { show: false }, cursor: { drag: { x: false, y: false }, points: { show: false } },
    hooks: { draw: [markSimulated] },
  };
}

/** A uPlot chart, made anew when `shape` changes and fed while it is there. */
function Chart({ id, label, shape, make, feed }) {
  const place = useRef(null);
  useEffect(() => {
    const node = place.current;
    let chart = new uPlot(make(node.clientWidth), feed(), node);
    const timer = setInterval(() => { if (!document.hidden) chart.setData(feed()); }, PERIOD_MS);
    const watch = new ResizeObserver(() => {
      if (node.clientWidth > 0 && node.clientWidth !== chart.width) chart.setSize({ width: node.clientWidth, height: HEIGHT_PX });
    });
    watch.observe(node);
    // The colours are in the chart's options.
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    const again = () => { chart.destroy(); chart = new uPlot(make(node.clientWidth), feed(), node); };
    scheme.addEventListener("change", again);
    return () => { clearInterval(timer); watch.disconnect(); scheme.removeEventListener("change", again); chart.destroy(); };
  }, [shape]);
  return html`<div id=${id} class="chart" role="img" aria-label=${label} ref=${place}></div>`;
}

const atLeast = (span) => (_, low, high) => [Math.min(0, low ?? 0), Math.max(span, 1.05 * (high ?? 0))];

function SumChart({ window_s }) {
  const zero = () => lab.rig.zero?.counts ?? [];
  const make = (width) => options(width, window_s,
    [{ label: "sum of rises", scale: "counts", stroke: style("--rise"), width: 1.5 }, { label: "depth", scale: "mm", stroke: style("--depth"), width: 1.5 }],
    { counts: { range: atLeast(SPAN_MIN_COUNTS) }, mm: { range: atLeast(DEPTH_MIN_MM) } },
    [axis("counts", "sum of rises, counts", 3, style("--rise")), axis("mm", "depth, mm", 1, style("--depth"))]);
  // Above the covering the depth is 0.
  const feed = () => columns(window_s, [(frame) => sumOf(frame, zero()), (frame) => (frame.tip_mm ? Math.max(-frame.tip_mm[2], 0) : null)]);
  return html`<${Chart} id="sum-chart" label="Sum of all rises and depth over the last minutes" shape=${`${window_s}`} make=${make} feed=${feed}/>`;
}

function ElementChart({ window_s }) {
  const elements = [...selected];
  const zero = () => lab.rig.zero?.counts ?? [];
  const make = (width) => options(width, window_s,
    elements.map((element, index) => ({ label: `element ${element}`, scale: "counts", stroke: TRACE_COLOURS[index], width: 1.5 })),
    { counts: { range: atLeast(SPAN_MIN_COUNTS) } }, [axis("counts", "rise, counts", 3), { ...axis("counts", "", 1), size: 54, show: true, values: () => [] }]);
  const feed = () => columns(window_s, elements.map((element) => (frame) => frame.counts[element] - zero()[element]));
  return html`<${Chart} id="element-chart" label=${`Rises of elements ${elements.join(", ")} over the last minutes`}
    shape=${`${window_s} ${elements}`} make=${make} feed=${feed}/>`;
}

export function Traces({ draw }) {
  const [window_s, setWindow] = useState(60);
  const values = rises(lab.frame);
  const sum = values ? values.reduce((all, rise) => all + rise, 0) : null;
  const depth = lab.view.stage ? Math.max(-lab.view.stage.z_mm, 0) : null;
  return html`
    <div class="controls"><label>Over <select id="window" value=${window_s} onChange=${(event) => { setWindow(Number(event.target.value)); draw(); }}>
      <option value="10">10 s</option><option value="60">1 min</option><option value="300">5 min</option>
    </select></label></div>
    <p class="keys"><span class="key rise"></span> sum of rises <b id="rise">${sum === null ? "?" : Math.round(sum)}</b> counts,
      <span class="key depth"></span> depth <b id="depth">${depth === null ? "?" : depth.toFixed(3)}</b> mm</p>
    <${SumChart} window_s=${window_s}/>
    ${selected.length === 0
      ? html`<p class="note">Click elements of the image for their traces.</p>`
      : html`<p class="keys">${selected.map((element, index) => html`<span key=${element} class="trace-key"><svg viewBox="0 0 14 4"><rect width="14" height="4"
          fill=${TRACE_COLOURS[index]}/></svg> element ${element} <b>${values ? Math.round(values[element]) : "?"}</b></span>`)}</p>
        <${ElementChart} window_s=${window_s}/>`}`;
}
