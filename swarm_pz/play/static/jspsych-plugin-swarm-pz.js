// A plug-in for jsPsych 8: one game of swarm-pz, at a server or in the page itself, is one trial. docs/jspsych.md explains parameters and data.

var jsPsychSwarmPz = (function (jspsych) {
  "use strict";

  const { ParameterType } = jspsych, typed = (type, ...names) => Object.fromEntries(names.map((name) => [name, { type: ParameterType[type] }]));
  const HOME = new URL("..", document.currentScript.src).href;
  const info = {
    name: "swarm-pz",
    version: "0.1.0",
    parameters: {
      engine: { type: ParameterType.STRING, default: "server" },
      table: { type: ParameterType.STRING, default: HOME },
      factors: { type: ParameterType.OBJECT, default: {} },
      opponent: { type: ParameterType.STRING, default: "uniform" },
      seat: { type: ParameterType.STRING, default: "red" },
      seed: { type: ParameterType.INT, default: null },
      settings: { type: ParameterType.OBJECT, default: {} },
      label: { type: ParameterType.STRING, default: "" },
      save: { type: ParameterType.FUNCTION, default: null },
      width: { type: ParameterType.STRING, default: "min(96vw, 60rem)" },
      height: { type: ParameterType.STRING, default: "92vh" },
      result_duration: { type: ParameterType.INT, default: 2500 },
      load_timeout: { type: ParameterType.INT, default: 20000 },
    },
    data: {
      ...typed("STRING", "outcome", "recording", "lines", "opponent", "side", "error"), ...typed("FLOAT", "seconds"),
      ...typed("INT", "captured", "lost", "commands", "seed"),
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
      const finish = async (row) => {
        removeEventListener("message", hear);
        clearTimeout(silence);
        frame.remove();
        const trialData = { ...NOTHING, ...row };
        if (trial.save && trialData.lines !== null) {
          try {
            await trial.save(trialData.recording, trialData.lines);
            trialData.lines = null;
          } catch (error) { trialData.error = `not saved: ${error?.message ?? error}`; } // the row keeps the lines
        }
        this.jsPsych.finishTrial(trialData);
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
