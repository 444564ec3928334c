//! The kinds of nodes: their names, inputs and parameters. Scene files, Python and the viewer read this table.
//!
//! A new node is a row here and an arm in the optics' `texture_node`.

use optics::texture_node::{
    NODE_ADD, NODE_BLACKBODY, NODE_BRICKS, NODE_CHANNEL, NODE_CHECKERBOARD, NODE_COMBINE, NODE_CONSTANT,
    NODE_COORDINATES, NODE_DOTS, NODE_FACING, NODE_GRADIENT, NODE_HSV, NODE_IMAGE, NODE_INVERT,
    NODE_MAGNITUDE, NODE_MAXIMUM, NODE_MINIMUM, NODE_MIX, NODE_MULTIPLY, NODE_NOISE, NODE_POWER, NODE_RANGE,
    NODE_SUBTRACT, NODE_TRIPLANAR, NODE_VERTEX_COLOR, NODE_VORONOI, NODE_WAVE,
};

/// What a node does, takes and may be told.
#[derive(Debug)]
pub struct NodeKind {
    /// Its name in files.
    pub name: &'static str,
    /// `NODE_…` of the optics.
    pub operation: u32,
    /// What it is for, in a sentence.
    pub purpose: &'static str,
    /// Values that it takes, at most three.
    pub inputs: &'static [InputKind],
    /// Numbers and choices, at most eight, in the order in which the optics have them.
    pub parameters: &'static [Parameter],
    /// Whether it has coordinates, so that it can be placed.
    pub is_placed: bool,
    /// Whether it shows an image.
    pub has_image: bool,
}

impl PartialEq for NodeKind {
    fn eq(&self, other: &Self) -> bool {
        self.operation == other.operation
    }
}

/// An input of a kind of nodes.
#[derive(Debug)]
pub struct InputKind {
    /// Its name in files.
    pub name: &'static str,
    /// Its value where nothing is connected, RGBA.
    pub default: [f32; 4],
}

/// A number or a choice of a kind of nodes.
#[derive(Debug)]
pub struct Parameter {
    /// Its name in files.
    pub name: &'static str,
    /// Its value where nothing is said.
    pub default: f32,
    /// Least and greatest value.
    pub range: [f32; 2],
    /// Names of the values 0, 1, …; empty for numbers.
    pub choices: &'static [&'static str],
    /// Whether only whole numbers differ.
    pub is_whole: bool,
}

impl Parameter {
    /// Whether it is no number but a switch: `false` or `true`.
    pub fn is_switch(&self) -> bool {
        self.choices == OFF_ON
    }
}

const fn number(name: &'static str, default: f32, range: [f32; 2]) -> Parameter {
    Parameter { name, default, range, choices: &[], is_whole: false }
}

const fn choice(name: &'static str, choices: &'static [&'static str]) -> Parameter {
    Parameter { name, default: 0.0, range: [0.0, (choices.len() - 1) as f32], choices, is_whole: true }
}

const fn input(name: &'static str, grey: f32) -> InputKind {
    InputKind { name, default: [grey, grey, grey, 1.0] }
}

/// Numbers whose size nobody limits but the arithmetic.
const ANY: [f32; 2] = [-1e6, 1e6];
const SEED: Parameter = Parameter { is_whole: true, ..number("seed", 0.0, [0.0, 65535.0]) };
const OFF_ON: &[&str] = &["false", "true"];
const A_B: &[InputKind] = &[input("a", 0.0), input("b", 0.0)];
const VALUE: &[InputKind] = &[input("input", 0.0)];

const fn arithmetic(
    name: &'static str,
    operation: u32,
    purpose: &'static str,
    inputs: &'static [InputKind],
) -> NodeKind {
    NodeKind { name, operation, purpose, inputs, parameters: &[], is_placed: false, has_image: false }
}

const fn mapping(
    name: &'static str,
    operation: u32,
    purpose: &'static str,
    inputs: &'static [InputKind],
    parameters: &'static [Parameter],
) -> NodeKind {
    NodeKind { name, operation, purpose, inputs, parameters, is_placed: false, has_image: false }
}

const fn pattern(
    name: &'static str,
    operation: u32,
    purpose: &'static str,
    inputs: &'static [InputKind],
    parameters: &'static [Parameter],
) -> NodeKind {
    NodeKind { name, operation, purpose, inputs, parameters, is_placed: true, has_image: false }
}

/// A value that is the same everywhere; files write it as a number or a colour.
pub static CONSTANT: NodeKind = mapping(
    "constant",
    NODE_CONSTANT,
    "One value everywhere.",
    &[],
    &[
        number("red", 0.0, ANY),
        number("green", 0.0, ANY),
        number("blue", 0.0, ANY),
        number("alpha", 1.0, ANY),
    ],
);

/// All kinds, in the order in which they are listed.
pub static KINDS: &[NodeKind] = &[
    NodeKind {
        name: "image",
        operation: NODE_IMAGE,
        purpose: "An image by its texture coordinates.",
        inputs: &[],
        parameters: &[],
        is_placed: false,
        has_image: true,
    },
    NodeKind {
        name: "triplanar",
        operation: NODE_TRIPLANAR,
        purpose: "An image projected along three axes, blended by the normal.",
        inputs: &[],
        parameters: &[number("sharpness", 4.0, [0.1, 64.0])],
        is_placed: true,
        has_image: true,
    },
    mapping("vertex-color", NODE_VERTEX_COLOR, "The colour that vertices have.", &[], &[]),
    pattern("coordinates", NODE_COORDINATES, "The coordinates as a colour.", &[], &[]),
    pattern(
        "checkerboard",
        NODE_CHECKERBOARD,
        "Squares, or cubes, of side 1.",
        &[input("a", 1.0), input("b", 0.0)],
        &[choice("cells", &["squares", "cubes"])],
    ),
    pattern(
        "bricks",
        NODE_BRICKS,
        "A wall of bricks whose tints lie between two values.",
        &[input("a", 0.6), input("b", 0.4), input("mortar", 0.8)],
        &[
            number("width", 0.5, [1e-6, 1e6]),
            number("height", 0.25, [1e-6, 1e6]),
            number("joint", 0.02, [0.0, 1e6]),
            number("shift", 0.5, [0.0, 1.0]),
            SEED,
        ],
    ),
    pattern(
        "dots",
        NODE_DOTS,
        "Dots, at most one in each square of side 1.",
        &[input("a", 1.0), input("b", 0.0)],
        &[number("radius", 0.35, [0.0, 0.5]), number("share", 0.5, [0.0, 1.0]), SEED],
    ),
    pattern(
        "gradient",
        NODE_GRADIENT,
        "From 0 to 1 along x, from the origin, or around z.",
        &[],
        &[choice("shape", &["linear", "quadratic", "easing", "diagonal", "spherical", "radial"])],
    ),
    pattern(
        "wave",
        NODE_WAVE,
        "Bands along x or rings around z, of period 1; with noise as offset, marble and wood.",
        &[],
        &[choice("shape", &["bands", "rings"]), choice("profile", &["sine", "saw"])],
    ),
    pattern(
        "noise",
        NODE_NOISE,
        "Octaves of noise (fBm), or of its magnitude (turbulence), from low to high.",
        &[],
        &[
            Parameter { default: 1.0, ..choice("kind", &["value", "perlin", "simplex"]) },
            number("octaves", 4.0, [1.0, 16.0]),
            number("lacunarity", 2.0, [1.0, 8.0]),
            number("gain", 0.5, [0.0, 1.0]),
            choice("turbulence", OFF_ON),
            number("low", 0.0, ANY),
            number("high", 1.0, ANY),
            SEED,
        ],
    ),
    pattern(
        "voronoi",
        NODE_VORONOI,
        "Cells around scattered points: distance from the point, from the edge, or a colour for each.",
        &[],
        &[choice("output", &["distance", "edge", "color"]), number("randomness", 1.0, [0.0, 1.0]), SEED],
    ),
    arithmetic(
        "mix",
        NODE_MIX,
        "From a to b by a factor.",
        &[input("a", 0.0), input("b", 1.0), input("factor", 0.5)],
    ),
    arithmetic("add", NODE_ADD, "a + b.", A_B),
    arithmetic("subtract", NODE_SUBTRACT, "a - b.", A_B),
    arithmetic("multiply", NODE_MULTIPLY, "a times b.", &[input("a", 1.0), input("b", 1.0)]),
    arithmetic("minimum", NODE_MINIMUM, "The smaller one.", A_B),
    arithmetic("maximum", NODE_MAXIMUM, "The larger one.", A_B),
    arithmetic("power", NODE_POWER, "a to the power of b.", &[input("a", 1.0), input("b", 1.0)]),
    arithmetic("invert", NODE_INVERT, "1 - input.", VALUE),
    arithmetic("magnitude", NODE_MAGNITUDE, "The value without its sign.", VALUE),
    mapping(
        "range",
        NODE_RANGE,
        "Maps one range to another, linearly, smoothly or by a step in its middle.",
        VALUE,
        &[
            number("from-low", 0.0, ANY),
            number("from-high", 1.0, ANY),
            number("to-low", 0.0, ANY),
            number("to-high", 1.0, ANY),
            choice("interpolation", &["linear", "smooth", "step"]),
        ],
    ),
    mapping(
        "blackbody",
        NODE_BLACKBODY,
        "The colour, of luminance 1, of a temperature in kelvin.",
        &[input("temperature", 6500.0)],
        &[],
    ),
    mapping(
        "hsv",
        NODE_HSV,
        "Turns the hue (in turns) and multiplies saturation and value.",
        VALUE,
        &[number("hue", 0.0, ANY), number("saturation", 1.0, [0.0, 1e6]), number("value", 1.0, [0.0, 1e6])],
    ),
    mapping(
        "channel",
        NODE_CHANNEL,
        "One channel in all of them.",
        VALUE,
        &[choice("channel", &["red", "green", "blue", "alpha", "luminance"])],
    ),
    arithmetic(
        "combine",
        NODE_COMBINE,
        "A colour of three numbers.",
        &[input("red", 0.0), input("green", 0.0), input("blue", 0.0)],
    ),
    mapping(
        "facing",
        NODE_FACING,
        "How far the surface faces a direction of its object: 1 along it, 0 across.",
        &[],
        &[number("x", 0.0, ANY), number("y", 1.0, ANY), number("z", 0.0, ANY)],
    ),
];

/// The kind of a name.
pub fn kind_named(name: &str) -> Option<&'static NodeKind> {
    KINDS.iter().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_as_the_records_need_them() {
        let mut operations: Vec<u32> = KINDS.iter().map(|k| k.operation).collect();
        operations.sort_unstable();
        operations.dedup();
        assert_eq!(operations.len(), KINDS.len(), "each has an operation of its own");
        for kind in KINDS {
            assert!(kind.inputs.len() <= 3 && kind.parameters.len() <= 8, "{}", kind.name);
            for p in kind.parameters {
                let [low, high] = p.range;
                assert!(low <= p.default && p.default <= high, "{}: {}", kind.name, p.name);
            }
            assert!(std::ptr::eq(kind_named(kind.name).unwrap(), kind));
        }
    }
}
