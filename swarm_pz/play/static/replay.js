// A recorded game: hold it, go to any moment, take over from there.

const at = (id) => document.getElementById(id);
const SEEK_EVERY_MS = 100; // the server takes so many messages a second and no more

export class Replay {
  constructor(link) {
    this.link = link;
    this.held = false;
    at("hold").addEventListener("click", () => this.hold(!this.held));
    at("moment").addEventListener("input", () => {
      this.hold(true);
      this.tell();
      this.later ??= setTimeout(() => this.seek(), SEEK_EVERY_MS);
    });
    at("take-over").addEventListener("click", () => link.send({ type: "take_over", seat: at("take-side").value }));
  }

  show(room) {
    const isReplay = room.phase === "replay";
    at("scrubber").hidden = !isReplay;
    if (!isReplay) return;
    at("moment").max = room.last_tick;
    at("moment").value = 0;
    this.tell();
    at("take-over").disabled = !room.verified;
    at("take-over").title = room.verified ? "" : "This game plays differently on this machine.";
    this.hold(false);
  }

  hold(held) {
    if (held !== this.held) this.link.send({ type: "pace", speed: held ? 0 : 1 });
    this.held = held;
    at("hold").textContent = held ? "Play" : "Pause";
    at("hold").setAttribute("aria-pressed", String(held));
  }

  seek() {
    this.later = null;
    this.link.send({ type: "seek", tick: Number(at("moment").value) });
  }

  follow(tick) {
    if (at("scrubber").hidden || this.held) return;
    at("moment").value = tick;
    this.tell();
  }

  tell() {
    const { value, max } = at("moment");
    at("moment").setAttribute("aria-valuetext", `${inWords(value)} of ${inWords(max)}`);
  }
}

function inWords(tick) {
  const seconds = Math.floor(tick / 30), minutes = Math.floor(seconds / 60);
  return `${minutes ? `${minutes} minutes ` : ""}${seconds % 60} seconds`;
}
