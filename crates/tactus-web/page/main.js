// The page: puts its parts together and draws them when something has changed.

import { html, render } from "./preact.js";
import { ArrayImage } from "./array.js";
import { onAnswer, token } from "./commands.js";
import { draw, duration, follow, lab } from "./lab.js";
import { Frames, Log } from "./log.js";
import { Place } from "./place.js";
import { Run } from "./run.js";
import { Runs } from "./runs.js";
import { Move, Start } from "./start.js";
import { Traces } from "./traces.js";

/** Which part of the page is shown: the lab now, or the recorded runs. */
let shown = "lab";

function Way({ to, children }) {
  const go = () => { shown = to; draw(); };
  return html`<button id=${`to-${to}`} class="way" type="button" aria-current=${shown === to ? "page" : undefined} onClick=${go}>${children}</button>`;
}

function Head() {
  const { rig, simulated, health, problem } = lab.view;
  const service = health && !lab.silent ? `version ${health.version}, up ${duration(health.uptime_s)}` : problem || lab.silent ? "no service" : "connecting";
  return html`<h1>Tactus <span id="rig">${rig}</span></h1>
    ${simulated && html`<p id="simulated">SIMULATED</p>`}
    <nav><${Way} to="lab">Lab<//><${Way} to="runs">Runs<//></nav>
    <p id="service">${service}</p>`;
}

function Panel({ id, title, children }) {
  return html`<section id=${`${id}-panel`} aria-labelledby=${`${id}-title`}><h2 id=${`${id}-title`}>${title}</h2>${children}</section>`;
}

function Page() {
  const problem = lab.silent ? "the dashboard does not answer; trying again" : lab.view.problem;
  return html`
    ${problem && html`<p id="problem" class="banner problem" role="alert">${problem}</p>`}
    ${shown === "runs" ? html`<${Runs} draw=${draw}/>` : html`<${Lab}/>`}`;
}

function Lab() {
  return html`<div class="columns">
      <div class="column image">
        <${Panel} id="array" title="Pressure image"><${ArrayImage} draw=${draw}/><//>
        <${Panel} id="place" title="Tip"><${Place}/><//>
      </div>
      <div class="column control">
        <${Panel} id="run" title="Run"><${Run}/><//>
        <${Panel} id="start" title="Start"><${Start} draw=${draw}/><//>
        <${Panel} id="move" title="Move and zero"><${Move} draw=${draw}/><//>
      </div>
      <div class="column charts">
        <${Panel} id="traces" title="Traces"><${Traces} draw=${draw}/><//>
        <${Panel} id="frames" title="Frames and zeros"><${Frames}/><//>
      </div>
      <div class="column wide"><${Panel} id="log" title="Log"><${Log}/><//></div>
    </div>`;
}

const head = document.getElementById("head");
const app = document.getElementById("app");
head.replaceChildren();
app.replaceChildren();

function show() {
  const { rig, simulated } = lab.view;
  document.title = `Tactus ${rig}${simulated ? " (SIMULATED)" : ""}`.trim();
  render(html`<${Head}/>`, head);
  render(html`<${Page}/>`, app);
}

token();
onAnswer(draw);
follow(show);
show();
