// Lessons of the course (docs/learn) that a page can show: a scene, settings, and what to look at. Each step changes the
// settings; what a step leaves out is as in the step before.

const CHAPTERS = "https://github.com/alhazen-render/alhazen/blob/main/docs/learn/";

export const LESSONS = [
  {
    title: "Rays and triangles", chapter: "01-rays-and-triangles.md", scene: "model", spp: 64,
    steps: [
      { name: "First hits", settings: { integrator: "ao" },
        text: "Every pixel sends a ray and asks what it meets first. Here each hit only says how much of the sky it sees." },
      { name: "Light", settings: { integrator: "path" },
        text: "The same rays, followed on: what they meet sends light to the camera. Click a pixel to see its path." },
    ],
  },
  {
    title: "BRDFs and energy", chapter: "04-brdfs-and-energy.md", scene: "material-grid", spp: 128,
    steps: [
      { name: "Light is lost", settings: { "single-scatter": true },
        text: "Light that bounces more than once between the facets of a rough surface is left out: rough metal is too dark." },
      { name: "Light is kept", settings: { "single-scatter": false },
        text: "With what the missing bounces bring. Keep the first picture and move the slider." },
    ],
  },
  {
    title: "Monte Carlo and noise", chapter: "05-monte-carlo.md", scene: "cornell", denoise: false,
    steps: [
      { name: "1 sample", spp: 1, settings: { sampler: "independent" }, text: "One path a pixel. Its light is right on average." },
      { name: "16 samples", spp: 16, settings: {}, text: "Sixteen times the work, a quarter of the noise." },
      { name: "256 samples", spp: 256, settings: {}, text: "Again sixteen times the work, again a quarter." },
      { name: "16 Sobol points", spp: 16, settings: { sampler: "sobol" },
        text: "As many samples as in the second step, but well spread: less noise for the same work." },
    ],
  },
  {
    title: "Importance sampling", chapter: "06-importance-sampling.md", scene: "cornell", spp: 16, denoise: false,
    steps: [
      { name: "By chance", settings: { mis: "bsdf" }, text: "Paths go where surfaces scatter, and meet the lamp by chance." },
      { name: "By the lamp", settings: { mis: "light" },
        text: "At every vertex a point of the lamp is drawn and joined: the same mean, far less noise." },
    ],
  },
  {
    title: "Lights and MIS", chapter: "07-lights-and-mis.md", scene: "mis.toml", file: "mis.toml", spp: 16, denoise: false,
    steps: [
      { name: "Lights only", settings: { mis: "light" },
        text: "Four lamps of equal power, four plates. The huge lamp in the polished plate (above, right) is noise." },
      { name: "BSDFs only", settings: { mis: "bsdf" },
        text: "Now the tiny lamp on the matt plate (below, left) is noise: a direction that the plate draws almost never meets it." },
      { name: "Both, weighted", settings: { mis: "power" },
        text: "Each sample is weighted by how likely the other way would have found it. No corner is bad. Click a plate: the table "
          + "shows both samples at each vertex, with densities and weights." },
    ],
  },
  {
    title: "Roulette and splitting", chapter: "08-roulette-and-splitting.md", scene: "cornell", spp: 64, denoise: false,
    steps: [
      { name: "Cut off", settings: { "max-depth": 3 },
        text: "Paths end after three segments. What longer ones would bring is missing: the picture is wrong, and no number of "
          + "samples mends it." },
      { name: "Roulette", settings: { "max-depth": 32, "roulette-start": 5 },
        text: "Weak paths end by chance, and those that go on count more. The mean is right." },
      { name: "Splitting", spp: 16, settings: { splitting: 4 },
        text: "Four paths from each first hit: the camera ray is shared, the light that comes there is sampled four times." },
    ],
  },
  {
    title: "Dielectrics", chapter: "09-dielectrics.md", scene: "glass", spp: 64,
    steps: [
      { name: "Glass", settings: {},
        text: "Click the glass and step through the vertices: at each one the path is reflected or refracted, by a number that "
          + "Fresnel's equations weigh." },
    ],
  },
];

/** Where a lesson's chapter is. */
export const chapter = (lesson) => CHAPTERS + lesson.chapter;
