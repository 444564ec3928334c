// The page: what its controls do.

import { View } from "./view.js";
import { draw, longest, tell } from "./path.js";
import { LESSONS, chapter } from "./lessons.js";
import { dropped, main, picked, save } from "./files.js";

const at = (id) => document.getElementById(id);
const picture = at("picture");
const overlay = at("overlay");
const kept = at("kept");
const view = new View(picture);
const address = new URL(location.href);

/** What is being explained: { x, y } of the picture's pixels, and what the renderer said. */
let explained;
let opened = { name: "picture", cameras: [] };
let size = [480, 270];

function fail(error) {
  at("error").textContent = error.message ?? String(error);
  at("error").hidden = false;
}

/** Does what the reader asked for; what goes wrong is shown, and what was on the screen stays. */
async function attempt(work) {
  at("error").hidden = true;
  try {
    return await work();
  } catch (error) {
    fail(error);
  }
}

/** Opens a scene: a built-in one by name, or one of some files. */
const open = (name, files) => attempt(async () => {
  at("status").textContent = `Opening ${name}…`;
  explain(undefined);
  opened = await view.ask("open", name, files);
  at("scene").value = files ? "" : name;
  at("camera").replaceChildren(...opened.cameras.map((camera, i) => new Option(camera || `camera ${i + 1}`, i)));
  at("camera").disabled = opened.cameras.length < 2;
  at("notes").replaceChildren(...opened.notes.map((note) => Object.assign(document.createElement("li"), { textContent: note })));
  at("notes-part").hidden = opened.notes.length === 0;
  for (const control of document.querySelectorAll("[data-setting]")) {
    if (control.dataset.touched) await set(control);
    else show(control, opened.settings[control.dataset.setting]);
  }
  if (at("exposure").dataset.touched) await setExposure();
  else at("exposure").value = Math.log2(opened.settings.exposure);
});

/** Shows a setting that the scene has itself. */
function show(control, value) {
  if (control.type === "checkbox") control.checked = value === "true";
  else control.value = value;
}

/** A setting's control tells the renderer. */
const set = (control) => {
  const value = control.type === "checkbox" ? control.checked : control.value;
  return view.ask("set", control.dataset.setting, value);
};
const setExposure = () => view.ask("set", "exposure", 2 ** at("exposure").value);
const want = () => view.ask("want", { spp: Number(at("spp").value) || 1, denoise: at("denoise").checked });

/** Gives a control a value, as the reader would. */
function put(name, value) {
  const control = document.querySelector(`[data-setting="${name}"]`) ?? at(name);
  show(control, String(value));
  control.dataset.touched = "1";
  return control;
}

/** Shows the path of a pixel; nothing without one. */
async function explain(pixel) {
  explained = undefined;
  at("path-controls").hidden = !pixel;
  at("path-hint").hidden = Boolean(pixel);
  if (pixel) {
    const explanation = await attempt(() => view.ask("explain", pixel.x, pixel.y, Number(at("sample").value) || 0));
    if (!explanation) return;
    explained = { pixel, explanation };
    at("vertices").max = longest(explanation);
    at("vertices").value = at("vertices").max;
  }
  showPath();
}

function showPath() {
  const vertices = Number(at("vertices").value);
  draw(overlay, explained?.explanation, vertices);
  tell(at("path"), explained?.explanation, vertices);
}

/** As large as there is room for, in a shape that screens have; not so large that a thread is busy for long. */
function fit() {
  const box = at("stage").getBoundingClientRect();
  const asked = Number(address.searchParams.get("width"));
  const width = Math.max(64, Math.min(asked || 640, Math.floor(box.width)));
  const height = Number(address.searchParams.get("height"))
    || Math.max(64, Math.min(Math.round(width * 0.75), Math.floor(box.height || width * 0.5625)));
  size = [width, height];
  [overlay.width, overlay.height] = size;
  explain(undefined);
  return view.ask("resize", ...size);
}

function status({ spp, speed, coarseness }) {
  const wanted = Number(at("spp").value) || 1;
  const rate = speed >= 1e6 ? `${(speed / 1e6).toFixed(1)} million` : `${Math.round(speed / 1e3)} thousand`;
  at("status").textContent = coarseness > 1 ? "Moving…" : `${spp} of ${wanted} samples, ${rate} a second`;
  at("progress").value = Math.min(1, spp / wanted);
  document.body.dataset.spp = spp;
  document.body.dataset.done = String(coarseness === 1 && spp >= wanted);
}

view.addEventListener("picture", ({ detail }) => {
  // A coarse picture is stretched to the size of the whole one.
  [picture.style.width, picture.style.height] = size.map((side) => `${side}px`);
  status(detail.progress);
});
view.addEventListener("progress", ({ detail }) => status(detail));
view.addEventListener("failed", ({ detail }) => fail(detail));
view.addEventListener("moved", () => explain(undefined));
view.addEventListener("pick", ({ detail }) => explain({
  x: Math.min(size[0] - 1, Math.floor(detail.x * size[0])), y: Math.min(size[1] - 1, Math.floor(detail.y * size[1])),
}));

for (const control of document.querySelectorAll("[data-setting]")) {
  control.addEventListener("change", () => {
    control.dataset.touched = "1";
    attempt(() => set(control));
  });
}
at("exposure").addEventListener("input", () => {
  at("exposure").dataset.touched = "1";
  attempt(setExposure);
});
for (const id of ["spp", "denoise"]) at(id).addEventListener("change", () => attempt(want));
at("scene").addEventListener("change", () => open(at("scene").value));
at("camera").addEventListener("change", () => attempt(() => view.ask("takeCamera", Number(at("camera").value))));
at("sample").addEventListener("change", () => explained && explain(explained.pixel));
at("vertices").addEventListener("input", showPath);
at("path-close").addEventListener("click", () => explain(undefined));
at("png").addEventListener("click", () => attempt(async () => {
  save(await view.ask("png", at("denoise").checked), `${opened.name || "picture"}.png`, "image/png");
}));
at("exr").addEventListener("click", () => attempt(async () => {
  save(await view.ask("exr"), `${opened.name || "picture"}.exr`, "image/x-exr");
}));
at("link").addEventListener("click", () => attempt(async () => {
  const link = new URL(location.pathname, location.href);
  if (at("scene").value) link.searchParams.set("scene", at("scene").value);
  const camera = (await view.ask("camera")).map((c) => Number(c.toPrecision(6)));
  link.searchParams.set("eye", camera.slice(0, 3).join());
  link.searchParams.set("target", camera.slice(3).join());
  for (const control of document.querySelectorAll("[data-touched]")) {
    const value = control.type === "checkbox" ? control.checked : control.value;
    link.searchParams.set(control.dataset.setting ?? control.id, value);
  }
  history.replaceState(null, "", link);
  await navigator.clipboard.writeText(link.href);
  at("status").textContent = "The link is in the clipboard";
}));

// Comparison: what was kept on the left of the slider, what is now on the right.
function split() {
  kept.style.clipPath = `inset(0 ${100 - at("split").value}% 0 0)`;
}
at("keep").addEventListener("click", () => {
  [kept.width, kept.height] = [picture.width, picture.height];
  kept.getContext("2d").drawImage(picture, 0, 0);
  [kept.style.width, kept.style.height] = size.map((side) => `${side}px`);
  kept.hidden = at("split-part").hidden = false;
  split();
});
at("split").addEventListener("input", split);

// Lessons.
at("lesson").append(new Option("—", ""), ...LESSONS.map((lesson, i) => new Option(lesson.title, i)));
at("lesson").addEventListener("change", () => begin(LESSONS[at("lesson").value]));

/** Opens the scene of a lesson, and offers its steps. */
const begin = (lesson) => attempt(async () => {
  if (!lesson) return at("lesson-text").replaceChildren();
  // A lesson begins with what its scene asks for.
  for (const control of document.querySelectorAll("[data-touched]")) delete control.dataset.touched;
  const files = lesson.file ? [await fetchFile(lesson.file)] : undefined;
  const text = document.createElement("p");
  const more = Object.assign(document.createElement("a"), { href: chapter(lesson), textContent: "The chapter", rel: "noopener" });
  const steps = lesson.steps.map((step) => {
    const button = Object.assign(document.createElement("button"), { textContent: step.name });
    button.addEventListener("click", () => attempt(() => take(lesson, step, text)));
    return button;
  });
  at("lesson-text").replaceChildren(...steps, text, more);
  await open(lesson.scene, files);
  await take(lesson, lesson.steps[0], text);
});

/** Makes the settings of a step. */
async function take(lesson, step, text) {
  text.textContent = step.text;
  put("spp", step.spp ?? lesson.spp);
  put("denoise", lesson.denoise ?? true);
  await want();
  for (const [name, value] of Object.entries(step.settings)) await set(put(name, value));
}

async function fetchFile(name) {
  const answer = await fetch(name);
  if (!answer.ok) throw new Error(`cannot fetch ${name}: ${answer.status}`);
  return { name, bytes: await answer.arrayBuffer() };
}

// Files.
const openFiles = (files) => attempt(async () => {
  const { model, light } = main(await files);
  if (model) await open(model.name, await files);
  else if (light) at("status").textContent = (await view.ask("lightBy", light.name, light.bytes)).join("; ");
  else throw new Error("there is no model and no environment among these files");
});
at("files").addEventListener("change", () => openFiles(picked(at("files").files)));
addEventListener("dragover", (event) => {
  event.preventDefault();
  at("drop").hidden = false;
});
addEventListener("dragleave", (event) => { if (!event.relatedTarget) at("drop").hidden = true; });
addEventListener("drop", (event) => {
  event.preventDefault();
  at("drop").hidden = true;
  openFiles(dropped(event.dataTransfer));
});

let resized;
addEventListener("resize", () => {
  clearTimeout(resized);
  resized = setTimeout(() => attempt(fit), 200);
});

attempt(async () => {
  await fit();
  const scenes = await view.ask("scenes");
  at("scene").append(new Option("—", ""), ...scenes.map(([name, about]) => {
    const option = new Option(name, name);
    option.title = about;
    return option;
  }));
  for (const [name, value] of address.searchParams) {
    if (document.querySelector(`[data-setting="${CSS.escape(name)}"]`) || ["spp", "exposure", "denoise"].includes(name)) put(name, value);
  }
  await want();
  const lesson = address.searchParams.get("lesson");
  if (lesson !== null && LESSONS[lesson]) {
    at("lesson").value = lesson;
    return begin(LESSONS[lesson]);
  }
  await open(address.searchParams.get("scene") || scenes[0][0]);
  const point = (name) => address.searchParams.get(name)?.split(",").map(Number);
  const [eye, target] = [point("eye"), point("target")];
  if (eye && target) await view.ask("lookAt", eye, target);
});

if ("serviceWorker" in navigator && location.protocol.startsWith("http")) {
  navigator.serviceWorker.register("sw.js").catch(() => {});
}
