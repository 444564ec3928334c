// The renderer's thread. Renders in slices, so that what the page asks for is done in between.
//
// Asked: { id, call, parameters }. Answered: { id, result } or { id, error }.
// Told without being asked: { picture: { width, height, pixels, progress, denoised } } and { failed }.

import init, { Page } from "./alhazen.js";

/** Milliseconds of a slice of rendering. */
const SLICE = 40;
/** Milliseconds between pictures, at least. */
const BETWEEN = 100;
/** So much longer than it takes to remove the noise, a picture without it is shown. */
const DENOISED_FOR = 6;

let page;
let ready;
let open = false;
let wanted = { spp: 256, denoise: true };
let running = false;
let shown = { at: 0, denoisedAt: -Infinity, denoisingTook: 0 };

const next = new MessageChannel();
next.port1.onmessage = slice;

/** Goes on rendering, if there is something to render. */
function wake() {
  if (open && !running) {
    running = true;
    next.port2.postMessage(null);
  }
}

/** Renders for a moment. */
function slice() {
  try {
    const progress = JSON.parse(page.render(wanted.spp, SLICE));
    const done = progress.coarseness === 1 && progress.spp >= wanted.spp;
    if (done || progress.coarseness > 1 || performance.now() - shown.at > BETWEEN) show(progress, done);
    if (done) running = false;
    else next.port2.postMessage(null);
  } catch (error) {
    running = false;
    postMessage({ failed: text(error) });
  }
}

/** Sends the picture to the page. */
function show(progress, done) {
  const now = performance.now();
  const worthIt = done || now - shown.denoisedAt > DENOISED_FOR * shown.denoisingTook;
  const denoise = wanted.denoise && progress.spp > 0 && progress.coarseness === 1;
  // As long as a picture without noise is shown, one with noise would be a step back.
  if (denoise && !worthIt) {
    postMessage({ progress });
    return;
  }
  const pixels = page.shown(denoise);
  const size = { width: page.shown_width, height: page.shown_height };
  shown.at = performance.now();
  if (denoise) [shown.denoisedAt, shown.denoisingTook] = [shown.at, shown.at - now];
  postMessage({ picture: { ...size, pixels, progress, denoised: denoise } }, [pixels.buffer]);
}

/** Begins the picture anew on the screen, too. */
function changed() {
  shown.denoisedAt = -Infinity;
  wake();
}

/** What the page can ask for. */
const calls = {
  scenes: () => JSON.parse(Page.scenes()),
  open(name, files) {
    if (files) {
      page.forget_files();
      for (const file of files) page.give(file.name, new Uint8Array(file.bytes));
    }
    const opened = JSON.parse(page.open(name));
    open = true;
    changed();
    return opened;
  },
  lightBy(name, bytes) {
    page.give(name, new Uint8Array(bytes));
    const notes = JSON.parse(page.light_by(name));
    changed();
    return notes;
  },
  resize(width, height) { page.resize(width, height); changed(); },
  orbit(x, y) { page.orbit(x, y); changed(); },
  pan(x, y) { page.pan(x, y); changed(); },
  dolly(steps) { page.dolly(steps); changed(); },
  lookAt(eye, target) { page.look_at(Float32Array.from(eye), Float32Array.from(target)); changed(); },
  takeCamera(index) { page.take_camera(index); changed(); },
  camera: () => Array.from(page.camera()),
  set(name, value) { page.set(name, String(value)); changed(); },
  want(change) { wanted = { ...wanted, ...change }; changed(); },
  png: (denoise) => page.png(denoise),
  exr: () => page.exr(),
  explain: (x, y, sample) => JSON.parse(page.explain(x, y, sample)),
};

const text = (error) => (error instanceof Error ? error.message : String(error));

onmessage = async ({ data: { id, call, parameters } }) => {
  try {
    ready ??= init({ module_or_path: new URL("alhazen_bg.wasm", import.meta.url) }).then(() => { page = new Page(); });
    await ready;
    postMessage({ id, result: calls[call](...parameters) });
  } catch (error) {
    postMessage({ id, error: text(error) });
  }
};
