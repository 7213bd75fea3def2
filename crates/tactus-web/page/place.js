// Where the tip is: seen from above, and the covering in section.

import { html } from "./preact.js";
import { isStale, lab } from "./lab.js";

const mm = (value, digits = 3) => value.toFixed(digits);

/** From the sensor's frame to the robot's: p_robot = Rot(angle) p_sensor + origin. */
export function toRobot([x, y], rig) {
  const angle = (rig.rotation_deg * Math.PI) / 180;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return [rig.origin_mm[0] + cos * x - sin * y, rig.origin_mm[1] + sin * x + cos * y];
}

/** From the robot's frame to the sensor's. */
export function toSensor([x, y], rig) {
  const angle = (rig.rotation_deg * Math.PI) / 180;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [dx, dy] = [x - rig.origin_mm[0], y - rig.origin_mm[1]];
  return [cos * dx + sin * dy, -sin * dx + cos * dy];
}

function Mark({ x, y, size }) {
  return lab.view.simulated && html`<text class="simulated-mark" x=${x} y=${y} font-size=${size} text-anchor="middle">SIMULATED</text>`;
}

/** The stage from above: the envelope, the array with its elements, the tip. Robot frame, y upwards. */
function FromAbove({ rig, stage }) {
  const [x0, x1] = rig.x_mm;
  const [y0, y1] = rig.y_mm;
  const margin = 0.09 * Math.max(x1 - x0, y1 - y0);
  const size = 0.62 * margin;
  const [w, h] = rig.element_mm;
  const corners = (x, y) => [[-w, -h], [w, -h], [w, h], [-w, h]]
    .map(([dx, dy]) => toRobot([x + dx / 2, y + dy / 2], rig))
    .map(([px, py]) => `${px},${-py}`)
    .join(" ");
  const isInside = stage.x_mm >= x0 && stage.x_mm <= x1 && stage.y_mm >= y0 && stage.y_mm <= y1;
  const tip = [Math.min(Math.max(stage.x_mm, x0 - margin / 2), x1 + margin / 2), Math.min(Math.max(stage.y_mm, y0 - margin / 2), y1 + margin / 2)];
  return html`<svg id="above" class=${isStale() ? "stale" : ""} role="img" viewBox=${`${x0 - margin} ${-y1 - margin} ${x1 - x0 + 2 * margin} ${y1 - y0 + 2.6 * margin}`}
      aria-label=${`Stage from above: tip at x ${mm(stage.x_mm)}, y ${mm(stage.y_mm)} mm, ${isInside ? "inside" : "OUTSIDE"} the envelope`}>
    <rect class="limit" x=${x0} y=${-y1} width=${x1 - x0} height=${y1 - y0}/>
    ${rig.row_centres_mm.map((y, row) => rig.col_centres_mm.map((x, col) =>
      html`<polygon key=${`${row} ${col}`} class="element-outline" points=${corners(x, y)}/>`))}
    <${Mark} x=${(x0 + x1) / 2} y=${-(y1 - 0.14 * (y1 - y0))} size=${1.7 * size}/>
    <path class="cross" d=${`M${x0} ${-tip[1]} H${x1} M${tip[0]} ${-y0} V${-y1}`}/>
    <circle class="tip" cx=${tip[0]} cy=${-tip[1]} r=${Math.max(rig.indenter_width_mm / 2, size / 2)}/>
    <text x=${x0} y=${-y0 + size * 1.6} font-size=${size}>x ${x0}</text>
    <text x=${x1} y=${-y0 + size * 1.6} font-size=${size} text-anchor="end">${x1} mm</text>
    <text x=${x1} y=${-y1 - size / 2} font-size=${size} text-anchor="end">limits, envelope</text>
    <text x=${x0} y=${-y1 - size / 2} font-size=${size}>y ${y1} mm</text>
    <text x=${x0 - size / 4} y=${-y0} font-size=${size} text-anchor="end">${y0}</text>
  </svg>`;
}

/** The outline of the tip, which stands on (0, 0) with y downwards. */
function tipPath(rig, height) {
  const half = (rig.indenter_width_mm || 1) / 2;
  const shaft = `V${-height} H${-half}`;
  if (rig.indenter_shape === "sphere") return `M${-half} ${-half} A${half} ${half} 0 0 0 ${half} ${-half} ${shaft} z`;
  if (rig.indenter_shape === "cone") return `M${-half} ${-half} L0 0 L${half} ${-half} ${shaft} z`;
  return `M${-half} 0 H${half} ${shaft} z`;
}

/** The covering in section along x through the tip, true to scale: heights with their limits. */
function Section({ rig, stage }) {
  const above = rig.safe_height_mm + 0.5;
  const below = rig.covering_mm + 0.55;
  const width = 1.35 * (above + below);
  const size = (above + below) / 15;
  const place = toSensor([stage.x_mm, stage.y_mm], rig);
  const isHigh = stage.z_mm > above - 0.4;
  const height = isHigh ? 0.3 : above - stage.z_mm;
  const left = -width * 0.32;
  const line = (z, kind, words) => html`<path class=${kind} d=${`M${left} ${-z} H${left + width}`}/>
    <text x=${left + width - size / 2} y=${-z - size / 4} font-size=${size} text-anchor="end">${words}</text>`;
  const depth = Math.max(-stage.z_mm, 0);
  return html`<svg id="section" class=${isStale() ? "stale" : ""} role="img" viewBox=${`${left} ${-above} ${width} ${above + below}`}
      aria-label=${`Section of the covering: tip at z ${mm(stage.z_mm)} mm, depth ${mm(depth)} of at most ${mm(rig.depth_max_mm)} mm, covering ${rig.covering_mm} mm`}>
    <rect class="covering" x=${left} y="0" width=${width} height=${rig.covering_mm}/>
    <rect class="sensor" x=${left} y=${rig.covering_mm} width=${width} height=${below - rig.covering_mm}/>
    ${rig.col_centres_mm.map((x, col) => html`<rect key=${col} class="element-block" x=${x - place[0] - rig.element_mm[0] / 2} y=${rig.covering_mm}
      width=${rig.element_mm[0]} height="0.22"/>`)}
    <${Mark} x=${left + width * 0.72} y=${-above + 4.6 * size} size=${1.5 * size}/>
    ${line(rig.safe_height_mm, "height", `safe height ${rig.safe_height_mm} mm`)}
    ${line(rig.approach_height_mm, "height", `approach ${rig.approach_height_mm} mm`)}
    <path class="tip" d=${tipPath(rig, height)} transform=${`translate(0 ${isHigh ? -above + 0.4 : -stage.z_mm})`}/>
    <path class="surface" d=${`M${left} 0 H${left + width}`}/>
    <path class="limit" d=${`M${left} ${rig.depth_max_mm} H${left + width}`}/>
    <text x=${left + width - size / 2} y=${rig.depth_max_mm - size / 4} font-size=${size} text-anchor="end">limit ${mm(rig.depth_max_mm)} mm deep</text>
    <text x=${left + size / 2} y=${rig.covering_mm - size / 4} font-size=${size}>covering ${rig.covering_mm} mm</text>
    ${isHigh && html`<text x=${left + size / 2} y=${-rig.safe_height_mm + 1.5 * size} font-size=${size}>↑ tip at z ${mm(stage.z_mm, 1)} mm</text>`}
  </svg>`;
}

export function Place() {
  const { stage } = lab.view;
  const rig = lab.rig.description;
  const words = stage ? `${stage.status}, x ${mm(stage.x_mm)}, y ${mm(stage.y_mm)}, z ${mm(stage.z_mm)} mm` : "unknown";
  const isKnown = stage && !["DISCONNECTED", "unknown"].includes(stage.status);
  return html`<p id="stage">${words}${stage?.status === "not homed" && ": the place is not to be trusted before a reset"}</p>
    ${rig && isKnown && html`<div class="places"><${FromAbove} rig=${rig} stage=${stage}/><${Section} rig=${rig} stage=${stage}/></div>
      <p class="note">Indenter ${rig.indenter}, ${rig.indenter_shape}${rig.indenter_width_mm > 0 && ` ${rig.indenter_width_mm} mm`}. Robot frame from above;
        the section is along x, true to scale.</p>`}`;
}
