//! What the threads have done: scenes that are loaded, pictures, answers about places.

use super::state::{Selection, Viewer};
use crate::document::Document;
use crate::loading::{self, Loaded, Opened};
use crate::queries::{Answer, Purpose};
use crate::render_settings::RenderSettings;
use crate::viewport::Zoom;
use crate::watch::Watch;
use crate::worker::{Event, Message, Shot, full_text};
use alhazen::{Job, Place, Source};

impl Viewer {
    pub(super) fn take_loaded(&mut self) {
        let mut i = 0;
        while i < self.loading.len() {
            match self.loading[i].poll() {
                Some(result) => {
                    let loading = self.loading.remove(i);
                    self.note_refused(&loading.job, &loading.refused.list());
                    self.take_result(loading.job, result);
                }
                None => i += 1,
            }
        }
    }

    fn take_result(&mut self, job: loading::Job, result: Result<Loaded, alhazen::LoadError>) {
        match (job, result) {
            // Nothing else changes.
            (_, Err(error)) => self.notice(full_text(&error), true),
            (loading::Job::Open(source), Ok(Loaded::Scene(opened))) => self.take_scene(source, *opened),
            (loading::Job::Model(file), Ok(Loaded::Resources(resources, report))) => {
                self.take_model(&file, resources, &report);
            }
            (loading::Job::Picture(file, material, slot), Ok(Loaded::Resources(resources, report))) => {
                self.take_picture(file, material, slot, resources, &report);
            }
            (loading::Job::Environment(file), Ok(Loaded::Resources(resources, report))) => {
                self.take_environment(&file, resources, &report);
            }
            // The loader answers what it was asked.
            _ => {}
        }
    }

    fn take_scene(&mut self, source: Source, opened: Opened) {
        let Opened { scene, base, resources, report } = opened;
        self.generation += 1;
        self.settings.remember(&source.to_string());
        let generation = self.generation;
        let edits = base.edits.clone();
        let document = Document::new(source.clone(), base, &scene, resources.clone(), report, generation);
        let job = Job::for_scene(document.scene());
        self.home = job.camera.clone();
        if !self.keeps_camera {
            self.look_through(job.camera.clone());
            self.follows = (!document.scene().cameras.is_empty()).then_some(0);
            self.clock = self.clock.for_scene(document.scene());
            self.render =
                RenderSettings { size: self.fixed_size, ..RenderSettings::of(&job, document.defaults.spp) };
            self.shown.tone = job.tone;
            self.zoom = Zoom::default();
            self.views.clear();
            self.deselect();
            self.gizmo =
                crate::gizmo::Gizmo { tool: self.gizmo.tool, local: self.gizmo.local, ..Default::default() };
        }
        self.outline = None;
        self.watch = match &source.place {
            Place::File(file) => {
                let wake = self.wake.clone();
                Watch::start(file, move || wake())
            }
            Place::Builtin(_) => None,
        };
        self.document = Some(document);
        self.worker.send(Message::Load { scene: Box::new(scene), edits, resources, generation });
        self.mend_selection();
        self.take_first_view();
    }

    pub(super) fn take_event(&mut self, event: Event) {
        match event {
            Event::Loaded { stats, .. } => self.backend.stats = stats,
            Event::Backend { name, device, reason } => {
                self.backend.name = name.to_owned();
                (self.backend.device, self.backend.reason) = (device, reason);
            }
            Event::Tables(tables) => {
                self.queries.set_scene(tables);
                self.asked_outline = None;
                self.forget_ground();
            }
            Event::Saved(path) => self.notice(format!("wrote {}", path.display()), false),
            Event::Recorded(recorded) => self.take_recorded(recorded),
            Event::Notice(text) => self.notice(text, false),
            Event::Failed(text) => self.notice(text, true),
        }
    }

    pub(super) fn take_answer(&mut self, ctx: &egui::Context, answer: Answer) {
        match answer {
            Answer::Point(Purpose::Select, seen) => {
                self.select(seen.map(|s| Selection { object: s.instance, material: s.material }));
                if self.selection.is_some() {
                    self.open.tab = crate::panels::Tab::Objects;
                }
            }
            Answer::Point(Purpose::Toggle, Some(seen)) => self.toggle_seen(seen),
            Answer::Point(Purpose::Toggle, None) => self.notice("there is no object", false),
            Answer::Point(Purpose::TakeMaterial(id), seen) => self.drop_material(id, seen),
            Answer::Point(Purpose::Target, Some(seen)) => self.steer(|c| c.target = seen.position),
            Answer::Point(Purpose::Focus, Some(seen)) => self.steer(|c| {
                let axis = (c.target - c.eye).normalize_or(glam::Vec3::NEG_Z);
                c.focus_distance = (seen.position - c.eye).dot(axis).max(1e-4);
            }),
            Answer::Point(Purpose::Aim, seen) => self.aim(seen),
            Answer::Point(Purpose::Inspect, seen) => self.under_pointer = seen,
            Answer::Point(Purpose::Target | Purpose::Focus, None) => {}
            Answer::Outline(outline) => self.take_outline(ctx, outline),
            Answer::Area(found) => self.take_area(found),
            Answer::Ground(size, pixels) => self.take_ground(ctx, size, pixels),
        }
    }

    pub(super) fn take_shot(&mut self, ctx: &egui::Context, shot: Shot) {
        if shot.side == 0 {
            self.statistics.pass(self.time, &shot.pass);
        }
        self.shots_seen += 1;
        let side = shot.side;
        // Small pictures are no pixels to look at.
        let smooth = egui::TextureOptions::LINEAR;
        let options = if shot.preview { smooth } else { self.texture_options() };
        match &mut self.textures[side] {
            Some(texture) => texture.set(shot.image.clone(), options),
            none => *none = Some(ctx.load_texture(format!("picture {side}"), shot.image.clone(), options)),
        }
        self.shots[side] = Some(shot);
    }
}
