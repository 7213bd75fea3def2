// Preact with htm: markup in template strings, without a build step.

import { h, render } from "./vendor/preact.module.js";
import htm from "./vendor/htm.module.js";

export { useEffect, useRef, useState } from "./vendor/hooks.module.js";
export { render };
export const html = htm.bind(h);
