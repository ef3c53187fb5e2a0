// The page's side of a table in a worker: what a server's socket and its pages are where there is one.

const KEPT_AFTER = 30; // frames
let shown = 0;
// By its name the worker knows what the page's address asks for: that of its own script is the cache's.
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
      if (data instanceof ArrayBuffer && ++shown === KEPT_AFTER) keepAll();
      if (data !== null) socket.onmessage({ data });
      else {
        socket.readyState = WebSocket.OPEN;
        socket.onopen();
      }
    };
    worker.postMessage(null, [other]);
    return socket;
  },
  // null where there is no such page.
  fetch: (path) => new Promise((resolve) => {
    const { port1: port, port2: other } = new MessageChannel();
    port.onmessage = ({ data }) => resolve(data === null ? null : new Response(data));
    worker.postMessage(path, [other]);
  }),
};

// Once a game has run for a second, and nothing is in its way, keep the page so that it comes up offline, too.
function keepAll() { navigator.serviceWorker?.register(new URL("../../sw.js", import.meta.url)).catch(() => {}); }
