// Binary messages as the server writes them, and frames as recordings of a page hold them: docs/protocol.md#frames.

import { EXACT, FASTEST, HEADER, HIDDEN, TARGET_HEADER, WITH_FIELDS } from "../frames.js";

const FRAME = 1, TARGET = 2;

// Encode the present moment of a game, perhaps without one team's drones; recordings have exact positions and velocities.
export function frameOf(game, { sequence = 0, ms = 0, fields = null, hidden = -1, exact = false } = {}) {
  const { positions, velocities, teams } = game, count = teams.length, bits = (count + 7) >> 3, size = exact ? 8 : 4;
  const flags = (fields ? WITH_FIELDS : 0) | (HIDDEN[hidden] ?? 0) | (exact ? EXACT : 0);
  const teamsAt = HEADER + 2 * size * count, fieldsAt = teamsAt + bits;
  const buffer = new ArrayBuffer(fieldsAt + (fields ? fields[0].length + fields[1].length : 0));
  const view = new DataView(buffer), bytes = new Uint8Array(buffer);
  bytes.set([FRAME, flags]);
  view.setUint16(2, count, true);
  view.setUint32(4, sequence, true);
  view.setUint32(8, game.tick, true);
  view.setFloat64(12, ms, true);
  for (let i = 0; i < 2 * count; i++) {
    const x = HEADER + i * size / 2, v = x + size * count, isShown = teams[i >> 1] !== hidden;
    if (exact) {
      view.setFloat32(x, positions[i], true);
      view.setFloat32(v, velocities[i], true);
    } else if (isShown) {
      view.setUint16(x, Math.round(65535 * Math.min(Math.max(positions[i], 0), 1)), true);
      view.setInt16(v, Math.round(32767 * Math.min(Math.max(velocities[i] / FASTEST, -1), 1)), true);
    }
  }
  for (let i = 0; i < count; i++) bytes[teamsAt + (i >> 3)] |= teams[i] << (i & 7);
  fields?.forEach((field, team) => bytes.set(field, fieldsAt + team * field.length));
  return buffer;
}

export function base64Of(buffer) { return btoa(String.fromCharCode(...new Uint8Array(buffer))); }

export function targetMessage(team, number, { cells, picture }) {
  const bytes = new Uint8Array(TARGET_HEADER + picture.length), view = new DataView(bytes.buffer);
  bytes.set([TARGET, team]);
  view.setUint16(2, cells, true);
  view.setUint32(4, number, true);
  bytes.set(picture, TARGET_HEADER);
  return bytes.buffer;
}
