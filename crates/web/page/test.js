// The page's test: `cargo xtask web --test` opens it. Pictures go to the server, which compares them with those of the machine;
// what the page itself does is checked here.

import { View } from "./view.js";
import "./element.js";

const [WIDTH, HEIGHT, SPP] = [64, 36, 2];
const DROPPED = [
  ["model/triangle.obj", "mtllib triangle.mtl\nusemtl red\nv -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n"],
  ["model/triangle.mtl", "newmtl red\nKd 0.8 0.1 0.1\n"],
];
/** A main thread that is away for longer than this, milliseconds, drops frames. */
const FRAME = 16;

const send = (name, body) => fetch(`sent/${name}`, { method: "POST", body });
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const event = (target, type, wanted = () => true) => new Promise((resolve, reject) => {
  const late = setTimeout(() => reject(new Error(`no ${type} within four minutes`)), 240_000);
  const listen = (event) => {
    if (!wanted(event.detail)) return;
    clearTimeout(late);
    target.removeEventListener(type, listen);
    resolve(event.detail);
  };
  target.addEventListener(type, listen);
});
async function until(what, condition, seconds = 120) {
  for (let i = 0; i < seconds * 20; i++) {
    if (condition()) return;
    await sleep(50);
  }
  throw new Error(`${what}: not within ${seconds} s`);
}
function check(holds, message) {
  if (!holds) throw new Error(message);
}

async function pictures() {
  const view = new View(document.createElement("canvas"));
  await view.ask("resize", WIDTH, HEIGHT);
  await view.ask("want", { spp: SPP, denoise: false });
  const scenes = (await view.ask("scenes")).map(([name]) => name);
  await send("list", JSON.stringify([...scenes, "dropped"].map((name) => `${name}.exr`)));
  const make = async (name, ...opened) => {
    const done = event(view, "picture", ({ progress }) => progress.coarseness === 1 && progress.spp >= SPP);
    await view.ask("open", ...opened);
    await done;
    await send(`${name}.exr`, await view.ask("exr"));
  };
  for (const name of scenes) await make(name, name);
  const files = DROPPED.map(([name, text]) => ({ name, bytes: new TextEncoder().encode(text).buffer }));
  await make("dropped", DROPPED[0][0], files);
  view.close();
}

/** The page in a frame, when its picture is done. */
async function page(query, width = 1000, height = 700) {
  const frame = Object.assign(document.createElement("iframe"), { src: `index.html?${query}`, width, height });
  document.body.append(frame);
  await event(frame, "load");
  const inner = frame.contentDocument;
  return { frame, document: inner, at: (id) => inner.getElementById(id), done: () => until("the picture", () => inner.body.dataset.done === "true") };
}
const pixels = (canvas) => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.join();
const press = ({ at, frame }, key) => at("picture").dispatchEvent(new frame.contentWindow.KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
const choose = (control, value) => {
  control.value = value;
  control.dispatchEvent(new Event("change", { bubbles: true }));
};
const SMALL = "width=160&height=90&spp=4&denoise=false";

const tests = {
  async "the keyboard turns the camera and explains a pixel"() {
    const opened = await page(`${SMALL}&scene=cornell`);
    await opened.done();
    const before = pixels(opened.at("picture"));
    press(opened, "ArrowRight");
    await until("another picture", () => opened.document.body.dataset.done === "true" && pixels(opened.at("picture")) !== before);
    press(opened, "Enter");
    await until("a path", () => opened.at("path").querySelectorAll("tr").length > 5);
    const text = opened.at("path").textContent;
    check(text.includes("throughput") && text.includes("the end"), text);
    const rows = opened.at("path").querySelectorAll("tr").length;
    opened.at("vertices").value = 1;
    opened.at("vertices").dispatchEvent(new Event("input"));
    check(opened.at("path").querySelectorAll("tr").length < rows, "one vertex has as many rows as all");
    opened.frame.remove();
  },
  async "the wheel goes nearer"() {
    const opened = await page(`${SMALL}&scene=three-spheres`);
    await opened.done();
    const before = pixels(opened.at("picture"));
    opened.at("picture").dispatchEvent(new opened.frame.contentWindow.WheelEvent("wheel", { deltaY: -300, cancelable: true }));
    await until("another picture", () => opened.document.body.dataset.done === "true" && pixels(opened.at("picture")) !== before);
    opened.frame.remove();
  },
  async "a lesson sets the scene and its settings"() {
    const opened = await page(`${SMALL}&lesson=4`);
    await opened.done();
    await until("the lesson's weighting", () => opened.document.querySelector('[data-setting="mis"]').value === "light");
    const alone = pixels(opened.at("picture"));
    const both = [...opened.document.querySelectorAll("#lesson-text button")].find((b) => b.textContent.startsWith("Both"));
    both.click();
    await until("another picture", () => opened.document.body.dataset.done === "true" && pixels(opened.at("picture")) !== alone);
    check(opened.document.querySelector('[data-setting="mis"]').value === "power", "the control shows it");
    opened.at("keep").click();
    check(!opened.at("kept").hidden && !opened.at("split-part").hidden, "what was kept is there");
    opened.frame.remove();
  },
  async "the denoiser takes noise away"() {
    const opened = await page("width=160&height=90&spp=1&denoise=false&scene=cornell");
    await opened.done();
    const roughness = () => {
      const data = opened.at("picture").getContext("2d").getImageData(0, 0, 160, 90).data;
      let sum = 0;
      for (let i = 4; i < data.length; i += 4) sum += Math.abs(data[i] - data[i - 4]);
      return sum;
    };
    const noisy = roughness();
    opened.at("denoise").click();
    await until("a clean picture", () => roughness() < 0.6 * noisy);
    opened.frame.remove();
  },
  async "a scene that does not exist is an error that can be read, and the page goes on"() {
    const opened = await page(`${SMALL}&scene=no-such-scene`);
    await until("a message", () => !opened.at("error").hidden);
    check(opened.at("error").textContent.includes("no-such-scene"), opened.at("error").textContent);
    choose(opened.at("scene"), "cornell");
    await opened.done();
    check(opened.at("error").hidden, "the message is gone");
    opened.frame.remove();
  },
  async "every control has a name for screen readers, and can be reached by the keyboard"() {
    const opened = await page(`${SMALL}&scene=cornell`);
    const controls = [...opened.document.querySelectorAll("button, input, select, canvas[tabindex]")];
    check(controls.length > 15, `only ${controls.length} controls`);
    for (const control of controls) {
      const name = control.getAttribute("aria-label") || control.textContent.trim() || [...control.labels ?? []].map((l) => l.textContent.trim()).join();
      check(name, `no name: ${control.outerHTML}`);
      check(control.tabIndex >= 0, `not by the keyboard: ${control.outerHTML}`);
    }
    opened.frame.remove();
  },
  async "a phone sees all of it"() {
    const opened = await page("spp=2&denoise=false&scene=cornell", 390, 760);
    await opened.done();
    const root = opened.document.scrollingElement;
    check(root.scrollWidth <= 390, `${root.scrollWidth} pixels wide`);
    const canvas = opened.at("picture").getBoundingClientRect();
    check(canvas.width > 200 && canvas.right <= 390, `the picture is ${canvas.width} wide`);
    opened.frame.width = 760;
    opened.frame.height = 390;
    await sleep(600);
    await opened.done();
    check(opened.document.scrollingElement.scrollWidth <= 760, "turned, it is too wide");
    opened.frame.remove();
  },
  async "the page answers while it renders"() {
    const opened = await page("width=640&height=360&spp=4096&scene=cornell");
    await until("a picture", () => Number(opened.document.body.dataset.spp) >= 1);
    const delays = [];
    for (let i = 0; i < 200; i++) {
      const begun = performance.now();
      await sleep(5);
      delays.push(performance.now() - begun - 5);
    }
    delays.sort((a, b) => a - b);
    const high = delays[Math.floor(0.95 * delays.length)];
    check(high < FRAME, `one in twenty waits took ${high.toFixed(1)} ms more than it should`);
    opened.frame.remove();
    return `${high.toFixed(1)} ms`;
  },
  async "an element shows a scene in any page"() {
    const element = document.createElement("alhazen-view");
    for (const [name, value] of [["src", "cornell"], ["width", "80"], ["height", "60"], ["spp", "2"]]) element.setAttribute(name, value);
    const shown = event(element, "picture", ({ progress }) => progress.coarseness === 1 && progress.spp >= 2);
    document.body.append(element);
    const { width, height } = await shown;
    check(width === 80 && height === 60, `${width}×${height}`);
    element.remove();
  },
  async "what the renderer refuses is an error with its words"() {
    const view = new View(document.createElement("canvas"));
    await view.ask("open", "cornell");
    const refused = await view.ask("set", "mis", "both").catch((error) => error.message);
    check(refused?.includes("both") && refused.includes("balance"), String(refused));
    view.close();
  },
  async "it is there without a network after the first visit"() {
    await navigator.serviceWorker.register("sw.js");
    await navigator.serviceWorker.ready;
    for (const file of ["./", "index.html", "main.js", "worker.js", "alhazen_bg.wasm", "mis.toml"]) {
      check(await caches.match(file), `${file} is not kept`);
    }
  },
};

const [passed, failed] = [[], []];
try {
  await pictures();
} catch (error) {
  failed.push(`pictures: ${error.message}`);
}
for (const [name, test] of Object.entries(tests)) {
  try {
    const figure = await test();
    passed.push(figure ? `${name} (${figure})` : name);
  } catch (error) {
    failed.push(`${name}: ${error.message}`);
  }
}
await send("report", JSON.stringify({ passed, failed }));
