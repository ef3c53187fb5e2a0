// A plug-in for jsPsych 8: one game of swarm-pz, at a table or in the page itself, is one trial. docs/jspsych.md says how.

var jsPsychSwarmPz = (function (jspsych) {
  "use strict";

  const { ParameterType } = jspsych, HOME = new URL("..", document.currentScript.src).href;
  const info = {
    name: "swarm-pz",
    version: "0.1.0",
    parameters: {
      // "server": at a table; "page": in the page itself, by the folder of swarm-pz site that this plug-in is in.
      engine: { type: ParameterType.STRING, default: "server" },
      // Address of the table, such as "https://play.example.org"; it was started with --embed and this page's origin.
      table: { type: ParameterType.STRING, default: HOME },
      // With "page", what is varied for red and blue, as a table's --factors: { red: { command_delay_ms: 200 } }.
      factors: { type: ParameterType.OBJECT, default: {} },
      // A policy.
      opponent: { type: ParameterType.STRING, default: "uniform" },
      // "red" or "blue".
      seat: { type: ParameterType.STRING, default: "red" },
      // Of the game's start, a whole number from 0 to 2^32 - 1; null takes any. Equal seeds, sizes and systems start alike.
      seed: { type: ParameterType.INT, default: null },
      // As in the table's protocol: red, blue, time_limit, mapping, speed, red_system, blue_system.
      settings: { type: ParameterType.OBJECT, default: {} },
      // What recordings call the participant, if the table was started with --record-labels.
      label: { type: ParameterType.STRING, default: "" },
      // Of the frame, as CSS has them.
      width: { type: ParameterType.STRING, default: "min(96vw, 60rem)" },
      height: { type: ParameterType.STRING, default: "92vh" },
      // For so long the result stays.
      result_duration: { type: ParameterType.INT, default: 2500 },
      // For so long the table may take to answer at first.
      load_timeout: { type: ParameterType.INT, default: 20000 },
    },
    data: {
      // "win", "draw", "loss" or "stopped"; null if no game was played.
      outcome: { type: ParameterType.STRING },
      // Of game.
      seconds: { type: ParameterType.FLOAT },
      // Drones that one's side took, and lost.
      captured: { type: ParameterType.INT },
      lost: { type: ParameterType.INT },
      // Commands that were given.
      commands: { type: ParameterType.INT },
      // The file at the table; or with "page" its name, and what it holds.
      recording: { type: ParameterType.STRING },
      lines: { type: ParameterType.STRING },
      opponent: { type: ParameterType.STRING },
      seed: { type: ParameterType.INT },
      side: { type: ParameterType.STRING },
      // Why no game was played, or it could not be read; else null.
      error: { type: ParameterType.STRING },
      // And at a table every other column of a game in the tables of `swarm-pz study`.
    },
  };
  const NOTHING = Object.fromEntries(Object.keys(info.data).map((name) => [name, null]));

  class SwarmPzPlugin {
    constructor(jsPsych) { this.jsPsych = jsPsych; }

    trial(element, trial) {
      const isHere = trial.engine === "page", address = new URL(isHere ? HOME : "/", isHere ? HOME : new URL(trial.table, location.href));
      const { origin } = address, frame = document.createElement("iframe");
      if (isHere) address.search = `factors=${encodeURIComponent(JSON.stringify(trial.factors))}`;
      address.hash = `embed=${encodeURIComponent(location.origin)}`;
      Object.assign(frame, { title: "A game of swarms", allow: "autoplay; fullscreen", src: address.href });
      Object.assign(frame.style, { width: trial.width, height: trial.height, border: "0" });
      const finish = (row) => {
        removeEventListener("message", hear);
        clearTimeout(silence);
        frame.remove();
        this.jsPsych.finishTrial({ ...NOTHING, ...row });
      };
      const hear = ({ source, origin: from, data }) => {
        if (source !== frame.contentWindow || from !== origin) return;
        if (data?.type === "swarm-pz.ready") {
          const { opponent, seat, seed, settings, label } = trial;
          clearTimeout(silence);
          frame.contentWindow.postMessage({ type: "swarm-pz.begin", create: { opponent, seat, seed, settings, label } }, origin);
        } else if (data?.type === "swarm-pz.over") this.jsPsych.pluginAPI.setTimeout(() => finish(data.row), trial.result_duration);
        else if (data?.type === "swarm-pz.refused") finish({ error: data.reason });
      };
      const silence = setTimeout(() => finish({
        error: isHere ? `no answer from ${HOME}: is the folder of swarm-pz site there, and served as this page is?`
          : `no answer from ${origin}: is the table running, and was it started with --embed ${location.origin}?`,
      }), trial.load_timeout);
      addEventListener("message", hear);
      element.replaceChildren(frame);
      frame.focus();
    }
  }
  SwarmPzPlugin.info = info;
  return SwarmPzPlugin;
})(jsPsychModule);
