// Opponents that unlock one by one: each has a face, a sentence, and the idea that beats it (ideas.js).

// A face: eyes, the slope of the brows, and the bend of the mouth.
export const LEVELS = {
  corners: { face: [4, 0, -0.4], says: "Waits in the four corners.", idea: "surround" },
  uniform: { face: [3, 0, 0], says: "Spreads out evenly, everywhere.", idea: "surround" },
  centre: { face: [1, 0.2, 0], says: "Crowds in the middle.", idea: "surround" },
  wavefront: { face: [2, -0.3, 0.6], says: "Gathers at a wall, then sweeps across.", idea: "surround" },
  halo: { face: [2, -0.2, 0.9], says: "Flies one broad ring, and never changes it.", idea: "breathe" },
  lasso: { face: [2, 0.5, 0.5], says: "Flies a broad ring that leans to you.", idea: "sides" },
  breather: { face: [3, -0.4, 0.8], says: "Makes a wide ring, then a narrow one.", idea: "lap" },
  pendulum: { face: [1, -0.5, 0.7], says: "Swings from side to side, close together.", idea: "follow" },
  tide: { face: [4, -0.2, 0.4], says: "Floods the left half, then the right half.", idea: "opposite" },
  stroller: { face: [2, -0.6, 0.3], says: "Walks around the middle, all together.", idea: "opposite" },
  hoop: { face: [1, 0.6, -0.6], says: "Rolls a small ring around the middle.", idea: "lap" },
  runner: { face: [2, 0.6, -0.3], says: "Runs around the middle, back to the start of its own trail.", idea: "sides" },
  hunter: { face: [2, 0.9, -0.5], says: "Sees you. It learned from games against scripts.", idea: "lap" },
  champion: { face: [3, 0.9, 0.2], says: "Sees you. It grew up in a league of learners.", idea: "lap" },
  veteran: { face: [2, 1, 0.7], says: "Sees you. It grew from the champion, and beats it.", idea: "lap" },
  finisher: { face: [4, 1, -0.8], says: "The last one. It grew from the veteran.", idea: "lap" },
};
