//! pbrt-v4 scenes: the part of the format that most exported scenes use.
//!
//! Read are transforms, attributes, includes, the perspective and orthographic cameras, the film's size, samples and
//! depth, triangle and PLY meshes, spheres and disks, instances, the common materials with image and procedural textures, and the common lights.
//! Everything else is passed over and reported with its line.
//!
//! pbrt's world is left-handed. It is mirrored at x = 0 here, together with the camera, so that the picture is the same;
//! a camera that mirrors already, as many exporters write, leaves the world as it is.
//!
//! The data flow: `tokens` → `parser` (through included files) → this file's directives, with the state in `state` →
//! `shapes`, `materials`, `lights`, `camera`. Source: "pbrt-v4 Input File Format".

mod camera;
mod lights;
mod materials;
mod motion;
mod parameters;
mod parser;
mod shapes;
mod state;
mod textures;
mod tokens;
mod version;

use super::session::instance;
use super::{LoadError, LoadOptions, Loaded};
use crate::load::textures::TextureLoader;
use crate::origin::{Bounds, stored};
use crate::{GroupId, Instance, LoadReport, Mesh, MeshId, Portal, Scene, Texture};
use glam::{Affine3A, DAffine3, DMat3, DMat4, DVec3};
use parameters::Parameters;
use parser::Parser;
use state::{Active, State};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use tokens::{Place, Token, TokenKind};

/// Instances and shapes are limited to this many in all.
const MAX_INSTANCES: usize = 1 << 22;

/// Loads a pbrt-v4 scene and the files that it includes.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`] for the scene and what it includes; [`LoadError::Malformed`], with the
/// line, for what is not the format.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| load_bytes(path, options.read(path)?, options))
}

/// Loads a scene that is in memory already; `path` is where other files are looked for and what messages say.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(path: &Path, text: Vec<u8>, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let text = super::text::decoded(path, &text)?.into_owned();
        let is_version_3 = version::is_3(&text);
        let mut builder = Builder::new(Parser::new(path, text, options), options);
        builder.read().map_err(|error| if is_version_3 { version::explain(error) } else { error })?;
        if is_version_3 {
            builder.report.approximated(version::NOTE);
        }
        Ok(builder.finish())
    })
}

/// A mesh of an object, or of the world, where it was defined.
#[derive(Clone)]
struct PlacedShape {
    name: String,
    mesh: MeshId,
    /// To the object's space, or to the world.
    transform: DAffine3,
}

/// An object that can be placed.
#[derive(Clone, Default)]
struct ObjectShapes {
    shapes: Vec<PlacedShape>,
    /// What its instances are in, once there are any.
    group: Option<GroupId>,
}

/// Reads directives and makes the scene.
struct Builder<'o> {
    options: &'o LoadOptions,
    parser: Parser<'o>,
    report: LoadReport,
    scene: Scene,
    images: TextureLoader<'o>,
    textures: Vec<Texture>,
    state: State,
    stack: Vec<(State, Saved)>,
    /// Named coordinate systems.
    systems: HashMap<String, [DAffine3; 2]>,
    named_materials: HashMap<String, u32>,
    named_textures: HashMap<String, textures::Value>,
    /// Materials of shapes that shine, by what they are made of.
    shining: HashMap<(u32, [u32; 3], bool), u32>,
    camera: Option<camera::PendingCamera>,
    environment: Option<lights::PendingEnvironment>,
    objects: HashMap<String, ObjectShapes>,
    /// The object that is being defined.
    object: Option<(String, Vec<PlacedShape>)>,
    /// Mirrors pbrt's world into this one.
    mirror: DAffine3,
    /// Mesh to world, for each of the scene's instances.
    worlds: Vec<DAffine3>,
    /// The same at the end of their motion; `None` for what stands still.
    ends: Vec<Option<DAffine3>>,
    /// When motions begin and end, seconds.
    times: [f32; 2],
    /// When the shutter opens and closes, seconds.
    shutter: [f32; 2],
    /// World positions of the scene's lights.
    light_positions: Vec<DVec3>,
    /// Corners in the world.
    portal: Option<[DVec3; 4]>,
}

/// What an attribute block ends with.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Saved {
    Attributes,
    Transform,
}

impl<'o> Builder<'o> {
    fn new(parser: Parser<'o>, options: &'o LoadOptions) -> Self {
        let mut builder = Self {
            options,
            parser,
            report: LoadReport::default(),
            scene: Scene::default(),
            images: TextureLoader::new(options, 0),
            textures: Vec::new(),
            state: State::default(),
            stack: Vec::new(),
            systems: HashMap::new(),
            named_materials: HashMap::new(),
            named_textures: HashMap::new(),
            shining: HashMap::new(),
            camera: None,
            environment: None,
            objects: HashMap::new(),
            object: None,
            mirror: DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
            worlds: Vec::new(),
            ends: Vec::new(),
            times: [0.0, 1.0],
            shutter: [0.0, 1.0],
            light_positions: Vec::new(),
            portal: None,
        };
        builder.add_default_material();
        builder
    }

    fn read(&mut self) -> Result<(), LoadError> {
        while let Some(Token { kind, place }) = self.parser.next()? {
            let TokenKind::Word(directive) = kind else {
                return Err(self.parser.unexpected(
                    &place,
                    "a directive",
                    Some(Token { kind, place: place.clone() }),
                ));
            };
            self.directive(&directive, &place)?;
        }
        if let Some((name, _)) = &self.object {
            self.report.repaired(format!("the object `{name}` has no end"));
        }
        Ok(())
    }

    fn directive(&mut self, directive: &str, place: &Place) -> Result<(), LoadError> {
        match directive {
            "Identity" => self.state.change(|_, transform| *transform = DAffine3::IDENTITY),
            "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform" | "ConcatTransform" => {
                self.transform(directive, place)?;
            }
            "CoordinateSystem" => {
                let name = self.parser.text(place)?;
                self.systems.insert(name, [self.state.transform, self.state.end]);
            }
            "CoordSysTransform" => {
                let name = self.parser.text(place)?;
                match self.systems.get(&name) {
                    Some(system) => self.state.change(|at, transform| *transform = system[at]),
                    None => self.report.ignored(format!("{place}: there is no coordinate system `{name}`")),
                }
            }
            "ReverseOrientation" => self.state.reversed ^= true,
            "AttributeBegin" | "TransformBegin" | "AttributeEnd" | "TransformEnd" => {
                self.block(directive, place)?
            }
            "ObjectBegin" | "ObjectEnd" | "ObjectInstance" => self.object(directive, place)?,
            "Include" | "Import" => {
                let name = self.parser.text(place)?;
                self.parser.include(place, &name)?;
            }
            "WorldBegin" => self.begin_world(),
            "NamedMaterial" => {
                let name = self.parser.text(place)?;
                match self.named_materials.get(&name) {
                    Some(material) => self.state.material = Some(*material),
                    None => return Err(self.parser.error(place, format!("there is no material `{name}`"))),
                }
            }
            "MediumInterface" => self.medium_interface(place)?,
            "ActiveTransform" | "TransformTimes" => self.moving(directive, place)?,
            "ColorSpace" => {
                if self.parser.text(place)? != "srgb" {
                    self.report.approximated(format!("{place}: colours are taken as sRGB's"));
                }
            }
            "Attribute" => {
                let _target = self.parser.text(place)?;
                let parameters = self.parser.parameters(place)?;
                if parameters.unused().next().is_some() {
                    self.report.ignored(format!("{place}: Attribute has no effect"));
                }
            }
            "Option" => {
                let _ = self.parser.parameters(place)?;
                self.report.info("options of the renderer are not used");
            }
            "Camera" | "Film" | "Sampler" | "Integrator" | "PixelFilter" | "Accelerator" | "Shape"
            | "Material" | "MakeNamedMaterial" | "LightSource" | "AreaLightSource" | "MakeNamedMedium" => {
                let kind = self.parser.text(place)?;
                let parameters = self.parser.parameters(place)?;
                self.described(directive, &kind, &parameters)?;
                self.note_unused(directive, &kind, &parameters);
            }
            "Texture" => {
                let name = self.parser.text(place)?;
                let value_type = self.parser.text(place)?;
                let class = self.parser.text(place)?;
                let parameters = self.parser.parameters(place)?;
                self.add_texture(name, &value_type, &class, &parameters);
                self.note_unused("Texture", &class, &parameters);
            }
            other => return Err(self.parser.error(place, format!("the directive `{other}` does not exist"))),
        }
        Ok(())
    }

    /// A directive with a kind and parameters.
    fn described(&mut self, directive: &str, kind: &str, p: &Parameters) -> Result<(), LoadError> {
        match directive {
            "Camera" => self.set_camera(kind, p),
            "Film" => {
                self.scene.defaults.width = p.count("xresolution").or(self.scene.defaults.width);
                self.scene.defaults.height = p.count("yresolution").or(self.scene.defaults.height);
                let _ = (p.text("filename"), p.number("diagonal"));
            }
            "Sampler" => self.scene.defaults.spp = p.count("pixelsamples").or(self.scene.defaults.spp),
            // pbrt counts bounces; here, the segment to the light counts, too.
            "Integrator" => self.scene.defaults.max_depth = p.count("maxdepth").map(|d| d.saturating_add(1)),
            "PixelFilter" | "Accelerator" => {
                p.unused().count();
                self.report.info(format!("{directive} has no effect"));
            }
            "Material" => self.state.material = Some(self.material(kind, p)),
            "MakeNamedMaterial" => {
                let name = kind.to_owned();
                let kind = p.text("type").unwrap_or("diffuse").to_owned();
                let material = self.material(&kind, p);
                self.named_materials.insert(name, material);
            }
            "LightSource" => self.add_light(kind, p)?,
            "AreaLightSource" => self.set_area_light(kind, p),
            "Shape" => self.add_shape(kind, p)?,
            _ => self.report.ignored(format!("{}: media are not rendered", p.place)),
        }
        Ok(())
    }

    fn note_unused(&mut self, directive: &str, kind: &str, parameters: &Parameters) {
        if matches!(
            directive,
            "Film" | "Sampler" | "Integrator" | "PixelFilter" | "Accelerator" | "MakeNamedMedium"
        ) {
            return;
        }
        let names: Vec<&str> = parameters.unused().collect();
        if !names.is_empty() {
            let names = names.join(", ");
            self.report.ignored(format!("{}: {directive} {kind}: {names} has no effect", parameters.place));
        }
    }

    fn transform(&mut self, directive: &str, place: &Place) -> Result<(), LoadError> {
        let applied = match directive {
            "Translate" => DAffine3::from_translation(vector(self.parser.numbers(place)?)),
            "Scale" => DAffine3::from_scale(vector(self.parser.numbers(place)?)),
            "Rotate" => {
                let [degrees, x, y, z] = self.parser.numbers(place)?;
                let axis = vector([x, y, z]).try_normalize();
                let axis = axis.ok_or_else(|| self.parser.error(place, "the axis of a rotation is zero"))?;
                DAffine3::from_axis_angle(axis, f64::from(degrees).to_radians())
            }
            "LookAt" => {
                let [ex, ey, ez, lx, ly, lz, ux, uy, uz] = self.parser.numbers(place)?;
                let found = look_at(vector([ex, ey, ez]), vector([lx, ly, lz]), vector([ux, uy, uz]));
                found.ok_or_else(|| self.parser.error(place, "LookAt has no direction"))?
            }
            _ => {
                let columns = self.parser.numbers::<16>(place)?.map(f64::from);
                let matrix = DMat4::from_cols_array(&columns);
                if matrix.row(3) != glam::DVec4::W {
                    self.report
                        .repaired(format!("{place}: the last row of a matrix is taken as (0, 0, 0, 1)"));
                }
                DAffine3::from_mat4(matrix)
            }
        };
        self.state.change(|_, transform| {
            *transform = if directive == "Transform" { applied } else { *transform * applied };
        });
        if self.state.transform.is_finite() && self.state.end.is_finite() {
            return Ok(());
        }
        Err(self.parser.error(place, "the transform is not finite"))
    }

    fn block(&mut self, directive: &str, place: &Place) -> Result<(), LoadError> {
        const MAX_BLOCKS: usize = 1 << 14;
        let ends = match directive {
            "AttributeBegin" | "TransformBegin" => {
                let saved = if directive == "AttributeBegin" { Saved::Attributes } else { Saved::Transform };
                if self.stack.len() >= MAX_BLOCKS {
                    return Err(self.parser.error(place, format!("blocks are more than {MAX_BLOCKS} deep")));
                }
                self.stack.push((self.state.clone(), saved));
                return Ok(());
            }
            "AttributeEnd" => Saved::Attributes,
            _ => Saved::Transform,
        };
        match self.stack.pop() {
            Some((state, Saved::Attributes)) if ends == Saved::Attributes => self.state = state,
            Some((state, Saved::Transform)) if ends == Saved::Transform => {
                let State { transform, end, active, .. } = state;
                (self.state.transform, self.state.end, self.state.active) = (transform, end, active);
            }
            _ => return Err(self.parser.error(place, format!("{directive} has no beginning"))),
        }
        Ok(())
    }

    fn object(&mut self, directive: &str, place: &Place) -> Result<(), LoadError> {
        match directive {
            "ObjectBegin" => {
                let name = self.parser.text(place)?;
                if self.object.is_some() {
                    return Err(self.parser.error(place, "an object is defined inside another"));
                }
                self.stack.push((self.state.clone(), Saved::Attributes));
                self.object = Some((name, Vec::new()));
            }
            "ObjectEnd" => {
                let Some((name, shapes)) = self.object.take() else {
                    return Err(self.parser.error(place, "ObjectEnd has no beginning"));
                };
                if let Some((state, _)) = self.stack.pop() {
                    self.state = state;
                }
                self.objects.insert(name, ObjectShapes { shapes, group: None });
            }
            _ => {
                let name = self.parser.text(place)?;
                let Some(ObjectShapes { shapes, group }) = self.objects.get_mut(&name) else {
                    return Err(self.parser.error(place, format!("there is no object `{name}`")));
                };
                if self.scene.instances.len().saturating_add(shapes.len()) > MAX_INSTANCES {
                    return Err(self
                        .parser
                        .error(place, format!("there are more than {MAX_INSTANCES} instances")));
                }
                let size: u64 = shapes.iter().map(|shape| instance(shape.name.len())).sum();
                self.options.budget().take(size, "instances")?;
                let to_world = self.mirror * self.state.transform;
                let groups = Arc::make_mut(&mut self.scene.groups);
                let group = *group.get_or_insert_with(|| groups.add(name, None));
                let end = self.state.moves().then(|| self.mirror * self.state.end);
                for shape in &*shapes {
                    self.ends.push(end.map(|end| end * shape.transform));
                    groups.put(self.scene.instances.len() as u32, Some(group));
                    self.worlds.push(to_world * shape.transform);
                    let name = shape.name.clone();
                    self.scene.instances.push(Instance::new(name, shape.mesh, Affine3A::IDENTITY));
                }
            }
        }
        Ok(())
    }

    fn begin_world(&mut self) {
        self.systems.insert("world".into(), [DAffine3::IDENTITY; 2]);
        (self.state.transform, self.state.end) = (DAffine3::IDENTITY, DAffine3::IDENTITY);
        self.state.active = Active::All;
    }

    fn medium_interface(&mut self, place: &Place) -> Result<(), LoadError> {
        self.parser.text(place)?;
        // The outer medium may be left out: a string that follows is its name.
        if let Some(token) = self.parser.next()?
            && !matches!(token.kind, TokenKind::Text(_))
        {
            self.parser.put_back(token);
        }
        self.report.ignored(format!("{place}: media are not rendered"));
        Ok(())
    }

    /// Gives the scene its origin, and everything in it its place relative to it.
    fn place_all(&mut self) {
        let boxes: Vec<_> = self.scene.meshes.iter().map(Mesh::bounds).collect();
        let mut bounds = Bounds::default();
        for (instance, world) in self.scene.instances.iter().zip(&self.worlds) {
            if let Some((low, high)) = boxes[instance.mesh as usize] {
                bounds.add_box(world, low.as_dvec3(), high.as_dvec3());
            }
        }
        let origin = bounds.anchor();
        self.scene.set_origin(origin, &mut self.report);
        for (instance, world) in self.scene.instances.iter_mut().zip(&self.worlds) {
            instance.transform = stored(world, origin);
        }
        self.move_instances(origin);
        for (light, world) in self.scene.lights.iter_mut().zip(&self.light_positions) {
            *light = light.moved(&stored(&DAffine3::from_translation(*world), origin));
        }
        let portal = self.portal.map(|corners| corners.map(|corner| (corner - origin).as_vec3()));
        self.scene.portals = portal.and_then(|corners| Portal::new(corners).ok()).into_iter().collect();
    }

    fn finish(mut self) -> Loaded {
        self.report.bytes_read += self.parser.bytes_read;
        self.place_all();
        self.finish_camera();
        self.open_shutter();
        let images = std::mem::replace(&mut self.images, TextureLoader::new(self.options, 0));
        self.scene.images = images.finish(&mut self.report);
        self.finish_environment();
        self.scene.textures = self.textures;
        self.scene.declares_light =
            !self.scene.lights.is_empty() || self.scene.materials.iter().any(|m| m.is_emissive());
        Loaded { scene: self.scene, report: self.report }
    }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// World to camera, as pbrt has it: the camera looks along +z, y is up, x to the right.
fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    let forward = (target - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(forward).try_normalize()?;
    let up = forward.cross(right);
    let camera_to_world = DAffine3 { matrix3: DMat3::from_cols(right, up, forward), translation: eye };
    Some(camera_to_world.inverse())
}
