"use strict";

const TRACE_S = 60;
// At most 20 views per second.
const POINTS_MAX = 20 * TRACE_S;
// Least span of the colour scale, in counts.
const SPAN_MIN_COUNTS = 50;
const SILENCE_MS = 4000;
// Dark blue over green to yellow: five anchors of the viridis map (van der Walt and Smith, 2015, CC0).
const COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

const at = (id) => document.getElementById(id);
let zero = null;
let cells = [];
let shape = "";
let lastSeq = null;
let trace = [];

function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * 4;
  const low = Math.min(Math.floor(place), 3);
  return COLOURS[low].map((from, part) => Math.round(from + (COLOURS[low + 1][part] - from) * (place - low)));
}

function makeCells(rows, cols) {
  if (shape === `${rows}x${cols}`) return;
  shape = `${rows}x${cols}`;
  zero = null;
  trace = [];
  const array = at("array");
  array.style.gridTemplateColumns = `repeat(${cols}, 1fr)`;
  cells = new Array(rows * cols);
  const inOrder = [];
  // Row 0 is at the bottom, where the origin is.
  for (let row = rows - 1; row >= 0; row -= 1) {
    for (let col = 0; col < cols; col += 1) {
      const cell = document.createElement("div");
      cell.title = `row ${row}, column ${col}`;
      cells[row * cols + col] = cell;
      inOrder.push(cell);
    }
  }
  array.replaceChildren(...inOrder);
}

function showFrame(view) {
  const { frame, sensor } = view;
  at("array").classList.toggle("stale", !frame || !view.health?.sensor_connected);
  if (!frame || !sensor || frame.counts.length !== sensor.rows * sensor.cols) return;
  makeCells(sensor.rows, sensor.cols);
  zero ??= frame.counts;
  const rises = frame.counts.map((count, element) => count - zero[element]);
  const span = Math.max(SPAN_MIN_COUNTS, ...rises);
  const bad = new Set(frame.bad_elements);
  rises.forEach((rise, element) => {
    const [r, g, b] = colour(rise / span);
    const cell = cells[element];
    cell.textContent = Math.round(rise);
    cell.style.background = `rgb(${r} ${g} ${b})`;
    cell.style.color = 0.3 * r + 0.6 * g + 0.1 * b > 120 ? "#000" : "#fff";
    cell.classList.toggle("bad", bad.has(element));
  });
  const sum = rises.reduce((all, rise) => all + rise, 0);
  // Above the covering it is 0.
  const depth = view.stage ? Math.max(-view.stage.z_mm, 0) : 0;
  if (lastSeq !== null && frame.seq < lastSeq) trace = [];
  if (frame.seq !== lastSeq) trace.push({ t: frame.t_s, sum, depth });
  lastSeq = frame.seq;
  while (trace.length > POINTS_MAX || (trace.length > 1 && trace.at(-1).t - trace[0].t > TRACE_S)) trace.shift();
  at("rise").textContent = Math.round(sum);
  at("depth").textContent = depth.toFixed(3);
  const rate = view.health ? `${view.health.frame_rate_hz.toFixed(1)} Hz, ${view.health.frames_lost} lost` : "";
  at("frames").textContent = `frame ${frame.seq}, ${rate}${view.missed ? `, ${view.missed} missed here` : ""}`;
}

function drawTrace() {
  const canvas = at("trace");
  const pen = canvas.getContext("2d");
  const { width, height } = canvas;
  const style = getComputedStyle(document.documentElement);
  pen.clearRect(0, 0, width, height);
  pen.strokeStyle = getComputedStyle(canvas).color;
  pen.globalAlpha = 0.2;
  pen.strokeRect(0.5, 0.5, width - 1, height - 1);
  pen.globalAlpha = 1;
  if (trace.length < 2) return;
  const now = trace.at(-1).t;
  pen.font = "22px system-ui, sans-serif";
  const line = (name, least, unit, side) => {
    const values = trace.map((point) => point[name]);
    const low = Math.min(0, ...values);
    const high = Math.max(least, ...values);
    pen.strokeStyle = style.getPropertyValue(name === "sum" ? "--rise" : "--depth");
    pen.lineWidth = 3;
    pen.beginPath();
    trace.forEach((point, index) => {
      const x = width * (1 - (now - point.t) / TRACE_S);
      const y = height - 6 - ((point[name] - low) / (high - low)) * (height - 12);
      if (index === 0) pen.moveTo(x, y);
      else pen.lineTo(x, y);
    });
    pen.stroke();
    pen.fillStyle = pen.strokeStyle;
    pen.textAlign = side;
    pen.fillText(`${Number(high.toPrecision(3))} ${unit}`, side === "left" ? 10 : width - 10, 28);
  };
  line("depth", 0.1, "mm", "left");
  line("sum", SPAN_MIN_COUNTS, "counts", "right");
}

function duration(seconds) {
  const whole = Math.round(seconds);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
}

function showRun(run) {
  const active = run && !["idle", "finished", "unknown"].includes(run.phase);
  at("fault").hidden = !run?.fault;
  at("fault").textContent = run?.fault ? `${run.fault}: nothing moves before a reset` : "";
  at("progress").hidden = !active;
  at("recording").textContent = run?.recording ?? "";
  if (!run || !run.run_id) {
    at("run").textContent = "none since the service started";
    return;
  }
  const ended = run.phase === "finished" ? `: ${run.exit_status}` : "";
  const left = active && run.remaining_s !== null ? `, ${duration(run.remaining_s)} left` : "";
  at("run").textContent =
    `${run.run_id} ${run.phase}${ended}, ${run.presses} of ${run.presses_planned} presses, ` +
    `${run.frames} frames, ${run.frames_lost} lost${left}. ${run.message}`;
  at("progress").value = run.presses / Math.max(run.presses_planned, 1);
}

function show(view) {
  at("problem").hidden = !view.problem;
  at("problem").textContent = view.problem;
  at("rig").textContent = view.rig;
  at("simulated").hidden = !view.simulated;
  document.title = view.simulated ? `Tactus ${view.rig} (SIMULATED)` : `Tactus ${view.rig}`;
  at("service").textContent = view.health
    ? `version ${view.health.version}, up ${duration(view.health.uptime_s)}` : "no service";
  const { stage, safety } = view;
  at("stage").textContent = stage
    ? `${stage.status}, x ${stage.x_mm.toFixed(3)}, y ${stage.y_mm.toFixed(3)}, z ${stage.z_mm.toFixed(3)} mm` : "unknown";
  at("safety").textContent = safety ? `${safety.verdict} by ${safety.rule}: ${safety.detail}` : "nothing happened";
  showFrame(view);
  showRun(view.run);
}

/** The token of commands: in the address once, then kept by this window. */
function token() {
  if (location.hash.length > 1) {
    sessionStorage.setItem("token", location.hash.slice(1));
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}

async function command(name, answer, patience_s, takeOver = "") {
  answer.textContent = `${name} ...`;
  const headers = { "x-tactus-token": token() };
  if (takeOver) headers["x-take-over"] = takeOver.replace(/[^\x20-\x7e]/g, "?");
  try {
    const reply = await fetch(name, { method: "POST", headers, signal: AbortSignal.timeout(1000 * patience_s) });
    answer.textContent = reply.ok ? `${name}: done` : `${name.toUpperCase()} FAILED: ${await reply.text()}`;
    if (reply.status === 423) askToTakeOver(name, answer, patience_s);
  } catch {
    answer.textContent = `${name.toUpperCase()} FAILED: the dashboard does not answer`;
  }
}

/** Another client holds the lease: whoever takes it over says why. */
function askToTakeOver(name, answer, patience_s) {
  at("holder").textContent = answer.textContent;
  at("reason").value = "";
  at("taken").onclose = () => {
    const reason = at("reason").value.trim();
    if (at("taken").returnValue === "yes" && reason) command(name, answer, patience_s, reason);
    at("taken").returnValue = "no";
  };
  at("taken").showModal();
}

function stop() {
  // A browser limits connections per site, and other windows may use the rest: this page frees its own for the stop.
  views?.close();
  command("stop", at("stopped"), 15).finally(open);
}

at("stop").addEventListener("click", stop);
for (const name of ["pause", "resume"]) at(name).addEventListener("click", () => command(name, at("answer"), 15));
at("reset").addEventListener("click", () => at("sure").showModal());
at("sure").addEventListener("close", () => {
  if (at("sure").returnValue === "yes") command("reset", at("answer"), 130);
  at("sure").returnValue = "";
});
at("tare").addEventListener("click", () => { zero = null; });
document.addEventListener("keydown", (event) => {
  if (event.target.tagName === "INPUT") return;
  const isPlain = !event.repeat && !event.ctrlKey && !event.metaKey && !event.altKey;
  if (event.key.toLowerCase() === "s" && isPlain) stop();
});

let views = null;
let latest = null;
let heard = Date.now();

/** Takes up the views; a window that nobody sees has none. */
function open() {
  views?.close();
  if (document.hidden) return;
  views = new EventSource("live");
  heard = Date.now();
  views.addEventListener("message", (event) => {
    heard = Date.now();
    const isFirst = latest === null;
    latest = JSON.parse(event.data);
    // Drawn with the next screen frame; views in between are skipped.
    if (isFirst) requestAnimationFrame(() => { const view = latest; latest = null; show(view); drawTrace(); });
  });
}

document.addEventListener("visibilitychange", open);
// The service sends its health every second; a longer silence means that it is unreachable.
setInterval(() => {
  if (document.hidden || Date.now() - heard < SILENCE_MS) return;
  at("problem").hidden = false;
  at("problem").textContent = "the dashboard does not answer; trying again";
  at("array").classList.add("stale");
  open();
}, 1000);
open();
token();
