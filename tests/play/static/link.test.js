// The connection: its greeting, the clock, acknowledgements, and how it reconnects.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { bytes, fixtures, reload, Socket, time } from "./page.js";
import { Link } from "../../../swarm_pz/play/static/link.js";

const SEAT = fixtures.seats.ergodic;

beforeEach(() => {
  reload();
  Socket.all = [];
  for (const store of [sessionStorage, localStorage]) store.removeItem("swarm-pz.seat");
});

async function connect(wanted = null) {
  const link = new Link(() => wanted), [socket] = Socket.all;
  await socket.open();
  return { link, socket, heard: (type, listener) => { link.addEventListener(type, listener); } };
}

test("the page greets in the server's protocol, as a person, with its screen, and asks for its seat", async () => {
  const { socket } = await connect({ token: SEAT.token });
  const [hello, ping] = socket.sent;
  assert.deepEqual([socket.address, socket.protocol], ["ws://table/socket", fixtures.subprotocol]);
  assert.deepEqual([hello.type, hello.kind, hello.token, hello.client.viewport, ping.type], ["hello", "person", SEAT.token, [390, 844], "ping"]);
  reload();
  Socket.all = [];
  assert.equal("token" in (await connect()).socket.sent[0], false);
});

test("nothing is said before the greeting, nor on a line that is lost", async () => {
  const link = new Link(() => null), [socket] = Socket.all;
  assert.equal(link.send({ type: "ready" }), false);
  await socket.open();
  assert.equal(link.send({ type: "ready" }), true);
  socket.readyState = 3;
  assert.equal(link.send({ type: "ready" }), false);
  assert.equal(socket.sent.filter(({ type }) => type === "ready").length, 1);
});

test("the quickest of the latest pings sets the clock", async () => {
  const { link, socket } = await connect();
  const answer = (trip, offset) => socket.hear({ type: "pong", sent_ms: time.ms - trip, server_ms: time.ms - trip / 2 + offset });
  assert.ok(Number.isNaN(link.now()));
  for (const trip of [800, 200, 3000]) answer(trip, 5000 + trip);
  assert.deepEqual([link.offsetMs, link.roundTripMs, link.now()], [5200, 200, time.ms + 5200]);
  for (let i = 0; i < 8; i++) answer(400, 7000);
  assert.equal(link.offsetMs, 7000, "clocks drift: old pings count no more");
});

test("every fourth frame is acknowledged by its number, and all are passed on", async () => {
  const { link, socket } = await connect(), received = [];
  link.addEventListener("frame", ({ detail }) => received.push(detail.sequence));
  link.addEventListener("target", ({ detail }) => received.push(detail.number));
  for (let i = 0; i < 8; i++) socket.hear(bytes(fixtures.frames[0].bytes));
  socket.hear(bytes(fixtures.targets[0].bytes));
  assert.deepEqual(received, [...Array(8).fill(7), 9]);
  assert.deepEqual(socket.sent.filter(({ type }) => type === "acknowledge"), Array(2).fill({ type: "acknowledge", sequence: 7 }));
});

test("a seat is kept by this window, and by the browser for who closes it", async () => {
  const { link, socket } = await connect();
  socket.hear(SEAT);
  assert.deepEqual([link.seat, link.lastSeat], Array(2).fill({ room: "ABCD", token: SEAT.token, seat: "red" }));
  socket.hear({ type: "room", code: "ABCD", phase: "over" });
  assert.deepEqual([link.seat.token, link.lastSeat], [SEAT.token, null], "the seat of a game that is over is this window's alone");
  socket.hear({ type: "room", code: "ABCD", phase: "starting" });
  assert.equal(link.lastSeat.token, SEAT.token);
  link.seat = null;
  assert.deepEqual([link.seat, link.lastSeat], [null, null]);
});

test("a lost connection is opened again, ever more slowly, and at once after it held", async () => {
  const { link, socket } = await connect(), closed = [];
  link.addEventListener("closed", () => closed.push(time.ms));
  const again = (waits) => {
    const count = Socket.all.length;
    time.pass(waits - 1);
    assert.equal(Socket.all.length, count);
    time.pass(1);
    assert.equal(Socket.all.length, count + 1);
  };
  socket.close();
  for (const waits of [250, 500, 1000, 2000, 4000, 4000]) {
    again(waits);
    Socket.all.at(-1).close();
  }
  again(4000);
  await Socket.all.at(-1).open();
  Socket.all.at(-1).close();
  again(250);
  assert.equal(closed.length, 8);
});

test("who was displaced does not come back", async () => {
  const { socket } = await connect();
  socket.hear({ type: "displaced" });
  time.pass(60_000);
  assert.equal(Socket.all.length, 1);
});
