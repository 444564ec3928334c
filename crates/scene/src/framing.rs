//! The camera of a scene that has none: it looks from the front right, slightly above, and what it sees fills the picture.
//!
//! Four planes through the eye bound what a picture shows. Each has a direction that does not depend on where the eye is, so
//! the scene's outermost point in each of these directions is all that has to be known of it. Where the four planes touch
//! the scene, the eye is as near as it may be.

use crate::{Camera, Instance, Mesh, Scene, Shape};
use elementary::{hypot, tan};
use glam::{DAffine3, DVec3, Vec3};

/// Vertical field of view of the default camera, degrees.
const FOV_Y: f32 = 40.0;

/// Width over height of a picture of which nothing is said.
const ASPECT: f32 = 16.0 / 9.0;

/// Share of the picture's width and height that is left free on each side.
const MARGIN: f64 = 0.025;

/// What is seen is at least this share of its own depth away, or the near end of something long would hide the rest.
const NEAREST: f64 = 0.25;

/// What is so many times longer from front to back than from left to right is looked at from its side.
const LONG: f64 = 3.0;

/// With more vertices in all instances than this, boxes stand for meshes.
const MOST_VERTICES: usize = 4_000_000;

/// Moments after the first at which a moving scene is looked at.
const MOMENTS: u32 = 16;

/// What a camera's film shows, as tangents of the angles between the optical axis and the picture's sides. A side on the
/// other side of the axis has a negative one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmWindow {
    /// To the left side.
    pub left: f64,
    /// To the right side.
    pub right: f64,
    /// To the lower side.
    pub bottom: f64,
    /// To the upper side.
    pub top: f64,
}

impl FilmWindow {
    /// Of a perspective camera without a lens: full vertical field of view in radians, width over height.
    pub fn perspective(fov_y: f32, aspect: f32) -> Self {
        let top = tan(f64::from(fov_y) * 0.5);
        let right = top * f64::from(aspect);
        Self { left: right, right, bottom: top, top }
    }

    /// Without a margin on each side.
    fn shrunk(self) -> Self {
        let (x, y) = (MARGIN * (self.left + self.right), MARGIN * (self.bottom + self.top));
        Self { left: self.left - x, right: self.right - x, bottom: self.bottom - y, top: self.top - y }
    }
}

/// How much of a scene's movement a camera has to show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motion {
    /// The whole of the animation that is playing, instead of the scene as it stands.
    pub plays: bool,
    /// The scene from all around: the camera will turn about the vertical axis through its middle.
    pub turns: bool,
}

impl Scene {
    /// The first camera of the file, or one that shows all of the scene as it stands.
    pub fn default_camera(&self) -> Camera {
        self.cameras.first().cloned().unwrap_or_else(|| {
            let (width, height) = (self.defaults.width, self.defaults.height);
            let aspect = width.zip(height).map_or(ASPECT, |(w, h)| w.max(1) as f32 / h.max(1) as f32);
            self.framing_camera(aspect)
        })
    }

    /// A camera for pictures of this width over height that shows all of the scene as it stands.
    pub fn framing_camera(&self, aspect: f32) -> Camera {
        let fov_y = FOV_Y.to_radians();
        let mut camera = Camera::perspective("default", Vec3::Z, Vec3::ZERO, fov_y);
        let film = FilmWindow::perspective(fov_y, aspect);
        let mut framing = Framing::new(film, self.bounds(), false);
        framing.add(self, MOST_VERTICES);
        framing.place(&mut camera);
        camera
    }

    /// Places `camera`, whose film shows `film`, where it shows all of the scene. With [`Motion::plays`] the scene is at
    /// `time` afterwards, and where the camera stands does not depend on when that is.
    pub fn frame(&mut self, camera: &mut Camera, film: FilmWindow, motion: Motion, time: f32) {
        if !(motion.plays && self.is_animated()) {
            let mut framing = Framing::new(film, self.bounds(), motion.turns);
            framing.add(self, MOST_VERTICES);
            framing.place(camera);
            return;
        }
        let last = self.duration();
        let moments = || (0..=MOMENTS).map(|i| last * i as f32 / MOMENTS as f32);
        let mut bounds = None;
        for moment in moments() {
            self.set_time(moment);
            bounds = union(bounds, self.bounds());
        }
        let mut framing = Framing::new(film, bounds, motion.turns);
        for moment in moments() {
            self.set_time(moment);
            framing.add(self, MOST_VERTICES / MOMENTS as usize);
        }
        self.set_time(time);
        framing.place(camera);
    }
}

/// Smallest and largest coordinates.
type Bounds = (Vec3, Vec3);

fn union(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    let both = |((a, b), (low, high)): (Bounds, Bounds)| (a.min(low), b.max(high));
    a.zip(b).map(both).or(a).or(b)
}

/// The planes that bound what is seen, and how far out the scene reaches across them.
struct Framing {
    film: FilmWindow,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Directions: of the planes through the left, right, lower and upper side, backwards and forwards.
    directions: [DVec3; 6],
    /// The scene's outermost point in each, along it.
    reach: [f64; 6],
    /// The middle of the scene's bounds.
    center: DVec3,
    turns: bool,
}

impl Framing {
    /// `bounds`: of the scene at all moments that count.
    fn new(film: FilmWindow, bounds: Option<Bounds>, turns: bool) -> Self {
        let (low, high) = bounds.unwrap_or((Vec3::splat(-1.0), Vec3::ONE));
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let size = high - low;
        let is_long = size.z > LONG * size.x && !turns;
        let from = if is_long { DVec3::new(1.0, 0.3, 0.45) } else { DVec3::new(0.45, 0.3, 1.0) };
        let forward = -from.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let film = film.shrunk();
        let directions = [
            -right - forward * film.left,
            right - forward * film.right,
            -up - forward * film.bottom,
            up - forward * film.top,
            -forward,
            forward,
        ];
        let reach = [f64::NEG_INFINITY; 6];
        Self { film, right, up, forward, directions, reach, center: (low + high) * 0.5, turns }
    }

    /// Makes room for the scene as it stands. With more than `most` vertices boxes stand for meshes.
    fn add(&mut self, scene: &Scene, most: usize) {
        let visible = || scene.instances.iter().filter(|i| i.visible);
        let counts: Vec<_> = scene.meshes.iter().map(vertex_count).collect();
        let count = |instance: &Instance| counts.get(instance.mesh as usize).copied().unwrap_or(0);
        let is_exact = visible().map(count).sum::<usize>() <= most;
        let outlines: Vec<_> = scene.meshes.iter().map(|mesh| outline(mesh, is_exact)).collect();
        for instance in visible() {
            let to_world = DAffine3::from_mat4(glam::Mat4::from(instance.transform).as_dmat4());
            for (center, radius) in outlines.get(instance.mesh as usize).into_iter().flatten() {
                self.add_ball(&to_world, center.as_dvec3(), f64::from(*radius));
            }
        }
    }

    /// Makes room for a ball in an instance's space, or for a point.
    fn add_ball(&mut self, to_world: &DAffine3, center: DVec3, radius: f64) {
        let point = to_world.transform_point3(center);
        if !point.is_finite() {
            return;
        }
        let aside = point - self.center;
        let axes = to_world.matrix3.transpose();
        for (direction, reach) in self.directions.iter().zip(&mut self.reach) {
            let mut along = point.dot(*direction);
            if self.turns {
                // The outermost point of the circle about the axis.
                let around = hypot(aside.x, aside.z) * hypot(direction.x, direction.z);
                along = self.center.dot(*direction) + around + aside.y * direction.y;
            }
            if radius > 0.0 {
                // Turned about the axis, an ellipsoid shows its largest radius at most.
                let largest = axes.x_axis.length_squared()
                    + axes.y_axis.length_squared()
                    + axes.z_axis.length_squared();
                let scale = if self.turns {
                    largest.sqrt() * direction.length()
                } else {
                    (axes * *direction).length()
                };
                along += radius * scale;
            }
            *reach = reach.max(along);
        }
    }

    /// Places the camera where the planes touch what has been added.
    fn place(mut self, camera: &mut Camera) {
        if self.reach.iter().any(|reach| !reach.is_finite()) {
            // Where there is nothing to see, something might be.
            self.add_ball(&DAffine3::IDENTITY, self.center, 1.0);
        }
        let [left, right, bottom, top, backwards, far] = self.reach;
        let (film, near) = (self.film, -backwards);
        let by_width = -(left + right) / (film.left + film.right);
        let by_height = -(bottom + top) / (film.bottom + film.top);
        // A point has no depth, and the camera stands before it.
        let least = (1e-6 * self.center.abs().max_element()).max(1e-8);
        let mut z = by_width.min(by_height).min(near - (NEAREST * (far - near)).max(least));
        let mut x = 0.5 * ((right + film.right * z) - (left + film.left * z));
        if self.turns {
            // The axis stays in the middle, whatever the film shows beside it.
            x = self.center.dot(self.right);
            if film.right > 0.0 {
                z = z.min((x - right) / film.right);
            }
            if film.left > 0.0 {
                z = z.min((-x - left) / film.left);
            }
        }
        let y = 0.5 * ((top + film.top * z) - (bottom + film.bottom * z));
        let eye = self.right * x + self.up * y + self.forward * z;
        let level = DVec3::new(self.forward.x, 0.0, self.forward.z);
        let distance = if self.turns {
            // Where the optical axis crosses the one that is turned about.
            (self.center - eye).dot(level) / level.length_squared()
        } else {
            0.5 * (near + far) - z
        };
        camera.eye = eye.as_vec3();
        camera.target = (eye + self.forward * distance).as_vec3();
        camera.up = Vec3::Y;
        camera.focus_distance = (camera.target - camera.eye).length().max(1e-6);
    }
}

fn vertex_count(mesh: &Mesh) -> usize {
    let count = |shape: &Shape| match shape {
        Shape::Triangles(mesh) => mesh.positions.len(),
        Shape::Spheres(spheres) => spheres.len(),
    };
    mesh.parts.iter().map(|part| count(&part.shape)).sum()
}

/// Points and balls in whose convex hull a mesh lies: vertices of its triangles, or the corners of its box.
fn outline(mesh: &Mesh, is_exact: bool) -> Vec<(Vec3, f32)> {
    let mut outline = Vec::new();
    for part in &mesh.parts {
        match &part.shape {
            Shape::Triangles(mesh) if is_exact && !mesh.indices.is_empty() => {
                let mut is_used = vec![false; mesh.positions.len()];
                let corners = mesh.indices.iter().flatten();
                corners.for_each(|&i| is_used.get_mut(i as usize).into_iter().for_each(|used| *used = true));
                let used = mesh.positions.iter().zip(is_used).filter(|(_, is_used)| *is_used);
                outline.extend(used.map(|(position, _)| (*position, 0.0)));
            }
            Shape::Spheres(spheres) if is_exact => {
                outline.extend(spheres.iter().map(|s| (s.center, s.radius.max(0.0))));
            }
            // Some front ends keep no more than its bounds of a mesh.
            shape @ (Shape::Triangles(_) | Shape::Spheres(_)) => {
                outline.extend(shape.bounds().into_iter().flat_map(corners_of));
            }
        }
    }
    outline
}

fn corners_of((low, high): Bounds) -> [(Vec3, f32); 8] {
    let side = |i: usize, k: usize| if i >> k & 1 == 0 { low[k] } else { high[k] };
    std::array::from_fn(|i| (Vec3::new(side(i, 0), side(i, 1), side(i, 2)), 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Sphere, TriangleMesh};
    use glam::{Affine3A, Quat};

    const EVERY: [f32; 4] = [16.0 / 9.0, 4.0 / 3.0, 1.0, 0.5];

    /// A point cloud with a triangle at every three points.
    fn mesh(positions: Vec<Vec3>) -> Shape {
        let indices = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Shape::Triangles(TriangleMesh { positions, indices, ..TriangleMesh::default() })
    }

    fn cuboid(size: Vec3) -> Vec<Vec3> {
        let corner = |i: u32| Vec3::from_array([0, 1, 2].map(|k| (i >> k & 1) as f32 - 0.5)) * size;
        (0..9).map(|i| corner(i % 8)).collect()
    }

    fn scene(shape: Shape, place: Affine3A) -> Scene {
        let meshes = vec![Mesh::single("mesh", shape, 0)];
        Scene { meshes, instances: vec![Instance::new("object", 0, place)], ..Scene::default() }
    }

    /// Where points appear on the film: `-1` to `1` from left to right and from bottom to top.
    fn on_film(camera: &Camera, aspect: f32, points: &[Vec3]) -> Vec<[f32; 2]> {
        let forward = (camera.target - camera.eye).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let crate::Projection::Perspective { fov_y } = camera.projection else { panic!("perspective") };
        let half = (fov_y * 0.5).tan();
        let seen = |p: &Vec3| {
            let v = *p - camera.eye;
            assert!(v.dot(forward) > 0.0, "{p} is behind the camera");
            [v.dot(right) / v.dot(forward) / half / aspect, v.dot(up) / v.dot(forward) / half]
        };
        points.iter().map(seen).collect()
    }

    /// Largest share of the picture's width or height that the points take. None may be outside.
    #[track_caller]
    fn filled(camera: &Camera, aspect: f32, points: &[Vec3]) -> f32 {
        let film = on_film(camera, aspect, points);
        let extent = |k: usize| {
            let (low, high) = film.iter().fold((1.0f32, -1.0f32), |(a, b), p| (a.min(p[k]), b.max(p[k])));
            assert!(low >= -0.96 && high <= 0.96, "{low} to {high} of 1");
            0.5 * (high - low)
        };
        extent(0).max(extent(1))
    }

    #[test]
    fn what_is_seen_fills_the_picture() {
        let sizes =
            [[1.0, 1.0, 1.0], [100.0, 0.1, 5.0], [5.0, 0.1, 100.0], [0.2, 60.0, 0.2], [30.0, 0.0, 30.0]];
        for size in sizes.map(Vec3::from) {
            for aspect in EVERY {
                let points = cuboid(size);
                let place = Affine3A::from_translation(Vec3::new(7.0, -3.0, 2.0));
                let scene = scene(mesh(points.clone()), place);
                let camera = scene.framing_camera(aspect);
                let world: Vec<_> = points.iter().map(|p| place.transform_point3(*p)).collect();
                let share = filled(&camera, aspect, &world);
                assert!(share > 0.94, "{size}, {aspect}: {share} of the picture");
                assert!((camera.focus_distance - (camera.target - camera.eye).length()).abs() < 1e-4);
            }
        }
    }

    /// A rod towards the viewer would fill the picture with its near end.
    #[test]
    fn the_near_end_does_not_hide_the_rest() {
        let rod =
            Affine3A::from_quat(Quat::from_rotation_arc(Vec3::Z, Vec3::new(0.45, 0.3, 1.0).normalize()));
        let points = cuboid(Vec3::new(0.02, 0.02, 10.0));
        let camera = scene(mesh(points.clone()), rod).framing_camera(1.5);
        let near =
            points.iter().map(|p| rod.transform_point3(*p).distance(camera.eye)).fold(f32::MAX, f32::min);
        assert!(near > 2.0, "{near} m");
        filled(&camera, 1.5, &points.iter().map(|p| rod.transform_point3(*p)).collect::<Vec<_>>());
    }

    #[test]
    fn boxes_around_what_is_turned_do_not_count() {
        // A rod along a diagonal of its own box, a vertex that no triangle has, an instance that is hidden.
        let turned =
            Affine3A::from_quat(Quat::from_rotation_z(0.7)) * Affine3A::from_scale(Vec3::new(9.0, 0.1, 0.1));
        let rod: Vec<_> = cuboid(Vec3::ONE).into_iter().map(|p| turned.transform_point3(p)).collect();
        let mut points = rod.clone();
        points.push(Vec3::splat(500.0));
        let mut scene = scene(mesh(points), Affine3A::from_rotation_y(0.4));
        let far = Affine3A::from_translation(Vec3::splat(80.0));
        scene.instances.push(Instance { visible: false, ..Instance::new("hidden", 0, far) });
        let camera = scene.framing_camera(1.0);
        let world: Vec<_> = rod.iter().map(|p| Affine3A::from_rotation_y(0.4).transform_point3(*p)).collect();
        assert!(filled(&camera, 1.0, &world) > 0.94);
    }

    #[test]
    fn spheres_are_framed_by_their_outline() {
        let place = Affine3A::from_scale(Vec3::new(1.0, 2.0, 1.0));
        let spheres = Shape::Spheres(vec![Sphere { center: Vec3::new(1.0, 0.0, 0.0), radius: 0.5 }]);
        let camera = scene(spheres, place).framing_camera(1.0);
        let on_sphere = (0..20_000).map(|i| {
            let (y, angle) = (1.0 - 2.0 * (i as f32 + 0.5) / 20_000.0, 2.399_963 * i as f32);
            let ring = (1.0 - y * y).sqrt();
            place.transform_point3(Vec3::new(
                1.0 + 0.5 * ring * angle.cos(),
                0.5 * y,
                0.5 * ring * angle.sin(),
            ))
        });
        assert!(filled(&camera, 1.0, &on_sphere.collect::<Vec<_>>()) > 0.94);
    }

    #[test]
    fn a_turntable_sees_all_sides() {
        let points = cuboid(Vec3::new(8.0, 1.0, 2.0));
        let place = Affine3A::from_translation(Vec3::new(3.0, 1.0, -20.0));
        let mut scene = scene(mesh(points.clone()), place);
        for aspect in EVERY {
            let mut camera = scene.default_camera();
            let film = FilmWindow::perspective(FOV_Y.to_radians(), aspect);
            scene.frame(&mut camera, film, Motion { turns: true, ..Motion::default() }, 0.0);
            let axis = camera.target - Vec3::new(3.0, camera.target.y, -20.0);
            assert!(axis.length() < 1e-4, "the axis goes through the middle: {}", camera.target);
            let shares = (0..36).map(|i| {
                let turn = Affine3A::from_rotation_y(i as f32 * 10f32.to_radians());
                let world = points.iter().map(|p| (place * turn).transform_point3(*p));
                filled(&camera, aspect, &world.collect::<Vec<_>>())
            });
            let largest = shares.fold(0.0, f32::max);
            assert!(largest > 0.9, "{aspect}: {largest}");
        }
    }

    #[test]
    fn scenes_without_anything_to_see_have_a_camera() {
        let without_triangles = scene(
            Shape::Triangles(TriangleMesh { positions: vec![Vec3::splat(9.0)], ..TriangleMesh::default() }),
            Affine3A::IDENTITY,
        );
        let point = scene(mesh(vec![Vec3::ONE; 3]), Affine3A::IDENTITY);
        for scene in [Scene::default(), without_triangles, point] {
            let camera = scene.default_camera();
            assert!(camera.eye.is_finite() && camera.eye != camera.target, "{camera:?}");
        }
    }
}
