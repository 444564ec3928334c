//! Optics values as the 32-bit words that shaders read and write.

use optics::material::ModelTag;
use optics::{Vec2f, Vec2u, Vec3f, Vec4f, Vec4i, Vec4u};

/// A value as words, field after field.
pub trait Words {
    /// Appends the words.
    fn put(&self, words: &mut Vec<u32>);

    /// Names of the fields of a structure, in order; empty for others.
    fn fields() -> &'static [&'static str] {
        &[]
    }
}

impl Words for f32 {
    fn put(&self, words: &mut Vec<u32>) {
        words.push(self.to_bits());
    }
}

impl Words for u32 {
    fn put(&self, words: &mut Vec<u32>) {
        words.push(*self);
    }
}

impl Words for i32 {
    fn put(&self, words: &mut Vec<u32>) {
        words.push(self.cast_unsigned());
    }
}

impl Words for Vec4u {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y, self.z, self.w]);
    }
}

impl Words for Vec4i {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y, self.z, self.w].map(i32::cast_unsigned));
    }
}

impl Words for bool {
    fn put(&self, words: &mut Vec<u32>) {
        words.push(u32::from(*self));
    }
}

impl Words for Vec2f {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y].map(f32::to_bits));
    }
}

impl Words for Vec2u {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y]);
    }
}

impl Words for Vec3f {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y, self.z].map(f32::to_bits));
    }
}

impl Words for Vec4f {
    fn put(&self, words: &mut Vec<u32>) {
        words.extend([self.x, self.y, self.z, self.w].map(f32::to_bits));
    }
}

impl Words for ModelTag {
    fn put(&self, words: &mut Vec<u32>) {
        words.push(*self as u32);
    }
}

impl<T: Words, const N: usize> Words for [T; N] {
    fn put(&self, words: &mut Vec<u32>) {
        self.iter().for_each(|value| value.put(words));
    }
}

macro_rules! structures {
    ($($name:ident in $module:ident { $($field:ident),* $(,)? })*) => {
        $(impl Words for optics::$module::$name {
            fn put(&self, words: &mut Vec<u32>) {
                $(self.$field.put(words);)*
            }

            fn fields() -> &'static [&'static str] {
                &[$(stringify!($field)),*]
            }
        })*

        /// Name and fields of every structure.
        fn structures() -> Vec<(&'static str, &'static [&'static str])> {
            vec![$((stringify!($name), optics::$module::$name::fields())),*]
        }
    };
}

structures! {
    RayShear in intersect { axis, shear }
    TriangleHit in intersect { t, u, v, hit }
    SphereHit in intersect { near, far, hit }
    BoxHit in intersect { near, far, hit }
    CameraFrame in camera { kind, origin, right, up, forward, half_size, lens_radius, focus_distance, distortion }
    AffineRows in motion { x, y, z }
    MotionSegment in motion {
        translation, translation_step, rotation, rotation_step, stretch, stretch_step, shear, shear_step
    }
    MotionPlace in motion { segment, fraction }
    CameraSegment in moving_camera { place, film, film_step, lens, lens_step }
    Shutter in shutter { open, duration, rise, fall, row_delay, column_delay }
    CameraRay in camera { origin, direction, weight }
    Distortion in distortion { model, skew, limit, radial, rest }
    LensDirection in distortion { direction, valid }
    Frame in frame { tangent, bitangent, normal }
    Light in light { kind, position, edge1, edge2, emission, size, two_sided }
    LightReach in light { center, radius }
    AxisBox in bounds { low, high }
    Shaft in shaft { low, high, low_step, high_step, known }
    ShaftEnds in shaft { low, high, end_low, end_high, size }
    ShaftRow in shaft { low, high, end_low, end_high, size }
    ShaftRay in shaft { low, high, low_inverse, high_inverse }
    ShaftInterval in shaft { first, last }
    SplitLight in signal { diffuse, specular, hit_distance }
    FoundLight in signal { diffuse, count, specular, hit_distance, squares, drawn, wanted }
    Signal in signal { diffuse, diffuse_deviation, specular, specular_deviation }
    History in history { diffuse, diffuse_count, specular, specular_count, moments, hit_distance }
    HistorySum in history { history, weight }
    Neighbourhood in accumulation { mean, mean_of_squares, brightest, luminance, count }
    SignalMean in accumulation { color, count, moments }
    ShownColors in antialiasing { mean, squares }
    FilterSum in spatial_filter { diffuse, specular, weights }
    Neighbours in rounds { mean, variance, weight }
    LightWay in light { direction, distance }
    LightSample in light { wi, distance, radiance, pdf, delta, barycentrics }
    LightGroup in light_tree { center, radius, intensity, axis, cos_spread, sin_spread, cos_emission, back }
    SphericalTriangle in spherical_triangle {
        a, b, c, nearness, volume, one_plus_ab, ac_plus_bc, half_turns, solid_angle,
    }
    SphericalRectangle in spherical_rectangle {
        first, size, height, difference, sum, cos_inner, start, half_turns, solid_angle,
    }
    ProfileCell in light_profile { first, second, third, fourth, down, across }
    EquirectPlace in equirect { left, right, top, bottom, across, down }
    NodeImportance in light_tree { sum, count }
    ChildChoice in light_tree { child, weight, before, end }
    LightBranch in light_tree { second, probability, remainder }
    TerminatorLift in terminator { offset, share }
    Reservoir in reservoir { chosen, weight, sum, remainder }
    Medium in volume { absorption, scattering, emission, anisotropy }
    Collision in volume { scattered, weight }
    GridPlace in volume { cell, next, beyond }
    Interiors in interiors { materials, priorities }
    Surroundings in interiors { around, passed, forgotten }
    MediumSample in volume { distance, scattered, weight }
    Roulette in vertex { start, min_survival }
    MisHeuristic in mis { lights, bsdfs, squared }
    GuideWalk in guiding { u, corner, size, density, child }
    GuideDescent in guiding { place, density, child }
    GuideSample in guiding { wi, pdf }
    LightSide in vertex { wi, above, possible }
    Continuation in vertex { state, wi, above, alive }
    PathState in path { throughput, radiance, pdf, specular, eta_scale, depth }
    Moments in estimator { count, mean, m2 }
    DielectricFresnel in fresnel { reflectance, cos_transmitted }
    Bsdf in scatter {
        kind, alpha, diffuse, diffuse_scale, diffuse_falloff, specular, specular_grazing, specular_probability, eta,
        compensation,
    }
    BsdfSample in scatter { wi, weight, pdf, delta, transmitted }
    BsdfValue in scatter { value_cos, pdf }
    LobeColors in scatter { diffuse, specular, roughness }
    TextureUse in image_texture { row_u, first_texel, row_v, flags, width, height, image, padding }
    Fractal in noise { kind, octaves, lacunarity, gain, turbulent, seed }
    VoronoiCell in voronoi { nearest, second, hash }
    Bricks in patterns { width, height, mortar, shift, seed }
    BrickShare in patterns { brick, tint }
    TexturePoint in texture_point {
        coords, color, position, width, world, object_density, normal, uv_density,
    }
    TextureNode in texture_node {
        row_x, row_y, row_z, low, high, operation, space, output, texture, a, b, c, offset, scale, padding0, padding1,
        padding2,
    }
    TexelFootprint in image_texture { x, y, right, below, bilinear }
    MaterialRecord in material {
        base_color, emission, model, metallic, roughness, specular, ior, transmission, normal_scale, alpha_cutoff, flags,
        checkerboard_even, checkerboard_scale, checkerboard_odd, tangent_turn, checkerboard_fade, medium, priority,
        absorption, layers, textures,
    }
    PlainPoint in plain {
        model, base_color, metallic, roughness, specular, ior, eta, thin, albedo_table,
    }
    LayersRecord in layers {
        specular_color, reflectance_ior, sheen_color, sheen_roughness, diffuse_transmission_color,
        diffuse_transmission, film_thickness, anisotropy_direction, anisotropy, coat, coat_roughness,
        coat_normal_scale, dispersion, iridescence, film_ior, diffuse_roughness, flags, padding0,
        padding1, padding2,
    }
    LayerTexels in layers { layers, metallic_roughness, transmission }
    SurfaceDirections in layers { wo, normal, shading_normal, layer_frame }
    LayeredPoint in layers { frame, wo, parameters, refraction_tint }
    MetallicRoughness in glossy { base_color, metallic, roughness, specular, ior }
    RoughDiffuse in oren_nayar { roughness, single, multiple }
    LayeredParameters in layered {
        base_color, metallic, roughness, diffuse_roughness, specular, specular_color, ior, anisotropy, transmission,
        diffuse_transmission, diffuse_transmission_color, sheen_color, sheen_roughness, coat, coat_roughness,
        coat_normal, iridescence, film_ior, film_thickness, eta, thin, inside,
    }
    LayeredAlbedos in layered { base, coat, sheen, whole_interface }
    Layered in layered {
        diffuse, diffuse_lobe, diffuse_below, widths, specular, specular_grazing, refracted, refracted_f0, refracted_f90, eta, sheen,
        sheen_alpha, coat, coat_grazing, coat_alpha, coat_normal, p_diffuse, p_diffuse_below, p_specular, p_refracted,
        p_sheen, p_coat,
    }
    Dispersed in layered { ior, tint }
    Closure in closure { layered, plain, layers, frame }
    AliasChoice in warp { index, remainder }
    PixelSampler in random { kind, scramble, index }
}

/// Fields are written in the order in which shaders construct them.
#[test]
fn fields_are_in_the_shaders_order() {
    let text = crate::shader::Text::new(optics::wgsl::all());
    let listed: std::collections::BTreeSet<_> =
        structures().iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(listed, text.structure_names(), "structures here and in the optics");
    for (name, fields) in structures() {
        assert_eq!(text.fields(name), fields, "fields of {name}");
    }
}
