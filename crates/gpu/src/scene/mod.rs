//! A scene on the device: bind group 0.
//!
//! The tables become a few large buffers and textures. What users have most of, geometry, is pulled by vertex number from
//! one buffer that interleaves position, normal and texture coordinates; what only some scenes have lies in `words`.
//! Geometries and the bindings of instances to them are joined, so that a hit leads to its material and vertices in one
//! look-up.

pub mod materials;
pub mod media;
pub mod records;
pub mod texels;
mod textures;
mod traits;
pub mod update;
pub mod upload;
pub mod word_records;
pub mod words;

pub use traits::SceneTraits;

use crate::shader::Variant;
use crate::{Gpu, GpuError};
use optics::Vec3f;
use optics::light::LIGHT_ENVIRONMENT;
use records::SceneInfo;
use scene::tables::SceneTables;
use std::num::NonZero;
use std::sync::Arc;
use texels::TexelPlaces;
use textures::SceneTextures;
use upload::{roomy_buffer, storage_buffer};
use wgpu::BufferUsages;
use words::Words;

/// The buffers of bind group 0, for tracers that make their own bind groups of them.
pub struct SceneBuffers {
    /// Binding 0: [`SceneInfo`], uniform, or storage beside a binding array.
    pub info: wgpu::Buffer,
    /// Binding 1: [`records::Instance`]s.
    pub instances: wgpu::Buffer,
    /// Binding 2: [`records::Binding`]s.
    pub bindings: wgpu::Buffer,
    /// Binding 3: [`scene::tables::MaterialRecord`]s.
    pub materials: wgpu::Buffer,
    /// Binding 4: [`records::LightRecord`]s.
    pub lights: wgpu::Buffer,
    /// Binding 5: [`records::Vertex`]es.
    pub vertices: wgpu::Buffer,
    /// Binding 6.
    pub words: wgpu::Buffer,
}

/// A scene on the device.
pub struct GpuScene {
    /// What it was made of.
    pub tables: Arc<SceneTables>,
    /// Its buffers.
    pub buffers: SceneBuffers,
    /// Its textures, from binding 7 on.
    pub textures: SceneTextures,
    /// Layout of bind group 0.
    pub layout: wgpu::BindGroupLayout,
    /// Bind group 0.
    pub bind_group: wgpu::BindGroup,
    /// Where what is in the buffer of words.
    words: Words,
    places: TexelPlaces,
    /// Whether no surface is near a flat light, as far as that is known.
    far_lights: bool,
    /// What there is at all, and has been.
    traits: SceneTraits,
}

/// Refuses scenes in which paths have to know what they are in, for frames.
///
/// # Errors
/// [`GpuError::Scene`], if it is one.
pub(crate) fn refuse_volumes(tables: &SceneTables) -> Result<(), GpuError> {
    if tables.needs_volumes() {
        let what = "frames of scenes with media, their boundaries, or bodies with priorities";
        return Err(GpuError::Scene { what, instead: "`path`" });
    }
    Ok(())
}

impl GpuScene {
    /// Copies the tables to the device.
    ///
    /// # Errors
    /// When something is too large for the device or there is no memory; the error names it.
    pub fn upload(gpu: &Gpu, tables: Arc<SceneTables>) -> Result<Self, GpuError> {
        Self::upload_with_room(gpu, tables, 0)
    }

    /// As [`GpuScene::upload`], with room for so many more lights.
    ///
    /// # Errors
    /// As [`GpuScene::upload`].
    pub fn upload_with_room(gpu: &Gpu, tables: Arc<SceneTables>, more_lights: u32) -> Result<Self, GpuError> {
        let words = Words::new(&tables);
        let places = TexelPlaces::new(gpu, &tables);
        let info = scene_info(&tables, &words, &places);
        let instances = records::instances(&tables);
        let bindings = records::bindings(&tables, &words);
        let materials = materials::materials(&tables, &words);
        let lights = records::lights(&tables, &words);
        let none = BufferUsages::empty();
        // Ray queries build the driver's structures from the same buffers.
        let queries = gpu.features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY);
        let input = if queries { BufferUsages::BLAS_INPUT } else { none };
        let buffers = SceneBuffers {
            info: upload::empty_buffer(
                gpu,
                "scene constants",
                size_of::<SceneInfo>() as u64,
                BufferUsages::UNIFORM | BufferUsages::STORAGE,
            )?,
            instances: storage_buffer(gpu, "instances", &instances, BufferUsages::COPY_SRC)?,
            bindings: storage_buffer(gpu, "geometry bindings", &bindings, none)?,
            materials: storage_buffer(gpu, "materials", &materials, none)?,
            lights: roomy_buffer(
                gpu,
                "lights",
                &lights,
                u64::from(more_lights) * size_of::<records::LightRecord>() as u64,
                none,
            )?,
            vertices: storage_buffer(gpu, "vertices", &records::vertices(&tables), input)?,
            words: roomy_buffer(
                gpu,
                words.object(),
                &words.data,
                words::words_of_lights(more_lights),
                input,
            )?,
        };
        upload::write_buffer(gpu, "scene constants", &buffers.info, bytemuck::bytes_of(&info))?;
        let textures = SceneTextures::upload(gpu, &tables, &places)?;
        gpu.queue.submit([]);
        let (layout, bind_group) = gpu
            .guarded(|| {
                let layout = layout(gpu, places.slots(), wgpu::ShaderStages::COMPUTE);
                let group = bind_group(gpu, &layout, &buffers, &textures, places.slots());
                (layout, group)
            })
            .map_err(|reason| GpuError::Device { doing: "binding the scene", reason })?;
        gpu.check("uploading the scene")?;
        let words = words.without_data();
        // What moves may come near.
        let far_lights = tables.motion.is_none() && !tables.surfaces_may_be_near_flat_lights();
        let traits = SceneTraits::of(&materials, &bindings, &instances, &lights);
        Ok(Self { tables, buffers, textures, layout, bind_group, words, places, far_lights, traits })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        let b = &self.buffers;
        let buffers = [&b.info, &b.instances, &b.bindings, &b.materials, &b.lights, &b.vertices, &b.words];
        buffers.iter().map(|b| b.size()).sum::<u64>() + self.textures.memory_bytes()
    }

    /// Bind group 0 and its layout for vertex and fragment shaders.
    ///
    /// # Errors
    /// When the device fails.
    pub fn raster_group(&self, gpu: &Gpu) -> Result<(wgpu::BindGroupLayout, wgpu::BindGroup), GpuError> {
        gpu.guarded(|| {
            let layout = layout(gpu, self.places.slots(), wgpu::ShaderStages::VERTEX_FRAGMENT);
            let group = bind_group(gpu, &layout, &self.buffers, &self.textures, self.places.slots());
            (layout, group)
        })
        .map_err(|reason| GpuError::Device { doing: "binding the scene for the rasteriser", reason })
    }

    /// Which shader variant the scene needs, for any view, and for shaders that know nothing of media.
    pub fn variant(&self) -> Variant {
        Variant {
            images: self.places.slots(),
            scene_moves: self.tables.motion.is_some(),
            ..variant_of(&self.tables)
        }
    }

    /// As [`GpuScene::variant`], for shaders that are made anew when the scene becomes another: they know no lights and no
    /// surfaces but such as there are.
    pub fn special_variant(&self) -> Variant {
        Variant {
            light_list: self.tables.light_tree.list().map_or(0, |(_, lights)| lights as u32),
            light_kind: self.only_light_kind(),
            far_lights: self.far_lights,
            one_light: self.tables.lights.len() == 1,
            traits: self.traits,
            ..self.variant()
        }
    }

    /// The kind that all lights have but the environment, if it is one.
    fn only_light_kind(&self) -> Option<u32> {
        let mut kinds = self.tables.lights.iter().map(|l| l.light.kind).filter(|&k| k != LIGHT_ENVIRONMENT);
        let first = kinds.next()?;
        kinds.all(|kind| kind == first).then_some(first)
    }

    /// The views of binding 7: as many as [`Variant::images`] says, or one texture of layers.
    pub fn texel_views(&self) -> Vec<&wgpu::TextureView> {
        self.textures.texel_views(self.places.slots())
    }
}

/// What of a variant follows from the scene's tables alone. Shaders made for a scene fit all others with the same.
fn variant_of(tables: &SceneTables) -> Variant {
    Variant {
        alpha: tables.has_alpha,
        sphere_holes: tables.has_sphere_holes(),
        culled_backs: tables.culls_backs(),
        half_texels: tables.has_half_texels(),
        placements: !tables.placements.is_empty(),
        turned_tangents: tables.turns_tangents(),
        graphs: tables.has_graphs(),
        layers: !tables.layers.is_empty(),
        absorption: tables.has_absorption(),
        light_tree: !tables.light_tree.is_empty(),
        profiles: !tables.profiles.is_empty(),
        portals: !tables.environment.portals.is_empty(),
        smooth_terminators: tables.has_smooth_terminators(),
        // Any view may come.
        lens_distortion: true,
        indirect_limit: true,
        ..Variant::default()
    }
}

fn scene_info(tables: &SceneTables, words: &Words, places: &TexelPlaces) -> SceneInfo {
    let environment = &tables.environment;
    SceneInfo {
        horizon: Vec3f::from_array(environment.horizon),
        environment_width: environment.width,
        zenith: Vec3f::from_array(environment.zenith),
        environment_height: environment.height,
        ground: Vec3f::from_array(environment.ground),
        environment_rotation: environment.rotation,
        light_count: tables.lights.len() as u32,
        environment_light: environment.light,
        first_disc: words.discs,
        disc_count: words.disc_count,
        row_alias: words.row_alias,
        texel_width_log2: places.folding().map_or(0, |l| l.width_log2),
        texel_height: places.folding().map_or(1, |l| l.height),
        sheen_albedo: words.sheen_albedo,
        light_tree: words.light_tree,
        fog_medium: words.medium(tables.fog.medium),
        fog_top: tables.fog.top,
        volume_flags: if tables.nested { records::VOLUMES_NEST } else { 0 }
            | if tables.has_bodies() { records::VOLUMES_BODIES } else { 0 },
        first_portal: words.portals,
        portal_count: environment.portals.len() as u32,
        emitter_boxes: words.emitter_boxes,
        emitter_box_count: tables.emitter_boxes.len() as u32,
        light_list: records::light_list(&tables.light_tree),
        light_list_indices: records::light_list_indices(&tables.light_tree),
    }
}

/// Layout of bind group 0 for shaders of some stages; `images`: as in [`Variant`].
fn layout(gpu: &Gpu, images: u32, visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayout {
    let buffer = |binding: u32, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let texture = |binding: u32, sample_type, view_dimension| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false },
        count: None,
    };
    let storage = wgpu::BufferBindingType::Storage { read_only: true };
    let float = wgpu::TextureSampleType::Float { filterable: false };
    let (flat, array) = (wgpu::TextureViewDimension::D2, wgpu::TextureViewDimension::D2Array);
    let mut entries = vec![buffer(0, if images == 0 { wgpu::BufferBindingType::Uniform } else { storage })];
    entries.extend((1..=6).map(|binding| buffer(binding, storage)));
    entries.push(match NonZero::new(images) {
        None => texture(7, float, array),
        count => wgpu::BindGroupLayoutEntry { count, ..texture(7, float, flat) },
    });
    entries.push(texture(8, float, flat));
    entries.push(texture(9, wgpu::TextureSampleType::Uint, flat));
    entries.push(texture(10, float, flat));
    entries.push(texture(11, float, flat));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &entries,
    })
}

fn bind_group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    b: &SceneBuffers,
    t: &SceneTextures,
    images: u32,
) -> wgpu::BindGroup {
    let buffers = [&b.info, &b.instances, &b.bindings, &b.materials, &b.lights, &b.vertices, &b.words];
    let texels = t.texel_views(images);
    let texels = match texels[..] {
        [one] if images == 0 => wgpu::BindingResource::TextureView(one),
        _ => wgpu::BindingResource::TextureViewArray(&texels),
    };
    let resources = buffers
        .into_iter()
        .map(wgpu::Buffer::as_entire_binding)
        .chain([texels])
        .chain(t.table_views().into_iter().map(wgpu::BindingResource::TextureView));
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout,
        entries: &entries,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GpuOptions, LimitCaps, open_for_test};

    fn tables(scene: &scene::Scene) -> Arc<SceneTables> {
        Arc::new(SceneTables::build(scene))
    }

    #[test]
    fn images_are_textures_of_their_own_where_that_is_possible() {
        let name = "images_are_textures_of_their_own_where_that_is_possible";
        for features in [wgpu::Features::all(), wgpu::Features::all() - texels::BINDING_ARRAYS] {
            let options = GpuOptions { features, ..GpuOptions::default() };
            let Some(gpu) = open_for_test(name, &options) else { return };
            let images = |scene: &scene::Scene| {
                GpuScene::upload(&gpu, tables(scene)).expect("upload").variant().images
            };
            assert_eq!(images(&testkit::scenes::cornell()), 0, "it has none");
            let possible = gpu.features.contains(texels::BINDING_ARRAYS);
            assert_eq!(images(&testkit::scenes::assortment()), if possible { 16 } else { 0 });
            assert!(!possible || features == wgpu::Features::all());
        }
    }

    #[test]
    fn scenes_fit_on_the_device() {
        let Some(gpu) = open_for_test("scenes_fit_on_the_device", &GpuOptions::default()) else { return };
        for scene in [testkit::scenes::cornell(), scene::Scene::default()] {
            let uploaded = GpuScene::upload(&gpu, tables(&scene)).expect("upload");
            assert!(uploaded.memory_bytes() > 0);
        }
    }

    #[test]
    fn what_is_too_large_is_named() {
        let caps = LimitCaps { storage_binding_bytes: 1 << 16, ..LimitCaps::default() };
        let options = GpuOptions { limits: Some(caps), ..GpuOptions::default() };
        let Some(gpu) = open_for_test("what_is_too_large_is_named", &options) else { return };
        let error = GpuScene::upload(&gpu, tables(&testkit::scenes::glass())).err().expect("too large");
        assert!(matches!(error, GpuError::BufferTooLarge { limit: 65_536, .. }), "{error}");
        assert!(error.to_string().contains("vertices") && error.to_string().contains("65536"), "{error}");
        gpu.check("testing").expect("the device is still good");
    }

    #[test]
    fn densities_that_are_too_many_are_named() {
        let caps = LimitCaps { storage_binding_bytes: 1 << 16, ..LimitCaps::default() };
        let options = GpuOptions { limits: Some(caps), ..GpuOptions::default() };
        let Some(gpu) = open_for_test("densities_that_are_too_many_are_named", &options) else { return };
        let fog = |cells: u32| {
            let size = [cells, cells, cells];
            let values = vec![1.0; (cells * cells * cells) as usize];
            let density = scene::DensityGrid::new(size, [glam::Vec3::ZERO, glam::Vec3::ONE], values);
            let medium = scene::Medium { density: density.map(Arc::new), ..scene::Medium::default() };
            let fog = Some(scene::Fog { medium, top: f32::INFINITY });
            tables(&scene::Scene { fog, ..testkit::scenes::cornell() })
        };
        assert!(GpuScene::upload(&gpu, fog(16)).is_ok());
        let error = GpuScene::upload(&gpu, fog(32)).err().expect("too large");
        assert!(matches!(error, GpuError::BufferTooLarge { limit: 65_536, .. }), "{error}");
        assert!(error.to_string().contains("densities of grids"), "{error}");
    }

    #[test]
    fn an_environment_that_is_too_large_is_named() {
        let caps = LimitCaps { texture_side: 512, ..LimitCaps::default() };
        let options = GpuOptions { limits: Some(caps), ..GpuOptions::default() };
        let Some(gpu) = open_for_test("an_environment_that_is_too_large_is_named", &options) else { return };
        let mut scene = testkit::scenes::cornell();
        let pixels = scene::Pixels::Rgb32F(vec![[1.0; 3]; 1024 * 2]);
        scene.images.push(scene::Image { name: "sky".into(), width: 1024, height: 2, pixels });
        scene.environment = scene::Environment::Image { image: 0, rotation: 0.0, intensity: 1.0 };
        let error = GpuScene::upload(&gpu, tables(&scene)).err().expect("too large");
        assert!(matches!(error, GpuError::TextureTooLarge { width: 1024, limit: 512, .. }), "{error}");
    }
}
