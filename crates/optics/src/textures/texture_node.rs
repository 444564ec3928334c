//! Nodes of texture graphs: one operation on up to four values. Back ends go through a graph node by node.

use crate::materials::record::wgsl_records;
use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod texture_node {
    use crate::color_nodes::*;
    use crate::math::*;
    use crate::noise::*;
    use crate::pattern::*;
    use crate::patterns::*;
    use crate::texture_point::*;
    use crate::voronoi::*;
    use wgsl_rs::std::*;

    /// Values that a graph keeps at a time.
    pub const GRAPH_REGISTERS: u32 = 16u32;

    /// Coordinates of a node: the first set of texture coordinates, as x and y.
    pub const SPACE_UV0: u32 = 0u32;
    /// Coordinates of a node: the second set.
    pub const SPACE_UV1: u32 = 1u32;
    /// Coordinates of a node: the position in object space.
    pub const SPACE_OBJECT: u32 = 2u32;
    /// Coordinates of a node: the position in world space.
    pub const SPACE_WORLD: u32 = 3u32;

    /// Operation: `low`.
    pub const NODE_CONSTANT: u32 = 0u32;
    /// Operation: a texel, which the back end gives as `a`.
    pub const NODE_IMAGE: u32 = 1u32;
    /// Operation: texels of one image along x, y and z, which the back end gives as `a`, `b` and `c`.
    pub const NODE_TRIPLANAR: u32 = 2u32;
    /// Operation: the vertex colour.
    pub const NODE_VERTEX_COLOR: u32 = 3u32;
    /// Operation: the coordinates themselves.
    pub const NODE_COORDINATES: u32 = 4u32;
    /// Operation: `a` or `b` by the squares of a checkerboard.
    pub const NODE_CHECKERBOARD: u32 = 5u32;
    /// Operation: bricks between `a` and `b`, mortar `c`.
    pub const NODE_BRICKS: u32 = 6u32;
    /// Operation: dots `a` on `b`.
    pub const NODE_DOTS: u32 = 7u32;
    /// Operation: a gradient.
    pub const NODE_GRADIENT: u32 = 8u32;
    /// Operation: bands or rings.
    pub const NODE_WAVE: u32 = 9u32;
    /// Operation: fractal noise.
    pub const NODE_NOISE: u32 = 10u32;
    /// Operation: Voronoi cells.
    pub const NODE_VORONOI: u32 = 11u32;
    /// Operation: from `a` to `b` by `c`.
    pub const NODE_MIX: u32 = 12u32;
    /// Operation: `a + b`.
    pub const NODE_ADD: u32 = 13u32;
    /// Operation: `a − b`.
    pub const NODE_SUBTRACT: u32 = 14u32;
    /// Operation: `a · b`.
    pub const NODE_MULTIPLY: u32 = 15u32;
    /// Operation: the smaller of `a` and `b`.
    pub const NODE_MINIMUM: u32 = 16u32;
    /// Operation: the larger of `a` and `b`.
    pub const NODE_MAXIMUM: u32 = 17u32;
    /// Operation: `a`, not below 0, to the power of `b`.
    pub const NODE_POWER: u32 = 18u32;
    /// Operation: `1 − a`.
    pub const NODE_INVERT: u32 = 19u32;
    /// Operation: the magnitude of `a`.
    pub const NODE_MAGNITUDE: u32 = 20u32;
    /// Operation: maps a range of `a` to another one.
    pub const NODE_RANGE: u32 = 21u32;
    /// Operation: the colour of a black body of `a` kelvin.
    pub const NODE_BLACKBODY: u32 = 22u32;
    /// Operation: `a` with its hue, saturation and value changed.
    pub const NODE_HSV: u32 = 23u32;
    /// Operation: one channel of `a`.
    pub const NODE_CHANNEL: u32 = 24u32;
    /// Operation: red of `a`, green of `b`, blue of `c`.
    pub const NODE_COMBINE: u32 = 25u32;
    /// Operation: how far the surface faces a direction.
    pub const NODE_FACING: u32 = 26u32;

    /// One node of a graph. Inputs are registers, or `NONE`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct TextureNode {
        /// First row of the affine map from the coordinates' space to the pattern's.
        pub row_x: Vec4f,
        /// Second row.
        pub row_y: Vec4f,
        /// Third row.
        pub row_z: Vec4f,
        /// Parameters 0 to 3.
        pub low: Vec4f,
        /// Parameters 4 to 7.
        pub high: Vec4f,
        /// `NODE_…`.
        pub operation: u32,
        /// `SPACE_…`.
        pub space: u32,
        /// The register that the result goes to.
        pub output: u32,
        /// The image of those that have one: an index into the tables' `graph_textures`; on a device, where its use begins in
        /// `words`.
        pub texture: u32,
        /// First input.
        pub a: u32,
        /// Second input.
        pub b: u32,
        /// Third input.
        pub c: u32,
        /// Added to the coordinates.
        pub offset: u32,
        /// Length of the longest row: by how much the map enlarges footprints.
        pub scale: f32,
        /// Fills 16 bytes.
        pub padding0: u32,
        /// Fills 16 bytes.
        pub padding1: u32,
        /// Fills 16 bytes.
        pub padding2: u32,
    }

    /// A number as a value: in all channels.
    pub fn number_value(x: f32) -> Vec4f {
        vec4f(x, x, x, x)
    }

    /// A colour as a value: its alpha is 1.
    pub fn color_value(c: Vec3f) -> Vec4f {
        vec4f(c.x, c.y, c.z, 1.0)
    }

    /// The coordinates of a node's pattern. `offset`: the value of that input, zeros without one.
    pub fn node_coordinates(n: TextureNode, p: TexturePoint, offset: Vec4f) -> Vec3f {
        let mut x = vec3f(p.coords.x, p.coords.y, 0.0);
        if n.space == SPACE_UV1 {
            x = vec3f(p.coords.z, p.coords.w, 0.0);
        } else if n.space == SPACE_OBJECT {
            x = p.position;
        } else if n.space == SPACE_WORLD {
            x = p.world;
        }
        let h = vec4f(x.x, x.y, x.z, 1.0);
        vec3f(dot(n.row_x, h), dot(n.row_y, h), dot(n.row_z, h)) + vec3f(offset.x, offset.y, offset.z)
    }

    /// Width of the footprint in a node's coordinates.
    pub fn node_footprint(n: TextureNode, p: TexturePoint) -> f32 {
        let mut density = p.uv_density.x;
        if n.space == SPACE_UV1 {
            density = p.uv_density.y;
        } else if n.space == SPACE_OBJECT {
            density = p.object_density;
        } else if n.space == SPACE_WORLD {
            density = 1.0;
        }
        p.width * density * n.scale
    }

    /// The value of a node.
    ///
    /// - `a`, `b`, `c`, `offset`: values of its inputs, zeros without one; of [`NODE_IMAGE`] and [`NODE_TRIPLANAR`] texels.
    pub fn evaluate_node(
        n: TextureNode,
        p: TexturePoint,
        a: Vec4f,
        b: Vec4f,
        c: Vec4f,
        offset: Vec4f,
    ) -> Vec4f {
        if n.operation < NODE_CHECKERBOARD {
            return evaluate_source(n, p, a, b, c, offset);
        }
        if n.operation < NODE_MIX {
            return evaluate_pattern(n, node_coordinates(n, p, offset), node_footprint(n, p), a, b, c);
        }
        if n.operation < NODE_RANGE {
            return evaluate_arithmetic(n.operation, a, b, c);
        }
        if n.operation == NODE_FACING {
            let direction = vec3f(n.low.x, n.low.y, n.low.z);
            return number_value(abs(dot(direction, p.normal)) / max(length(direction), 1e-20));
        }
        evaluate_color(n, a, b, c)
    }

    /// As [`evaluate_node`], of what other nodes begin with.
    pub fn evaluate_source(
        n: TextureNode,
        p: TexturePoint,
        a: Vec4f,
        b: Vec4f,
        c: Vec4f,
        offset: Vec4f,
    ) -> Vec4f {
        if n.operation == NODE_CONSTANT {
            return n.low;
        }
        if n.operation == NODE_TRIPLANAR {
            let w = triplanar_weights(p.normal, n.low.x);
            return a * w.x + b * w.y + c * w.z;
        }
        if n.operation == NODE_VERTEX_COLOR {
            return p.color;
        }
        if n.operation == NODE_COORDINATES {
            return color_value(node_coordinates(n, p, offset));
        }
        a
    }

    /// Weights of the images that are projected along x, y and z. `sharpness`: 1 blends widely, 8 hardly.
    pub fn triplanar_weights(normal: Vec3f, sharpness: f32) -> Vec3f {
        let x = pow(abs(normal.x), sharpness);
        let y = pow(abs(normal.y), sharpness);
        let z = pow(abs(normal.z), sharpness);
        vec3f(x, y, z) * (1.0 / max(x + y + z, 1e-20))
    }

    /// The texture coordinates of an image that is projected along an axis: 0 is x. `x`: the node's coordinates.
    pub fn triplanar_coords(x: Vec3f, axis: u32) -> Vec4f {
        if axis == 0u32 {
            return vec4f(x.z, x.y, x.z, x.y);
        }
        if axis == 1u32 {
            return vec4f(x.x, x.z, x.x, x.z);
        }
        vec4f(x.x, x.y, x.x, x.y)
    }

    /// As [`evaluate_node`], of patterns. `x`: their coordinates, `width`: of the footprint there.
    pub fn evaluate_pattern(n: TextureNode, x: Vec3f, width: f32, a: Vec4f, b: Vec4f, c: Vec4f) -> Vec4f {
        let kind = u32(n.low.x);
        if n.operation == NODE_CHECKERBOARD {
            let mut odd = checkerboard(vec2f(x.x, x.y), width);
            if kind == 1u32 {
                odd = checkerboard_3d(x, width);
            }
            return a + (b - a) * odd;
        }
        if n.operation == NODE_BRICKS {
            let wall = Bricks {
                width: max(n.low.x, 1e-6),
                height: max(n.low.y, 1e-6),
                mortar: n.low.z,
                shift: n.low.w,
                seed: u32(n.high.x),
            };
            let share = brick_wall(wall, vec2f(x.x, x.y), width);
            return c + (a + (b - a) * share.tint - c) * share.brick;
        }
        if n.operation == NODE_DOTS {
            let share = dot_share(vec2f(x.x, x.y), width, n.low.x, n.low.y, u32(n.low.z));
            return b + (a - b) * share;
        }
        if n.operation == NODE_GRADIENT {
            return number_value(gradient_value(x, kind));
        }
        if n.operation == NODE_WAVE {
            let along = select(x.x, length(vec2f(x.x, x.y)), kind == 1u32);
            let saw = saw_mean(along, width);
            return number_value(select(sine_mean(along, width), saw, n.low.y == 1.0));
        }
        if n.operation == NODE_NOISE {
            return number_value(node_noise(n, x, width));
        }
        voronoi_value(n, x, width)
    }

    /// The value of [`NODE_NOISE`]: its range is mapped to that of the parameters.
    pub fn node_noise(n: TextureNode, x: Vec3f, width: f32) -> f32 {
        let f = Fractal {
            kind: u32(n.low.x),
            octaves: n.low.y,
            lacunarity: n.low.z,
            gain: n.low.w,
            turbulent: n.high.x == 1.0,
            seed: u32(n.high.w),
        };
        let value = fractal_noise(f, x, width);
        let share = select(0.5 + 0.5 * value, value, f.turbulent);
        n.high.y + (n.high.z - n.high.y) * share
    }

    /// The value of [`NODE_VORONOI`]: distance, distance from the edge, or a colour for each cell.
    pub fn voronoi_value(n: TextureNode, x: Vec3f, width: f32) -> Vec4f {
        let seen = octave_share(0.5 * width);
        let cell = voronoi_cell(x, n.low.y, u32(n.low.z));
        if n.low.x == 2.0 {
            let half = vec3f(0.5, 0.5, 0.5);
            return color_value(half + (hash_vector(cell.hash) - half) * seen);
        }
        // Means of both over space, where points are anywhere.
        let distance = select(cell.nearest, cell.second - cell.nearest, n.low.x == 1.0);
        let mean = select(0.55, 0.24, n.low.x == 1.0);
        number_value(mean + (distance - mean) * seen)
    }

    /// As [`evaluate_node`], of arithmetic.
    pub fn evaluate_arithmetic(operation: u32, a: Vec4f, b: Vec4f, c: Vec4f) -> Vec4f {
        if operation == NODE_MIX {
            return a + (b - a) * c;
        }
        if operation == NODE_ADD {
            return a + b;
        }
        if operation == NODE_SUBTRACT {
            return a - b;
        }
        if operation == NODE_MULTIPLY {
            return a * b;
        }
        if operation == NODE_MINIMUM {
            return min(a, b);
        }
        if operation == NODE_MAXIMUM {
            return max(a, b);
        }
        if operation == NODE_POWER {
            return vec4f(
                safe_power(a.x, b.x),
                safe_power(a.y, b.y),
                safe_power(a.z, b.z),
                safe_power(a.w, b.w),
            );
        }
        if operation == NODE_INVERT {
            return vec4f(1.0, 1.0, 1.0, 1.0) - a;
        }
        abs(a)
    }

    /// `x`, not below 0, to the power of `y`; 0 stays 0.
    pub fn safe_power(x: f32, y: f32) -> f32 {
        if x <= 0.0 {
            return 0.0;
        }
        pow(x, y)
    }

    /// As [`evaluate_node`], of what maps values and colours.
    pub fn evaluate_color(n: TextureNode, a: Vec4f, b: Vec4f, c: Vec4f) -> Vec4f {
        if n.operation == NODE_RANGE {
            return vec4f(map_range(n, a.x), map_range(n, a.y), map_range(n, a.z), map_range(n, a.w));
        }
        if n.operation == NODE_BLACKBODY {
            return color_value(blackbody_color(a.x));
        }
        if n.operation == NODE_HSV {
            let color = adjust_hsv(vec3f(a.x, a.y, a.z), n.low.x, n.low.y, n.low.z);
            return vec4f(color.x, color.y, color.z, a.w);
        }
        if n.operation == NODE_CHANNEL {
            let grey = luminance(vec3f(a.x, a.y, a.z));
            let channel = u32(n.low.x);
            let first = select(select(grey, a.x, channel == 0u32), a.y, channel == 1u32);
            return number_value(select(select(first, a.z, channel == 2u32), a.w, channel == 3u32));
        }
        vec4f(a.x, b.x, c.x, 1.0)
    }

    /// A number of [`NODE_RANGE`]: from the range of parameters 0 and 1 to that of 2 and 3, linearly, smoothly or by a step.
    pub fn map_range(n: TextureNode, x: f32) -> f32 {
        let width = n.low.y - n.low.x;
        let safe = select(width, 1e-20, width == 0.0);
        let mut t = saturate((x - n.low.x) / safe);
        if n.high.x == 1.0 {
            t = t * t * (3.0 - 2.0 * t);
        } else if n.high.x == 2.0 {
            t = select(0.0, 1.0, t >= 0.5);
        }
        n.low.z + (n.low.w - n.low.z) * t
    }

    /// The value of a graph as a material may use it: not negative, and not above 1 where it stands for a share.
    pub fn graph_value(value: Vec4f, is_share: bool) -> Vec4f {
        let most = select(1e9, 1.0, is_share);
        clamp(value, vec4f(0.0, 0.0, 0.0, 0.0), vec4f(most, most, most, most))
    }
}

use texture_node::TextureNode;

wgsl_records!(TextureNode);
