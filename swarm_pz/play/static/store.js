// What the browser keeps under a name, for this window or for all of them; one that keeps nothing forgets.

/** @param {"local" | "session"} where */
export function recall(name, where = "local") {
  try { return JSON.parse(window[`${where}Storage`].getItem(`swarm-pz.${name}`)); } catch { return null; }
}

// Keep a value, or null for nothing; tell whether the browser does.
/** @param {"local" | "session"} where */
export function keep(name, value, where = "local") {
  try {
    window[`${where}Storage`].setItem(`swarm-pz.${name}`, JSON.stringify(value));
    return true;
  } catch { return false; }
}
