// Recorded games, as the server lists them: links to watch them.

const NAME = /^(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)Z-([A-Z0-9]+)-(\d+)/;

// Fill a list with the recorded games, of one room if one is named; returns how many there are.
export async function listGames(list, room = "") {
  let names = [];
  try {
    const answer = await fetch("/recordings");
    names = answer.ok ? await answer.json() : [];
  } catch { /* without the server there is no list */ }
  const shown = names.filter((name) => !room || name.match(NAME)?.[7] === room);
  list.replaceChildren(...shown.map((name) => {
    const item = document.createElement("li"), link = document.createElement("a");
    link.href = `#replay=${encodeURIComponent(name)}`;
    link.textContent = title(name);
    item.append(link);
    return item;
  }));
  if (!shown.length && !room) list.append(Object.assign(document.createElement("li"), { textContent: "None so far." }));
  return shown.length;
}

function title(name) {
  const parts = name.match(NAME);
  if (!parts) return name;
  const [year, month, day, hour, minute, second] = parts.slice(1, 7).map(Number);
  const began = new Date(Date.UTC(year, month - 1, day, hour, minute, second));
  return `${began.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" })}, room ${parts[7]}, game ${parts[8]}`;
}
