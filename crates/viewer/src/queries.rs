//! What is under the pointer: rays through the picture, asked of the facade's ray queries on a thread of their own.

use crate::gizmo::grid::{self, Grid};
use alhazen::{Camera, Control, InstanceId, MaterialId, RayQueries, SceneTables, camera_frame, picture_ray};
use egui::Color32;
use glam::Vec3;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Something to find out.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The camera of the picture.
    pub camera: Camera,
    /// Width of the picture, pixels.
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    /// What about it.
    pub what: What,
}

/// What is asked of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// What is seen at a point (pixels), for this purpose.
    Point {
        /// From the left.
        x: f32,
        /// From the top.
        y: f32,
        /// What it is for.
        purpose: Purpose,
    },
    /// Where the outline of objects is; their numbers, sorted.
    Outline(Vec<InstanceId>),
    /// Which objects are seen for the most part in a rectangle: left, top, right and bottom in shares of the picture.
    Area([f32; 4]),
    /// What the grid on the ground looks like.
    Ground(Grid),
}

/// What a point is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Select what is there.
    Select,
    /// Select it as well, or no more.
    Toggle,
    /// Give it a material.
    TakeMaterial(MaterialId),
    /// Turn the camera about it.
    Target,
    /// Bring it into the lens's focus.
    Focus,
    /// Tell what it is.
    Inspect,
    /// Have a light fall there.
    Aim,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// What is at a point; `None` is nothing.
    Point(Purpose, Option<Seen>),
    /// Pixels of an outline.
    Outline(Outline),
    /// Objects in a rectangle, sorted.
    Area(Vec<InstanceId>),
    /// Width, height and colours of the grid on the ground.
    Ground([u32; 2], Vec<Color32>),
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// World space, metres.
    pub position: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Distance from the camera along the ray, metres.
    pub distance: f32,
    /// Index of the object.
    pub instance: u32,
    /// Index of the material.
    pub material: u32,
    /// Number of the triangle or sphere in its mesh.
    pub primitive: u32,
}

/// The outline of objects as a mask.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outline {
    /// The objects, sorted.
    pub instances: Vec<InstanceId>,
    /// Width of the mask.
    pub width: u32,
    /// Height of the mask.
    pub height: u32,
    /// Whether each pixel is on the outline, row 0 at the top.
    pub mask: Vec<bool>,
}

enum Message {
    Scene(Arc<SceneTables>),
    Ask(Box<Question>),
}

/// The thread that answers, seen from the window's.
pub struct Queries {
    messages: Sender<Message>,
    answers: Receiver<Answer>,
}

impl Queries {
    /// Starts the thread; `wake` is called when there is an answer. It ends with this.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (messages, inbox) = channel();
        let (outbox, answers) = channel();
        let work = move || {
            let mut thread = Thread { tables: None, built: None };
            while let Ok(message) = inbox.recv() {
                let (tables, questions) = newest(message, &inbox);
                if let Some(tables) = tables {
                    (thread.tables, thread.built) = (Some(tables), None);
                }
                for answer in questions.into_iter().filter_map(|q| thread.answer(&q)) {
                    if outbox.send(answer).is_err() {
                        return;
                    }
                    wake();
                }
            }
        };
        if let Err(error) = std::thread::Builder::new().name("queries".into()).spawn(work) {
            eprintln!("cannot start a thread for picking: {error}");
        }
        Self { messages, answers }
    }

    /// Asks about this scene from now on.
    pub fn set_scene(&self, tables: Arc<SceneTables>) {
        let _ = self.messages.send(Message::Scene(tables));
    }

    /// Asks something; of questions of one kind only the last is answered if they come too fast.
    pub fn ask(&self, question: Question) {
        let _ = self.messages.send(Message::Ask(Box::new(question)));
    }

    /// The next answer.
    pub fn next_answer(&self) -> Option<Answer> {
        self.answers.try_recv().ok()
    }
}

/// All messages that there are: the last scene, and of each kind of question the last.
fn newest(first: Message, inbox: &Receiver<Message>) -> (Option<Arc<SceneTables>>, Vec<Question>) {
    let (mut tables, mut questions) = (None, Vec::<Question>::new());
    for message in std::iter::once(first).chain(inbox.try_iter()) {
        match message {
            Message::Scene(scene) => tables = Some(scene),
            Message::Ask(question) => {
                questions.retain(|q| !is_alike(&q.what, &question.what));
                questions.push(*question);
            }
        }
    }
    (tables, questions)
}

/// Whether nobody waits for the answer to one question once the other is asked.
fn is_alike(a: &What, b: &What) -> bool {
    match (a, b) {
        (What::Point { purpose: a, .. }, What::Point { purpose: b, .. }) => a == b,
        _ => std::mem::discriminant(a) == std::mem::discriminant(b),
    }
}

struct Thread {
    tables: Option<Arc<SceneTables>>,
    /// Made when the first question about a scene comes: many scenes are only looked at.
    built: Option<RayQueries>,
}

impl Thread {
    fn answer(&mut self, question: &Question) -> Option<Answer> {
        if self.built.is_none() {
            self.built = RayQueries::new(self.tables.clone()?, None).ok();
        }
        let queries = self.built.as_ref()?;
        Some(match &question.what {
            What::Point { x, y, purpose } => Answer::Point(*purpose, seen(queries, question, *x, *y)),
            What::Outline(instances) => Answer::Outline(outline(queries, question, instances)),
            What::Ground(ground) => {
                let size = [question.width, question.height];
                Answer::Ground(size, grid::picture(queries, &question.camera, size, ground))
            }
            What::Area(area) => Answer::Area(mostly_within(&objects(queries, question), question, *area)),
        })
    }
}

/// What a picture shows at a point.
pub fn seen(queries: &RayQueries, question: &Question, x: f32, y: f32) -> Option<Seen> {
    let frame = camera_frame(&question.camera, question.width, question.height);
    let ray = |_| picture_ray(&frame, question.width, question.height, x, y);
    let found = queries.map(1, &Control::new(), ray, |_, point| {
        point.map(|p| Seen {
            position: p.position().into(),
            normal: p.normal().into(),
            distance: p.distance(),
            instance: p.instance(),
            material: p.material(),
            primitive: p.primitive(),
        })
    });
    found.into_iter().next().flatten()
}

/// The object that is seen in each pixel.
fn objects(queries: &RayQueries, question: &Question) -> Vec<Option<InstanceId>> {
    let (width, height) = (question.width, question.height);
    let frame = camera_frame(&question.camera, width, height);
    let ray = |i: usize| {
        let (x, y) = (i as u32 % width, i as u32 / width);
        picture_ray(&frame, width, height, x as f32 + 0.5, y as f32 + 0.5)
    };
    let count = width as usize * height as usize;
    queries.map(count, &Control::new(), ray, |_, point| point.map(|p| p.instance()))
}

/// Objects that have at least half of their pixels in a rectangle, sorted. So a rectangle around things on a floor does
/// not have the floor.
fn mostly_within(
    objects: &[Option<InstanceId>],
    question: &Question,
    [left, top, right, bottom]: [f32; 4],
) -> Vec<InstanceId> {
    let (width, height) = (question.width as f32, question.height as f32);
    let mut counts = BTreeMap::<InstanceId, [u32; 2]>::new();
    for (i, object) in objects.iter().enumerate() {
        let Some(object) = object else { continue };
        let (x, y) = (i as u32 % question.width, i as u32 / question.width);
        let (x, y) = ((x as f32 + 0.5) / width, (y as f32 + 0.5) / height);
        let [inside, all] = counts.entry(*object).or_default();
        *inside += u32::from(x >= left && x < right && y >= top && y < bottom);
        *all += 1;
    }
    counts.into_iter().filter(|(_, [inside, all])| 2 * inside >= *all).map(|(object, _)| object).collect()
}

/// Pixels of objects that have a neighbour that is not: their outline as far as it is seen.
///
/// - `instances`: sorted.
pub fn outline(queries: &RayQueries, question: &Question, instances: &[InstanceId]) -> Outline {
    let (width, height) = (question.width, question.height);
    let seen = objects(queries, question);
    let border = |of: &[InstanceId]| {
        let is_one = |object: &Option<InstanceId>| object.is_some_and(|o| of.binary_search(&o).is_ok());
        let inside: Vec<bool> = seen.iter().map(is_one).collect();
        edges(&solid(&inside, width as usize), width as usize)
    };
    // A few have a border each, also where they are in front of each other; many have one around them all.
    let each = if instances.len() <= MOST_BORDERS { 1 } else { instances.len() };
    let mut mask = vec![false; seen.len()];
    for of in instances.chunks(each) {
        mask.iter_mut().zip(border(of)).for_each(|(mask, on)| *mask |= on);
    }
    Outline { instances: instances.to_vec(), width, height, mask }
}

/// What is shown as the inside of an object. Rays pass through what is half transparent at random, so
/// where such a surface fades its pixels are speckles: there the border runs where half of many rays
/// hit it.
fn solid(inside: &[bool], width: usize) -> Vec<bool> {
    let most = majority(inside, width);
    let radius = width / 50 + 1;
    let share = |on: bool| if on { 1.0 } else { 0.0 };
    let speckles = smooth(inside.iter().zip(&most).map(|(a, b)| share(a != b)).collect(), width, radius);
    let many = smooth(inside.iter().map(|inside| share(*inside)).collect(), width, radius);
    let pixels = most.iter().zip(&many).zip(&speckles);
    pixels.map(|((most, many), speckles)| if *speckles > SPECKLED { *many > 0.5 } else { *most }).collect()
}

/// So many objects have an outline each.
const MOST_BORDERS: usize = 6;

/// A place is speckled if more than this share of its pixels is not like those around them.
const SPECKLED: f32 = 0.02;

/// The mean of the values within `radius`, weighted by a tent: a box filter along rows and columns,
/// twice.
fn smooth(mut values: Vec<f32>, width: usize, radius: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    for _ in 0..2 {
        (0..height).for_each(|y| box_filter(&mut values, y * width, 1, width, radius));
        (0..width).for_each(|x| box_filter(&mut values, x, width, height, radius));
    }
    values
}

/// The mean within `radius` along `count` values that are `stride` apart, from `first` on.
fn box_filter(values: &mut [f32], first: usize, stride: usize, count: usize, radius: usize) {
    let mut sums = Vec::with_capacity(count + 1);
    sums.push(0.0);
    for i in 0..count {
        sums.push(sums[i] + f64::from(values[first + i * stride]));
    }
    for i in 0..count {
        let (from, to) = (i.saturating_sub(radius), (i + radius + 1).min(count));
        values[first + i * stride] = ((sums[to] - sums[from]) / (to - from) as f64) as f32;
    }
}

/// What most of the nine pixels around each one are: surfaces that are half transparent are hit here and there.
fn majority(inside: &[bool], width: usize) -> Vec<bool> {
    let height = inside.len() / width.max(1);
    let around = |v: usize, size: usize| v.saturating_sub(1)..(v + 2).min(size);
    let most = |i: usize| {
        let (x, y) = (i % width, i / width);
        let all = around(y, height).flat_map(|y| around(x, width).map(move |x| inside[y * width + x]));
        let (mut set, mut count) = (0, 0);
        all.for_each(|v| (set, count) = (set + usize::from(v), count + 1));
        set * 2 > count
    };
    (0..inside.len()).map(most).collect()
}

/// Pixels that are set and have a neighbour, or the picture's border, that is not.
fn edges(inside: &[bool], width: usize) -> Vec<bool> {
    let height = inside.len() / width.max(1);
    let is_inside = |x: isize, y: isize| {
        let known = x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height;
        known && inside[y as usize * width + x as usize]
    };
    let is_edge = |i: usize| {
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        let surrounded = [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().all(|(dx, dy)| is_inside(x + dx, y + dy));
        inside[i] && !surrounded
    };
    (0..inside.len()).map(is_edge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{LoadOptions, Source};

    fn cornell() -> (RayQueries, Question) {
        let scene = Source::parse("cornell").load(&LoadOptions::default()).expect("built in").scene;
        let what = What::Outline(vec![0]);
        let camera = scene.default_camera();
        let tables = SceneTables::build(&scene);
        let question = Question { camera, width: 80, height: 80, what };
        (RayQueries::new(tables, Some(2)).expect("threads"), question)
    }

    #[test]
    fn points_tell_what_is_seen_there() {
        let (queries, question) = cornell();
        let center = seen(&queries, &question, 40.0, 40.0).expect("the box is closed at the back");
        assert!((center.position - question.camera.eye).length() - center.distance < 1e-3);
        let axis = (question.camera.target - question.camera.eye).normalize();
        assert!(center.normal.dot(axis) < 0.0, "the normal faces the camera");
        let floor = seen(&queries, &question, 40.0, 78.0).expect("the floor");
        assert!(floor.position.y < center.position.y);
    }

    #[test]
    fn outlines_surround_what_is_seen_of_an_object() {
        let (queries, mut question) = cornell();
        let at = seen(&queries, &question, 30.0, 55.0).expect("something");
        question.what = What::Outline(vec![at.instance]);
        let outline = outline(&queries, &question, &[at.instance]);
        let count = outline.mask.iter().filter(|m| **m).count();
        assert!(count > 20 && count < 2000, "{count}");
        // With what is behind it, it keeps its own outline.
        let all: Vec<_> = (0..=at.instance.max(9)).collect();
        let few = super::outline(&queries, &question, &all[..MOST_BORDERS.min(all.len())]);
        let many = super::outline(&queries, &question, &all);
        let set = |outline: &Outline| outline.mask.iter().filter(|m| **m).count();
        assert!(set(&few) > set(&many), "{} {}", set(&few), set(&many));
    }

    /// The back wall of the box is seen all around its middle.
    #[test]
    fn rectangles_have_what_is_for_the_most_part_in_them() {
        let (queries, question) = cornell();
        let seen = objects(&queries, &question);
        let all = mostly_within(&seen, &question, [0.0, 0.0, 1.0, 1.0]);
        assert!(all.len() > 3 && all.is_sorted(), "{all:?}");
        let left = mostly_within(&seen, &question, [0.0, 0.0, 0.5, 1.0]);
        let right = mostly_within(&seen, &question, [0.5, 0.0, 1.0, 1.0]);
        assert!(!left.is_empty() && left.len() < all.len() && left != right, "{left:?} {right:?}");
        assert!(mostly_within(&seen, &question, [0.49, 0.49, 0.51, 0.51]).is_empty());
    }

    #[test]
    fn edges_are_inside() {
        let mut inside = vec![false; 25];
        for (x, y) in [(1, 1), (2, 1), (3, 1), (1, 2), (2, 2), (3, 2), (1, 3), (2, 3), (3, 3)] {
            inside[y * 5 + x] = true;
        }
        let edges = edges(&inside, 5);
        assert_eq!(edges.iter().filter(|e| **e).count(), 8);
        assert!(!edges[12] && edges[6]);
    }

    /// A floor that fades: hit ever more rarely towards the top.
    #[test]
    fn what_fades_has_a_calm_outline() {
        let (width, height) = (400, 240);
        let random = |i: usize| (i as u32).wrapping_mul(2_654_435_761) >> 8;
        let inside: Vec<bool> = (0..width * height)
            .map(|i| f64::from(random(i) % 1000) / 1000.0 < (i / width) as f64 / height as f64)
            .collect();
        let edge = |mask: Vec<bool>| edges(&mask, width).iter().filter(|on| **on).count();
        let (rough, calm) = (edge(majority(&inside, width)), edge(solid(&inside, width)));
        // Around the lower half: twice its width and height, and the steps of the upper border.
        assert!(calm < 2 * width + height + 300 && rough > 5 * calm, "{calm} of {rough}");
    }

    #[test]
    fn single_pixels_are_no_objects() {
        let mut inside = vec![false; 49];
        inside[24] = true;
        assert!(majority(&inside, 7).iter().all(|v| !v));
        assert!(majority(&[true; 49], 7).iter().all(|v| *v));
    }

    #[test]
    fn the_thread_answers_the_last_question_of_each_kind() {
        let scene = Source::parse("cornell").load(&LoadOptions::default()).expect("built in").scene;
        let (wake, woken) = channel();
        let queries = Queries::start(move || {
            let _ = wake.send(());
        });
        queries.set_scene(Arc::new(SceneTables::build(&scene)));
        let what = What::Point { x: 10.0, y: 10.0, purpose: Purpose::Select };
        queries.ask(Question { camera: scene.default_camera(), width: 20, height: 20, what });
        woken.recv_timeout(std::time::Duration::from_secs(60)).expect("an answer");
        let Some(Answer::Point(Purpose::Select, Some(seen))) = queries.next_answer() else {
            panic!("a point")
        };
        assert!(seen.distance > 0.0);
    }
}
