// Commands to the server, all but STOP. Each needs the token of the page's address.

/** The last answer, and who holds the lease if somebody else does. */
export const commands = { answer: "", failed: false, taken: null, busy: "" };

let changed = () => {};

export function onAnswer(draws) {
  changed = draws;
}

/** The token: in the address once, then kept by this window. */
export function token() {
  if (location.hash.length > 1) {
    sessionStorage.setItem("token", location.hash.slice(1));
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}

function headers(takeOver) {
  const all = { "x-tactus-token": token() };
  if (takeOver) all["x-take-over"] = takeOver.replace(/[^\x20-\x7e]/g, "?");
  return all;
}

/** Asks the server. Throws an error with the server's words. */
export async function ask(path, body, { patience_s = 30, signal, takeOver } = {}) {
  const signals = [AbortSignal.timeout(1000 * patience_s), ...(signal ? [signal] : [])];
  let reply;
  try {
    reply = await fetch(path, {
      method: "POST",
      headers: headers(takeOver),
      body: body === undefined ? undefined : JSON.stringify(body),
      signal: AbortSignal.any(signals),
    });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Error("the dashboard does not answer", { cause: error });
  }
  const text = await reply.text();
  if (!reply.ok) throw Object.assign(new Error(text), { status: reply.status });
  return text;
}

/** Sends a command, and shows its answer. `words` names it. */
export async function command(path, words, { body, patience_s = 15, takeOver } = {}) {
  Object.assign(commands, { answer: `${words} ...`, failed: false, taken: null, busy: words });
  changed();
  try {
    const note = await ask(path, body, { patience_s, takeOver });
    commands.answer = note ? `${words}: done; ${note}` : `${words}: done`;
  } catch (error) {
    commands.failed = true;
    commands.answer = `${words.toUpperCase()} FAILED: ${error.message}`;
    // Another client holds the lease: whoever takes it over says why.
    if (error.status === 423) {
      commands.taken = { holder: error.message, again: (reason) => command(path, words, { body, patience_s, takeOver: reason }) };
    }
  }
  commands.busy = "";
  changed();
  return !commands.failed;
}
