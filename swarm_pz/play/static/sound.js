// Sound and vibration at events, with one switch that the browser stores.

import { keep, recall } from "./store.js";

const SHORTEST_MS = 120; // between two sounds
const ROW_MS = 2500, RISE = 2, HIGHEST = 12; // each capture within ROW_MS of the last one sounds RISE semitones higher
// Notes in Hz, one after the other, and a vibration in ms.
const KINDS = {
  took: { notes: [660, 880], shake: [35] },
  lost: { notes: [330, 220], shake: [70, 40, 70] },
  won: { notes: [523, 659, 784, 1047], shake: [60, 40, 60, 40, 120] },
  over: { notes: [392, 330, 262], shake: [150] },
};
const NOTE_S = 0.09, LOUDNESS = 0.08;

export class Sound {
  constructor(button) {
    this.button = button;
    this.last = -Infinity;
    this.rise = 0;
    this.context = null;
    this.isOn = recall("sound") !== false;
    button.addEventListener("click", () => this.turn(!this.isOn));
    this.show();
  }

  turn(on) {
    this.isOn = on;
    keep("sound", on);
    this.show();
    if (on) this.play("took");
  }

  show() { this.button.setAttribute("aria-pressed", String(this.isOn)); }

  play(kind) {
    const now = performance.now();
    if (!this.isOn || document.hidden || now - this.last < SHORTEST_MS) return;
    this.rise = kind === "took" && kind === this.kind && now - this.last < ROW_MS ? Math.min(this.rise + RISE, HIGHEST) : 0;
    this.last = now;
    this.kind = kind;
    const { notes, shake } = KINDS[kind], activation = navigator.userActivation;
    if (activation?.hasBeenActive) navigator.vibrate?.(shake);
    if (!activation || activation.hasBeenActive) this.sound(notes);
  }

  sound(notes) {
    try {
      this.context ??= new AudioContext();
    } catch { return; } // no sound on this machine
    const { context } = this, loudness = context.createGain();
    context.resume?.();
    loudness.connect(context.destination);
    notes.forEach((hertz, i) => {
      const note = context.createOscillator(), begins = context.currentTime + i * NOTE_S;
      note.type = "triangle";
      note.frequency.value = hertz * 2 ** (this.rise / 12);
      loudness.gain.setValueAtTime(LOUDNESS, begins);
      loudness.gain.exponentialRampToValueAtTime(0.001, begins + 0.95 * NOTE_S);
      note.connect(loudness);
      note.start(begins);
      note.stop(begins + NOTE_S);
    });
  }
}
