// <alhazen-view>: a scene in any page.
//
//   <script type="module" src="element.js"></script>
//   <alhazen-view src="model.glb" width="640" height="360"></alhazen-view>
//
// `src` is a file of the same site, or the name of a built-in scene. `spp` is how many samples a pixel gets, `denoise="off"`
// shows the noise. Events are those of View (view.js), and `opened`.

import { View } from "./view.js";

class AlhazenView extends HTMLElement {
  static observedAttributes = ["src"];

  connectedCallback() {
    const canvas = document.createElement("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", this.getAttribute("alt") ?? "A rendered scene; arrow keys turn it");
    Object.assign(canvas.style, { touchAction: "none", maxWidth: "100%" });
    this.replaceChildren(canvas);
    this.view = new View(canvas);
    for (const type of ["picture", "progress", "failed", "pick", "moved"]) {
      this.view.addEventListener(type, ({ detail }) => this.dispatchEvent(new CustomEvent(type, { detail })));
    }
    this.#open();
  }

  disconnectedCallback() {
    this.view?.close();
    this.view = undefined;
  }

  attributeChangedCallback() {
    if (this.view) this.#open();
  }

  async #open() {
    const number = (name, usual) => Number(this.getAttribute(name)) || usual;
    const source = this.getAttribute("src") ?? "three-spheres";
    try {
      await this.view.ask("resize", number("width", 640), number("height", 360));
      await this.view.ask("want", { spp: number("spp", 256), denoise: this.getAttribute("denoise") !== "off" });
      const isFile = source.includes(".") || source.includes("/");
      const files = isFile ? [await fetched(source)] : undefined;
      const opened = await this.view.ask("open", isFile ? files[0].name : source, files);
      this.dispatchEvent(new CustomEvent("opened", { detail: opened }));
    } catch (error) {
      this.dispatchEvent(new CustomEvent("failed", { detail: error.message }));
    }
  }
}

/** A file of this site, as the worker takes it. */
async function fetched(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`cannot fetch ${address}: ${answer.status}`);
  return { name: address.split("/").pop(), bytes: await answer.arrayBuffer() };
}

customElements.define("alhazen-view", AlhazenView);
