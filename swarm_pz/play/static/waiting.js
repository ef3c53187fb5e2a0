// A room in which no game runs yet: who is here, who is ready, and how somebody else comes in.

import { called } from "./cards.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const LOOPBACK = /^(localhost|127\.|\[::1\])/;

export class Waiting {
  constructor(link) {
    this.addresses = [];
    link.addEventListener("welcome", ({ detail }) => this.setAddresses(detail.addresses));
    at("address").addEventListener("change", () => this.showInvitation());
    at("invitation-link").addEventListener("focus", () => at("invitation-link").select());
    at("copy").addEventListener("click", () => this.copy());
  }

  // Addresses for other devices; that of this page first, if it is one of them.
  setAddresses(addresses) {
    const own = `${location.origin}/`;
    this.isLocal = LOOPBACK.test(location.host) && !addresses.length;
    this.addresses = [...new Set([...(LOOPBACK.test(location.host) && !this.isLocal ? [] : [own]), ...addresses])];
    at("address").replaceChildren(...this.addresses.map((address) => new Option(address, address)));
    at("address-choice").hidden = this.addresses.length < 2;
  }

  // Returns what is to be said of the room.
  show(room, seat) {
    at("waiting").hidden = room.phase !== "waiting" || !meetsSomebody(room, seat);
    at("room-code").textContent = this.code = room.code;
    for (const side of SIDES) at(`${side}-seat`).textContent = describe(room, side, seat);
    const free = freeSides(room);
    at("invitation").hidden = room.phase !== "waiting" || seat === null || !free.length;
    if (!at("invitation").hidden) this.showInvitation();
    at("watching").hidden = seat !== null || !["starting", "playing"].includes(room.phase);
    at("watching").textContent = at("watching").hidden ? "" : watching(room);
    return words(room, seat, free);
  }

  showInvitation() {
    const address = at("address").value;
    const link = `${address}#room=${this.code}`;
    if (at("invitation-link").value === link) return;
    at("invitation-link").value = link;
    at("invitation-code").src = `/invitations/${this.code}.svg?at=${encodeURIComponent(address)}`;
    at("invitation-hint").textContent = this.isLocal
      ? "Only this machine reaches this link. For phones and other machines, start the table with --host 0.0.0.0."
      : "Whoever opens it takes the free seat.";
    at("copy").textContent = "Copy the link";
  }

  async copy() {
    const field = at("invitation-link");
    try {
      await navigator.clipboard.writeText(field.value);
    } catch { // only pages that are encrypted, or of this machine, may use it
      field.select();
      if (!document.execCommand("copy")) return;
    }
    at("copy").textContent = "Copied";
  }
}

// Whether one waits for others than policies.
export function meetsSomebody(room, seat) {
  return SIDES.some((side, i) => i !== seat && room.settings[side] > 0 && room[side].kind !== "policy");
}

export function freeSides(room) {
  return SIDES.filter((side) => room[side].kind === "free" && room.settings[side] > 0);
}

function name({ kind, name, label }) {
  return { free: "free", policy: called(name), person: label || "a person", program: label || "a program" }[kind];
}

function describe(room, side, seat) {
  const state = room[side], you = seat === SIDES.indexOf(side);
  if (room.settings[side] === 0) return `${side}: no drones`;
  if (state.kind === "free") return `${side}: free`;
  const how = { loading: "getting ready", failed: "cannot play" }[state.policy_state]
    ?? (!state.connected ? "away" : state.ready ? "ready" : "not ready yet");
  return `${side}: ${you && !state.label ? "you" : name(state) + (you ? " (you)" : "")}, ${how}`;
}

// Why one has no seat in a game that is played.
function watching(room) {
  const given = SIDES.filter((side) => room[side].gone);
  if (given.length) return `You watch: the ${given.join(" and the ")} seat was given up for good. It is free again after this game.`;
  return SIDES.some((side) => isClient(room[side])) ? "You watch: both seats are taken." : "You watch.";
}

function isClient({ kind }) { return kind === "person" || kind === "program"; }

function words(room, seat, free) {
  if (seat === null) {
    if (free.length) return `You watch. The ${free[0]} seat is free.`;
    return SIDES.some((side) => isClient(room[side]))
      ? "You watch: both seats are taken. The game begins when both are ready." : "They wait for you to begin.";
  }
  const other = SIDES[1 - seat], own = room[SIDES[seat]], state = room[other];
  if (free.length) return `The ${free[0]} seat is free: send somebody the link.`;
  if (room.settings[other] === 0) return "You are alone here: practise as long as you like.";
  if (own.ready) return `Waiting for ${name(state)} to be ready.`;
  return state.ready ? `${name(state)} is ready. The game begins when you are.` : "Both are here. The game begins when both are ready.";
}
