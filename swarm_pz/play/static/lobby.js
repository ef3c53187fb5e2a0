// The lobby: open a room, join one, go back to one's seat, or take the lesson.

const at = (id) => document.getElementById(id);

export class Lobby {
  constructor(link) {
    this.link = link;
    at("create").addEventListener("submit", (event) => this.create(event));
    at("join").addEventListener("submit", (event) => this.join(event));
    at("opponent").addEventListener("change", () => this.describe());
    at("side").addEventListener("change", () => { at("red-player").hidden = at("side").value !== "watch"; });
    at("start-lesson").addEventListener("click", () => { location.hash = "lesson"; });
    at("return").addEventListener("click", () => {
      location.hash = `room=${link.lastSeat.room}`;
    });
  }

  show(welcome) {
    const seat = this.link.lastSeat;
    at("return").hidden = !seat;
    if (seat) at("return").textContent = `Return to your seat in room ${seat.room}`;
    if (!welcome || at("opponent").options.length) return;
    this.policies = welcome.policies;
    const players = () => [
      new Option("a person, in another window or on another device", ""),
      ...welcome.policies.map(({ name }) => new Option(name, name)),
    ];
    at("opponent").append(...players());
    at("opponent").add(new Option("nobody: practise alone", "none"), 1);
    at("player").append(...players());
    at("opponent").value = "uniform";
    this.describe();
  }

  describe() {
    const policy = this.policies.find(({ name }) => name === at("opponent").value);
    at("opponent-about").textContent = policy?.about ?? "";
  }

  create(event) {
    event.preventDefault();
    const opponent = at("opponent").value, seat = at("side").value;
    const settings = {
      red: Number(at("red-drones").value),
      blue: Number(at("blue-drones").value),
      time_limit: at("time-limit").value ? Number(at("time-limit").value) : null,
      mapping: at("mapping").value,
      speed: Number(at("speed").value),
    };
    if (opponent === "none") settings[seat === "blue" ? "red" : "blue"] = 0;
    const isPolicy = opponent && opponent !== "none", player = seat === "watch" && at("player").value;
    this.link.send({
      type: "create", settings, seat, label: at("label").value,
      ...(isPolicy ? { opponent } : {}), ...(player ? { player } : {}),
    });
  }

  join(event) {
    event.preventDefault();
    const room = at("code").value.toUpperCase(), seat = at("join-side").value;
    this.link.send({ type: "join", room, seat, label: at("label").value });
  }
}
