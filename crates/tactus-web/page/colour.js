// Colours of counts and of traces.

/** Dark blue over green to yellow: five anchors of the viridis map (van der Walt and Smith, 2015, CC0). */
export const COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** Colours of traces that can be told apart in both schemes, also by most who are colour-blind (Okabe and Ito, 2008). */
export const TRACE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#8a6d00", "#7d3fbf"];

/** The colour of a share of the scale. Below 0 and above 1 it stays at the ends. */
export function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (COLOURS.length - 1);
  const low = Math.min(Math.floor(place), COLOURS.length - 2);
  return COLOURS[low].map((from, part) => Math.round(from + (COLOURS[low + 1][part] - from) * (place - low)));
}

/** Black or white, whichever can be read on a colour. */
export function inkOn([r, g, b]) {
  return 0.3 * r + 0.6 * g + 0.1 * b > 120 ? "#000" : "#fff";
}
