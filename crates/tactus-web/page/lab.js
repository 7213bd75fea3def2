// What this page knows of the rig, and the connection to the dashboard's server.

/** Frames that are kept, as many as the server keeps. */
const FRAMES_MAX = 9000;
/** Log entries that are kept. */
const LOG_MAX = 400;
/** The server sends a view every second; a longer silence means that it is unreachable. */
const SILENCE_MS = 4000;

/** The one state of the page; the pictures read it and change nothing. */
export const lab = {
  /** Sensor, zero and description of the rig; null before they are known. */
  rig: { sensor: null, zero: null, description: null },
  view: { problem: "", rig: "", simulated: false, stage: null, run: null, safety: null, health: null },
  /** The last minutes: { seq, t_s, tip_mm, lost_before, counts }, in order. */
  frames: [],
  frame: null,
  log: [],
  /** Frames that did not reach this page. */
  missed: 0,
  silent: false,
};

let views = null;
let heard = Date.now();
let changed = () => {};
let isDrawing = false;
let historyWanted = true;

/** Draws with the next screen frame; what comes before it is drawn together. */
export function draw() {
  if (isDrawing) return;
  isDrawing = true;
  requestAnimationFrame(() => { isDrawing = false; changed(); });
}

function hear(name, take) {
  views.addEventListener(name, (event) => {
    heard = Date.now();
    lab.silent = false;
    take(JSON.parse(event.data));
    draw();
  });
}

function takeFrame(frame) {
  const last = lab.frames.at(-1);
  const kept = { ...frame, counts: Float32Array.from(frame.counts) };
  lab.frame = kept;
  if (last && (frame.seq < last.seq || last.counts.length !== frame.counts.length)) {
    // The service has started anew, or has another array.
    lab.frames = [];
    lab.missed = 0;
  } else if (last && frame.seq === last.seq) {
    return;
  } else if (last) {
    lab.missed += Math.max(frame.seq - last.seq - 1 - frame.lost_before, 0);
  }
  lab.frames.push(kept);
  if (lab.frames.length > FRAMES_MAX) lab.frames.splice(0, lab.frames.length - FRAMES_MAX);
  if (historyWanted) fetchHistory();
}

function takeView(view) {
  lab.view = view;
  if (view.problem) lab.frame = null;
}

function takeLog(entries) {
  const known = lab.log.at(-1)?.number ?? -1;
  const first = entries[0]?.number ?? 0;
  // The server has started anew: its numbers begin at 0.
  if (entries.length > 0 && entries.at(-1).number < known) lab.log = [];
  lab.log = [...lab.log.filter((entry) => entry.number < first), ...entries].slice(-LOG_MAX);
}

/** Puts the last minutes before the frames that this page has seen. */
async function fetchHistory() {
  historyWanted = false;
  try {
    const reply = await fetch("history");
    const past = parseHistory(await reply.arrayBuffer());
    const first = lab.frames[0];
    if (!first || past.length === 0 || past[0].counts.length !== first.counts.length) return;
    const older = past.filter((frame) => frame.seq < first.seq);
    lab.frames = [...older, ...lab.frames].slice(-FRAMES_MAX);
    draw();
  } catch {
    historyWanted = true;
  }
}

/** As `History::bytes` of the server writes it. */
function parseHistory(buffer) {
  const data = new DataView(buffer);
  const elements = data.getUint32(0, true);
  const size = 32 + 4 * elements;
  const frames = new Array(data.getUint32(4, true));
  for (let index = 0; index < frames.length; index += 1) {
    const at = 8 + index * size;
    const tip = [16, 20, 24].map((offset) => data.getFloat32(at + offset, true));
    frames[index] = {
      seq: data.getFloat64(at, true),
      t_s: data.getFloat64(at + 8, true),
      tip_mm: Number.isNaN(tip[2]) ? null : tip,
      lost_before: data.getFloat32(at + 28, true),
      counts: new Float32Array(buffer, at + 32, elements),
    };
  }
  return frames;
}

/** Takes up the views; a window that nobody sees has none. */
function open() {
  views?.close();
  if (document.hidden) return;
  views = new EventSource("live");
  heard = Date.now();
  historyWanted = true;
  hear("rig", (rig) => { lab.rig = rig; });
  hear("view", takeView);
  hear("log", takeLog);
  hear("frame", takeFrame);
}

/** Connects, and calls `draws` whenever something has changed. */
export function follow(draws) {
  changed = draws;
  document.addEventListener("visibilitychange", open);
  window.addEventListener("tactus-stopping", () => views?.close());
  window.addEventListener("tactus-stopped", open);
  setInterval(() => {
    if (document.hidden || Date.now() - heard < SILENCE_MS) return;
    lab.silent = true;
    draw();
    open();
  }, 1000);
  open();
}

/** Rises of a frame above the zero that all viewers share; null without a zero. */
export function rises(frame) {
  const zero = lab.rig.zero?.counts;
  if (!frame || !zero || zero.length !== frame.counts.length) return null;
  return Array.from(frame.counts, (counts, element) => counts - zero[element]);
}

/** True if what is shown is not the present. */
export function isStale() {
  return lab.silent || !lab.frame || !lab.view.health?.sensor_connected;
}

/** 75 -> "1 min 15 s". */
export function duration(seconds) {
  const whole = Math.round(seconds);
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  return `${Math.floor(whole / 3600)} h ${Math.floor((whole % 3600) / 60)} min`;
}

/** The time of day here, of milliseconds since 1970. */
export function clock(t_wall_ms) {
  return new Date(t_wall_ms).toLocaleTimeString([], { hour12: false });
}
