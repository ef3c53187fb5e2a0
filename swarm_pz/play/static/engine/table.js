// The page's connection to the game in its worker, in place of a server's socket and pages.

import { FRAME } from "../frames.js";

const KEPT_AFTER = 30; // frames
let frames = 0;
// The worker's name carries the page's query string: the address of its own script may come from the cache.
const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module", name: location.search });

/** @type {any} */
export const PAGE = {
  connect() {
    const { port1: port, port2: other } = new MessageChannel();
    /** @type {any} */
    const socket = {
      readyState: WebSocket.CONNECTING,
      onopen() {}, onmessage(_) {}, onclose() {},
      send: (text) => port.postMessage(text),
      close() {
        socket.readyState = WebSocket.CLOSED;
        port.close();
        queueMicrotask(() => socket.onclose());
      },
    };
    port.onmessage = ({ data }) => {
      if (data?.type === FRAME && ++frames === KEPT_AFTER) keepAll();
      if (data !== null) socket.onmessage({ data });
      else {
        socket.readyState = WebSocket.OPEN;
        socket.onopen();
      }
    };
    worker.postMessage(null, [other]);
    return socket;
  },
  // null if there is no such page.
  fetch: (path) => new Promise((resolve) => {
    const { port1: port, port2: other } = new MessageChannel();
    port.onmessage = ({ data }) => resolve(data === null ? null : new Response(data));
    worker.postMessage(path, [other]);
  }),
  keepAll,
};

// Keep the page for offline use. This waits for a second of a game, or a recorded one: downloads then disturb nothing.
function keepAll() { navigator.serviceWorker?.register(new URL("../../sw.js", import.meta.url)).catch(() => {}); }
