// Opponents that unlock one by one: each has a face, a sentence, and the idea that beats it.

// A face: the number of eyes, the slope of the brows, and the bend of the mouth.
export const LEVELS = {
  corners: { face: [4, 0, -0.4], says: "Waits in the four corners.", idea: "surround" },
  uniform: { face: [3, 0, 0], says: "Spreads out evenly, everywhere.", idea: "surround" },
  wavefront: { face: [2, -0.3, 0.6], says: "Gathers at a wall, then sweeps across.", idea: "surround" },
  centre: { face: [1, 0.2, 0], says: "Crowds in the middle.", idea: "surround" },
  halo: { face: [2, -0.2, 0.9], says: "Flies one broad ring, and never changes it.", idea: "breathe" },
  lasso: { face: [2, 0.5, 0.5], says: "Flies a broad ring that leans to you.", idea: "halves" },
  breather: { face: [3, -0.4, 0.8], says: "Makes a wide ring, then a narrow one.", idea: "lap" },
  pendulum: { face: [1, -0.5, 0.7], says: "Swings from side to side, close together.", idea: "follow" },
  tide: { face: [4, -0.2, 0.4], says: "Floods the left half, then the right half.", idea: "opposite" },
  stroller: { face: [2, -0.6, 0.3], says: "Walks around the middle, all together.", idea: "opposite" },
  hoop: { face: [1, 0.6, -0.6], says: "Rolls a small ring around the middle.", idea: "lap" },
  runner: { face: [2, 0.6, -0.3], says: "Runs around the middle, back to the start of its own trail.", idea: "halves" },
  hunter: { face: [2, 0.9, -0.5], says: "Sees you. It learned from games against scripts.", idea: "lap" },
  champion: { face: [3, 0.9, 0.2], says: "Sees you. It grew up in a league of learners.", idea: "lap" },
  veteran: { face: [2, 1, 0.7], says: "Sees you. It grew from the champion, and beats it.", idea: "lap" },
  finisher: { face: [4, 1, -0.8], says: "Sees you, and finds you where you hide.", idea: "four" },
  scholar: { face: [1, 1, -0.9], says: "The last one. It learned from four teachers.", idea: "four" },
};

// Ideas: a sentence, and an arc to draw every `every_s` seconds, `radii` in turn, in map widths, and a `centre`.
// Arcs have a `length`, in degrees; the first one's middle is at `begins`, and each next one's is a `turn` further. A
// dot is a short arc. The picture shows an idea `against` a script. benchmarks/page_levels.py reads this as JSON.
export const IDEAS = {
  "surround": {
    "says": "Draw one big circle, at once, and leave it.", "against": "centre", "every_s": 120, "radii": [0.33]
  },
  "breathe": {
    "says": "Draw a wide ring, four seconds later a small one, and so on: their ring is never where yours is.",
    "against": "halo", "every_s": 4, "radii": [0.3, 0.15]
  },
  "halves": {
    "says": "Draw half a big ring on the left, four seconds later half a ring on the right, and so on: all of you meet a part of them.",
    "against": "runner", "every_s": 4, "radii": [0.35], "length": 150, "begins": 180, "turn": 180
  },
  "follow": {
    "says": "They wander: every two seconds, draw the ring around them again.",
    "against": "pendulum", "every_s": 2, "radii": [0.3], "centre": "they"
  },
  "opposite": {
    "says": "Every two seconds, draw a dot where they are not: across the middle from them.",
    "against": "stroller", "every_s": 2, "radii": [0.01], "centre": "across"
  },
  "lap": {
    "says": "Run around the middle: from the upper left down, a short wide stroke every second, six for a round. Your trails close to a ring.",
    "against": "breather", "every_s": 1, "radii": [0.24], "length": 46, "begins": 135, "turn": 60, "width": 0.3
  },
  "four": {
    "says": "Every three seconds, draw a wide dot halfway to the wall: above, left, below, right, and so on.",
    "against": "breather", "every_s": 3, "radii": [0.3], "length": 2, "begins": 90, "turn": 90, "width": 0.25
  }
};
