// A room before its game: players, readiness, and the invitation.

import { paintPicture, PICTURES } from "./cards.js";
import { byId, copy, hear, on } from "./elements.js";
import { onLook } from "./ground.js";
import { keep, recall } from "./store.js";
import { playerOf, SIDES } from "./words.js";

const LOOPBACK = /^(localhost|127\.|\[::1\])/;

export class Waiting {
  constructor(link) {
    hear(link, {
      welcome: ({ addresses, records_labels: isRecorded }) => {
        this.setAddresses(addresses);
        byId("label-hint").textContent = isRecorded ? "This server records it with your games." : "Only the people in this room see it.";
      },
    });
    byId("label").value = recall("name") ?? "";
    on("change", {
      address: () => this.showInvitation(), label: () => link.send({ type: "ready", ready: this.isReady, label: byId("label").value }),
    });
    on("focus", { "invitation-link": () => byId("invitation-link").select() });
    on("input", { label: () => keep("name", byId("label").value) });
    const paint = () => byId("taught").querySelectorAll("canvas").forEach((canvas, i) => paintPicture(canvas, PICTURES[i]));
    paint();
    onLook(paint);
    on("click", { copy: () => copy(byId("invitation-link"), byId("copy")) });
  }

  // List addresses for other devices, this page's own first if they can use it.
  setAddresses(addresses) {
    const isHere = LOOPBACK.test(location.host);
    this.isLocal = isHere && !addresses.length;
    const all = [...new Set([...(isHere && !this.isLocal ? [] : [`${location.origin}/`]), ...addresses])];
    byId("address").replaceChildren(...all.map((address) => new Option(address, address)));
    byId("address-choice").hidden = all.length < 2;
  }

  // Show a room, and return a sentence about it.
  show(room, seat) {
    const isWaiting = room.phase === "waiting", free = freeSides(room);
    byId("waiting").hidden = !isWaiting || !meetsSomebody(room, seat);
    byId("naming").hidden = seat === null;
    this.isReady = Boolean(room[SIDES[seat]]?.ready);
    byId("taught").hidden = !isWaiting || seat === null;
    byId("room-code").textContent = this.code = room.code;
    for (const side of SIDES) byId(`${side}-seat`).textContent = describe(room, side, seat);
    byId("invitation").hidden = !(isWaiting || room.phase === "over") || seat === null || room.once || !free.length;
    if (!byId("invitation").hidden) this.showInvitation();
    byId("watching").hidden = seat !== null || !["starting", "playing"].includes(room.phase);
    byId("watching").textContent = byId("watching").hidden ? "" : watching(room);
    return words(room, seat, free);
  }

  showInvitation() {
    const address = byId("address").value, link = `${address}#room=${this.code}`;
    if (byId("invitation-link").value === link) return;
    byId("invitation-link").value = link;
    byId("invitation-code").src = `/invitations/${this.code}.svg?at=${encodeURIComponent(address)}`;
    byId("invitation-hint").textContent = this.isLocal
      ? "Only this computer can open this link. For phones and other computers, start the server with --host 0.0.0.0."
      : "The first person who opens it takes the free seat.";
    byId("copy").textContent = "Copy the link";
  }
}

// Tell if the room waits for anybody but policies.
export function meetsSomebody(room, seat) {
  return SIDES.some((side, i) => i !== seat && room.settings[side] > 0 && room[side].kind !== "policy");
}

export function freeSides(room) {
  return SIDES.filter((side) => room[side].kind === "free" && room.settings[side] > 0);
}

function describe(room, side, seat) {
  const state = room[side], isOwn = seat === SIDES.indexOf(side);
  if (room.settings[side] === 0) return `${side}: no drones`;
  if (state.kind === "free") return `${side}: free`;
  const status = { loading: "getting ready", failed: "cannot play" }[state.policy_state]
    ?? (!state.connected ? "away" : state.ready ? "ready" : "not ready yet");
  return `${side}: ${isOwn && !state.label ? "you" : playerOf(state) + (isOwn ? " (you)" : "")}, ${status}`;
}

// Explain why a visitor has no seat in a running game.
function watching(room) {
  const gone = SIDES.filter((side) => room[side].gone);
  if (gone.length) return `You watch: the ${gone.join(" and the ")} seat was given up for good. It is free again after this game.`;
  return hasPeople(room) ? "You watch: both seats are taken." : "You watch.";
}

function hasPeople(room) { return SIDES.some((side) => ["person", "program"].includes(room[side].kind)); }

function words(room, seat, free) {
  if (seat === null) {
    if (free.length) return `You watch. The ${free[0]} seat is free.`;
    return hasPeople(room) ? "You watch: both seats are taken. The game begins when both are ready." : "They wait for you to begin.";
  }
  const other = SIDES[1 - seat], state = room[other];
  if (free.length) return `The ${free[0]} seat is free: send somebody the link.`;
  if (room.settings[other] === 0) return "You are alone here: practise as long as you like.";
  if (room[SIDES[seat]].ready) return `Waiting for ${playerOf(state)} to be ready.`;
  return state.ready ? `${playerOf(state)} is ready. The game begins when you are.` : "Both are here. The game begins when both are ready.";
}
