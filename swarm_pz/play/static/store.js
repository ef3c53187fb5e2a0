// Read a value that the browser stores for this window or for all windows; null without one.

/** @param {"local" | "session"} where */
export function recall(name, where = "local") {
  try { return JSON.parse(window[`${where}Storage`].getItem(`swarm-pz.${name}`)); } catch { return null; }
}

// Store a value, or null; return true if the browser stored it.
/** @param {"local" | "session"} where */
export function keep(name, value, where = "local") {
  try {
    window[`${where}Storage`].setItem(`swarm-pz.${name}`, JSON.stringify(value));
    return true;
  } catch { return false; }
}
