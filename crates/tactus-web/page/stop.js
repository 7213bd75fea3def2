"use strict";

// STOP: it needs no other script, no token and no lease, and is never disabled. Key S does the same.
(() => {
  const button = document.getElementById("stop");
  const said = document.getElementById("stopped");
  const PATIENCE_MS = 15000;

  async function stop() {
    said.textContent = "stop ...";
    said.className = "";
    // A browser limits connections per site, and other windows may use the rest: the page frees its own for the stop.
    window.dispatchEvent(new Event("tactus-stopping"));
    let failure = "";
    try {
      const reply = await fetch("stop", { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) });
      if (!reply.ok) failure = await reply.text();
    } catch {
      failure = "the dashboard does not answer";
    }
    said.textContent = failure ? `STOP FAILED: ${failure}` : "stop: done";
    said.className = failure ? "failed" : "";
    window.dispatchEvent(new Event("tactus-stopped"));
  }

  button.addEventListener("click", stop);
  document.addEventListener("keydown", (event) => {
    // An S that somebody types into a field is a letter.
    const isTyping = ["INPUT", "TEXTAREA", "SELECT"].includes(event.target.tagName) && event.target.type !== "checkbox";
    const isPlain = !event.repeat && !event.ctrlKey && !event.metaKey && !event.altKey;
    if (!isTyping && isPlain && event.key.toLowerCase() === "s") stop();
  });
})();
